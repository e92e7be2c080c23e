//! The way of the block through a program, in covariance steps.

use nalgebra::Matrix3;

use crate::error::Error;
use crate::simulation::Ship;
use crate::table::Trajectory;
use crate::table::scheme::{Program, Segment, SegmentKind};

/// Length of a step.
const STEP_NANOS: i64 = 1_000_000_000;
/// Parts of a step over which the attitude is averaged while the table turns (midpoint rule: 4e-6 at 5 deg/s).
const PARTS: i64 = 10;

/// One second of the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathStep {
    /// Its end, from the start of the program \[s\].
    pub time_s: f64,
    /// C_b^n, mean over the step.
    pub mean: Matrix3<f64>,
    /// C_b^n at its end.
    pub end: Matrix3<f64>,
}

/// Iterator over the steps of a program, without end.
pub(super) struct Path<'a> {
    program: &'a Program,
    segments: Vec<Segment>,
    current: usize,
    motion: Option<Trajectory>,
    ship: Matrix3<f64>,
    now: i64,
    /// Mean of a step at rest in the present dwell.
    resting: Option<Matrix3<f64>>,
}

impl<'a> Path<'a> {
    /// From the start of the first dwell to `duration_s`.
    pub fn new(program: &'a Program, ship: &Ship, duration_s: f64) -> Self {
        let end = crate::time::seconds_to_nanos(duration_s);
        let mut segments = Vec::new();
        for segment in program.segments() {
            segments.push(segment);
            if segment.end_nanos >= end {
                break;
            }
        }
        Self {
            program,
            segments,
            current: 0,
            motion: None,
            ship: ship.at(0.0).attitude.to_rotation_matrix().into_inner(),
            now: 0,
            resting: None,
        }
    }

    /// Moves to the segment that `nanos` lies in; says whether the block rests there.
    fn seek(&mut self, nanos: i64) -> Result<(), Error> {
        while self.current + 1 < self.segments.len()
            && self.segments[self.current].end_nanos <= nanos
        {
            self.current += 1;
            let segment = self.segments[self.current];
            self.resting = None;
            self.motion = match self.program.step(segment.step) {
                Some(step) if segment.kind == SegmentKind::Rotation => {
                    let mut from = self.program.target(segment.cycle, segment.step);
                    from[step.joint.index()] -= step.angle_rad;
                    Some(Trajectory::trapezoid(
                        step.joint,
                        from,
                        step.angle_rad,
                        step.rate_rad_s,
                        step.acceleration_rad_s2,
                    )?)
                }
                _ => None,
            };
        }
        Ok(())
    }

    /// C_b^n at a time that is not before the last one asked for.
    fn attitude(&mut self, nanos: i64) -> Result<Matrix3<f64>, Error> {
        self.seek(nanos)?;
        let segment = self.segments[self.current];
        let angles = self
            .motion
            .as_ref()
            .and_then(|motion| motion.at(nanos - segment.start_nanos))
            .map_or_else(
                || self.program.target(segment.cycle, segment.step),
                |state| state.position,
            );
        Ok(self.ship * self.program.table.attitude(angles).to_rotation_matrix())
    }

    fn step(&mut self) -> Result<PathStep, Error> {
        let (from, to) = (self.now, self.now + STEP_NANOS);
        self.now = to;
        self.seek(from)?;
        let rests = self.motion.is_none() && self.segments[self.current].end_nanos >= to;
        if let Some(resting) = self.resting.filter(|_| rests) {
            return Ok(PathStep {
                time_s: to as f64 / 1e9,
                mean: resting,
                end: resting,
            });
        }
        let mut sum = Matrix3::zeros();
        for part in 0..PARTS {
            sum += self.attitude(from + (2 * part + 1) * STEP_NANOS / (2 * PARTS))?;
        }
        let mean = sum / PARTS as f64;
        if rests {
            self.resting = Some(mean);
        }
        let end = if rests { mean } else { self.attitude(to)? };
        Ok(PathStep {
            time_s: to as f64 / 1e9,
            mean,
            end,
        })
    }
}

impl Iterator for Path<'_> {
    type Item = Result<PathStep, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.step())
    }
}
