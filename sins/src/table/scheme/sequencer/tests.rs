//! The sequencer against a table that follows perfectly, and against tables that do not.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::simulation::{Table, TableSettings};
use crate::table::scheme::{About, Rotation, Scheme};
use crate::table::{Axis, Turntable};

/// A table and a sequencer, 10 joint states a second.
struct Bench {
    sequencer: Sequencer,
    table: Table,
    now: Stamp,
    commands: u32,
}

impl Bench {
    fn new(scheme: &Scheme, settings: SequencerSettings) -> Self {
        let program = scheme.program(Turntable::default()).unwrap();
        Self {
            sequencer: Sequencer::new(program, settings).unwrap(),
            table: Table::new(TableSettings::default(), Stamp::default()).unwrap(),
            now: Stamp::default(),
            commands: 0,
        }
    }

    fn give(&mut self, command: Option<Command>) {
        if let Some(command) = command {
            self.commands += 1;
            self.table
                .command(self.now, command.start, &command.trajectory)
                .unwrap();
        }
    }

    fn sample(&self) -> JointSample {
        let state = self.table.state(self.now);
        JointSample {
            stamp: self.now,
            position: state.position,
            velocity: state.velocity,
        }
    }

    fn run_until(&mut self, seconds: f64) {
        while self.now.seconds_since(Stamp::default()) < seconds - 1e-9 {
            self.now = self.now.plus_nanos(100_000_000);
            self.table.advance(self.now);
            let command = self.sequencer.ingest(&self.sample());
            self.give(command);
        }
    }

    fn state(&self) -> State {
        self.sequencer.state()
    }
}

/// Dwells of 50 s, +90 and −90 about x (20 s each), once.
fn short() -> Scheme {
    let turn = |degrees: f64| Rotation::new(About::Joint(Joint::Outer), degrees.to_radians());
    let mut scheme = Scheme::new("short", vec![turn(90.0), turn(-90.0)]);
    scheme.dwell_s = 50.0;
    scheme.cycles = Some(1);
    scheme
}

fn started() -> Bench {
    let mut bench = Bench::new(&short(), SequencerSettings::default());
    bench.sequencer.start().unwrap();
    bench.sequencer.ingest(&bench.sample());
    bench
}

/// The whole program: 50 + 2·(20 + 50) s, two commands, finished.
#[test]
fn runs_to_the_end() {
    let mut bench = started();
    bench.run_until(189.9);
    assert_eq!(bench.state(), State::Dwelling);
    bench.run_until(190.0);
    assert_eq!(bench.state(), State::Finished);
    assert_eq!(bench.commands, 2);
}

/// The status tells step, position, rotation, elapsed and remaining at every stage.
#[test]
fn status_tells_where_it_stands() {
    let mut bench = started();
    bench.run_until(45.0);
    let status = bench.sequencer.status();
    assert_eq!(
        (status.state, status.step, status.position.as_str()),
        (State::Dwelling, 0, "A")
    );
    assert_eq!(status.rotation.unwrap().axis, Axis::X);
    assert!(
        (status.elapsed_s - 45.0).abs() < 1e-9
            && (status.remaining_s.unwrap() - 145.0).abs() < 1e-9
    );
    bench.run_until(60.0);
    let status = bench.sequencer.status();
    assert_eq!(
        (status.state, status.step, status.position.as_str()),
        (State::Rotating, 1, "B")
    );
    assert!((status.remaining_s.unwrap() - 130.0).abs() < 1e-6);
    assert_eq!(status.target, [90f64.to_radians(), 0.0]);
    bench.run_until(100.0);
    let status = bench.sequencer.status();
    assert_eq!((status.state, status.step), (State::Dwelling, 1));
    assert!((status.rotation.unwrap().angle_rad + 90f64.to_radians()).abs() < 1e-12);
    assert!((status.remaining_s.unwrap() - 90.0).abs() < 1e-6);
}

/// Without a lead the motion starts when the command is there, and the dwell counts from the arrival.
#[test]
fn works_without_a_lead() {
    let settings = SequencerSettings {
        command_lead_s: 0.0,
        ..SequencerSettings::default()
    };
    let mut bench = Bench::new(&short(), settings);
    bench.sequencer.start().unwrap();
    bench.sequencer.ingest(&bench.sample());
    bench.run_until(191.0);
    assert_eq!((bench.state(), bench.commands), (State::Finished, 2));
}

/// Pause in a rotation stops the table short; resume turns what is left, and the dwell is a whole one.
#[test]
fn pause_and_resume_in_a_rotation() {
    let mut bench = started();
    bench.run_until(58.0);
    let command = bench.sequencer.pause().unwrap();
    assert!(
        command
            .as_ref()
            .is_some_and(|c| c.trajectory.points.is_empty())
    );
    bench.give(command);
    bench.run_until(200.0);
    assert_eq!(
        (bench.state(), bench.sample().velocity),
        (State::Paused, [0.0; 2])
    );
    let stands = bench.sample().position[0];
    assert!(stands > 0.3 && stands < 1.0, "{stands}");
    bench.sequencer.resume().unwrap();
    bench.run_until(216.0);
    assert_eq!(bench.state(), State::Dwelling);
    assert!((bench.sample().position[0] - 90f64.to_radians()).abs() < 1e-12);
    let remaining = bench.sequencer.status().remaining_s.unwrap();
    assert!(remaining > 100.0 && remaining < 120.0, "{remaining}");
    bench.run_until(340.0);
    assert_eq!(bench.state(), State::Finished);
}

/// Pause in a dwell stops its clock; a rotation that was already commanded is called off.
#[test]
fn pause_in_a_dwell_stops_its_clock() {
    for pause_at in [20.0, 45.0] {
        let mut bench = started();
        bench.run_until(pause_at);
        let command = bench.sequencer.pause().unwrap();
        bench.give(command);
        bench.run_until(300.0);
        assert_eq!(bench.sample().position, [0.0; 2]);
        bench.sequencer.resume().unwrap();
        bench.run_until(300.0 + 50.0 - pause_at);
        assert!(bench.sample().position[0] < 1e-3);
        bench.run_until(300.0 + 50.0 - pause_at + 25.0);
        assert!(
            (bench.sample().position[0] - 90f64.to_radians()).abs() < 1e-9,
            "{pause_at}"
        );
    }
}

/// Abort stops the table at once, for good; start begins anew, from where the table stands.
#[test]
fn abort_then_start_again() {
    let mut bench = started();
    bench.run_until(58.0);
    let command = bench.sequencer.abort().unwrap();
    bench.give(Some(command));
    bench.run_until(100.0);
    assert_eq!(
        (bench.state(), bench.sample().velocity),
        (State::Aborted, [0.0; 2])
    );
    bench.sequencer.start().unwrap();
    bench.run_until(130.0);
    assert_eq!(
        (bench.state(), bench.sequencer.status().step),
        (State::Dwelling, 0)
    );
    assert!(bench.sample().position[0].abs() < 1e-12);
}

/// A sequencer that starts while the table still turns stops it, then drives it to zero.
#[test]
fn finds_a_moving_table() {
    let mut bench = Bench::new(&short(), SequencerSettings::default());
    let motion = Trajectory::trapezoid(Joint::Inner, [0.0; 2], 2.0, 0.1, 0.05).unwrap();
    bench.table.command(bench.now, None, &motion).unwrap();
    bench.run_until(8.0);
    bench.sequencer.start().unwrap();
    bench.run_until(40.0);
    assert_eq!(bench.state(), State::Dwelling);
    assert!(bench.sample().position[1].abs() < 1e-12);
}

/// What the state does not permit is refused with the request and the state.
#[test]
fn illegal_requests_are_refused() {
    let mut bench = Bench::new(&short(), SequencerSettings::default());
    assert_eq!(
        bench.sequencer.pause().unwrap_err().to_string(),
        "cannot pause: the scheme is idle"
    );
    assert!(bench.sequencer.resume().is_err() && bench.sequencer.abort().is_err());
    bench.sequencer.start().unwrap();
    assert!(bench.sequencer.start().is_err() && bench.sequencer.resume().is_err());
    bench.run_until(5.0);
    bench.sequencer.pause().unwrap();
    assert!(bench.sequencer.pause().is_err() && bench.sequencer.start().is_err());
    bench.sequencer.abort().unwrap();
    assert_eq!(
        bench.sequencer.abort().unwrap_err().to_string(),
        "cannot abort: the scheme is aborted"
    );
}

/// A table that ignores its command is a fault that names joint, target and actual angle.
#[test]
fn table_that_never_arrives_is_a_fault() {
    let mut bench = started();
    for k in 1..=2000 {
        bench.sequencer.ingest(&JointSample {
            stamp: Stamp::from_nanos(k * 100_000_000),
            ..bench.sample()
        });
    }
    let status = bench.sequencer.status();
    assert_eq!(status.state, State::Fault);
    for part in ["outer_joint", "target 90.0000", "actual 0.0000"] {
        assert!(status.message.contains(part), "{}", status.message);
    }
}

/// A joint that leaves its place during a dwell is a fault.
#[test]
fn moved_table_is_a_fault() {
    let mut bench = started();
    bench.run_until(10.0);
    let mut sample = bench.sample();
    (sample.stamp, sample.position[1]) = (sample.stamp.plus_seconds(0.1), 0.01);
    assert!(
        bench
            .sequencer
            .ingest(&sample)
            .unwrap()
            .trajectory
            .points
            .is_empty()
    );
    assert!(
        bench
            .sequencer
            .status()
            .message
            .contains("inner_joint left its position")
    );
}

/// Time that runs back is a fault; the scheme can be started again.
#[test]
fn time_running_back_is_a_fault() {
    let mut bench = started();
    bench.run_until(10.0);
    bench.now = Stamp::default();
    bench.sequencer.ingest(&bench.sample());
    assert_eq!(bench.state(), State::Fault);
    assert!(
        bench
            .sequencer
            .status()
            .message
            .contains("ran back by 10.000 s")
    );
    bench.sequencer.start().unwrap();
    bench.run_until(1.0);
    assert_eq!(bench.state(), State::Dwelling);
}

/// Where it is asked for, a new beginning of time is a new beginning of the program.
#[test]
fn program_restarts_with_time() {
    let settings = SequencerSettings {
        restart_when_time_runs_back: true,
        ..SequencerSettings::default()
    };
    let mut bench = Bench::new(&short(), settings);
    bench.sequencer.start().unwrap();
    bench.run_until(100.0);
    bench.now = Stamp::default();
    bench.table = Table::new(TableSettings::default(), bench.now).unwrap();
    bench.sequencer.ingest(&bench.sample());
    bench.run_until(5.0);
    let status = bench.sequencer.status();
    assert_eq!(
        (status.state, status.step, status.elapsed_s),
        (State::Dwelling, 0, 4.9)
    );
}

/// A gap in the joint states is counted and told; the program goes on where the table still stands right.
#[test]
fn gap_is_told() {
    let mut bench = started();
    bench.run_until(10.0);
    bench.sequencer.take_notes();
    bench.now = bench.now.plus_seconds(5.0);
    bench.run_until(16.0);
    assert_eq!(
        (bench.sequencer.gaps(), bench.state()),
        (1, State::Dwelling)
    );
    assert!(bench.sequencer.take_notes()[0].contains("gap of 5.100 s"));
}

/// The time given ends the program, without a rotation that would begin after it.
#[test]
fn stops_after_the_time_given() {
    let settings = SequencerSettings {
        stop_after_s: Some(55.0),
        ..SequencerSettings::default()
    };
    let mut scheme = Scheme::eight_position();
    scheme.dwell_s = 60.0;
    let mut bench = Bench::new(&scheme, settings);
    bench.sequencer.start().unwrap();
    bench.sequencer.ingest(&bench.sample());
    bench.run_until(20.0);
    assert!((bench.sequencer.status().remaining_s.unwrap() - 35.0).abs() < 1e-9);
    bench.run_until(55.0);
    assert_eq!((bench.state(), bench.commands), (State::Finished, 0));
}

/// Settings that mean nothing are refused by name.
#[test]
fn settings_are_checked() {
    let program = short().program(Turntable::default()).unwrap();
    let settings = SequencerSettings {
        rate_tolerance_rad_s: 0.0,
        ..SequencerSettings::default()
    };
    assert!(
        Sequencer::new(program, settings)
            .unwrap_err()
            .to_string()
            .contains("rate tolerance")
    );
}

/// What the table itself reports ends the scheme with its words and stops it; where nothing runs it is nobody's fault.
#[test]
fn a_failure_that_the_table_reports_is_a_fault() {
    let mut bench = started();
    bench.run_until(60.0);
    let command = bench.sequencer.table_failed("blocked".to_owned()).unwrap();
    assert!(command.trajectory.points.is_empty());
    assert_eq!(bench.state(), State::Fault);
    assert_eq!(bench.sequencer.status().message, "blocked");
    assert_eq!(bench.sequencer.table_failed("again".to_owned()), None);
    assert_eq!(bench.sequencer.status().message, "blocked");
}

impl Bench {
    /// The sequencer is killed; the table goes on by itself, and joint states come again after `seconds`.
    fn kill(&mut self, seconds: f64) {
        let kept = postcard::to_allocvec(&self.sequencer.snapshot()).unwrap();
        let end = self.now.plus_seconds(seconds);
        while self.now < end {
            self.now = self.now.plus_nanos(100_000_000);
            self.table.advance(self.now);
        }
        let snapshot: Snapshot = postcard::from_bytes(&kept).unwrap();
        let (program, settings) = (self.sequencer.program().clone(), self.sequencer.settings);
        self.sequencer = Sequencer::go_on(&program, settings, snapshot).unwrap();
    }
}

/// Killed in a dwell, in a rotation, while a command waits for its start, and over the end of any of them: the scheme goes on
/// where it stood, and ends when it would have ended, or later by what the gap was longer than the dwell.
#[test]
fn a_killed_sequencer_goes_on_where_it_stood() {
    let scheme = short();
    let mut end = Bench::new(&scheme, SequencerSettings::default());
    end.sequencer.start().unwrap();
    end.run_until(300.0);
    assert_eq!(end.state(), State::Finished);
    let commands = end.commands;
    for (kill_s, gap_s, late_s) in [
        (30.0, 5.0, 0.0),
        (47.0, 2.0, 0.0),
        (47.0, 10.0, 0.0),
        (38.0, 22.0, 10.0),
        (60.0, 3.0, 0.0),
        (60.0, 30.0, 0.0),
        (60.0, 70.0, 10.0),
        (30.0, 60.0, 40.0),
    ] {
        let mut bench = Bench::new(&scheme, SequencerSettings::default());
        bench.sequencer.start().unwrap();
        bench.run_until(kill_s);
        bench.kill(gap_s);
        let mut finished = None;
        while finished.is_none() && bench.now.seconds_since(Stamp::default()) < 400.0 {
            let next = bench.now.seconds_since(Stamp::default()) + 0.1;
            bench.run_until(next);
            assert_ne!(
                bench.state(),
                State::Fault,
                "{:?}",
                bench.sequencer.status()
            );
            if bench.state() == State::Finished {
                finished = Some(next);
            }
        }
        println!(
            "{kill_s} {gap_s}: {finished:?}, {} commands",
            bench.commands
        );
        let finished = finished.unwrap();
        assert!(
            (finished - 190.0 - late_s).abs() < 2.0,
            "{kill_s} {gap_s}: {finished}"
        );
        assert!(bench.commands <= commands + 1, "{kill_s} {gap_s}");
    }
}

/// What waits for a person goes on waiting: a pause stays one, and an end stays one.
#[test]
fn a_pause_outlives_a_kill() {
    let mut bench = Bench::new(&short(), SequencerSettings::default());
    bench.sequencer.start().unwrap();
    bench.run_until(30.0);
    bench.sequencer.pause().unwrap();
    bench.kill(100.0);
    bench.run_until(140.0);
    assert_eq!(bench.state(), State::Paused);
    bench.sequencer.resume().unwrap();
    bench.run_until(150.0);
    assert_eq!(bench.state(), State::Dwelling);
    let left = bench.sequencer.status().remaining_s.unwrap();
    bench.sequencer.abort().unwrap();
    bench.kill(10.0);
    bench.run_until(170.0);
    assert_eq!(bench.state(), State::Aborted);
    assert!(left > 100.0, "{left}");
}

/// Another scheme, or other steps under the same name, is refused by name.
#[test]
fn another_program_is_not_gone_on_with() {
    let mut bench = Bench::new(&short(), SequencerSettings::default());
    bench.sequencer.start().unwrap();
    bench.run_until(30.0);
    let go_on = |scheme: &Scheme| {
        let program = scheme.program(Turntable::default()).unwrap();
        let snapshot = bench.sequencer.snapshot();
        let told = Sequencer::go_on(&program, SequencerSettings::default(), snapshot);
        told.unwrap_err().to_string()
    };
    let told = go_on(&Scheme::eight_position());
    assert!(told.contains("eight-position"), "{told}");
    let mut longer = short();
    longer.dwell_s = 60.0;
    assert!(go_on(&longer).contains("other steps"));
}
