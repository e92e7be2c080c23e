//! Parameters: declared once, with everything that a person or a tool wants to know of them.

mod declaration;
mod kinds;
mod print;
mod services;
mod set;
mod store;
mod unit;
mod value;

pub use declaration::Parameter;
pub use set::ParameterSet;
pub use store::{Parameters, USE_SIM_TIME};
pub use unit::Unit;
pub use value::{FromValue, ParameterType, Value};

pub(crate) use print::{file, table, usage};
pub(crate) use services::serve;
pub(crate) use store::{HARDWARE_ID, NODE, QOS_OVERRIDES, use_sim_time};
