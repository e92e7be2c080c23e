//! Quality of service: the presets that this suite's topics use.

use std::time::Duration;

use ros2_client::QosProfile;
use ros2_client::qos::{Durability, History, Reliability, WhenFull};

/// Samples that writer and reader of a sensor topic keep. A reader that is not scheduled for a while loses nothing
/// as long as fewer arrive in that time: 0.4 s at 10 000 samples/s, 20 s at 200.
pub const SENSOR_DEPTH: usize = 4000;

/// Requests, and answers, that wait until they are taken.
const SERVICE_DEPTH: usize = 200;

/// Reliability, durability and depth of a topic's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Lost samples are sent again.
    pub reliable: bool,
    /// Late subscribers get the last samples.
    pub transient_local: bool,
    /// Samples kept.
    pub depth: usize,
    /// Samples older than this are not delivered any more.
    pub lifespan: Option<Duration>,
}

impl Qos {
    /// Sensor samples that must not be lost: reliable, deep. Readers made with it also take from best-effort writers.
    pub const fn sensor() -> Self {
        Self::reliable(SENSOR_DEPTH)
    }

    /// Reliable, volatile.
    pub const fn reliable(depth: usize) -> Self {
        Self {
            reliable: true,
            transient_local: false,
            depth,
            lifespan: None,
        }
    }

    /// Reliable, transient local: who comes late gets the last `depth`.
    pub const fn latched(depth: usize) -> Self {
        Self {
            reliable: true,
            transient_local: true,
            depth,
            lifespan: None,
        }
    }

    /// Requests and answers of a service. All clients share the topic of the answers, so that it must hold those of all who ask
    /// at the same time.
    pub(crate) const fn service() -> Self {
        Self::reliable(SERVICE_DEPTH)
    }

    /// Best effort, volatile.
    pub const fn best_effort(depth: usize) -> Self {
        Self {
            reliable: false,
            transient_local: false,
            depth,
            lifespan: None,
        }
    }

    pub(crate) fn profile(self) -> QosProfile {
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
