//! Quality of service as the middleware takes it.

use std::time::Duration;

use ros2_client::QosProfile;
use ros2_client::qos::{Durability, History, Reliability, WhenFull};
pub use ros2_interfaces::{Qos, SENSOR_DEPTH};

/// Requests and answers of a service. All clients share the topic of the answers, so that it must hold those of all who ask
/// at the same time.
pub(crate) const SERVICE: Qos = Qos::reliable(200);

/// The middleware's form of it.
pub(crate) trait Profile {
    fn profile(self) -> QosProfile;
}

impl Profile for Qos {
    fn profile(self) -> QosProfile {
        // The window is ours to watch: `Publisher` never waits inside the middleware (see there), so that the time
        // given here only has to be long.
        let when_full = WhenFull::Wait(Duration::from_secs(3600));
        QosProfile::default()
            .reliability(if self.reliable {
                Reliability::Reliable { when_full }
            } else {
                Reliability::BestEffort
            })
            .durability(if self.transient_local {
                Durability::TransientLocal
            } else {
                Durability::Volatile
            })
            .history(History::KeepLast {
                depth: self.depth.max(1),
            })
            .lifespan(self.lifespan)
    }
}
