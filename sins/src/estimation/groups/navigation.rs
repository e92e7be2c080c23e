//! Errors of position, velocity and attitude (Sensors 2015, 15, 3154, equations 25 to 27), ENU, no vertical channel.
//!
//! φ̇ = −ω_in × φ + δω_in − C_b^n δω
//! δv̇ = fⁿ × φ + C_b^n δf − (2ω_ie + ω_en) × δv − (2δω_ie + δω_en) × v   (E and N)
//! δL̇ = δv_N / (R_M + h), δλ̇ = (δv_E + v_E tan L δL) / ((R_N + h) cos L)
//!
//! with the change of the radii with latitude added, so that F is the whole derivative of the mechanization. δω and δf, the
//! errors of the sensors, are what the other groups are about.

use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::{Deserialize, Serialize};

use crate::earth::{EARTH_RATE_RAD_S, LocalEarth};
use crate::estimation::group::{Coupling, Group, Interval};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::sample::NoiseDensity;
use crate::units::ARC_SECOND;

/// Number of the states, which are the first of every model.
pub const NAVIGATION_STATES: usize = 7;

/// Row of δL.
pub(in crate::estimation) const LATITUDE: usize = 0;
/// Row of δλ.
pub(in crate::estimation) const LONGITUDE: usize = 1;
/// Row of δv_E; δv_N follows.
pub(in crate::estimation) const VELOCITY_EAST: usize = 2;
/// Row of δv_N.
pub(in crate::estimation) const VELOCITY_NORTH: usize = 3;
/// Row of φ_E; φ_N and φ_U follow.
pub(in crate::estimation) const MISALIGNMENT_EAST: usize = 4;

/// Names of the errors of latitude and longitude.
pub const POSITION: [&str; 2] = ["latitude_error_rad", "longitude_error_rad"];
/// Names of the errors of the velocities east and north.
pub const VELOCITY: [&str; 2] = ["velocity_error_east_m_s", "velocity_error_north_m_s"];
/// Names of the misalignments about east, north and up.
pub const MISALIGNMENT: [&str; 3] = [
    "misalignment_east_rad",
    "misalignment_north_rad",
    "misalignment_up_rad",
];

/// What is known of position, velocity and attitude before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Navigation {
    /// One-sigma of the horizontal position, each axis \[m\].
    pub position_m: f64,
    /// One-sigma of the horizontal velocity, each axis \[m/s\].
    pub velocity_m_s: f64,
    /// One-sigma of the misalignment about E, N, U \[rad\].
    pub misalignment_rad: Vector3<f64>,
}

impl Group for Navigation {
    const LABELS: &'static [StateLabel] = &[
        StateLabel::new(POSITION[0], "δL", "latitude error", "arcsec", ARC_SECOND),
        StateLabel::new(POSITION[1], "δλ", "longitude error", "arcsec", ARC_SECOND),
        StateLabel::new(VELOCITY[0], "δvE", "velocity error east", "m/s", 1.0),
        StateLabel::new(VELOCITY[1], "δvN", "velocity error north", "m/s", 1.0),
        StateLabel::new(
            MISALIGNMENT[0],
            "φE",
            "misalignment east",
            "arcsec",
            ARC_SECOND,
        ),
        StateLabel::new(
            MISALIGNMENT[1],
            "φN",
            "misalignment north",
            "arcsec",
            ARC_SECOND,
        ),
        StateLabel::new(
            MISALIGNMENT[2],
            "φU",
            "misalignment up",
            "arcsec",
            ARC_SECOND,
        ),
    ];

    type Gathered = ();

    fn prior(&self, place: &NavigationState, sigma: &mut [f64]) {
        let earth = LocalEarth::at(place.position.latitude_rad, place.position.height_m);
        sigma[LATITUDE] = self.position_m / earth.meridian_radius_m;
        sigma[LONGITUDE] = self.position_m / (earth.transverse_radius_m * earth.cos_latitude);
        sigma[VELOCITY_EAST..MISALIGNMENT_EAST].fill(self.velocity_m_s);
        sigma[MISALIGNMENT_EAST..].copy_from_slice(self.misalignment_rad.as_slice());
    }

    fn couple(&self, (): &(), interval: &Interval, into: &mut Coupling<'_>) {
        let Interval {
            seconds,
            earth,
            velocity: v,
            gained,
            ..
        } = interval;
        let (rm, rn) = (earth.meridian_radius_m, earth.transverse_radius_m);
        let (drm, drn) = (
            earth.meridian_radius_slope_m,
            earth.transverse_radius_slope_m,
        );
        let (sin, cos) = (earth.sin_latitude, earth.cos_latitude);
        let (tan, sec) = (sin / cos, 1.0 / cos);

        // δω_ie and δω_en by latitude, and δω_en by the velocity errors.
        let earth_by_latitude = EARTH_RATE_RAD_S * Vector3::new(0.0, -sin, cos);
        let transport_by_latitude = Vector3::new(
            v.y * drm / (rm * rm),
            -v.x * drn / (rn * rn),
            v.x * sec * sec / rn - v.x * tan * drn / (rn * rn),
        );
        let transport_by_east = Vector3::new(0.0, 1.0 / rn, tan / rn);
        let transport_by_north = Vector3::new(-1.0 / rm, 0.0, 0.0);
        let frame_rate = earth.earth_rate() + earth.transport_rate(v);
        let coriolis_rate = earth.earth_rate() + frame_rate;

        into.add(LATITUDE, VELOCITY_NORTH, seconds / rm);
        into.add(LATITUDE, LATITUDE, -v.y * drm / (rm * rm) * seconds);
        into.add(LONGITUDE, VELOCITY_EAST, sec / rn * seconds);
        let by_latitude = v.x * sec / rn * (tan - drn / rn);
        into.add(LONGITUDE, LATITUDE, by_latitude * seconds);

        let by_latitude = -(2.0 * earth_by_latitude + transport_by_latitude).cross(v);
        into.drives(
            LATITUDE,
            Some(by_latitude * *seconds),
            Some((earth_by_latitude + transport_by_latitude) * *seconds),
        );
        for (state, axis, transport) in [
            (VELOCITY_EAST, Vector3::x(), transport_by_east),
            (VELOCITY_NORTH, Vector3::y(), transport_by_north),
        ] {
            let coriolis = -coriolis_rate.cross(&axis) - transport.cross(v);
            into.drives(state, Some(coriolis * *seconds), Some(transport * *seconds));
        }
        let (force, turn) = (gained.cross_matrix(), frame_rate.cross_matrix());
        for axis in 0..3 {
            into.drives(
                MISALIGNMENT_EAST + axis,
                Some(force.column(axis).into_owned()),
                Some(-turn.column(axis) * *seconds),
            );
        }
    }

    fn correct_navigation(x: &[f64], strapdown: &mut Strapdown) {
        strapdown.correct(
            &Vector3::from_column_slice(&x[MISALIGNMENT_EAST..MISALIGNMENT_EAST + 3]),
            &Vector3::new(x[VELOCITY_EAST], x[VELOCITY_NORTH], 0.0),
            [x[LATITUDE], x[LONGITUDE]],
        );
    }
}

/// G q Gᵀ per second (equation 27): white noise of the sensors as it drives velocity and misalignment, of a block that stands
/// as `body_to_navigation` says. `velocity_up` is the row of the vertical velocity, where there is one.
pub fn sensor_noise_rate<const M: usize>(
    noise: &NoiseDensity,
    body_to_navigation: &Matrix3<f64>,
    velocity_up: Option<usize>,
) -> SMatrix<f64, M, M> {
    let c = body_to_navigation;
    let spread = |density: &Vector3<f64>| {
        c * Matrix3::from_diagonal(&density.component_mul(density)) * c.transpose()
    };
    let (velocity, misalignment) = (spread(&noise.accelerometer), spread(&noise.gyroscope));
    let rows = [Some(VELOCITY_EAST), Some(VELOCITY_NORTH), velocity_up];
    let mut q = SMatrix::<f64, M, M>::zeros();
    for (i, row) in rows.into_iter().enumerate() {
        for (j, column) in rows.into_iter().enumerate() {
            if let (Some(row), Some(column)) = (row, column) {
                q[(row, column)] = velocity[(i, j)];
            }
            q[(MISALIGNMENT_EAST + i, MISALIGNMENT_EAST + j)] = misalignment[(i, j)];
        }
    }
    q
}

/// Covariance of the navigation errors of one solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigationCovariance(SMatrix<f64, NAVIGATION_STATES, NAVIGATION_STATES>);

impl NavigationCovariance {
    /// The first states of a model's covariance.
    pub fn of<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Self {
        Self(SMatrix::from_fn(|row, column| covariance[(row, column)]))
    }

    /// Of errors that do not depend on each other: one-sigma of latitude and longitude \[rad\], of velocity east and north
    /// \[m/s\], and of the misalignment about E, N, U \[rad\].
    pub fn from_sigmas(
        position_rad: [f64; 2],
        velocity_m_s: [f64; 2],
        misalignment_rad: [f64; 3],
    ) -> Self {
        let sigma = [&position_rad[..], &velocity_m_s, &misalignment_rad].concat();
        Self(SMatrix::from_diagonal(&SMatrix::from_iterator(
            sigma.into_iter().map(|sigma| sigma * sigma),
        )))
    }

    /// Of latitude and longitude \[rad²\].
    pub fn position(&self) -> nalgebra::Matrix2<f64> {
        self.0.fixed_view::<2, 2>(LATITUDE, LATITUDE).into_owned()
    }

    /// Of position (rows) and misalignment (columns) \[rad²\].
    pub fn position_misalignment(&self) -> nalgebra::Matrix2x3<f64> {
        self.0
            .fixed_view::<2, 3>(LATITUDE, MISALIGNMENT_EAST)
            .into_owned()
    }

    /// Of the velocities east and north \[m²/s²\].
    pub fn velocity(&self) -> nalgebra::Matrix2<f64> {
        self.0
            .fixed_view::<2, 2>(VELOCITY_EAST, VELOCITY_EAST)
            .into_owned()
    }

    /// Of the misalignment about E, N, U \[rad²\].
    pub fn misalignment(&self) -> Matrix3<f64> {
        self.0
            .fixed_view::<3, 3>(MISALIGNMENT_EAST, MISALIGNMENT_EAST)
            .into_owned()
    }
}

#[cfg(test)]
mod tests {
    use crate::estimation::column_test::columns_hold;
    use crate::estimation::model::Paper;

    /// Every column of latitude, longitude, velocity and misalignment, for a block that turns on a ship under way.
    #[test]
    fn columns_are_the_derivative_of_the_machine() {
        columns_hold::<Paper, { Paper::M }, { Paper::N }>(super::Navigation::LABELS);
    }

    use super::Group;
}
