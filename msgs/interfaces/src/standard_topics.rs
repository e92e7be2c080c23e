//! The topics that every ROS 2 system has.

use std::time::Duration;

use crate::diagnostic_msgs::DiagnosticArray;
use crate::rcl_interfaces::{Log, ParameterEvent};
use crate::rosgraph_msgs::Clock;
use crate::tf2_msgs::TFMessage;
use crate::{Qos, Topic};

/// Simulated time.
pub const CLOCK: Topic<Clock> = Topic::new(
    "/clock",
    Qos::best_effort(1),
    "simulator or player",
    "nodes with `use_sim_time`",
    "Simulated time",
)
.overridable();

/// How nodes are.
pub const DIAGNOSTICS: Topic<DiagnosticArray> = Topic::new(
    "/diagnostics",
    Qos::reliable(10),
    "every node",
    "all",
    "A status a subject, once a second",
);

/// Log lines.
pub const ROSOUT: Topic<Log> = Topic::new(
    "/rosout",
    Qos::latched(1000).with_lifespan(Duration::from_secs(10)),
    "every node",
    "all",
    "Log lines",
);

/// Changes of parameters.
pub const PARAMETER_EVENTS: Topic<ParameterEvent> = Topic::new(
    "/parameter_events",
    Qos::reliable(1000),
    "every node",
    "all",
    "New and changed parameters",
);

/// Frames that move.
pub const TF: Topic<TFMessage> = Topic::new(
    "/tf",
    Qos::reliable(100),
    "whoever knows a frame",
    "all",
    "Frames that move",
);

/// Frames that do not.
pub const TF_STATIC: Topic<TFMessage> = Topic::new(
    "/tf_static",
    Qos::latched(1),
    "whoever knows a frame",
    "all",
    "Frames that stand still",
);
