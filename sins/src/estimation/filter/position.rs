//! Positions as measurements: of the antenna, which stands aside from the table's centre.

use nalgebra::{UnitQuaternion, Vector3};

use super::ErrorFilter;
use crate::estimation::groups::navigation;
use crate::estimation::measurement::{Measurement, Outcome, Row};
use crate::estimation::model::Model;
use crate::sensor::PositionMeasurement;

/// Where the antenna of a position is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntennaArm {
    /// From the table's centre, in the axes that the block has at zero joints: starboard, forward, up \[m\].
    pub from_table_centre_m: Vector3<f64>,
    /// Turns those axes into n.
    pub ship: UnitQuaternion<f64>,
}

impl<G: Model<M, N>, const M: usize, const N: usize> ErrorFilter<G, M, N> {
    /// Measures where the antenna is: z = (p + C_v^n l) − p̃ in metres east, north and, with a vertical channel and a known
    /// sigma, up; l is the antenna's arm in the ship, what has been found of it added, and `ship` how she stands (v to n).
    /// An error φ of the attitude turns the arm by −φ × (C l). A position that is older than the state by `age_s` is carried
    /// on by the velocity. Where any component lies beyond the gate none is taken.
    pub fn update_position(
        &mut self,
        measurement: &PositionMeasurement,
        age_s: f64,
        arm: &AntennaArm,
        gate: Option<f64>,
    ) -> [Outcome; 3] {
        let state = self.strapdown.state();
        let earth = self.strapdown.earth();
        let lever = arm.ship * (arm.from_table_centre_m + self.installation.antenna_arm_m);
        let ship = arm.ship.to_rotation_matrix().into_inner();
        let there = measurement.position;
        let scale = [
            earth.transverse_radius_m * earth.cos_latitude,
            earth.meridian_radius_m,
        ];
        let here = &state.position;
        let apart = Vector3::new(
            (here.longitude_rad - there.longitude_rad) * scale[0],
            (here.latitude_rad - there.latitude_rad) * scale[1],
            here.height_m - there.height_m,
        );
        let error = apart + lever - state.velocity * age_s;
        let turned = lever.cross_matrix();
        let height = G::VELOCITY_UP.map(|up| up - 1);
        let rows = [
            Some((navigation::LONGITUDE, scale[0])),
            Some((navigation::LATITUDE, scale[1])),
            height.map(|height| (height, 1.0)),
        ];
        let measurements: [Option<Measurement<N>>; 3] = std::array::from_fn(|axis| {
            let sigma = measurement.sigma_m[axis];
            let direct = rows[axis].filter(|_| sigma > 0.0)?;
            let by_attitude =
                (0..3).map(|k| (navigation::MISALIGNMENT_EAST + k, turned[(axis, k)]));
            let by_arm = G::ANTENNA
                .into_iter()
                .flat_map(|first| (0..3).map(move |k| (first + k, -ship[(axis, k)])));
            let row = Row::new(std::iter::once(direct).chain(by_attitude).chain(by_arm));
            Some(Measurement::new(row, error[axis], sigma * sigma))
        });
        let beyond = measurements.iter().flatten().find_map(|measurement| {
            let innovation = self.kalman.innovation(measurement)?;
            gate.filter(|gate| innovation.normalized_squared() > *gate)
                .map(|_| innovation)
        });
        let outcomes = measurements.map(|measurement| match (measurement, beyond) {
            (None, _) => Outcome::Refused,
            (Some(_), Some(innovation)) => Outcome::Gated(innovation),
            (Some(measurement), None) => self.kalman.update(&measurement),
        });
        self.conclude(outcomes, rows.map(|row| row.is_some()))
    }
}
