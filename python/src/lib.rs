//! Python package of the rotary SINS suite, module `rotary_sins._rotary_sins`.
//!
//! Bindings are thin: what they do is done in `sins`, `bags` and `analysis`, where the command line has it from, so that both give
//! the same numbers to the last bit. The interpreter is released while they work. No DDS is inside.
#![allow(
    clippy::needless_pass_by_value,
    reason = "what comes from Python comes as a value"
)]

#[cfg(feature = "extension")]
mod alignment;
#[cfg(feature = "extension")]
mod calibration;
#[cfg(feature = "extension")]
mod columns;
#[cfg(feature = "extension")]
mod errors;
#[cfg(feature = "extension")]
mod estimate;
#[cfg(feature = "extension")]
mod navigation;
#[cfg(feature = "extension")]
mod record;
#[cfg(feature = "extension")]
mod scheme;
#[cfg(feature = "extension")]
mod sensor_errors;
#[cfg(feature = "extension")]
mod settings;
#[cfg(feature = "extension")]
mod simulation;
#[cfg(feature = "extension")]
mod source;
#[cfg(feature = "extension")]
mod studies;
#[cfg(feature = "extension")]
mod values;

#[cfg(feature = "extension")]
mod module {
    use pyo3::prelude::*;

    /// Self-calibration of a dual-axis rotary strapdown inertial navigation system.
    #[pymodule]
    mod _rotary_sins {
        #[pymodule_export]
        use crate::alignment::align;
        #[pymodule_export]
        use crate::calibration::{
            Calibration, Calibrator, calibrate, calibration_settings, smooth,
        };
        #[pymodule_export]
        use crate::errors::{AlignmentError, BagError, RotarySinsError, SchemeError, SettingError};
        #[pymodule_export]
        use crate::estimate::Estimate;
        #[pymodule_export]
        use crate::navigation::{navigate, navigation_settings};
        #[pymodule_export]
        use crate::record::{Record, read};
        #[pymodule_export]
        use crate::scheme::{Scheme, scheme_names};
        #[pymodule_export]
        use crate::sensor_errors::{Compensator, SensorErrors};
        #[pymodule_export]
        use crate::simulation::{simulate, simulation_settings};
        #[pymodule_export]
        use crate::studies::{allan, bound, observability, states};
    }
}
