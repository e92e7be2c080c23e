//! The machine that runs a [`Program`]: fed joint states, it hands back joint trajectories.
//!
//! It never looks at a clock. Dwells, deadlines and gaps are counted by the stamps of the joint states, so a run is the same
//! at any speed of simulated time and from any bag.
//!
//! A rotation is commanded a little before it is due (`command_lead_s`), with the moment it is due as its start: then
//! the time line does not depend on how long the command travels. A dwell counts from the planned end of the rotation
//! where the first joint state after it lies within the tolerances, otherwise from the first joint state that does.

mod kept;
mod settings;
mod status;

use std::mem;

use serde::{Deserialize, Serialize};

use super::Program;
use crate::error::Error;
use crate::table::{JOINT_NAMES, Joint, JointSample, Trajectory};
use crate::time::{Stamp, seconds_to_nanos};

pub use kept::Snapshot;
pub use settings::SequencerSettings;
pub use status::{Command, Refused, RotationStatus, State, Status};

/// A drive of one joint that was commanded.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Leg {
    joint: Joint,
    start: Stamp,
    end: Stamp,
    /// Whether a joint state after `end` was seen, and since when the table has been within the tolerances.
    seen_after_end: bool,
    arrived: Option<Stamp>,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
enum Phase {
    Idle,
    /// Waiting for both joints to rest, to plan the next drive from where they stand.
    Stilling {
        deadline: Option<Stamp>,
    },
    Driving(Leg),
    Dwelling {
        until: Stamp,
    },
    Paused,
    Aborted,
    Finished,
    Fault,
}

/// Runs a [`Program`] against the joint states of a table.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sequencer {
    program: Program,
    settings: SequencerSettings,
    phase: Phase,
    cycle: u32,
    step: u32,
    /// Step that the table is still in while the command of the next one waits for its start.
    departing: (u32, u32),
    /// Where the joints stand by plan \[rad\].
    at: [f64; 2],
    /// Dwell on arrival, and how long the next drive still has to wait \[ns\].
    dwell_nanos: i64,
    delay_nanos: i64,
    begun: Option<Stamp>,
    last: Option<JointSample>,
    gaps: u64,
    message: String,
    #[serde(skip)]
    notes: Vec<String>,
    /// It goes on from a snapshot, and has not seen the table since.
    #[serde(skip)]
    woken: bool,
}

impl Sequencer {
    /// A sequencer that waits to be started.
    ///
    /// # Errors
    /// [`Error::Setting`] where a setting means nothing.
    pub fn new(program: Program, settings: SequencerSettings) -> Result<Self, Error> {
        settings.validate()?;
        Ok(Self {
            program,
            settings,
            phase: Phase::Idle,
            cycle: 0,
            step: 0,
            departing: (0, 0),
            at: [0.0; 2],
            dwell_nanos: 0,
            delay_nanos: 0,
            begun: None,
            last: None,
            gaps: 0,
            message: String::new(),
            notes: Vec::new(),
            woken: false,
        })
    }

    /// The program that runs.
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// Steps between joint states longer than the setting, since the sequencer was made.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// What a person should read since the last call, oldest first.
    pub fn take_notes(&mut self) -> Vec<String> {
        mem::take(&mut self.notes)
    }

    /// Starts the program from its beginning; the table first drives to zero if it stands elsewhere.
    ///
    /// # Errors
    /// [`Refused`] while it runs or is paused.
    pub fn start(&mut self) -> Result<(), Refused> {
        if !matches!(
            self.phase,
            Phase::Idle | Phase::Aborted | Phase::Finished | Phase::Fault
        ) {
            return Err(self.refused("start"));
        }
        self.begin();
        Ok(())
    }

    fn begin(&mut self) {
        (self.cycle, self.step, self.departing) = (0, 0, (0, 0));
        self.dwell_nanos = self.program.dwell_nanos(0);
        self.delay_nanos = 0;
        self.begun = None;
        self.phase = Phase::Stilling { deadline: None };
        self.say(format!("{}: started", self.program.name));
    }

    /// Stops the table where it is, or stops the clock of the dwell. The command, if there is one, stops the table.
    ///
    /// # Errors
    /// [`Refused`] where nothing runs.
    pub fn pause(&mut self) -> Result<Option<Command>, Refused> {
        let now = self.last.map(|sample| sample.stamp);
        let command = match (self.phase, now) {
            (Phase::Stilling { .. }, _) => Some(Command::hold()),
            (Phase::Driving(leg), Some(now)) => {
                self.delay_nanos = (leg.start.nanos() - now.nanos()).max(0);
                Some(Command::hold())
            }
            (Phase::Dwelling { until }, Some(now)) => {
                self.dwell_nanos = if until.nanos() == i64::MAX {
                    i64::MAX
                } else {
                    until.nanos() - now.nanos()
                };
                None
            }
            _ => return Err(self.refused("pause")),
        };
        self.phase = Phase::Paused;
        self.say("paused".to_owned());
        Ok(command)
    }

    /// Goes on: with what is left of the rotation, or of the dwell.
    ///
    /// # Errors
    /// [`Refused`] where it is not paused.
    pub fn resume(&mut self) -> Result<(), Refused> {
        if !matches!(self.phase, Phase::Paused) {
            return Err(self.refused("resume"));
        }
        self.phase = Phase::Stilling { deadline: None };
        self.say("resumed".to_owned());
        Ok(())
    }

    /// Ends the program now. The command stops the table where it is.
    ///
    /// # Errors
    /// [`Refused`] where nothing runs.
    pub fn abort(&mut self) -> Result<Command, Refused> {
        if matches!(
            self.phase,
            Phase::Idle | Phase::Aborted | Phase::Finished | Phase::Fault
        ) {
            return Err(self.refused("abort"));
        }
        self.phase = Phase::Aborted;
        self.say("aborted".to_owned());
        Ok(Command::hold())
    }

    /// The table says itself that it cannot go on: a fault with this reason, unless nothing runs. The command stops the
    /// table.
    pub fn table_failed(&mut self, reason: String) -> Option<Command> {
        let state = self.state();
        (state != State::Idle && !state.is_over()).then(|| self.fault(reason))
    }

    /// Takes a joint state; hands back a motion where one is due. A joint state with the stamp of the last one is ignored.
    pub fn ingest(&mut self, sample: &JointSample) -> Option<Command> {
        if !sample
            .position
            .iter()
            .chain(&sample.velocity)
            .all(|v| v.is_finite())
        {
            self.note(format!(
                "joint state at {} ns is not finite, ignored",
                sample.stamp.nanos()
            ));
            return None;
        }
        let now = sample.stamp;
        if mem::take(&mut self.woken) {
            self.wake(sample);
        }
        if let Some(last) = self.last.replace(*sample) {
            if now == last.stamp {
                return None;
            }
            let step_s = now.seconds_since(last.stamp);
            if step_s < 0.0 {
                return self.time_ran_back(-step_s);
            }
            if step_s > self.settings.joint_state_gap_s {
                self.gaps += 1;
                self.note(format!(
                    "gap of {step_s:.3} s in the joint states before {} ns",
                    now.nanos()
                ));
            }
        }
        match self.phase {
            Phase::Stilling { deadline } => self.still(sample, deadline),
            Phase::Driving(leg) => self.drive(sample, leg),
            Phase::Dwelling { until } => self.dwell(sample, until),
            Phase::Idle | Phase::Paused | Phase::Aborted | Phase::Finished | Phase::Fault => None,
        }
    }

    /// What the sequencer is doing, as of the last joint state.
    pub fn state(&self) -> State {
        match self.phase {
            Phase::Idle => State::Idle,
            Phase::Stilling { .. } => State::WaitingForTable,
            Phase::Driving(_) if self.waits_to_start() => State::Dwelling,
            Phase::Driving(_) if self.step == 0 => State::WaitingForTable,
            Phase::Driving(_) => State::Rotating,
            Phase::Dwelling { .. } => State::Dwelling,
            Phase::Paused => State::Paused,
            Phase::Aborted => State::Aborted,
            Phase::Finished => State::Finished,
            Phase::Fault => State::Fault,
        }
    }

    /// Whether a rotation was commanded whose start is still to come.
    fn waits_to_start(&self) -> bool {
        match (self.phase, self.last) {
            (Phase::Driving(leg), Some(last)) => last.stamp < leg.start,
            _ => false,
        }
    }

    /// Where the scheme stands, as of the last joint state.
    pub fn status(&self) -> Status {
        let now = self.last.map(|sample| sample.stamp);
        let state = self.state();
        let (cycle, step) = if self.waits_to_start() {
            self.departing
        } else {
            (self.cycle, self.step)
        };
        let next = if state == State::Dwelling {
            self.program.next(cycle, step)
        } else {
            Some((cycle, step))
        };
        let rotation = next.and_then(|(_, step)| self.program.step(step));
        Status {
            stamp: now.unwrap_or_default(),
            scheme: self.program.name.clone(),
            state,
            cycle,
            step,
            steps_per_cycle: self.program.steps.len() as u32,
            position: self.program.position(step).to_owned(),
            rotation: rotation.map(|s| RotationStatus {
                joint: s.joint,
                axis: s.axis,
                angle_rad: s.angle_rad,
            }),
            elapsed_s: match (now, self.begun) {
                (Some(now), Some(begun)) => now.seconds_since(begun).max(0.0),
                _ => 0.0,
            },
            remaining_s: self.remaining_nanos().map(|nanos| nanos as f64 * 1e-9),
            target: self.program.target(cycle, step),
            message: self.message.clone(),
        }
    }

    fn remaining_nanos(&self) -> Option<i64> {
        if matches!(self.phase, Phase::Finished | Phase::Aborted | Phase::Fault) {
            return Some(0);
        }
        let now = self.last.map_or(0, |sample| sample.stamp.nanos());
        let after = self.program.nanos_after(self.cycle, self.step);
        let current = match self.phase {
            Phase::Dwelling { until } => until.nanos().saturating_sub(now),
            Phase::Driving(leg) => (leg.end.nanos() - now)
                .max(0)
                .saturating_add(self.dwell_nanos),
            _ => self.dwell_nanos,
        };
        let planned = after.map(|after| after.saturating_add(current.max(0)));
        match (planned, self.stop_at()) {
            (planned, Some(stop)) => {
                let left = (stop.nanos() - now).max(0);
                Some(planned.map_or(left, |planned| planned.min(left)))
            }
            (planned, None) => planned,
        }
    }

    fn stop_at(&self) -> Option<Stamp> {
        Some(self.begun?.plus_seconds(self.settings.stop_after_s?))
    }

    fn still(&mut self, sample: &JointSample, deadline: Option<Stamp>) -> Option<Command> {
        let now = sample.stamp;
        let rests = sample
            .velocity
            .iter()
            .all(|v| v.abs() <= self.settings.rate_tolerance_rad_s);
        if !rests {
            let Some(deadline) = deadline else {
                self.phase = Phase::Stilling {
                    deadline: Some(now.plus_seconds(self.settings.arrival_timeout_s)),
                };
                return Some(Command::hold());
            };
            if now > deadline {
                return Some(self.fault(format!(
                    "the table does not stop: it turns at {}",
                    rates(sample)
                )));
            }
            return None;
        }
        let target = self.program.target(self.cycle, self.step);
        self.at = sample.position;
        for (at, target) in self.at.iter_mut().zip(target) {
            if (*at - target).abs() <= self.settings.position_tolerance_rad {
                *at = target;
            }
        }
        let delay = mem::take(&mut self.delay_nanos);
        if self.at == target {
            self.arrive(now);
            return None;
        }
        Some(self.next_leg(now, (delay > 0).then(|| now.plus_nanos(delay))))
    }

    /// Commands the drive of the first joint that is not where it should be. There is one.
    fn next_leg(&mut self, now: Stamp, start: Option<Stamp>) -> Command {
        let target = self.program.target(self.cycle, self.step);
        let joint = if self.at[1] == target[1] {
            Joint::Outer
        } else {
            Joint::Inner
        };
        let angle = target[joint.index()] - self.at[joint.index()];
        let (rate, acceleration) = self.program.step(self.step).map_or(
            (self.program.rate_rad_s, self.program.acceleration_rad_s2),
            |s| (s.rate_rad_s, s.acceleration_rad_s2),
        );
        let trajectory = match Trajectory::trapezoid(joint, self.at, angle, rate, acceleration) {
            Ok(trajectory) => trajectory,
            Err(error) => return self.fault(error.to_string()),
        };
        let begins = start.unwrap_or(now);
        self.phase = Phase::Driving(Leg {
            joint,
            start: begins,
            end: begins.plus_nanos(trajectory.duration_nanos()),
            seen_after_end: false,
            arrived: None,
        });
        let (name, degrees) = (joint.name(), target[joint.index()].to_degrees());
        self.say(format!("{name} to {degrees:.3} deg"));
        Command { start, trajectory }
    }

    fn drive(&mut self, sample: &JointSample, mut leg: Leg) -> Option<Command> {
        let now = sample.stamp;
        if now < leg.end {
            return None;
        }
        let target = self.program.target(self.cycle, self.step);
        let joint = leg.joint.index();
        let close =
            (sample.position[joint] - target[joint]).abs() <= self.settings.position_tolerance_rad;
        let rests = sample
            .velocity
            .iter()
            .all(|v| v.abs() <= self.settings.rate_tolerance_rad_s);
        if close && rests {
            let since = leg
                .arrived
                .unwrap_or(if leg.seen_after_end { now } else { leg.end });
            leg.arrived = Some(since);
            if now.seconds_since(since) >= self.settings.settling_s {
                self.at[joint] = target[joint];
                if self.at == target {
                    self.arrive(since);
                    return None;
                }
                return Some(self.next_leg(now, None));
            }
        } else {
            leg.arrived = None;
            if now.seconds_since(leg.end) > self.settings.arrival_timeout_s {
                let (wanted, actual) = (
                    target[joint].to_degrees(),
                    sample.position[joint].to_degrees(),
                );
                return Some(self.fault(format!(
                    "{} did not arrive: target {wanted:.4} deg, actual {actual:.4} deg, turning at {}, {:.1} s after the end of the motion",
                    leg.joint.name(),
                    rates(sample),
                    now.seconds_since(leg.end),
                )));
            }
        }
        leg.seen_after_end = true;
        self.phase = Phase::Driving(leg);
        None
    }

    fn arrive(&mut self, at: Stamp) {
        self.begun.get_or_insert(at);
        let until = Stamp::from_nanos(at.nanos().saturating_add(self.dwell_nanos));
        self.phase = Phase::Dwelling { until };
        self.say(format!("arrived at {}", self.program.position(self.step)));
    }

    fn dwell(&mut self, sample: &JointSample, until: Stamp) -> Option<Command> {
        let now = sample.stamp;
        for (joint, name) in JOINT_NAMES.iter().enumerate() {
            if (sample.position[joint] - self.at[joint]).abs()
                > self.settings.position_tolerance_rad
            {
                return Some(self.fault(format!(
                    "{name} left its position: target {:.4} deg, actual {:.4} deg",
                    self.at[joint].to_degrees(),
                    sample.position[joint].to_degrees(),
                )));
            }
        }
        let stop_at = self.stop_at();
        if stop_at.is_some_and(|stop| now >= stop) {
            return self.finish();
        }
        let Some((cycle, step)) = self.program.next(self.cycle, self.step) else {
            return if now >= until { self.finish() } else { None };
        };
        let lead = seconds_to_nanos(self.settings.command_lead_s);
        if now < until.plus_nanos(-lead) || stop_at.is_some_and(|stop| until >= stop) {
            return None;
        }
        self.departing = (self.cycle, self.step);
        (self.cycle, self.step) = (cycle, step);
        self.dwell_nanos = self.program.dwell_nanos(step);
        Some(self.next_leg(now, (lead > 0 && until >= now).then_some(until)))
    }

    fn finish(&mut self) -> Option<Command> {
        self.phase = Phase::Finished;
        self.say("finished".to_owned());
        None
    }

    fn time_ran_back(&mut self, seconds: f64) -> Option<Command> {
        if matches!(
            self.phase,
            Phase::Idle | Phase::Aborted | Phase::Finished | Phase::Fault
        ) {
            return None;
        }
        let reason = format!("time of the joint states ran back by {seconds:.3} s");
        if self.settings.restart_when_time_runs_back {
            self.say(reason);
            self.begin();
            return None;
        }
        Some(self.fault(reason))
    }

    fn fault(&mut self, reason: String) -> Command {
        self.phase = Phase::Fault;
        self.say(reason);
        Command::hold()
    }

    fn refused(&self, request: &'static str) -> Refused {
        Refused {
            request,
            state: self.state(),
        }
    }

    fn say(&mut self, message: String) {
        self.message.clone_from(&message);
        self.notes.push(message);
    }

    fn note(&mut self, note: String) {
        self.notes.push(note);
    }
}

fn rates(sample: &JointSample) -> String {
    format!(
        "{:.4}, {:.4} deg/s",
        sample.velocity[0].to_degrees(),
        sample.velocity[1].to_degrees()
    )
}

#[cfg(test)]
mod tests;
