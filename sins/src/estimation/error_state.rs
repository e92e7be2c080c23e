//! The error model of the paper (Sensors 2015, 15, 3154, equations 25 to 27): thirteen states, ENU, no vertical channel.
//!
//! φ̇ = −ω_in × φ + δω_in − C_b^n ε
//! δv̇ = fⁿ × φ + C_b^n ∇ − (2ω_ie + ω_en) × δv − (2δω_ie + δω_en) × v   (E and N)
//! δL̇ = δv_N / (R_M + h), δλ̇ = (δv_E + v_E tan L δL) / ((R_N + h) cos L)
//!
//! with the change of the radii with latitude added, so that F is the whole derivative of the mechanization.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::earth::{EARTH_RATE_RAD_S, LocalEarth};
use crate::sensor::sample::NoiseDensity;
use crate::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

/// Number of states.
pub const STATES: usize = 13;

/// Names of the states with their units, in the order of the state vector.
pub const STATE_NAMES: [&str; STATES] = [
    "latitude_error_rad",
    "longitude_error_rad",
    "velocity_error_east_m_s",
    "velocity_error_north_m_s",
    "misalignment_east_rad",
    "misalignment_north_rad",
    "misalignment_up_rad",
    "accelerometer_bias_x_m_s2",
    "accelerometer_bias_y_m_s2",
    "accelerometer_bias_z_m_s2",
    "gyroscope_drift_x_rad_s",
    "gyroscope_drift_y_rad_s",
    "gyroscope_drift_z_rad_s",
];

/// How a person calls a state, and the field unit in which a person reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateLabel {
    /// The symbol of the conventions, such as `φU` or `∇x`.
    pub symbol: &'static str,
    /// In words, such as `accelerometer bias x`.
    pub words: &'static str,
    /// The field unit.
    pub unit: &'static str,
    /// One field unit in SI.
    pub scale: f64,
}

const fn label(
    symbol: &'static str,
    words: &'static str,
    unit: &'static str,
    scale: f64,
) -> StateLabel {
    StateLabel {
        symbol,
        words,
        unit,
        scale,
    }
}

/// Labels of the states, in the order of the state vector.
pub const STATE_LABELS: [StateLabel; STATES] = [
    label("δL", "latitude error", "arcsec", ARC_SECOND),
    label("δλ", "longitude error", "arcsec", ARC_SECOND),
    label("δvE", "velocity error east", "m/s", 1.0),
    label("δvN", "velocity error north", "m/s", 1.0),
    label("φE", "misalignment east", "arcsec", ARC_SECOND),
    label("φN", "misalignment north", "arcsec", ARC_SECOND),
    label("φU", "misalignment up", "arcsec", ARC_SECOND),
    label("∇x", "accelerometer bias x", "ug", MICRO_G),
    label("∇y", "accelerometer bias y", "ug", MICRO_G),
    label("∇z", "accelerometer bias z", "ug", MICRO_G),
    label("εx", "gyroscope drift x", "deg/h", DEG_PER_HOUR),
    label("εy", "gyroscope drift y", "deg/h", DEG_PER_HOUR),
    label("εz", "gyroscope drift z", "deg/h", DEG_PER_HOUR),
];

/// Index of the latitude error δL.
pub const LATITUDE: usize = 0;
/// Index of the longitude error δλ.
pub const LONGITUDE: usize = 1;
/// Index of δv_E; δv_N follows.
pub const VELOCITY: usize = 2;
/// Index of φ_E; φ_N and φ_U follow.
pub const MISALIGNMENT: usize = 4;
/// Index of ∇_x; y and z follow.
pub const BIAS: usize = 7;
/// Index of ε_x; y and z follow.
pub const DRIFT: usize = 10;

/// The state vector.
pub type StateVector = SVector<f64, STATES>;
/// A square matrix over the states.
pub type StateMatrix = SMatrix<f64, STATES, STATES>;

/// What the error model depends on at one moment (or on average over an interval).
#[derive(Clone, Copy, Debug)]
pub struct Linearization {
    /// The earth at the present latitude.
    pub earth: LocalEarth,
    /// Velocity in n \[m/s\].
    pub velocity: Vector3<f64>,
    /// Specific force in n \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// C_b^n.
    pub body_to_navigation: Matrix3<f64>,
}

impl Linearization {
    /// F of ẋ = F x + G w (equation 26) \[1/s and the units of the states\].
    pub fn dynamics(&self) -> StateMatrix {
        let Self {
            earth,
            velocity: v,
            specific_force: f,
            body_to_navigation: c,
        } = self;
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

        let mut m = StateMatrix::zeros();
        m[(LATITUDE, VELOCITY + 1)] = 1.0 / rm;
        m[(LATITUDE, LATITUDE)] = -v.y * drm / (rm * rm);
        m[(LONGITUDE, VELOCITY)] = sec / rn;
        m[(LONGITUDE, LATITUDE)] = v.x * sec / rn * (tan - drn / rn);

        let horizontal = |vector: Vector3<f64>| vector.fixed_rows::<2>(0).into_owned();
        let mut velocity_column = |column: usize, vector: Vector3<f64>| {
            m.fixed_view_mut::<2, 1>(VELOCITY, column)
                .copy_from(&horizontal(vector));
        };
        velocity_column(
            LATITUDE,
            -(2.0 * earth_by_latitude + transport_by_latitude).cross(v),
        );
        velocity_column(
            VELOCITY,
            -coriolis_rate.cross(&Vector3::x()) - transport_by_east.cross(v),
        );
        velocity_column(
            VELOCITY + 1,
            -coriolis_rate.cross(&Vector3::y()) - transport_by_north.cross(v),
        );
        m.fixed_view_mut::<2, 3>(VELOCITY, MISALIGNMENT)
            .copy_from(&f.cross_matrix().fixed_view::<2, 3>(0, 0));
        m.fixed_view_mut::<2, 3>(VELOCITY, BIAS)
            .copy_from(&c.fixed_view::<2, 3>(0, 0));

        m.fixed_view_mut::<3, 1>(MISALIGNMENT, LATITUDE)
            .copy_from(&(earth_by_latitude + transport_by_latitude));
        m.fixed_view_mut::<3, 1>(MISALIGNMENT, VELOCITY)
            .copy_from(&transport_by_east);
        m.fixed_view_mut::<3, 1>(MISALIGNMENT, VELOCITY + 1)
            .copy_from(&transport_by_north);
        m.fixed_view_mut::<3, 3>(MISALIGNMENT, MISALIGNMENT)
            .copy_from(&-frame_rate.cross_matrix());
        m.fixed_view_mut::<3, 3>(MISALIGNMENT, DRIFT).copy_from(&-c);
        m
    }

    /// Φ = I + A + A²/2 over `seconds`, A = F · seconds, with this linearization the mean over that time.
    pub fn transition(&self, seconds: f64) -> StateMatrix {
        let a = self.dynamics() * seconds;
        StateMatrix::identity() + a + a * a * 0.5
    }

    /// G q Gᵀ per second (equation 27): white sensor noise as it drives velocity and misalignment errors.
    pub fn process_noise_rate(&self, noise: &NoiseDensity) -> StateMatrix {
        let c = &self.body_to_navigation;
        let spread = |density: &Vector3<f64>| {
            c * Matrix3::from_diagonal(&density.component_mul(density)) * c.transpose()
        };
        let mut q = StateMatrix::zeros();
        q.fixed_view_mut::<2, 2>(VELOCITY, VELOCITY)
            .copy_from(&spread(&noise.accelerometer).fixed_view::<2, 2>(0, 0));
        q.fixed_view_mut::<3, 3>(MISALIGNMENT, MISALIGNMENT)
            .copy_from(&spread(&noise.gyroscope));
        q
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::Position;
    use crate::earth::rotation::{HeadingPitchRoll, small_rotation};
    use crate::mechanization::strapdown::{NavigationState, Strapdown};
    use crate::sensor::Increment;

    /// Error of a perturbed navigation state against a true one, by the definitions of the states.
    fn error_of(computed: &NavigationState, truth: &NavigationState) -> StateVector {
        let mut x = StateVector::zeros();
        x[LATITUDE] = computed.position.latitude_rad - truth.position.latitude_rad;
        x[LONGITUDE] = computed.position.longitude_rad - truth.position.longitude_rad;
        x[VELOCITY] = computed.velocity.x - truth.velocity.x;
        x[VELOCITY + 1] = computed.velocity.y - truth.velocity.y;
        // C' = (I − φ×) C
        let phi = -(computed.attitude * truth.attitude.inverse()).scaled_axis();
        x.fixed_rows_mut::<3>(MISALIGNMENT).copy_from(&phi);
        x
    }

    /// Every column of F against a numerical derivative of the nonlinear mechanization, for a ship under way.
    #[test]
    fn dynamics_are_the_derivative_of_the_mechanization() {
        let truth = NavigationState {
            attitude: HeadingPitchRoll {
                heading: 1.1,
                pitch: 0.2,
                roll: -0.3,
            }
            .attitude(),
            velocity: Vector3::new(400.0, -300.0, 0.0),
            position: Position {
                latitude_rad: 0.8,
                longitude_rad: 0.3,
                height_m: 50.0,
            },
        };
        let rate = Vector3::new(0.01, -0.02, 0.03);
        let force = Vector3::new(0.5, 1.5, 9.7);
        let interval = 1e-3;
        let run = |start: NavigationState, drift: Vector3<f64>, bias: Vector3<f64>| {
            let mut strapdown = Strapdown::new(start);
            strapdown.propagate(&Increment::from_averages(
                interval,
                &(rate + drift),
                &(force + bias),
            ));
            *strapdown.state()
        };
        let c = truth.attitude.to_rotation_matrix().into_inner();
        let f = Linearization {
            earth: LocalEarth::at(truth.position.latitude_rad, truth.position.height_m),
            velocity: truth.velocity,
            specific_force: c * force,
            body_to_navigation: c,
        }
        .dynamics();
        let end = run(truth, Vector3::zeros(), Vector3::zeros());
        let scale = StateVector::from_column_slice(&[
            1e-4, 1e-4, 1.0, 1.0, 1e-4, 1e-4, 1e-4, 1e-1, 1e-1, 1e-1, 1e-4, 1e-4, 1e-4,
        ]);
        for column in 0..STATES {
            let mut x0 = StateVector::zeros();
            x0[column] = scale[column];
            let derivative = |sign: f64| {
                let x = x0 * sign;
                let start = NavigationState {
                    attitude: small_rotation(&-x.fixed_rows::<3>(MISALIGNMENT).into_owned())
                        * truth.attitude,
                    velocity: truth.velocity + Vector3::new(x[VELOCITY], x[VELOCITY + 1], 0.0),
                    position: Position {
                        latitude_rad: truth.position.latitude_rad + x[LATITUDE],
                        longitude_rad: truth.position.longitude_rad + x[LONGITUDE],
                        height_m: truth.position.height_m,
                    },
                };
                let error = error_of(
                    &run(
                        start,
                        x.fixed_rows::<3>(DRIFT).into_owned(),
                        x.fixed_rows::<3>(BIAS).into_owned(),
                    ),
                    &end,
                );
                let mut change = error - x;
                change.fixed_rows_mut::<6>(BIAS).fill(0.0);
                change / interval
            };
            let numerical = (derivative(1.0) - derivative(-1.0)) * 0.5;
            // The mean derivative over the interval: F and its own second order.
            let analytic = (f + f * f * (0.5 * interval)) * x0;
            // Tolerance: the motion of F and the transport rate of the start velocity within a millisecond, and rounding.
            for (start, len, rounding) in [
                (LATITUDE, 2, 5e-13),
                (VELOCITY, 2, 1e-8),
                (MISALIGNMENT, 3, 2e-11),
            ] {
                let (n, a) = (numerical.rows(start, len), analytic.rows(start, len));
                let tolerance = 2e-4 * a.norm() + rounding;
                assert!(
                    (n - a).norm() <= tolerance,
                    "column {column} rows {start}: numerical {n} analytic {a}"
                );
            }
        }
    }
}
