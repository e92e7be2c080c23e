//! Every message type that the suite uses, by name.

use std::sync::LazyLock;

use ros2_interfaces::{KnownType, Registry, RegistryError};

use crate::{
    Calibration, CalibrationOutlook, SchemeStatus, SelfCalibrateFeedback, SelfCalibrateGoal,
    SelfCalibrateResult, SelfCalibrationEstimate,
};

/// Hands every message type that topics of the suite carry to a macro, as
/// [`ros2_interfaces::with_standard_types`] does with the standard ones.
#[macro_export]
macro_rules! with_known_types {
    ($macro:ident $(, $first:ident)?) => {
        $crate::ros2_interfaces::with_standard_types!(
            $macro $(, $first)?;
            $crate::SchemeStatus,
            $crate::SelfCalibrationEstimate,
            $crate::CalibrationOutlook,
            $crate::Calibration,
        )
    };
}

macro_rules! list {
    ($($type:ty),* $(,)?) => { &[$(KnownType::of::<$type>()),*] };
}

/// All message types that topics of the suite carry.
pub const KNOWN_TYPES: &[KnownType] = with_known_types!(list);

/// Adds the messages of this package, and the parts of its action.
///
/// # Errors
/// Where the registry has another type of one of these names.
pub fn register(registry: &mut Registry) -> Result<(), RegistryError> {
    registry.register::<SchemeStatus>()?;
    registry.register::<SelfCalibrationEstimate>()?;
    registry.register::<CalibrationOutlook>()?;
    registry.register::<Calibration>()?;
    registry.register::<SelfCalibrateGoal>()?;
    registry.register::<SelfCalibrateResult>()?;
    registry.register::<SelfCalibrateFeedback>()
}

/// The standard types and ours.
pub fn registry() -> &'static Registry {
    static REGISTRY: LazyLock<Registry> = LazyLock::new(|| {
        let mut registry = Registry::standard();
        if let Err(error) = register(&mut registry) {
            unreachable!("the tests hold the hashes of our own types: {error}");
        }
        registry
    });
    &REGISTRY
}

/// The type of this full name (`package/msg/Type`), where the suite has it.
pub fn known_type(name: &str) -> Option<&'static KnownType> {
    registry().get(name)
}
