//! A simulator and a sequencer in lockstep, in memory.

use super::{Simulator, Tick};
use crate::error::Error;
use crate::table::scheme::Sequencer;
use crate::table::scheme::sequencer::State;
use crate::time::{Stamp, seconds_to_nanos};

/// Runs a scheme on a simulated table: an iterator over all sampling intervals until the time is over.
///
/// ```
/// use sins::table::scheme::{Scheme, Sequencer, sequencer::SequencerSettings};
/// use sins::simulation::{ImuErrorSettings, ImuErrors, Run, Simulator, SimulatorSettings};
///
/// let scheme = Scheme::eight_position();
/// let settings = SimulatorSettings::default();
/// let program = scheme.program(settings.plant.turntable)?;
/// let run = Run::new(Simulator::new(settings)?, Sequencer::new(program, SequencerSettings::default())?, 10.0);
/// // One truth, several IMUs: what a Monte Carlo does.
/// let mut others = [ImuErrors::new(ImuErrorSettings::default(), 2)?, ImuErrors::new(ImuErrorSettings::default(), 3)?];
/// let mut samples = 0;
/// for tick in run {
///     let tick = tick?;
///     for imu in &mut others {
///         let _sample = imu.measure(&tick.truth);
///     }
///     samples += 1;
/// }
/// assert_eq!(samples, 1000);
/// # Ok::<(), sins::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Run {
    simulator: Simulator,
    sequencer: Sequencer,
    end: Stamp,
    begun: bool,
    failed: bool,
}

impl Run {
    /// `duration_s` of the simulator's time, from where it stands. A sequencer that is not started yet is started.
    pub fn new(simulator: Simulator, sequencer: Sequencer, duration_s: f64) -> Self {
        let end = simulator
            .plant()
            .now()
            .plus_nanos(seconds_to_nanos(duration_s));
        Self {
            simulator,
            sequencer,
            end,
            begun: false,
            failed: false,
        }
    }

    /// The sequencer.
    pub fn sequencer(&self) -> &Sequencer {
        &self.sequencer
    }

    /// The simulator.
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    fn sequence(&mut self, joints: &crate::table::JointSample) -> Result<(), Error> {
        if let Some(command) = self.sequencer.ingest(joints) {
            self.simulator.command(command.start, &command.trajectory)?;
        }
        let notes = self.sequencer.take_notes();
        if matches!(self.sequencer.state(), State::Fault) {
            let name = self.sequencer.program().name.clone();
            return Err(Error::Scheme {
                name,
                reason: notes.last().cloned().unwrap_or_default(),
            });
        }
        Ok(())
    }

    fn advance(&mut self) -> Result<Tick, Error> {
        if !self.begun {
            self.begun = true;
            if self.sequencer.state() == State::Idle {
                self.sequencer.start().map_err(|refused| Error::Scheme {
                    name: self.sequencer.program().name.clone(),
                    reason: refused.to_string(),
                })?;
            }
            let first = self.simulator.first_joints();
            self.sequence(&first)?;
        }
        let tick = self.simulator.step();
        if let Some(joints) = &tick.joints {
            self.sequence(joints)?;
        }
        Ok(tick)
    }
}

impl Iterator for Run {
    type Item = Result<Tick, Error>;

    /// The next interval; an error (a fault of the sequencer, a refused motion) is the last item.
    fn next(&mut self) -> Option<Self::Item> {
        if self.failed || self.simulator.plant().now() >= self.end {
            return None;
        }
        let tick = self.advance();
        self.failed = tick.is_err();
        Some(tick)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::simulation::{EncoderSettings, PlantSettings, SimulatorSettings, TableSettings};
    use crate::table::scheme::sequencer::SequencerSettings;
    use crate::table::scheme::{Scheme, SegmentKind};
    use crate::table::{Axis, Turntable};

    fn run(scheme: &Scheme, settings: &SimulatorSettings, hours: f64) -> Run {
        let program = scheme.program(settings.plant.turntable).unwrap();
        let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
        Run::new(
            Simulator::new(*settings).unwrap(),
            sequencer,
            hours * 3600.0,
        )
    }

    fn at_10_hz() -> SimulatorSettings {
        SimulatorSettings {
            plant: PlantSettings {
                imu_rate_hz: 10.0,
                ..PlantSettings::default()
            },
            ..SimulatorSettings::default()
        }
    }

    /// The run follows the time line to the sample: at the end of every planned segment the joints stand at its target, and they move in
    /// rotations only.
    #[test]
    fn run_follows_the_planned_time_line() {
        for turntable in [
            Turntable::default(),
            Turntable::new(Axis::Y, Axis::X).unwrap(),
        ] {
            let mut settings = at_10_hz();
            settings.plant.turntable = turntable;
            settings.encoder = EncoderSettings {
                resolution_rad: 5e-6,
                position_std_rad: 5e-6,
                rate_std_rad_s: 1e-5,
            };
            let mut run = run(&Scheme::eight_position(), &settings, 4.0);
            let program = run.sequencer().program().clone();
            for segment in program
                .segments()
                .take_while(|s| s.end_nanos <= 14_400_000_000_000)
            {
                for nanos in (segment.start_nanos..segment.end_nanos).step_by(100_000_000) {
                    let joints = run.next().unwrap().unwrap().truth.joints;
                    assert_eq!(joints.stamp.nanos(), nanos + 100_000_000);
                    if segment.kind == SegmentKind::Dwell {
                        assert_eq!(joints.velocity, [0.0; 2], "{segment:?}");
                    }
                    if nanos + 100_000_000 == segment.end_nanos {
                        let target = program.target(segment.cycle, segment.step);
                        assert!(
                            (0..2).all(|j| (joints.position[j] - target[j]).abs() < 1e-9),
                            "{segment:?}"
                        );
                    }
                }
            }
        }
    }

    /// A table that stands elsewhere is first driven to zero, then the first dwell begins.
    #[test]
    fn drives_to_the_start_first() {
        let mut settings = at_10_hz();
        settings.plant.table = TableSettings {
            start: [0.5, -0.3],
            ..TableSettings::default()
        };
        let mut run = run(&Scheme::eight_position(), &settings, 0.1);
        let last = run.by_ref().map(Result::unwrap).last().unwrap();
        assert!(
            last.truth.joints.position.iter().all(|p| p.abs() < 1e-9),
            "{:?}",
            last.truth.joints
        );
        assert_eq!(run.sequencer().state(), State::Dwelling);
        let elapsed = run.sequencer().status().elapsed_s;
        assert!(elapsed > 300.0 && elapsed < 350.0, "{elapsed}");
    }

    /// The same seed gives the same run to the last bit; an encoder that is read more often changes no IMU sample.
    #[test]
    fn runs_repeat() {
        let imu = |settings| {
            run(&Scheme::eight_position(), &settings, 0.15)
                .map(|t| t.unwrap().imu)
                .collect::<Vec<_>>()
        };
        let reference = imu(at_10_hz());
        assert_eq!(reference.len(), 5400);
        assert!(reference == imu(at_10_hz()));
        assert!(
            reference
                == imu(SimulatorSettings {
                    joint_state_rate_hz: 1.0,
                    ..at_10_hz()
                })
        );
        assert!(
            reference
                != imu(SimulatorSettings {
                    seed: 2,
                    ..at_10_hz()
                })
        );
    }

    /// A table too weak for the scheme ends the run with an error that says why.
    #[test]
    fn refused_motion_ends_the_run() {
        let mut settings = at_10_hz();
        settings.plant.table.max_rate_rad_s = 0.01;
        let last = run(&Scheme::eight_position(), &settings, 1.0)
            .last()
            .unwrap();
        assert!(
            last.unwrap_err()
                .to_string()
                .contains("rate of outer_joint")
        );
    }
}
