//! What the filter assumes, in the units of the people who set it. Names and defaults are those of the node's parameters.

use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use sins::{
    machines::self_calibration::{Reference, Settings, Thresholds},
    sensor::sample::NoiseDensity,
    table::Turntable,
    units::{ARC_MINUTE, DEG_PER_HOUR, DEG_PER_SQRT_HOUR, MICRO_G},
};

/// Where the velocity error is measured against.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum VelocityReference {
    /// The ship lies at her mooring
    Moored,
    /// Velocities over ground, /aiding/velocity
    Measured,
}

/// Options of the filter.
#[derive(Args)]
#[command(next_help_heading = "Filter")]
pub struct FilterOptions {
    /// White noise of the gyroscopes [deg/√h] (default: from the covariances of the messages)
    #[arg(
        long,
        value_name = "DEG/√h",
        requires = "velocity_random_walk_ug_per_sqrt_hz"
    )]
    angle_random_walk_deg_per_sqrt_hour: Option<f64>,
    /// White noise of the accelerometers [ug/√Hz] (default: from the covariances of the messages)
    #[arg(
        long,
        value_name = "ug/√Hz",
        requires = "angle_random_walk_deg_per_sqrt_hour"
    )]
    velocity_random_walk_ug_per_sqrt_hz: Option<f64>,
    /// Initial 1 sigma of the position, each axis
    #[arg(long, value_name = "M", default_value_t = 10.0)]
    prior_position_m: f64,
    /// Initial 1 sigma of the velocity, each axis
    #[arg(long, value_name = "M/S", default_value_t = 0.01)]
    prior_velocity_m_s: f64,
    /// Initial 1 sigma of the accelerometer biases
    #[arg(long, value_name = "ug", default_value_t = 100.0)]
    prior_accelerometer_bias_ug: f64,
    /// Initial 1 sigma of the gyroscope drifts
    #[arg(long, value_name = "DEG/h", default_value_t = 0.01)]
    prior_gyroscope_drift_deg_per_hour: f64,
    /// What the velocity is held against
    #[arg(long, value_enum, default_value = "moored")]
    velocity_reference: VelocityReference,
    /// 1 sigma of the moored ship's residual velocity, each axis
    #[arg(long, value_name = "M/S", default_value_t = 0.01)]
    moored_sigma_m_s: f64,
    /// How much later than its sample, by the stamps, a measured velocity may come
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0)]
    velocity_patience_s: f64,
    /// Time between covariance steps
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    update_interval_s: f64,
    /// Length of coarse alignment
    #[arg(long, value_name = "SECONDS", default_value_t = 300.0)]
    coarse_alignment_s: f64,
    /// Shortest coarse alignment, where the bag ends early
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    coarse_alignment_min_s: f64,
    /// A longer hole in the samples starts the alignment anew
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0)]
    restart_gap_s: f64,
}

impl FilterOptions {
    /// The settings they amount to.
    pub fn settings(&self, turntable: Turntable) -> anyhow::Result<Settings> {
        let noise = self
            .angle_random_walk_deg_per_sqrt_hour
            .zip(self.velocity_random_walk_ug_per_sqrt_hz);
        let mut settings = Settings {
            turntable,
            noise: noise.map(|(gyroscope, accelerometer)| NoiseDensity {
                gyroscope: Vector3::repeat(gyroscope * DEG_PER_SQRT_HOUR),
                accelerometer: Vector3::repeat(accelerometer * MICRO_G),
            }),
            reference: match self.velocity_reference {
                VelocityReference::Moored => Reference::Moored {
                    sigma_m_s: self.moored_sigma_m_s,
                },
                VelocityReference::Measured => Reference::Measured {
                    patience_s: self.velocity_patience_s,
                },
            },
            step_s: self.update_interval_s,
            coarse_alignment_s: self.coarse_alignment_s,
            coarse_alignment_min_s: self.coarse_alignment_min_s,
            restart_gap_s: self.restart_gap_s,
            ..Settings::default()
        };
        settings.prior.position_m = self.prior_position_m;
        settings.prior.velocity_m_s = self.prior_velocity_m_s;
        settings.prior.accelerometer_bias_m_s2 =
            Vector3::repeat(self.prior_accelerometer_bias_ug * MICRO_G);
        settings.prior.gyroscope_drift_rad_s =
            Vector3::repeat(self.prior_gyroscope_drift_deg_per_hour * DEG_PER_HOUR);
        settings.check()?;
        Ok(settings)
    }
}

/// When the estimate counts as found. Zero asks nothing.
#[derive(Args)]
#[command(next_help_heading = "Converged below (1 sigma, 0: not asked for)")]
pub struct ThresholdOptions {
    /// Of every gyroscope drift
    #[arg(long, value_name = "DEG/h", default_value_t = 0.002)]
    gyroscope_drift_threshold_deg_per_hour: f64,
    /// Of every accelerometer bias
    #[arg(long, value_name = "ug", default_value_t = 10.0)]
    accelerometer_bias_threshold_ug: f64,
    /// Of the azimuth
    #[arg(long, value_name = "ARCMIN", default_value_t = 1.0)]
    azimuth_threshold_arcmin: f64,
    /// Of the level
    #[arg(long, value_name = "ARCMIN", default_value_t = 0.0)]
    level_threshold_arcmin: f64,
}

impl ThresholdOptions {
    /// The thresholds they amount to.
    pub fn thresholds(&self) -> Thresholds {
        let level = self.level_threshold_arcmin * ARC_MINUTE;
        Thresholds::new(
            [level, level, self.azimuth_threshold_arcmin * ARC_MINUTE],
            [self.accelerometer_bias_threshold_ug * MICRO_G; 3],
            [self.gyroscope_drift_threshold_deg_per_hour * DEG_PER_HOUR; 3],
        )
    }
}
