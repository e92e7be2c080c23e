//! What the filter assumes.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, ensure};
use nalgebra::Vector3;
use ros_node::{ParameterSet, Unit};
use sins::estimation::filter::InitialUncertainty;
use sins::machines::self_calibration::{EncoderAccuracy, NoiseFrom, Reference, Settings};
use sins::sensor::sample::NoiseDensity;
use sins::table::Turntable;

use crate::axes;
use crate::groups::{GradeChoice, groups, readable, told};
use crate::units::{
    ARC_SECOND, DEGREE, DEGREE_PER_HOUR, DEGREE_PER_HOUR_SQRT_HOUR, DEGREE_PER_SQRT_HOUR, MICRO_G,
    MICRO_G_PER_SQRT_HERTZ, MICRO_G_PER_SQRT_HOUR,
};

/// How much later than its sample a measured velocity may come, where nothing else is said \[s\].
const VELOCITY_PATIENCE_S: f64 = 30.0;

/// What the velocity is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VelocityReference {
    /// The ship lies at her mooring.
    Moored,
    /// Velocities over ground.
    Measured,
    /// Positions.
    Position,
    /// The mooring where the ship lies still, positions where she moves and they come.
    Auto,
}

impl VelocityReference {
    const NAMES: [&str; 4] = ["moored", "measured", "position", "auto"];
}

impl fmt::Display for VelocityReference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Self::NAMES[*self as usize])
    }
}

impl FromStr for VelocityReference {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "moored" => Ok(Self::Moored),
            "measured" => Ok(Self::Measured),
            "position" => Ok(Self::Position),
            "auto" => Ok(Self::Auto),
            other => Err(format!("'{other}' is none of {}", Self::NAMES.join(", "))),
        }
    }
}

/// The settings of the filter, and what of them is not put together yet.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterParameters {
    settings: Settings,
    grade: GradeChoice,
    velocity_reference: VelocityReference,
    moored_sigma_m_s: f64,
    velocity_patience_s: f64,
}

impl From<Settings> for FilterParameters {
    /// As these settings have it.
    fn from(mut settings: Settings) -> Self {
        settings.groups = readable(settings.groups);
        let moored = |reference| match reference {
            Reference::Moored { sigma_m_s } | Reference::Auto { sigma_m_s, .. } => Some(sigma_m_s),
            Reference::Measured { .. } | Reference::Position { .. } => None,
        };
        let patience = |reference| match reference {
            Reference::Moored { .. } => None,
            Reference::Measured { patience_s }
            | Reference::Position { patience_s }
            | Reference::Auto { patience_s, .. } => Some(patience_s),
        };
        let velocity_reference = match settings.reference {
            Reference::Moored { .. } => VelocityReference::Moored,
            Reference::Measured { .. } => VelocityReference::Measured,
            Reference::Position { .. } => VelocityReference::Position,
            Reference::Auto { .. } => VelocityReference::Auto,
        };
        let reference = settings.reference;
        Self {
            grade: GradeChoice::from(settings.grade),
            settings,
            velocity_reference,
            moored_sigma_m_s: moored(reference)
                .or_else(|| moored(Settings::default().reference))
                .unwrap_or_default(),
            velocity_patience_s: patience(reference).unwrap_or(VELOCITY_PATIENCE_S),
        }
    }
}

impl FilterParameters {
    /// The settings.
    ///
    /// # Errors
    /// One line naming what makes no sense together with the rest.
    pub fn settings(self) -> anyhow::Result<Settings> {
        let Turntable { outer, inner } = self.settings.turntable;
        Turntable::new(outer, inner).context("parameters outer_axis and inner_axis")?;
        if let Some(noise) = self.settings.noise {
            let gyroscope = DEGREE_PER_SQRT_HOUR.from_si(noise.gyroscope.x);
            let accelerometer = MICRO_G_PER_SQRT_HERTZ.from_si(noise.accelerometer.x);
            ensure!(
                (gyroscope > 0.0) == (accelerometer > 0.0),
                "parameters angle_random_walk_deg_per_sqrt_hour ({gyroscope}) and velocity_random_walk_ug_per_sqrt_hz \
                 ({accelerometer}): expected both positive, or both 0 to take the noise from the messages"
            );
        }
        let settings = Settings {
            reference: match self.velocity_reference {
                VelocityReference::Moored => Reference::Moored {
                    sigma_m_s: self.moored_sigma_m_s,
                },
                VelocityReference::Measured => Reference::Measured {
                    patience_s: self.velocity_patience_s,
                },
                VelocityReference::Position => Reference::Position {
                    patience_s: self.velocity_patience_s,
                },
                VelocityReference::Auto => Reference::Auto {
                    sigma_m_s: self.moored_sigma_m_s,
                    patience_s: self.velocity_patience_s,
                },
            },
            grade: self.grade.into(),
            groups: told(self.settings.groups),
            encoders: self.settings.encoders.filter(|e| e.sigma_rad > 0.0),
            ..self.settings
        };
        settings.check()?;
        Ok(settings)
    }

    /// On this table.
    #[must_use]
    pub fn with_turntable(mut self, turntable: Turntable) -> Self {
        self.settings.turntable = turntable;
        self
    }

    /// What encoders are worth; nothing, where their sigma is 0.
    fn encoders(&mut self) -> &mut EncoderAccuracy {
        self.settings.encoders.get_or_insert(EncoderAccuracy {
            sigma_rad: 0.0,
            ..EncoderAccuracy::default()
        })
    }

    /// The noise; none, where both densities are 0.
    fn noise(&mut self) -> &mut NoiseDensity {
        self.settings.noise.get_or_insert(NoiseDensity {
            gyroscope: Vector3::zeros(),
            accelerometer: Vector3::zeros(),
        })
    }
}

/// Parameters of what any alignment on samples needs, with the defaults of these settings.
pub fn alignment(base: Settings) -> ParameterSet<FilterParameters> {
    let set = ParameterSet::new("Filter", FilterParameters::from(base))
        .include(axes(), |s| &mut s.settings.turntable)
        .uniform(
            "angle_random_walk_deg_per_sqrt_hour",
            DEGREE_PER_SQRT_HOUR,
            0.0..=10.0,
            |s| s.noise().gyroscope.as_mut_slice(),
            "White noise of the gyroscopes; 0: as noise_from says",
        )
        .uniform(
            "velocity_random_walk_ug_per_sqrt_hz",
            MICRO_G_PER_SQRT_HERTZ,
            0.0..=1e5,
            |s| s.noise().accelerometer.as_mut_slice(),
            "White noise of the accelerometers; 0: as noise_from says",
        )
        .choice(
            "noise_from",
            &NoiseFrom::ALL.map(NoiseFrom::name),
            |s| &mut s.settings.noise_from,
            "The noise is taken from the covariances of the Imu messages, or from the samples of a coarse alignment at rest",
        )
        .number(
            "moored_sigma_m_s",
            Unit::METRE_PER_SECOND,
            1e-6..=10.0,
            |s| &mut s.moored_sigma_m_s,
            "1 sigma of the moored ship's residual velocity, each axis",
        )
        .number(
            "coarse_alignment_s",
            Unit::SECOND,
            10.0..=7200.0,
            |s| &mut s.settings.coarse_alignment_s,
            "Length of coarse alignment",
        )
        .number(
            "restart_gap_s",
            Unit::SECOND,
            0.01..=3600.0,
            |s| &mut s.settings.restart_gap_s,
            "A longer hole in the samples starts the alignment anew, unless the joint states tell the turn in it",
        )
        .choice(
            "velocity_reference",
            &VelocityReference::NAMES,
            |s| &mut s.velocity_reference,
            "What the velocity is held against; moored: it is zero; measured: aiding/velocity; position: fix; auto: moored or position",
        )
        .number(
            "velocity_patience_s",
            Unit::SECOND,
            0.01..=3600.0,
            |s| &mut s.velocity_patience_s,
            "How much later than its sample, by the stamps, a measured velocity or position may come",
        )
        .numbers(
            "antenna_arm_m",
            Unit::METRE,
            -1e3..=1e3,
            |s| s.settings.antenna.arm_m.as_mut_slice(),
            "Antenna of the positions, from the table's centre: starboard, forward, up",
        )
        .number(
            "antenna_latency_s",
            Unit::SECOND,
            -10.0..=10.0,
            |s| &mut s.settings.antenna.latency_s,
            "How old a position is at its stamp",
        )
        .number(
            "gate_sigmas",
            Unit::NONE,
            1.0..=1e9,
            |s| &mut s.settings.gate_sigmas,
            "A measured velocity or position further off than so many sigmas is left out, and counted",
        );
    range(set)
}

/// What the sensors can give.
fn range(set: ParameterSet<FilterParameters>) -> ParameterSet<FilterParameters> {
    set.group("Range")
        .number(
            "rate_limit_rad_s",
            Unit::RADIAN_PER_SECOND,
            1e-3..=1e4,
            |s| &mut s.settings.range.rate_rad_s,
            "A sample with a greater angular velocity of an axis is refused",
        )
        .number(
            "force_limit_m_s2",
            Unit::METRE_PER_SECOND2,
            1.0..=1e5,
            |s| &mut s.settings.range.force_m_s2,
            "A sample with a greater linear acceleration of an axis is refused",
        )
        .number(
            "rate_step_rad_s",
            Unit::RADIAN_PER_SECOND,
            1e-4..=1e4,
            |s| &mut s.settings.range.rate_step_rad_s,
            "A single sample that jumps by more, and back again, is refused",
        )
        .number(
            "force_step_m_s2",
            Unit::METRE_PER_SECOND2,
            1e-2..=1e5,
            |s| &mut s.settings.range.force_step_m_s2,
            "A single sample whose linear acceleration jumps by more, and back again, is refused",
        )
        .group("Filter")
}

/// Parameters of the filter of self-calibration. The thresholds are apart, see [`crate::thresholds`].
pub fn filter() -> ParameterSet<FilterParameters> {
    filter_of(calibrating())
}

/// What self-calibration is told where nobody says anything else.
pub fn calibrating() -> Settings {
    Settings::calibrating()
}

/// The same parameters with the defaults of these settings.
pub fn filter_of(base: Settings) -> ParameterSet<FilterParameters> {
    let set = alignment(base)
        .number(
            "update_interval_s",
            Unit::SECOND,
            0.01..=60.0,
            |s| &mut s.settings.step_s,
            "Time between covariance steps, and between estimates",
        )
        .number(
            "coarse_alignment_min_s",
            Unit::SECOND,
            1.0..=7200.0,
            |s| &mut s.settings.coarse_alignment_min_s,
            "Shortest coarse alignment, where the samples end early",
        )
        .number(
            "coarse_residual_limit_m_s",
            Unit::METRE_PER_SECOND,
            1e-3..=100.0,
            |s| &mut s.settings.coarse_residual_limit_m_s,
            "Velocity that coarse alignment may leave unexplained",
        )
        .number(
            "turn_deg",
            DEGREE,
            0.1..=180.0,
            |s| &mut s.settings.turn_rad,
            "Turn of the block that ends fine alignment and begins calibration",
        )
        .count(
            "innovation_window_updates",
            10..=100_000,
            |s| &mut s.settings.window_updates,
            "Length of the innovation test in updates",
        )
        .number(
            "innovation_false_alarm",
            Unit::NONE,
            1e-12..=0.4,
            |s| &mut s.settings.window_false_alarm,
            "Probability that the innovation test fails over one window when all is well",
        )
        .count(
            "innovation_recovery_windows",
            1..=10_000,
            |s| &mut s.settings.recovery_windows,
            "Windows that have to agree before a run that failed the innovation test counts as consistent again",
        )
        .number(
            "refused_share",
            Unit::NONE,
            0.0..=1.0,
            |s| &mut s.settings.refused_share,
            "A greater share of refused samples keeps the estimate from converging",
        )
        .number(
            "gap_share",
            Unit::NONE,
            0.0..=1.0,
            |s| &mut s.settings.gap_share,
            "A greater share of holes among the samples keeps the estimate from converging",
        )
        .number(
            "gyroscope_drift_walk_deg_per_hour_sqrt_hour",
            DEGREE_PER_HOUR_SQRT_HOUR,
            0.0..=1e3,
            |s| &mut s.settings.walk.gyroscope_drift_rad_s_sqrt_s,
            "How the gyroscope drifts wander from one alignment to the next",
        )
        .number(
            "accelerometer_bias_walk_ug_per_sqrt_hour",
            MICRO_G_PER_SQRT_HOUR,
            0.0..=1e6,
            |s| &mut s.settings.walk.accelerometer_bias_m_s2_sqrt_s,
            "How the accelerometer biases wander from one alignment to the next",
        )
        .include(prior(), |s| &mut s.settings.prior);
    whole(set)
}

/// The model, and what the whole one is told.
fn whole(set: ParameterSet<FilterParameters>) -> ParameterSet<FilterParameters> {
    set.choice(
            "model",
            &["whole", "paper"],
            |s| &mut s.settings.model,
            "Errors that are estimated; paper: the thirteen states; whole: the whole sensor on the whole table",
        )
        .choice(
            "grade",
            &GradeChoice::NAMES,
            |s| &mut s.grade,
            "Grade of the sensor, from which the whole model takes its priors; auto: as the noise tells it",
        )
        .include(groups(), |s| &mut s.settings.groups)
        .number(
            "encoder_sigma_arcsec",
            ARC_SECOND,
            0.0..=1e5,
            |s| &mut s.encoders().sigma_rad,
            "1 sigma of an encoder's reading; 0: the whole model does not use the encoders",
        )
        .number(
            "encoder_wobble_arcsec",
            ARC_SECOND,
            1e-3..=1e5,
            |s| &mut s.encoders().wobble_sigma_rad,
            "1 sigma about the axis across both joints: how the table's axes wobble",
        )
}

/// Parameters of what is known before the first sample.
fn prior() -> ParameterSet<InitialUncertainty> {
    ParameterSet::new("Prior", Settings::default().prior)
        .number(
            "prior_position_m",
            Unit::METRE,
            1e-3..=1e6,
            |s| &mut s.position_m,
            "Initial 1 sigma of the position, each axis",
        )
        .number(
            "prior_velocity_m_s",
            Unit::METRE_PER_SECOND,
            1e-6..=100.0,
            |s| &mut s.velocity_m_s,
            "Initial 1 sigma of the velocity, each axis",
        )
        .numbers(
            "prior_misalignment_deg",
            DEGREE,
            1e-4..=180.0,
            |s| s.misalignment_rad.as_mut_slice(),
            "Initial 1 sigma of the attitude about East, North, Up; wide: the filter itself finds what the coarse alignment is worth",
        )
        .numbers(
            "prior_accelerometer_bias_ug",
            MICRO_G,
            1e-6..=1e6,
            |s| s.accelerometer_bias_m_s2.as_mut_slice(),
            "Initial 1 sigma of the accelerometer biases x, y, z",
        )
        .numbers(
            "prior_gyroscope_drift_deg_per_hour",
            DEGREE_PER_HOUR,
            1e-9..=1e4,
            |s| s.gyroscope_drift_rad_s.as_mut_slice(),
            "Initial 1 sigma of the gyroscope drifts x, y, z",
        )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use ros_node::Value;

    use super::*;

    fn with(given: &[(&str, Value)]) -> anyhow::Result<Settings> {
        let mut parameters = filter().base().clone();
        for (name, value) in given {
            filter().put(&mut parameters, name, value)?;
        }
        parameters.settings()
    }

    /// The defaults are those of the machine to the last bit, so that node and command line agree; but for the model.
    #[test]
    fn defaults_are_those_of_the_machine() {
        assert_eq!(with(&[]).unwrap(), calibrating());
        assert_eq!(
            with(&[
                ("model", "paper".into()),
                ("velocity_reference", "moored".into())
            ])
            .unwrap(),
            Settings::default()
        );
    }

    /// The reference is put together of three parameters, the noise of two.
    #[test]
    fn what_belongs_together_is_put_together() {
        let measured = with(&[
            ("velocity_reference", "measured".into()),
            ("velocity_patience_s", 0.5.into()),
            ("angle_random_walk_deg_per_sqrt_hour", 0.001.into()),
            ("velocity_random_walk_ug_per_sqrt_hz", 10.0.into()),
        ])
        .unwrap();
        assert_eq!(measured.reference, Reference::Measured { patience_s: 0.5 });
        assert_eq!(
            measured.noise.unwrap(),
            sins::machines::self_calibration::default_noise()
        );
        let moored = with(&[
            ("velocity_reference", "moored".into()),
            ("moored_sigma_m_s", 0.05.into()),
        ])
        .unwrap();
        assert_eq!(moored.reference, Reference::Moored { sigma_m_s: 0.05 });
    }

    /// One density without the other, and one axis twice, are refused by name.
    #[test]
    fn what_makes_no_sense_together_is_named() {
        let one = with(&[("angle_random_walk_deg_per_sqrt_hour", 0.001.into())]);
        let error = one.unwrap_err().to_string();
        assert!(
            error.contains("velocity_random_walk_ug_per_sqrt_hz (0)"),
            "{error}"
        );
        let error = format!("{:#}", with(&[("inner_axis", "x".into())]).unwrap_err());
        assert!(
            error.contains("inner_axis") && error.contains('x'),
            "{error}"
        );
    }
}
