//! Settings of self-calibration, each with a default that suits a ship at her mooring.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::Thresholds;
use super::encoders::EncoderAccuracy;
use super::sensor_knowledge::SensorWalk;
use crate::error::Error;
use crate::estimation::filter::InitialUncertainty;
use crate::estimation::grade::{Grade, GroupPriors};
use crate::machines::unseen_motion::UnseenMotion;
use crate::sensor::sample::NoiseDensity;
use crate::stream::StreamSettings;
use crate::stream::plausibility::SensorRange;
use crate::table::Turntable;
use crate::units::{DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G};

/// Where the velocity error is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reference {
    /// The ship lies at her mooring: her velocity is zero, give or take this one-sigma \[m/s\], once a second.
    Moored {
        /// One-sigma of the ship's residual motion, per axis \[m/s\].
        sigma_m_s: f64,
    },
    /// Velocity measurements are given. Samples wait, by their stamps, until the velocity for their time has come.
    Measured {
        /// How much later than its velocity a sample may come before the filter goes on without it \[s\].
        patience_s: f64,
    },
    /// Positions are given. Samples wait, by their stamps, until the position for their time has come.
    Position {
        /// How much later than its position a sample may come before the filter goes on without it \[s\].
        patience_s: f64,
    },
    /// As the ship lies: moored where she lies still while the alignment gathers, and by her positions where she moves and
    /// positions with their uncertainty come.
    Auto {
        /// As of a moored ship \[m/s\].
        sigma_m_s: f64,
        /// As of positions \[s\].
        patience_s: f64,
    },
}

/// The antenna whose position is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Antenna {
    /// From the table's centre, in the ship: starboard, forward, up \[m\].
    pub arm_m: Vector3<f64>,
    /// How old a position is at its stamp \[s\].
    pub latency_s: f64,
}

/// Which errors are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelChoice {
    /// The paper's thirteen states: navigation, biases, drifts.
    #[default]
    Paper,
    /// The whole sensor on the whole table, with a vertical channel; the groups whose prior is not zero.
    Whole,
}

impl ModelChoice {
    /// The name that the command line and parameters carry.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Whole => "whole",
        }
    }
}

impl std::fmt::Display for ModelChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for ModelChoice {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        [Self::Paper, Self::Whole]
            .into_iter()
            .find(|model| model.name() == text)
            .ok_or_else(|| Error::setting("model", text, "whole or paper"))
    }
}

/// Where the white noise of the sensors is taken from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoiseFrom {
    /// From the variances that come with the samples.
    #[default]
    Samples,
    /// From the samples of the coarse alignment, where ship and block rest; else from their variances.
    Rest,
}

impl NoiseFrom {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Samples, Self::Rest];

    /// The name that the command line and parameters carry.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Samples => "messages",
            Self::Rest => "rest",
        }
    }
}

impl std::fmt::Display for NoiseFrom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for NoiseFrom {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|source| source.name() == text)
            .ok_or_else(|| Error::setting("noise_from", text, "messages or rest"))
    }
}

/// Everything that self-calibration can be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Which axis each joint turns about; needed for the vehicle's attitude only.
    pub turntable: Turntable,
    /// Which errors are estimated.
    pub model: ModelChoice,
    /// Grade of the sensor, of which the whole model takes what is known before; none: as the noise tells it. Drifts and biases
    /// are as uncertain as `prior` or the grade says, whichever is wider.
    pub grade: Option<Grade>,
    /// What is known before of those that the whole model has beyond the paper's; negative: as the grade says.
    pub groups: GroupPriors,
    /// What the encoders are worth to the whole model; none: they are not used.
    pub encoders: Option<EncoderAccuracy>,
    /// White noise of the sensors; by default as `noise_from` says.
    pub noise: Option<NoiseDensity>,
    /// Where the white noise is taken from where nobody tells it.
    pub noise_from: NoiseFrom,
    /// Initial one-sigma. The misalignment is meant to be wide: the coarse alignment only chooses the point about which the
    /// filter is linear, and the filter itself goes over the same samples to find what they are worth.
    pub prior: InitialUncertainty,
    /// Velocity reference.
    pub reference: Reference,
    /// The antenna of the positions.
    pub antenna: Antenna,
    /// A position, or a measured velocity, further off than so many sigmas is left out; infinite: none is.
    pub gate_sigmas: f64,
    /// Time between covariance steps \[s\].
    pub step_s: f64,
    /// Length of coarse alignment \[s\].
    pub coarse_alignment_s: f64,
    /// Shortest coarse alignment, where the samples end or break off early \[s\].
    pub coarse_alignment_min_s: f64,
    /// Velocity that coarse alignment may leave unexplained \[m/s\].
    pub coarse_residual_limit_m_s: f64,
    /// When the estimate counts as found.
    #[serde(skip)]
    pub thresholds: Thresholds,
    /// Length of the innovation test in updates.
    pub window_updates: usize,
    /// Probability that the innovation test fails when all is well, per window.
    pub window_false_alarm: f64,
    /// Turn of the block that ends fine alignment and begins calibration \[rad\].
    pub turn_rad: f64,
    /// A hole in the samples longer than this starts the alignment anew, unless the joints tell the turn in it; so does a clock that
    /// is set back, by however little \[s\].
    pub restart_gap_s: f64,
    /// What the sensors can give; samples beyond it are refused.
    pub range: SensorRange,
    /// How sensor errors wander from one alignment to the next.
    pub walk: SensorWalk,
    /// What ship and table may do in a hole.
    pub unseen: UnseenMotion,
    /// So many windows have to pass before a run that failed the innovation test counts as consistent again.
    pub recovery_windows: usize,
    /// Whether a second filter runs beside for the judge to ask. Without it he sees the innovations alone.
    pub witness: bool,
    /// How much later than its sample, by the stamps, a joint state may come where encoders are measured or the judge looks at
    /// them \[s\].
    pub joint_patience_s: f64,
    /// A greater share of refused samples speaks against an estimate.
    pub refused_share: f64,
    /// A greater share of holes speaks against an estimate.
    pub gap_share: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            turntable: Turntable::default(),
            model: ModelChoice::default(),
            grade: None,
            groups: GroupPriors::BY_GRADE,
            encoders: Some(EncoderAccuracy::default()),
            noise: None,
            noise_from: NoiseFrom::default(),
            prior: InitialUncertainty {
                position_m: 10.0,
                velocity_m_s: 0.01,
                misalignment_rad: Vector3::new(1.0, 1.0, 10.0) * std::f64::consts::PI / 180.0,
                accelerometer_bias_m_s2: Vector3::repeat(100.0 * MICRO_G),
                gyroscope_drift_rad_s: Vector3::repeat(0.01 * DEG_PER_HOUR),
            },
            reference: Reference::Moored { sigma_m_s: 0.01 },
            antenna: Antenna::default(),
            gate_sigmas: 5.0,
            step_s: 1.0,
            coarse_alignment_s: 300.0,
            coarse_alignment_min_s: 60.0,
            coarse_residual_limit_m_s: 1.0,
            thresholds: Thresholds::default(),
            window_updates: 300,
            window_false_alarm: 1e-6,
            turn_rad: 10.0 * std::f64::consts::PI / 180.0,
            restart_gap_s: 5.0,
            range: SensorRange::default(),
            walk: SensorWalk::default(),
            unseen: UnseenMotion::default(),
            recovery_windows: 6,
            witness: true,
            joint_patience_s: 30.0,
            refused_share: 0.01,
            gap_share: 0.1,
        }
    }
}

/// How much later than its sample a measured velocity or position may come, where nothing else is said \[s\].
const PATIENCE_S: f64 = 30.0;
/// What is left of a moored ship's velocity in a quiet harbour \[m/s\].
const MOORED_SIGMA_M_S: f64 = 0.01;

impl Settings {
    /// What self-calibration is told where nobody says anything else: the whole model, and the reference that suits how the
    /// ship lies. (The machine's own default is the paper's: thirteen states at a mooring.)
    pub fn calibrating() -> Self {
        Self {
            model: ModelChoice::Whole,
            reference: Reference::Auto {
                sigma_m_s: MOORED_SIGMA_M_S,
                patience_s: PATIENCE_S,
            },
            ..Self::default()
        }
    }
}

/// The noise of reading D (0.001 deg/√h, 10 ug/√Hz), used where neither settings nor samples tell any.
pub fn default_noise() -> NoiseDensity {
    NoiseDensity {
        gyroscope: Vector3::repeat(0.001 * DEG_PER_SQRT_HOUR),
        accelerometer: Vector3::repeat(10.0 * MICRO_G),
    }
}

/// The mooring keeps the ship and the encoders tell the table's turn: so long they are believed together \[s\].
const LONGEST_TOLD_HOLE_S: f64 = 3600.0;

fn positive(name: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(Error::setting(name, value, "a positive number"))
    }
}

impl Settings {
    /// The normalized innovation squared beyond which a measurement is left out.
    pub(super) fn gate(&self) -> Option<f64> {
        self.gate_sigmas
            .is_finite()
            .then_some(self.gate_sigmas * self.gate_sigmas)
    }

    /// Whether readings of the encoders are measurements.
    fn measures_encoders(&self) -> bool {
        self.model == ModelChoice::Whole && self.encoders.is_some()
    }

    /// Settings of the stream that feeds the machine.
    pub(in crate::machines) fn stream(&self) -> StreamSettings {
        StreamSettings {
            longest_bridge_s: self.restart_gap_s,
            longest_told_hole_s: LONGEST_TOLD_HOLE_S,
            // What is measured must not depend on which of two messages comes first.
            joint_patience_s: if self.measures_encoders() || self.witness {
                self.joint_patience_s
            } else {
                0.0
            },
            velocity_patience_s: match self.reference {
                Reference::Measured { patience_s } => Some(patience_s),
                _ => None,
            },
            position_patience_s: match self.reference {
                Reference::Position { patience_s } | Reference::Auto { patience_s, .. } => {
                    Some(patience_s)
                }
                _ => None,
            },
            range: self.range,
        }
    }

    /// Refuses groups that do not go without each other. The whole model measures upwards too, so accelerometer scale factors,
    /// installation angles and squares all show there, and what is not estimated is taken for something that is (largest error over
    /// sigma on an independent filter): a square of 5 ug/g² without squares 32, with scale factors or without; a scale factor of
    /// 30 ppm without scale factors 71; installation angles of 7 arcsec without them 13.
    fn check_groups(&self) -> Result<(), Error> {
        if self.model != ModelChoice::Whole {
            return Ok(());
        }
        let groups = &self.groups;
        for (name, sigma, why) in [
            (
                "groups.accelerometer_scale_factor",
                groups.accelerometer_scale_factor,
                "what upward innovations show of the scale factors would be taken for biases (30 ppm: 71 sigma)",
            ),
            (
                "groups.accelerometer_installation_rad",
                groups.accelerometer_installation_rad,
                "what upward innovations show of the installation angles would be taken for biases (7 arcsec: 13 sigma)",
            ),
            (
                "groups.accelerometer_quadratic_per_m_s2",
                groups.accelerometer_quadratic_per_m_s2,
                "scale factors, installation angles and biases would take the squares for their own (5 ug/g2: 32 sigma)",
            ),
        ] {
            if sigma == 0.0 {
                let expected = format!(
                    "a positive number beside the vertical channel of the whole model, a small one where they are known: {why}; the \
                     model paper has neither"
                );
                return Err(Error::setting(name, 0, expected));
            }
        }
        Ok(())
    }

    fn check_reference(&self) -> Result<(), Error> {
        match self.reference {
            Reference::Moored { sigma_m_s } => positive("reference.sigma_m_s", sigma_m_s)?,
            Reference::Measured { patience_s } | Reference::Position { patience_s } => {
                positive("reference.patience_s", patience_s)?;
            }
            Reference::Auto {
                sigma_m_s,
                patience_s,
            } => {
                positive("reference.sigma_m_s", sigma_m_s)?;
                positive("reference.patience_s", patience_s)?;
            }
        }
        if !self.antenna.arm_m.iter().all(|v| v.is_finite()) || !self.antenna.latency_s.is_finite()
        {
            let given = format!("{:?}", self.antenna);
            return Err(Error::setting("antenna", given, "finite numbers"));
        }
        if self.gate_sigmas.is_nan() || self.gate_sigmas < 1.0 {
            return Err(Error::setting(
                "gate_sigmas",
                self.gate_sigmas,
                "at least 1",
            ));
        }
        Ok(())
    }

    /// Refuses values that mean nothing.
    ///
    /// # Errors
    /// [`Error::Setting`] with the name of the first setting that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        positive("step_s", self.step_s)?;
        positive("joint_patience_s", self.joint_patience_s)?;
        positive("coarse_alignment_s", self.coarse_alignment_s)?;
        positive("coarse_alignment_min_s", self.coarse_alignment_min_s)?;
        positive("coarse_residual_limit_m_s", self.coarse_residual_limit_m_s)?;
        positive("turn_rad", self.turn_rad)?;
        positive("restart_gap_s", self.restart_gap_s)?;
        self.range.check()?;
        self.unseen.check()?;
        for (name, value) in [
            (
                "walk.gyroscope_drift_rad_s_sqrt_s",
                self.walk.gyroscope_drift_rad_s_sqrt_s,
            ),
            (
                "walk.accelerometer_bias_m_s2_sqrt_s",
                self.walk.accelerometer_bias_m_s2_sqrt_s,
            ),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::setting(name, value, "a number that is not negative"));
            }
        }
        for (name, value) in self.groups.named() {
            if !value.is_finite() {
                let name = format!("groups.{name}");
                return Err(Error::setting(name, value, "a finite number"));
            }
        }
        if let Some(encoders) = &self.encoders {
            positive("encoders.sigma_rad", encoders.sigma_rad)?;
            positive("encoders.wobble_sigma_rad", encoders.wobble_sigma_rad)?;
        }
        for (name, value) in [
            ("refused_share", self.refused_share),
            ("gap_share", self.gap_share),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::setting(name, value, "0 .. 1"));
            }
        }
        positive("prior.position_m", self.prior.position_m)?;
        positive("prior.velocity_m_s", self.prior.velocity_m_s)?;
        for (name, vector) in [
            ("prior.misalignment_rad", &self.prior.misalignment_rad),
            (
                "prior.accelerometer_bias_m_s2",
                &self.prior.accelerometer_bias_m_s2,
            ),
            (
                "prior.gyroscope_drift_rad_s",
                &self.prior.gyroscope_drift_rad_s,
            ),
        ] {
            vector.iter().try_for_each(|v| positive(name, *v))?;
        }
        for (label, limit) in self.thresholds.iter() {
            if limit.is_nan() {
                let name = format!("threshold of {}", label.name);
                return Err(Error::setting(name, limit, "a number that is not negative"));
            }
        }
        self.check_reference()?;
        self.check_groups()?;
        if let Some(noise) = &self.noise {
            for value in noise.gyroscope.iter().chain(&noise.accelerometer) {
                if !(value.is_finite() && *value >= 0.0) {
                    return Err(Error::setting(
                        "noise density",
                        value,
                        "a number that is not negative",
                    ));
                }
            }
        }
        if !(1e-12..0.5).contains(&self.window_false_alarm) {
            return Err(Error::setting(
                "window_false_alarm",
                self.window_false_alarm,
                "1e-12 .. 0.5",
            ));
        }
        if self.window_updates == 0 {
            return Err(Error::setting("window_updates", 0, "at least 1"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A vertical channel without accelerometer scale factors, installation angles or squares is refused by name and with the
    /// reason, be it one of them or all; a small prior is not, and the model paper has none of them.
    #[test]
    fn groups_that_belong_together_come_together() {
        let check = |model: ModelChoice, [scale, installation, square]: [f64; 3]| {
            let groups = GroupPriors {
                accelerometer_scale_factor: scale,
                accelerometer_installation_rad: installation,
                accelerometer_quadratic_per_m_s2: square,
                ..GroupPriors::BY_GRADE
            };
            Settings {
                model,
                groups,
                ..Settings::default()
            }
            .check()
        };
        for (priors, name, reason) in [
            ([-1.0, -1.0, 0.0], "accelerometer_quadratic", "32 sigma"),
            ([0.0, -1.0, -1.0], "accelerometer_scale_factor", "71 sigma"),
            ([-1.0, 0.0, -1.0], "accelerometer_installation", "13 sigma"),
            ([0.0; 3], "accelerometer_scale_factor", "71 sigma"),
        ] {
            let refused = check(ModelChoice::Whole, priors).unwrap_err().to_string();
            assert!(
                refused.contains(name) && refused.contains(reason),
                "{refused}"
            );
            check(ModelChoice::Paper, priors).unwrap();
        }
        check(ModelChoice::Whole, [1e-9, 1e-9, 1e-9]).unwrap();
        check(ModelChoice::Whole, [-1.0; 3]).unwrap();
    }
}
