//! `rotary-sins navigate`: free-inertial navigation with and without a calibration, held against the positions of the bag.

use std::{ops::ControlFlow, path::PathBuf};

use anyhow::{Context, ensure};
use bags::Sample;
use clap::Args;
use ros_node::ParameterSet;
use serde::Serialize;
use sins::{
    earth::Position,
    machines::{
        navigator::{Navigator, NavigatorEvent, NavigatorOutput, NavigatorSettings},
        odometry::pose_covariance,
    },
    mechanization::strapdown::NavigationState,
    units::NAUTICAL_MILE_M,
};

use crate::{
    Outcome,
    filter_options::AlignmentOptions,
    output,
    parameter_options::{Given, Group},
    sensor_input::{SensorInput, Told},
};

/// Options of `navigate`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    /// Calibration, as `calibrate --output` writes it
    #[arg(long, value_name = "FILE.yaml")]
    calibration: PathBuf,
    #[command(flatten)]
    navigation: Given<Navigation>,
    /// Write JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    filter: AlignmentOptions,
}

/// Parameters of the navigator, as the node `navigation_compensator` has them, that mean something for a bag.
#[derive(Clone, Debug)]
struct Navigation;

impl Group for Navigation {
    type Settings = NavigatorSettings;
    const HEADING: &'static str = "Navigation";

    fn set() -> ParameterSet<NavigatorSettings> {
        navigation_compensator::parameters::navigator().without(&[
            "history_s",
            "joint_patience_s",
            "start_from_calibration",
        ])
    }
}

#[derive(Serialize)]
struct Report {
    max_position_error_nmi: f64,
    max_position_error_uncompensated_nmi: f64,
    final_position_error_nmi: f64,
    final_position_error_uncompensated_nmi: f64,
    position_std_nmi: f64,
    alignment_s: f64,
    navigation_s: f64,
    fixes: u64,
    samples: u64,
    gaps: u64,
    lost_samples: u64,
    refused_samples: u64,
    restarts: u64,
    warnings: Vec<String>,
}

/// Largest and last distance from the fixes.
#[derive(Clone, Copy, Default)]
struct Distance {
    largest: f64,
    last: f64,
}

impl Distance {
    fn take(&mut self, state: &NavigationState, fix: &Position) {
        self.last = fix.offset_m(&state.position).xy().norm() / NAUTICAL_MILE_M;
        self.largest = self.largest.max(self.last);
    }
}

/// What of the navigator's events a person should know.
fn tell(told: &mut Told<'_>, event: &NavigatorEvent) {
    let topic = told.topic;
    match event {
        NavigatorEvent::Refused(refused) => told.notes.refused(told.progress, topic, refused),
        NavigatorEvent::Restarted { stamp, cause } => told.notes.say(
            told.progress,
            format!(
                "{topic}: {cause} at {} ns: navigation aligns itself anew",
                stamp.nanos()
            ),
        ),
        NavigatorEvent::HoleCrossed {
            stamp,
            seconds,
            held: true,
        } => told.notes.say(
            told.progress,
            format!(
                "{topic}: a hole of {seconds:.3} s up to {} ns: course and speed are kept, less certain",
                stamp.nanos()
            ),
        ),
        NavigatorEvent::AlignmentFailed { reason, .. } => {
            told.notes.hold(format!("{topic}: {reason}"));
        }
        _ => {}
    }
}

/// Aligns on the first part of the bag, then navigates freely.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let name = || options.calibration.display().to_string();
    let calibration = calibration_file::read(&options.calibration)?
        .usable()
        .with_context(name)?;
    let bag = options.input.open()?;
    let settings = options.navigation.settings()?;
    let mut navigator = Navigator::new(NavigatorSettings {
        alignment: options.filter.machine(options.input.turntable()?)?,
        // In a bag every joint state is there in time.
        joint_patience_s: NavigatorSettings::default().joint_patience_s,
        ..settings
    })?;
    navigator.push_calibration(calibration)?;
    let (mut with, mut without) = (Distance::default(), Distance::default());
    let mut fixes = 0_u64;
    let mut first: Option<NavigatorOutput> = None;
    let mut last: Option<NavigatorOutput> = None;
    let mut start = None;
    let mut notes = options.input.feed(&bag, "navigating", |sample, told| {
        match sample {
            Sample::Imu(imu) => {
                start.get_or_insert(imu.stamp);
                navigator.push_imu(&imu);
                while let Some(event) = navigator.poll() {
                    if let NavigatorEvent::Sample {
                        output: Some(output),
                        ..
                    } = &event
                    {
                        first.get_or_insert_with(|| (**output).clone());
                        last = Some((**output).clone());
                    }
                    tell(told, &event);
                }
            }
            Sample::Joints(joints) => navigator.push_joints(joints)?,
            Sample::Velocity(stamp, velocity) => navigator.push_velocity(stamp, velocity)?,
            Sample::Fix(fix) => {
                let Some(position) = fix.position else {
                    return Ok(ControlFlow::Continue(()));
                };
                navigator.push_position(position)?;
                if let Some(output) = &last {
                    with.take(&output.compensated.navigation, &position);
                    without.take(&output.uncompensated.navigation, &position);
                    fixes += 1;
                    told.progress.message(format!(
                        "{:.3} nmi, uncompensated {:.3} nmi",
                        with.last, without.last
                    ));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    })?;
    navigator.end();
    while let Some(event) = navigator.poll() {
        if let NavigatorEvent::Sample {
            output: Some(output),
            ..
        } = event
        {
            first.get_or_insert_with(|| (*output).clone());
            last = Some(*output);
        }
    }
    let (Some(first), Some(last), Some(start)) = (first, last, start) else {
        anyhow::bail!(
            "{}: navigation did not begin: it stands at {}, and needs {} s at rest and a position",
            options.input.what_is_missing(&bag),
            navigator.phase().name(),
            settings.alignment_s
        );
    };
    notes.tell(&output::Screen);
    ensure!(
        fixes > 0,
        "{}: no position to hold the navigation against after its start",
        bag.path().display()
    );
    let counts = navigator.stream().counts();
    let pose = pose_covariance(&last.compensated.navigation, &last.compensated.covariance);
    let report = Report {
        max_position_error_nmi: with.largest,
        max_position_error_uncompensated_nmi: without.largest,
        final_position_error_nmi: with.last,
        final_position_error_uncompensated_nmi: without.last,
        position_std_nmi: (pose[(0, 0)] + pose[(1, 1)]).sqrt() / NAUTICAL_MILE_M,
        alignment_s: first.stamp.seconds_since(start),
        navigation_s: last.stamp.seconds_since(first.stamp),
        fixes,
        samples: counts.samples,
        gaps: counts.gaps,
        lost_samples: counts.lost,
        refused_samples: counts.refused(),
        restarts: counts.restarts,
        warnings: notes.lines,
    };
    report.print(options.json)?;
    Ok(Outcome::Reached)
}

impl Report {
    fn print(&self, json: bool) -> anyhow::Result<()> {
        if json {
            return output::json(self);
        }
        output::text_line(&format!(
            "position error at most {:.3} nmi in {:.0} s ({:.3} nmi without compensation)",
            self.max_position_error_nmi,
            self.navigation_s,
            self.max_position_error_uncompensated_nmi
        ))
    }
}
