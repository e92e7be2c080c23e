//! What a node runs by itself: its clock, `/rosout`, `/diagnostics`.

use std::sync::{Arc, PoisonError, Weak};

use ros2_interfaces::standard_topics::{CLOCK, DIAGNOSTICS, ROSOUT};

use super::{Node, Shared};
use crate::diagnostics::{Level, Report};
use crate::error::Result;
use crate::parameters::{HARDWARE_ID, USE_SIM_TIME};

impl Node {
    pub(super) fn follow_clock(&self) -> Result<()> {
        self.announce_subscription(&CLOCK)?;
        let weak = |shared: &Arc<Shared>| {
            let shared = Arc::downgrade(shared);
            // The task must not keep the node alive.
            move || {
                Some(Self {
                    shared: shared.upgrade()?,
                })
            }
        };
        let (of_parameter, of_topic) = (weak(&self.shared), weak(&self.shared));
        let use_sim_time = move || {
            of_parameter().is_some_and(|node| node.parameter(USE_SIM_TIME).unwrap_or(false))
        };
        let subscribe = move || {
            let subscription = of_topic()?.ungated_subscription(&CLOCK);
            subscription
                .inspect_err(|error| tracing::error!("{error}"))
                .ok()
        };
        let changes = self.parameters().changes();
        self.spawn(
            self.clock()
                .clone()
                .follow(use_sim_time, changes, subscribe),
        );
        Ok(())
    }

    pub(super) fn start_rosout(&self) -> Result<()> {
        let Some(mut lines) = crate::logging::rosout_lines() else {
            return Ok(());
        };
        let publisher = self.ungated_publisher(ROSOUT.name, ROSOUT.qos)?;
        self.spawn(async move {
            while let Some(line) = lines.recv().await {
                publisher.publish(line).left_to_diagnostics();
            }
        });
        Ok(())
    }

    pub(super) fn start_diagnostics(&self, managed: bool) -> Result<()> {
        let publisher = self.ungated_publisher(DIAGNOSTICS.name, DIAGNOSTICS.qos)?;
        if let Ok(hardware_id) = self.parameter::<String>(HARDWARE_ID) {
            self.diagnostics().set_hardware_id(&hardware_id);
        }
        // The tasks must not keep the node alive, so they hold weak handles.
        if managed {
            let shared = Arc::downgrade(&self.shared);
            self.shared.diagnostics.add_built_in("lifecycle", move || {
                shared.upgrade().map_or_else(
                    || Report::stale("the node has ended"),
                    |shared| {
                        let state = shared.lifecycle.label();
                        Report::ok(&state).with("state", state)
                    },
                )
            });
        }
        let shared = Arc::downgrade(&self.shared);
        self.shared.diagnostics.add_built_in("topics", move || {
            shared.upgrade().map_or_else(
                || Report::stale("the node has ended"),
                |shared| shared.topics_report(),
            )
        });
        let diagnostics = self.shared.diagnostics.clone();
        self.spawn(diagnostics.run(
            self.shared.identity.name.clone(),
            self.shared.clock.clone(),
            self.gate().clone(),
            publisher,
        ));
        Ok(())
    }
}

impl Shared {
    /// The built-in diagnostics task: what got lost between us and others.
    fn topics_report(&self) -> Report {
        let endpoints = self
            .endpoints
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let mut report = Report::ok("nothing lost, everybody compatible");
        for publisher in endpoints.publishers.iter().filter_map(Weak::upgrade) {
            if publisher.dropped() > 0 {
                report = report
                    .counted(
                        Level::Warn,
                        &format!("{} dropped", publisher.topic()),
                        publisher.dropped(),
                        &format!(
                            "{}: {} messages dropped",
                            publisher.topic(),
                            publisher.dropped()
                        ),
                    )
                    .with(
                        &format!("{} dropped", publisher.topic()),
                        publisher.dropped(),
                    );
            }
        }
        for subscription in endpoints.subscriptions.iter().filter_map(Weak::upgrade) {
            let (topic, lost, bad) = (
                subscription.topic(),
                subscription.lost(),
                subscription.undecodable(),
            );
            // Of the clock only the newest sample counts, and best effort with depth 1 is its rule.
            if lost > 0 && topic != CLOCK.name {
                report = report
                    .counted(
                        Level::Warn,
                        &format!("{topic} lost"),
                        lost,
                        &format!("{topic}: {lost} messages lost"),
                    )
                    .with(&format!("{topic} lost"), lost);
            }
            // What was passed over was meant to be.
            if subscription.passed_over() > 0 {
                report = report.with(
                    &format!("{topic} passed over while inactive"),
                    subscription.passed_over(),
                );
            }
            if bad > 0 {
                report = report
                    .counted(
                        Level::Error,
                        &format!("{topic} undecodable"),
                        bad,
                        &format!("{topic}: {bad} messages of another form"),
                    )
                    .with(&format!("{topic} undecodable"), bad);
            }
        }
        let mut queues: Vec<(String, u64)> = self
            .overflows()
            .iter()
            .map(|overflow| (overflow.queue().to_owned(), overflow.total()))
            .collect();
        queues.push((
            "transition events".to_owned(),
            self.lifecycle.overflow().total(),
        ));
        queues.push((ROSOUT.name.to_owned(), crate::logging::rosout_overflow()));
        for (queue, count) in queues.iter().filter(|(_, count)| *count > 0) {
            report = report
                .counted(
                    Level::Warn,
                    queue,
                    *count,
                    &format!("{queue}: {count} entries had no room in the queue"),
                )
                .with(&format!("{queue} overflowed"), count);
        }
        for (topic, why) in self.graph.incompatible() {
            report = report
                .worsened(Level::Error, &format!("{topic}: {why}"))
                .with(&format!("{topic} incompatible"), why);
        }
        report
    }
}
