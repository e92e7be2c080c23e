//! The demo's own ears: a node that hears what the others tell.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::Result;
use ros_node::{Node, NodeBuilder};
use ros2_interfaces::diagnostic_msgs::DiagnosticStatus;
use ros2_interfaces::nav_msgs::Odometry;
use ros2_interfaces::sensor_msgs::NavSatFix;
use ros2_interfaces::{RosMessage, Topic};
use rotary_sins_msgs::convert::position_from_fix;
use rotary_sins_msgs::interfaces::topics;
use rotary_sins_msgs::{Calibration, SchemeStatus, SelfCalibrationEstimate};
use sins::earth::Position;

/// Consumers whose diagnostics count samples.
pub const CONSUMERS: [&str; 2] = ["self_calibrator", "navigation_compensator"];

/// True poses kept, for the one at the time of the last estimate.
const KEPT_POSES: usize = 20;

/// Horizontal distance from where the ship lies \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PositionError {
    /// Largest so far.
    pub largest_m: f64,
    /// Newest.
    pub last_m: f64,
}

/// What has been heard.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Newest of the sequencer.
    pub scheme: Option<SchemeStatus>,
    /// Newest of the calibrator.
    pub estimate: Option<SelfCalibrationEstimate>,
    /// Newest calibration.
    pub calibration: Option<Calibration>,
    /// The truth about the sensors.
    pub truth: Option<Calibration>,
    /// The truth about the attitude of the block, the last ones.
    pub truth_odometry: VecDeque<Odometry>,
    /// Where navigation with the calibration has gone.
    pub compensated: Option<PositionError>,
    /// Where navigation without it has gone.
    pub uncompensated: Option<PositionError>,
    /// Newest diagnostics by name.
    pub diagnostics: BTreeMap<String, DiagnosticStatus>,
}

/// What a consumer's diagnostics say about its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Samples used.
    pub samples: u64,
    /// Samples missing, by the stamps.
    pub lost: u64,
    /// Samples refused: repeated, backward, not finite.
    pub refused: u64,
}

impl Seen {
    /// Counts of a consumer; `None` before its first diagnostics.
    pub fn counts(&self, consumer: &str) -> Option<Counts> {
        let status = self.diagnostics.get(&format!("{consumer}: imu samples"))?;
        let value = |key: &str| {
            status
                .values
                .iter()
                .find(|value| value.key == key)
                .and_then(|value| value.value.parse::<u64>().ok())
        };
        Some(Counts {
            samples: value("samples")?,
            lost: value("lost")?,
            refused: value("repeated")? + value("backward")? + value("not finite")?,
        })
    }

    /// Whether all consumers have all samples and the calibration at the end of the scheme has come.
    pub fn is_complete(&self, samples: u64, duration_s: f64) -> bool {
        let counted = CONSUMERS.iter().all(|consumer| {
            self.counts(consumer)
                .is_some_and(|counts| counts.samples >= samples)
        });
        let calibrated = self
            .calibration
            .as_ref()
            .is_some_and(|calibration| calibration.duration >= duration_s - 2.0);
        counted && calibrated
    }

    fn position_error(&self, fix: &NavSatFix) -> Option<f64> {
        let truth = self.truth.as_ref()?;
        let origin = Position {
            latitude_rad: truth.latitude_deg.to_radians(),
            longitude_rad: truth.longitude_deg.to_radians(),
            height_m: truth.height_m,
        };
        let position = position_from_fix(fix)?;
        let offset = origin.offset_m(&position);
        Some(offset.x.hypot(offset.y))
    }
}

fn follow(error: &mut Option<PositionError>, distance_m: Option<f64>) {
    if let Some(last_m) = distance_m {
        let largest_m = error.map_or(last_m, |before| before.largest_m.max(last_m));
        *error = Some(PositionError { largest_m, last_m });
    }
}

/// The node.
pub struct Watch {
    node: Node,
    seen: Arc<Mutex<Seen>>,
}

impl Watch {
    /// Joins the domain and listens.
    ///
    /// # Errors
    /// What the middleware refuses.
    pub fn start() -> Result<Self> {
        let name = format!("demo_{}", std::process::id());
        let node = NodeBuilder::new(&name)
            .about("watches the demo")
            .start(["--ros-args", "--disable-rosout-logs"])?;
        let watch = Self {
            node,
            seen: Arc::default(),
        };
        watch.listen(&topics::SCHEME_STATUS.with_depth(10), |seen, message| {
            seen.scheme = Some(message);
        })?;
        watch.listen(&topics::ESTIMATE.with_depth(1000), |seen, message| {
            seen.estimate = Some(message);
        })?;
        watch.listen(&topics::CALIBRATION.with_depth(10), |seen, message| {
            seen.calibration = Some(message);
        })?;
        watch.listen(&topics::TRUE_CALIBRATION, |seen, message| {
            seen.truth = Some(message);
        })?;
        watch.listen(&topics::TRUE_ODOMETRY, |seen, message| {
            if seen.truth_odometry.len() == KEPT_POSES {
                seen.truth_odometry.pop_front();
            }
            seen.truth_odometry.push_back(message);
        })?;
        watch.listen(&topics::FIX_INS.with_depth(1000), |seen, fix| {
            let distance = seen.position_error(&fix);
            follow(&mut seen.compensated, distance);
        })?;
        watch.listen(
            &topics::UNCOMPENSATED_FIX_INS.with_depth(1000),
            |seen, fix| {
                let distance = seen.position_error(&fix);
                follow(&mut seen.uncompensated, distance);
            },
        )?;
        watch.listen(&topics::DIAGNOSTICS.with_depth(100), |seen, array| {
            for status in array.status {
                seen.diagnostics.insert(status.name.clone(), status);
            }
        })?;
        Ok(watch)
    }

    fn listen<M: RosMessage + ros2_client::Message + Send + 'static>(
        &self,
        topic: &Topic<M>,
        take: fn(&mut Seen, M),
    ) -> Result<()> {
        let mut subscription = self.node.subscribe_on(topic)?;
        let seen = Arc::clone(&self.seen);
        self.node.spawn(async move {
            loop {
                let message = subscription.recv().await;
                take(&mut lock(&seen), message);
            }
        });
        Ok(())
    }

    /// What has been heard so far.
    pub fn seen(&self) -> Seen {
        lock(&self.seen).clone()
    }

    /// Leaves the domain.
    pub async fn end(self) {
        self.node.request_shutdown();
        drop(self.node);
        tokio::task::yield_now().await;
    }
}

// Every change under the lock is a whole message, so a panic elsewhere leaves it usable.
fn lock(seen: &Mutex<Seen>) -> MutexGuard<'_, Seen> {
    seen.lock().unwrap_or_else(PoisonError::into_inner)
}
