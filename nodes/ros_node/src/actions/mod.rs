//! Actions: goals that take their time. The serving end is [`ActionServer`], the asking end [`ActionClient`].
//!
//! Both stand on the five parts of an action that ros2-client makes: three services and two topics. What ros2-client
//! makes of these parts is not used, for its server waits for ever where nobody asks for a result and forgets what has
//! ended at once.

mod client;
mod endpoints;
mod goals;
mod server;

pub use client::{ActionClient, GoalNews, RemoteGoal};
pub use goals::CancelReturn;
pub use ros2_client::action::{GoalId, GoalStatusEnum as GoalStatus};
pub use server::{ActionServer, GoalHandle, GoalRequest};

/// What goals, results and feedback are made of; every message with a default is one.
pub trait ActionPart: ros2_client::Message + Clone + Default + Send + Sync + 'static {}

impl<M: ros2_client::Message + Clone + Default + Send + Sync + 'static> ActionPart for M {}
