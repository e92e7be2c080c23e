//! A solution of the navigator as a map and a ship's instruments want it: the covariance of the pose in metres, and the motion
//! of the ship in her own axes.

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use crate::earth::LocalEarth;
use crate::earth::rotation::base_link_to_block;
use crate::estimation::groups::navigation::{MISALIGNMENT, POSITION, VELOCITY};
use crate::estimation::groups::vertical::HEIGHT;
use crate::estimation::state::NamedCovariance;
use crate::machines::navigator::Solution;
use crate::mechanization::strapdown::NavigationState;
use crate::table::{JointSample, Turntable};

/// Variance of what the system does not estimate at all: height \[m²\], vertical velocity \[m²/s²\].
pub const UNKNOWN_VARIANCE: f64 = 1e6;

/// Covariance of the pose in the local frame: E, N, U \[m\] and the rotations about E, N, U \[rad\].
///
/// The attitude that is calculated is the true one turned by −φ (C' = (I − φ×) C). What is not estimated is unknown.
pub fn pose_covariance(navigation: &NavigationState, covariance: &NamedCovariance) -> Matrix6<f64> {
    let earth = LocalEarth::at(
        navigation.position.latitude_rad,
        navigation.position.height_m,
    );
    let [latitude, longitude] = POSITION;
    let [east, north, up] = MISALIGNMENT;
    let pose = [longitude, latitude, HEIGHT, east, north, up];
    let to_pose = Matrix6::from_diagonal(&Vector6::new(
        earth.transverse_radius_m * earth.cos_latitude,
        earth.meridian_radius_m,
        1.0,
        -1.0,
        -1.0,
        -1.0,
    ));
    let known = covariance.block_or(&pose, 0.0);
    let mut covariance_of_pose = to_pose * known * to_pose;
    for (axis, name) in pose.into_iter().enumerate() {
        if covariance.position(name).is_none() {
            covariance_of_pose[(axis, axis)] = UNKNOWN_VARIANCE;
        }
    }
    covariance_of_pose
}

/// Motion of the ship in her own axes (`base_link`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleMotion {
    /// Velocity over ground \[m/s\].
    pub velocity: Vector3<f64>,
    /// Angular rate against the local frame \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Of velocity \[m²/s²\] and angular rate \[rad²/s²\], both in `base_link`.
    pub covariance: Matrix6<f64>,
}

/// The ship's motion from the block's: the table's rate and the rotation of the local frame taken out of the gyroscopes'
/// reading, ω_nv^v = C_b^v (ω_ib^b − ω_vb^b) − C_n^v ω_in^n.
///
/// `angular_rate_variance` is that of one sample \[rad²/s²\]; the encoders' part is not in it.
pub fn vehicle_motion(
    solution: &Solution,
    table: &Turntable,
    joints: &JointSample,
    angular_rate_variance: &Vector3<f64>,
) -> VehicleMotion {
    let navigation = &solution.navigation;
    let to_vehicle = solution.base_link.inverse();
    let block_to_vehicle: UnitQuaternion<f64> =
        base_link_to_block().inverse() * table.attitude(joints.position);
    let earth = LocalEarth::at(
        navigation.position.latitude_rad,
        navigation.position.height_m,
    );
    let frame_rate = earth.earth_rate() + earth.transport_rate(&navigation.velocity);
    let table_rate = table.body_rate(joints.position, joints.velocity);
    let angular_rate =
        block_to_vehicle * (solution.angular_rate - table_rate) - to_vehicle * frame_rate;
    let mut level = Matrix3::zeros();
    level
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&solution.covariance.block_or(&VELOCITY, UNKNOWN_VARIANCE));
    let turn = to_vehicle.to_rotation_matrix();
    let mut velocity_covariance = turn * level * turn.transpose();
    velocity_covariance[(2, 2)] += UNKNOWN_VARIANCE;
    let block = block_to_vehicle.to_rotation_matrix();
    let known = angular_rate_variance.map(|v| if v > 0.0 { v } else { UNKNOWN_VARIANCE });
    let mut covariance = Matrix6::zeros();
    covariance
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&velocity_covariance);
    covariance
        .fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(block * Matrix3::from_diagonal(&known) * block.transpose()));
    VehicleMotion {
        velocity: to_vehicle * navigation.velocity,
        angular_rate,
        covariance,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::earth::Position;
    use crate::earth::rotation::HeadingPitchRoll;
    use crate::time::Stamp;

    const ORIGIN: Position = Position {
        latitude_rad: 0.8,
        longitude_rad: 3.1,
        height_m: 10.0,
    };

    fn solution(heading: f64, table: UnitQuaternion<f64>, rate: Vector3<f64>) -> Solution {
        let ship = HeadingPitchRoll {
            heading,
            pitch: 0.0,
            roll: 0.0,
        }
        .attitude();
        Solution {
            navigation: NavigationState {
                attitude: ship * table,
                velocity: Vector3::new(1.0, 2.0, 0.0),
                position: ORIGIN,
            },
            base_link: ship * base_link_to_block(),
            angular_rate: rate,
            specific_force: Vector3::zeros(),
            covariance: NamedCovariance::from_sigmas(
                POSITION
                    .into_iter()
                    .chain(VELOCITY)
                    .chain(MISALIGNMENT)
                    .map(|name| (name, 2.0)),
            )
            .unwrap(),
        }
    }

    /// Position in metres takes the radii; the vertical is unknown; rotations take the misalignment.
    #[test]
    fn pose_covariance_is_in_metres() {
        let solution = solution(0.0, UnitQuaternion::identity(), Vector3::zeros());
        let covariance = pose_covariance(&solution.navigation, &solution.covariance);
        assert!((covariance[(1, 1)].sqrt() / (2.0 * 6.37e6) - 1.0).abs() < 5e-3);
        assert!(covariance[(0, 0)] < covariance[(1, 1)]);
        assert_eq!(
            (covariance[(2, 2)], covariance[(4, 4)]),
            (UNKNOWN_VARIANCE, 4.0)
        );
    }

    /// A ship that heads east and does not turn has the north velocity on her port side, whatever the table does.
    #[test]
    fn motion_is_in_the_ships_axes() {
        let table = Turntable::default();
        let joints = JointSample {
            stamp: Stamp::default(),
            position: [0.4, -1.1],
            velocity: [0.05, -0.08],
        };
        let still = solution(
            std::f64::consts::FRAC_PI_2,
            table.attitude(joints.position),
            Vector3::zeros(),
        );
        let earth = LocalEarth::at(ORIGIN.latitude_rad, ORIGIN.height_m);
        let frame_rate = earth.earth_rate() + earth.transport_rate(&still.navigation.velocity);
        let rate = still.navigation.attitude.inverse() * frame_rate
            + table.body_rate(joints.position, joints.velocity);
        let turning = Solution {
            angular_rate: rate,
            ..still
        };
        let motion = vehicle_motion(&turning, &table, &joints, &Vector3::repeat(1e-12));
        assert!(
            (motion.velocity - Vector3::new(1.0, 2.0, 0.0)).norm() < 1e-12,
            "{}",
            motion.velocity
        );
        assert!(
            motion.angular_rate.norm() < 1e-15,
            "{}",
            motion.angular_rate
        );
        assert!(
            (motion.covariance[(0, 0)] - 4.0).abs() < 1e-12
                && motion.covariance[(2, 2)] >= UNKNOWN_VARIANCE
        );
    }
}
