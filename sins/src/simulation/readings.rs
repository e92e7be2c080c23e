//! What a simulated interval hands to a machine.

use super::Tick;
use crate::earth::Position;
use crate::sensor::{PositionMeasurement, VelocityMeasurement};
use crate::stream::Reading;

impl Tick {
    /// Its readings as a machine takes them: what aids a sample comes before it.
    pub fn readings(&self) -> impl Iterator<Item = Reading> + use<> {
        let position = self.position.map(|fix| {
            Reading::Fix(PositionMeasurement {
                stamp: fix.stamp,
                position: Position {
                    latitude_rad: fix.latitude_rad,
                    longitude_rad: fix.longitude_rad,
                    height_m: fix.height_m,
                },
                sigma_m: fix.variance_m2.map(f64::sqrt),
            })
        });
        let velocity = self.velocity.map(|fix| {
            let measurement = VelocityMeasurement {
                east_north: [fix.velocity.x, fix.velocity.y],
                sigma: [fix.variance.x.sqrt(), fix.variance.y.sqrt()],
            };
            Reading::Velocity(fix.stamp, measurement)
        });
        let joints = self.joints.map(Reading::Joints);
        [position, velocity, joints, Some(Reading::Imu(self.imu))]
            .into_iter()
            .flatten()
    }
}
