//! Free-inertial navigation with a calibration and without it, held against the positions of a record.

use bags::Sample;
use serde::Serialize;
use sins::{
    earth::Position,
    machines::navigator::{
        Navigator, NavigatorEvent, NavigatorOutput, NavigatorPhase, NavigatorSettings,
    },
    machines::odometry::pose_covariance,
    machines::self_calibration::Calibration,
    mechanization::strapdown::NavigationState,
    stream::counts::StreamCounts,
    time::Stamp,
    units::NAUTICAL_MILE_M,
};

/// Largest and last horizontal distance from the positions \[nmi\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distance {
    /// The largest.
    pub largest: f64,
    /// The last.
    pub last: f64,
}

impl Distance {
    fn take(&mut self, state: &NavigationState, fix: &Position) {
        self.last = fix.offset_m(&state.position).xy().norm() / NAUTICAL_MILE_M;
        self.largest = self.largest.max(self.last);
    }
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Navigated {
    /// With the calibration.
    pub with: Distance,
    /// Without it.
    pub without: Distance,
    /// The first output.
    pub first: NavigatorOutput,
    /// The last one.
    pub last: NavigatorOutput,
    /// Stamp of the first sample.
    pub start: Stamp,
    /// Positions that it was held against.
    pub fixes: u64,
    /// What became of the samples.
    pub counts: StreamCounts,
}

impl Navigated {
    /// One sigma of the last compensated position, east and north together \[nmi\].
    pub fn position_std_nmi(&self) -> f64 {
        let solution = &self.last.compensated;
        let pose = pose_covariance(&solution.navigation, &solution.covariance);
        (pose[(0, 0)] + pose[(1, 1)]).sqrt() / NAUTICAL_MILE_M
    }

    /// How long it aligned \[s\].
    pub fn alignment_s(&self) -> f64 {
        self.first.stamp.seconds_since(self.start)
    }

    /// How long it navigated \[s\].
    pub fn navigation_s(&self) -> f64 {
        self.last.stamp.seconds_since(self.first.stamp)
    }
}

/// The same as figures, by the keys that command line and Python give them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NavigationFigures {
    /// Largest distance with the calibration \[nmi\].
    pub max_position_error_nmi: f64,
    /// Without it \[nmi\].
    pub max_position_error_uncompensated_nmi: f64,
    /// Last distance with the calibration \[nmi\].
    pub final_position_error_nmi: f64,
    /// Without it \[nmi\].
    pub final_position_error_uncompensated_nmi: f64,
    /// See [`Navigated::position_std_nmi`].
    pub position_std_nmi: f64,
    /// See [`Navigated::alignment_s`].
    pub alignment_s: f64,
    /// See [`Navigated::navigation_s`].
    pub navigation_s: f64,
    /// Positions that it was held against.
    pub fixes: u64,
    /// Samples that were used.
    pub samples: u64,
    /// Holes among them.
    pub gaps: u64,
    /// Samples that are missing.
    pub lost_samples: u64,
    /// Samples that were refused.
    pub refused_samples: u64,
    /// Alignments after the first.
    pub restarts: u64,
}

impl From<&Navigated> for NavigationFigures {
    fn from(navigated: &Navigated) -> Self {
        let counts = &navigated.counts;
        Self {
            max_position_error_nmi: navigated.with.largest,
            max_position_error_uncompensated_nmi: navigated.without.largest,
            final_position_error_nmi: navigated.with.last,
            final_position_error_uncompensated_nmi: navigated.without.last,
            position_std_nmi: navigated.position_std_nmi(),
            alignment_s: navigated.alignment_s(),
            navigation_s: navigated.navigation_s(),
            fixes: navigated.fixes,
            samples: counts.samples,
            gaps: counts.gaps,
            lost_samples: counts.lost,
            refused_samples: counts.refused(),
            restarts: counts.restarts,
        }
    }
}

/// A navigation under way.
pub struct FreeNavigation {
    navigator: Navigator,
    distances: [Distance; 2],
    fixes: u64,
    first: Option<NavigatorOutput>,
    last: Option<NavigatorOutput>,
    start: Option<Stamp>,
}

impl FreeNavigation {
    /// One that waits for its first sample.
    ///
    /// # Errors
    /// Where settings or calibration are refused.
    pub fn new(settings: NavigatorSettings, calibration: Calibration) -> Result<Self, sins::Error> {
        let mut navigator = Navigator::new(settings)?;
        navigator.push_calibration(calibration)?;
        Ok(Self {
            navigator,
            distances: [Distance::default(); 2],
            fixes: 0,
            first: None,
            last: None,
            start: None,
        })
    }

    /// Takes a sample, and tells what happens by it; says whether it was a position that the solution is held against.
    ///
    /// # Errors
    /// Where the sample is refused; it is left out.
    pub fn push(
        &mut self,
        sample: &Sample,
        tell: impl FnMut(&NavigatorEvent),
    ) -> Result<bool, sins::Error> {
        match sample {
            Sample::Imu(imu) => {
                self.start.get_or_insert(imu.stamp);
                self.navigator.push_imu(imu);
                self.drain(tell);
            }
            Sample::Joints(joints) => self.navigator.push_joints(*joints)?,
            Sample::Velocity(stamp, velocity) => self.navigator.push_velocity(*stamp, *velocity)?,
            Sample::Fix(fix) => {
                let Some(position) = fix.position else {
                    return Ok(false);
                };
                self.navigator.push_position(position)?;
                if let Some(output) = &self.last {
                    self.distances[0].take(&output.compensated.navigation, &position);
                    self.distances[1].take(&output.uncompensated.navigation, &position);
                    self.fixes += 1;
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    fn drain(&mut self, mut tell: impl FnMut(&NavigatorEvent)) {
        while let Some(event) = self.navigator.poll() {
            tell(&event);
            if let NavigatorEvent::Sample {
                output: Some(output),
                ..
            } = event
            {
                if self.first.is_none() {
                    self.first = Some((*output).clone());
                }
                self.last = Some(*output);
            }
        }
    }

    /// With the calibration and without it, so far.
    pub fn distances(&self) -> [Distance; 2] {
        self.distances
    }

    /// Where it stands.
    pub fn phase(&self) -> NavigatorPhase {
        self.navigator.phase()
    }

    /// No more will come; nothing, where navigation did not begin.
    pub fn finish(&mut self) -> Option<Navigated> {
        self.navigator.end();
        self.drain(|_| {});
        let [with, without] = self.distances;
        Some(Navigated {
            with,
            without,
            first: self.first.take()?,
            last: self.last.take()?,
            start: self.start?,
            fixes: self.fixes,
            counts: self.navigator.stream().counts(),
        })
    }
}
