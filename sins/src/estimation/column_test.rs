//! The columns of a model against the nonlinear machine, by numerical derivative: for the tests of the groups.
#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::filter::{ErrorFilter, Loop};
use super::groups::antenna::Antenna;
use super::groups::arms::AccelerometerArms;
use super::groups::bias::Bias;
use super::groups::delay::AccelerometerDelay;
use super::groups::g_sensitivity::GyroscopeGSensitivity;
use super::groups::navigation::Navigation;
use super::groups::quadratic::AccelerometerQuadratic;
use super::groups::scale::{AccelerometerMatrix, GyroscopeMatrix};
use super::groups::table::{BaseAttitude, Table};
use super::groups::vertical::Vertical;
use super::model::{Matrices, Model, Paper, Whole};
use super::state::StateLabel;
use crate::earth::Position;
use crate::earth::rotation::{HeadingPitchRoll, small_rotation};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::Increment;
use crate::sensor::errors::{BlockMotion, SensorErrors};
use crate::sensor::sample::NoiseDensity;

/// Settings of a model for tests, and the sensor errors about which it is linear there.
pub(super) trait Example {
    fn example() -> Self;
    fn errors() -> SensorErrors;
}

impl Example for Paper {
    fn example() -> Self {
        Self {
            navigation: Navigation {
                position_m: 10.0,
                velocity_m_s: 0.01,
                misalignment_rad: Vector3::new(1e-3, 2e-3, 3e-3),
            },
            bias: Bias {
                accelerometer_bias_m_s2: Vector3::new(1e-3, 2e-3, 3e-3),
                gyroscope_drift_rad_s: Vector3::new(1e-7, 2e-7, 3e-7),
                accelerometer_walk_m_s2_sqrt_s: 1e-6,
                gyroscope_walk_rad_s_sqrt_s: 1e-9,
            },
        }
    }

    fn errors() -> SensorErrors {
        SensorErrors::constant(
            Vector3::new(1e-4, 2e-4, -1e-4),
            Vector3::new(0.1, -0.2, 0.3),
        )
    }
}

impl Example for Matrices {
    fn example() -> Self {
        let Paper { navigation, bias } = Paper::example();
        Self {
            navigation,
            bias,
            gyroscope_matrix: GyroscopeMatrix {
                scale_factor: 1e-5,
                installation_rad: 2e-5,
            },
            accelerometer_matrix: AccelerometerMatrix {
                scale_factor: 3e-5,
                installation_rad: 4e-5,
            },
        }
    }

    fn errors() -> SensorErrors {
        SensorErrors {
            gyroscope_matrix: Matrix3::new(0.01, 0.02, -0.01, 0.03, -0.02, 0.01, 0.02, -0.03, 0.02),
            accelerometer_matrix: Matrix3::new(0.02, 0.0, 0.0, -0.03, 0.01, 0.0, 0.02, 0.03, -0.02),
            ..Paper::errors()
        }
    }
}

impl Example for Whole {
    fn example() -> Self {
        let Matrices {
            navigation,
            bias,
            gyroscope_matrix,
            accelerometer_matrix,
        } = Matrices::example();
        Self {
            navigation,
            vertical: Vertical {
                height_m: 10.0,
                velocity_m_s: 0.01,
            },
            bias,
            gyroscope_matrix,
            accelerometer_matrix,
            quadratic: AccelerometerQuadratic {
                quadratic_per_m_s2: 1e-6,
            },
            arms: AccelerometerArms { arm_m: 0.03 },
            g_sensitivity: GyroscopeGSensitivity {
                g_sensitivity_rad_s_per_m_s2: 1e-9,
            },
            delay: AccelerometerDelay { delay_s: 1e-3 },
            table: Table {
                nonorthogonality_rad: 1e-4,
                inner_axis_tilt_rad: 2e-4,
                encoder_zero_rad: 3e-4,
                encoder_eccentricity_rad: 4e-5,
            },
            antenna: Antenna { arm_m: 1.0 },
            base: BaseAttitude {
                walk_rad_sqrt_s: 0.0,
            },
        }
    }

    // Arms, delay, squares and g-sensitivity act on each other in the second order, which the columns leave out.
    fn errors() -> SensorErrors {
        Paper::errors()
    }
}

/// Where the example's ship is and how fast she is.
pub(super) fn place() -> NavigationState {
    NavigationState {
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
    }
}

/// True rate \[rad/s\] and specific force \[m/s²\] of each sample: neither stands still, so that what is gathered matters. They
/// are the same backwards, for then A²/2 of the mean F is the second order of the transition.
const SAMPLES: Samples = [
    ([0.01, -0.02, 0.03], [0.5, 1.5, 9.7]),
    ([0.03, 0.01, -0.02], [2.5, -1.0, 8.0]),
    ([0.03, 0.01, -0.02], [2.5, -1.0, 8.0]),
    ([0.01, -0.02, 0.03], [0.5, 1.5, 9.7]),
];
const SAMPLE_S: f64 = 2.5e-4;

/// Error of a computed navigation state against a true one, by the definitions of the states.
fn error_of<G: Model<M, N>, const M: usize, const N: usize>(
    computed: &NavigationState,
    truth: &NavigationState,
) -> SVector<f64, N> {
    let mut x = SVector::zeros();
    // C' = (I − φ×) C
    let phi = -(computed.attitude * truth.attitude.inverse()).scaled_axis();
    let velocity = computed.velocity - truth.velocity;
    for (name, value) in [
        (
            "latitude_error_rad",
            computed.position.latitude_rad - truth.position.latitude_rad,
        ),
        (
            "longitude_error_rad",
            computed.position.longitude_rad - truth.position.longitude_rad,
        ),
        ("velocity_error_east_m_s", velocity.x),
        ("velocity_error_north_m_s", velocity.y),
        ("misalignment_east_rad", phi.x),
        ("misalignment_north_rad", phi.y),
        ("misalignment_up_rad", phi.z),
    ] {
        x[G::position(name).unwrap()] = value;
    }
    for (name, value) in [
        (
            "height_error_m",
            computed.position.height_m - truth.position.height_m,
        ),
        ("velocity_error_up_m_s", velocity.z),
    ] {
        if let Some(state) = G::position(name) {
            x[state] = value;
        }
    }
    x
}

/// The step of the derivative: small enough for the machine to be linear, large enough against rounding.
fn step_of(name: &str) -> f64 {
    match name {
        _ if name.starts_with("velocity") || name == "height_error_m" => 1.0,
        _ if name.starts_with("accelerometer_quadratic") => 1e-3,
        _ if name.starts_with("accelerometer_arm") => 1.0,
        "accelerometer_delay_s" => 1e-3,
        _ if name.starts_with("gyroscope_g") => 1e-5,
        _ if name.starts_with("accelerometer_bias") => 0.1,
        _ if name.starts_with("accelerometer_") || name.starts_with("gyroscope_scale") => 1e-2,
        _ if name.starts_with("gyroscope_installation") => 1e-2,
        _ => 1e-4,
    }
}

/// The same for states that are seen by the change from sample to sample: an even one that does not come back, and so small
/// that its pushes are no jumps.
const RAMP: Samples = [
    ([0.010, -0.020, 0.030], [0.50, 1.50, 9.70]),
    ([0.011, -0.018, 0.027], [0.52, 1.45, 9.68]),
    ([0.012, -0.016, 0.024], [0.54, 1.40, 9.66]),
    ([0.013, -0.014, 0.021], [0.56, 1.35, 9.64]),
];

/// True rate \[rad/s\] and specific force \[m/s²\] of each sample.
type Samples = [([f64; 3], [f64; 3]); 4];

/// Runs a filter with an error of one state, and gives the filter back.
fn run<G: Model<M, N> + Example, const M: usize, const N: usize>(
    samples: &Samples,
    error: &SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
) -> ErrorFilter<G, M, N> {
    let at = |name: &str| G::position(name).map_or(0.0, |state| error[state]);
    let truth = place();
    let phi = Vector3::new(
        at("misalignment_east_rad"),
        at("misalignment_north_rad"),
        at("misalignment_up_rad"),
    );
    let start = NavigationState {
        attitude: small_rotation(&-phi) * truth.attitude,
        velocity: truth.velocity
            + Vector3::new(
                at("velocity_error_east_m_s"),
                at("velocity_error_north_m_s"),
                at("velocity_error_up_m_s"),
            ),
        position: Position {
            latitude_rad: truth.position.latitude_rad + at("latitude_error_rad"),
            longitude_rad: truth.position.longitude_rad + at("longitude_error_rad"),
            height_m: truth.position.height_m + at("height_error_m"),
        },
    };
    let known = G::errors();
    let mut real = known;
    G::correct_sensors(error, &mut real);
    let quiet = NoiseDensity {
        gyroscope: Vector3::zeros(),
        accelerometer: Vector3::zeros(),
    };
    let mut filter =
        ErrorFilter::new(G::example(), start, &known, covariance, quiet, Loop::Open).unwrap();
    let mut before: Option<([f64; 3], [f64; 3])> = None;
    for (rate, force) in *samples {
        let slope = |now: [f64; 3], before: Option<[f64; 3]>| {
            before.map_or_else(Vector3::zeros, |before| {
                (Vector3::from(now) - Vector3::from(before)) / SAMPLE_S
            })
        };
        let motion = BlockMotion {
            rate: rate.into(),
            rate_derivative: slope(rate, before.map(|(rate, _)| rate)),
            force: force.into(),
            force_derivative: slope(force, before.map(|(_, force)| force)),
        };
        before = Some((rate, force));
        let (rate, force) = real.corrupt(&motion);
        filter.propagate(&Increment::from_averages(SAMPLE_S, &rate, &force));
    }
    filter.step().unwrap();
    filter
}

/// Holds the columns of these states: what the filter says that an error of the state becomes over a millisecond, against what
/// the machine makes of it.
pub(super) fn columns_hold<G: Model<M, N> + Example, const M: usize, const N: usize>(
    states: &[StateLabel],
) {
    columns_hold_over::<G, M, N>(states, &SAMPLES, true);
}

/// The same for states that are seen by the change from sample to sample. The first sample has none before it, so that the push
/// is not even over the step: only what the velocity gains is looked at, and not the second order in the other rows.
pub(super) fn change_columns_hold<G: Model<M, N> + Example, const M: usize, const N: usize>(
    states: &[StateLabel],
) {
    columns_hold_over::<G, M, N>(states, &RAMP, false);
}

fn columns_hold_over<G: Model<M, N> + Example, const M: usize, const N: usize>(
    states: &[StateLabel],
    samples: &Samples,
    all_rows: bool,
) {
    let seconds = SAMPLE_S * samples.len() as f64;
    let nothing = SVector::<f64, N>::zeros();
    let truth = *run::<G, M, N>(samples, &nothing, SMatrix::zeros()).navigation();
    for state in states {
        let column = G::position(state.name).unwrap();
        let mut x0 = nothing;
        x0[column] = step_of(state.name);
        // Of a covariance of rank one, x0 x0ᵀ, the step makes (Φ x0)(Φ x0)ᵀ.
        let filter = run::<G, M, N>(samples, &nothing, x0 * x0.transpose());
        let walked = G::example().walk()[column] * seconds;
        let own = (filter.covariance()[(column, column)] - walked).sqrt();
        let analytic = (filter.covariance().column(column) / own - x0) / seconds;
        let change = |sign: f64| {
            let x = x0 * sign;
            let computed = *run::<G, M, N>(samples, &x, SMatrix::zeros()).navigation();
            let mut navigation = x;
            navigation.rows_mut(M, N - M).fill(0.0);
            (error_of::<G, M, N>(&computed, &truth) - navigation) / seconds
        };
        let numerical = (change(1.0) - change(-1.0)) * 0.5;
        // Tolerance: the motion of F within a millisecond, and rounding of position, velocity and attitude.
        let vertical = [(7, 1, 1e-9), (8, 1, 1e-8)];
        let rows = [(0, 2, 5e-13), (2, 2, 1e-8), (4, 3, 2e-11)];
        for (first, count, rounding) in rows.into_iter().chain(vertical).take(M - 4) {
            if !all_rows && ![2, 8].contains(&first) {
                continue;
            }
            let (n, a) = (numerical.rows(first, count), analytic.rows(first, count));
            assert!(
                (n - a).norm() <= 2e-4 * a.norm() + rounding,
                "{} rows {first}: numerical {n} analytic {a}",
                state.name
            );
        }
    }
}
