//! Parameters: declared once, with everything that a person or a tool wants to know of them.

mod declaration;
mod services;
mod store;
mod value;

pub use declaration::Parameter;
pub use store::{Parameters, USE_SIM_TIME};
pub use value::{FromValue, ParameterType, Value};

pub(crate) use services::serve;
pub(crate) use store::{HARDWARE_ID, QOS_OVERRIDES};
