//! A filter whose model is chosen while the program runs: for whoever drives it, nothing is generic.

use serde::{Deserialize, Serialize};

use super::filter::{AntennaArm, Crossing, EncoderReading, ErrorFilter, VelocityMeasurement};
use super::installation::Installation;
use super::measurement::{Outcome, UpdateCounts};
use super::model::{Inertial, InertialFilter, Model, Paper, PaperFilter, Whole, WholeFilter};
use super::smoother::Tape;
use super::state::{NamedCovariance, StateEstimate};
use crate::error::Error;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::compensation::Compensation;
use crate::sensor::{Increment, NoiseDensity, PositionMeasurement, SensorErrors};
use crate::time::Stamp;

/// The filter of one of the models.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum AnyFilter {
    /// Of the thirteen states.
    Paper(Box<PaperFilter>),
    /// Of the whole sensor.
    Whole(Box<WholeFilter>),
    /// Of the whole sensor, for free-inertial navigation.
    Inertial(Box<InertialFilter>),
}

impl From<PaperFilter> for AnyFilter {
    fn from(filter: PaperFilter) -> Self {
        Self::Paper(Box::new(filter))
    }
}

impl From<WholeFilter> for AnyFilter {
    fn from(filter: WholeFilter) -> Self {
        Self::Whole(Box::new(filter))
    }
}

impl From<InertialFilter> for AnyFilter {
    fn from(filter: InertialFilter) -> Self {
        Self::Inertial(Box::new(filter))
    }
}

/// Passes methods on to the filter, whichever it is. Each is the one of [`ErrorFilter`] of the same name.
macro_rules! pass_on {
    ($($(#[$attribute:meta])* $method:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)*) => {
        $(
            #[doc = concat!("See [`ErrorFilter::", stringify!($method), "`].")]
            $(#[$attribute])*
            pub fn $method(&self $(, $argument: $type)*) $(-> $result)? {
                match self {
                    Self::Paper(filter) => filter.$method($($argument),*),
                    Self::Whole(filter) => filter.$method($($argument),*),
                    Self::Inertial(filter) => filter.$method($($argument),*),
                }
            }
        )*
    };
    (mut $($(#[$attribute:meta])* $method:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)*) => {
        $(
            #[doc = concat!("See [`ErrorFilter::", stringify!($method), "`].")]
            $(#[$attribute])*
            pub fn $method(&mut self $(, $argument: $type)*) $(-> $result)? {
                match self {
                    Self::Paper(filter) => filter.$method($($argument),*),
                    Self::Whole(filter) => filter.$method($($argument),*),
                    Self::Inertial(filter) => filter.$method($($argument),*),
                }
            }
        )*
    };
}

impl AnyFilter {
    pass_on! {
        navigation() -> &NavigationState;
        compensation() -> &Compensation;
        sensor_errors() -> SensorErrors;
        installation() -> &Installation;
        noise() -> &NoiseDensity;
        estimate() -> StateEstimate;
        named_covariance() -> NamedCovariance;
        counts() -> UpdateCounts;
        pending_s() -> f64;
        largest_misalignment_sigma() -> f64;
        believed() -> NavigationState;
        estimate_about_believed() -> StateEstimate;
        base_state() -> Option<usize>;
        believed_installation() -> Installation;
        tape_bytes() -> usize;
        /// # Errors
        /// As there.
        check() -> Result<(), Error>;
    }

    pass_on! {
        mut
        #[inline]
        propagate(increment: &Increment);
        /// # Errors
        /// As there.
        step() -> Result<(), Error>;
        update_velocity(measurement: &VelocityMeasurement, gate: Option<f64>) -> [Outcome; 2];
        update_vertical_velocity(up_m_s: f64, sigma_m_s: f64, gate: Option<f64>) -> [Outcome; 1];
        update_position(measurement: &PositionMeasurement, age_s: f64, arm: &AntennaArm, gate: Option<f64>) -> [Outcome; 3];
        update_encoders(reading: &EncoderReading, gate: Option<f64>) -> [Outcome; 3];
        set_base_walk(walk_rad_sqrt_s: f64);
        forget_base();
        close_loop();
        record(records: bool);
        take_tape() -> Option<Tape>;
        mark(stamp: Stamp);
        move_to(navigation: &NavigationState);
        bridge(angle_sigma: f64, velocity_sigma: f64);
        /// # Errors
        /// As there.
        cross(crossing: &Crossing) -> Result<(), Error>;
        /// # Errors
        /// As there.
        set_sensor_errors(errors: &SensorErrors) -> Result<(), Error>;
    }

    /// Whether a state of this name moves in its model.
    pub fn is_moving(&self, name: &str) -> bool {
        fn of<G: Model<M, N>, const M: usize, const N: usize>(
            _: &ErrorFilter<G, M, N>,
            name: &str,
        ) -> bool {
            G::is_moving(name)
        }
        match self {
            Self::Paper(filter) => of(filter, name),
            Self::Whole(filter) => of(filter, name),
            Self::Inertial(filter) => of(filter, name),
        }
    }

    /// Whether it has a vertical channel.
    pub fn has_vertical_channel(&self) -> bool {
        match self {
            Self::Paper(_) => <Paper as Model<{ Paper::M }, { Paper::N }>>::VELOCITY_UP.is_some(),
            Self::Whole(_) => <Whole as Model<{ Whole::M }, { Whole::N }>>::VELOCITY_UP.is_some(),
            Self::Inertial(_) => {
                <Inertial as Model<{ Inertial::M }, { Inertial::N }>>::VELOCITY_UP.is_some()
            }
        }
    }
}
