//! Each error alone shows what its closed form says, through the whole plant.
#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix3, Vector3};

use super::{ImuErrorSettings, ImuErrors};
use crate::sensor::sample::ImuSample;
use crate::sensor::{BlockMotion, SensorErrors};
use crate::simulation::{Plant, PlantSettings, TruthSample};
use crate::table::{Joint, Trajectory};

const RATE: f64 = 0.2;
/// In the cruise of [`turning`].
const CRUISE: usize = 400;

/// A table that turns about its outer axis (x), with a cruise at [`RATE`]; truth and samples.
fn turning(settings: &ImuErrorSettings) -> Vec<(TruthSample, ImuSample)> {
    let mut plant = Plant::new(PlantSettings {
        accelerometer_delay_s: settings.errors.accelerometer_delay_s,
        ..PlantSettings::default()
    })
    .unwrap();
    let motion = Trajectory::trapezoid(Joint::Outer, [0.0; 2], 2.0, RATE, 0.1).unwrap();
    plant.command(None, &motion).unwrap();
    let mut imu = ImuErrors::new(*settings, 1).unwrap();
    (0..1000)
        .map(|_| {
            let truth = plant.step();
            (truth, imu.measure(&truth))
        })
        .collect()
}

fn with(change: impl FnOnce(&mut SensorErrors)) -> ImuErrorSettings {
    let mut settings = ImuErrorSettings::perfect();
    change(&mut settings.errors);
    settings
}

/// An accelerometer at an arm r across the axis feels ω² r towards it at a constant rate and ω̇ r across while the table speeds up.
#[test]
fn an_arm_feels_centripetal_and_tangential_acceleration() {
    let all = turning(&with(|errors| {
        errors.accelerometer_arms = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.03, 0.0, 0.0, 0.02, 0.0);
    }));
    let off = |k: usize| all[k].1.specific_force - all[k].0.specific_force;
    // The earth turns the block too, by less than 1e-4 of the rate.
    let cruise = off(CRUISE);
    assert!((cruise.y + RATE * RATE * 0.03).abs() < 1e-6, "{cruise}");
    assert!(cruise.x == 0.0 && cruise.z.abs() < 1e-6);
    assert!((off(50).z - 0.1 * 0.02).abs() < 1e-6);
}

/// An accelerometer that is late reports what was felt that much before: with a delay of one interval, the sample before.
#[test]
fn a_late_accelerometer_reports_the_past() {
    let late = turning(&with(|errors| errors.accelerometer_delay_s = 0.01));
    let (mut worst, mut greatest) = (0.0f64, 0.0f64);
    for k in 1..late.len() {
        let past = late[k - 1].0.specific_force;
        worst = worst.max((late[k].1.specific_force - past).norm());
        greatest = greatest.max((late[k].1.specific_force - late[k].0.specific_force).norm());
    }
    assert!(worst < 1e-12, "{worst}");
    // g ω τ at the most.
    assert!((greatest - 9.807 * RATE * 0.01).abs() < 1e-5, "{greatest}");
}

/// The quadratic term adds K_2 f² to an axis under gravity; g-sensitivity adds G f to a rate; an asymmetric scale factor adds a |ω|.
#[test]
fn squares_g_sensitivity_and_asymmetry_are_as_written() {
    let mut settings = with(|errors| {
        errors.accelerometer_quadratic = Vector3::new(0.0, 0.0, 5e-7);
        errors.gyroscope_g_sensitivity[(1, 2)] = 3e-9;
    });
    settings.gyroscope_asymmetry = Vector3::new(2e-6, 0.0, 0.0);
    let mut plant = Plant::new(PlantSettings::default()).unwrap();
    let truth = plant.step();
    let sample = ImuErrors::new(settings, 1).unwrap().measure(&truth);
    let gravity = truth.specific_force.z;
    let force = sample.specific_force - truth.specific_force;
    assert!((force.z - 5e-7 * gravity * gravity).abs() < 1e-14 && force.xy().norm() == 0.0);
    let rate = sample.angular_rate - truth.angular_rate;
    assert!((rate.y - 3e-9 * gravity).abs() < 1e-20);
    for back in [1.0, -1.0] {
        let mut plant = Plant::new(PlantSettings::default()).unwrap();
        let motion = Trajectory::trapezoid(Joint::Outer, [0.0; 2], back * 2.0, RATE, 0.1).unwrap();
        plant.command(None, &motion).unwrap();
        let truth = (0..CRUISE).map(|_| plant.step()).last().unwrap();
        let sample = ImuErrors::new(settings, 1).unwrap().measure(&truth);
        let off = sample.angular_rate.x - truth.angular_rate.x;
        assert!((off - 2e-6 * RATE).abs() < 1e-12, "{back}: {off}");
    }
}

/// Over an interval in which the force swings by d the mean of the square is f² + d²/12, which squaring the mean would miss.
#[test]
fn squares_are_averaged_after_squaring() {
    let mut plant = Plant::new(PlantSettings {
        imu_rate_hz: 1.0,
        ..PlantSettings::default()
    })
    .unwrap();
    let motion = Trajectory::trapezoid(Joint::Outer, [0.0; 2], 2.0, RATE, 0.1).unwrap();
    plant.command(None, &motion).unwrap();
    let truth = (0..5).map(|_| plant.step()).last().unwrap();
    let mean = truth.accelerometers.specific_force;
    let excess = truth.accelerometers.specific_force_square.y - mean.y * mean.y;
    let z = truth.accelerometers.specific_force_square.z - mean.z * mean.z;
    // Together the squares are g² exactly; the square of the mean vector is less by the chord of the turn, g² ω²/12.
    assert!(((excess + z) / (9.807f64.powi(2) * RATE * RATE / 12.0) - 1.0).abs() < 0.01);
}

/// The filter's own model of the errors, another path, says the same to its order: everything at once in a cruise.
#[test]
fn the_model_of_the_filter_agrees() {
    let settings = with(|errors| {
        *errors = SensorErrors {
            gyroscope_drift: Vector3::new(1e-7, -2e-7, 3e-7),
            accelerometer_bias: Vector3::new(1e-3, 2e-3, -3e-3),
            gyroscope_matrix: Matrix3::new(3e-6, 1e-5, -1e-5, 2e-5, -4e-6, 5e-6, 1e-5, -8e-6, 5e-6),
            accelerometer_matrix: Matrix3::new(3e-5, 0.0, 0.0, 2e-5, -4e-5, 0.0, 1e-5, -8e-6, 5e-5),
            accelerometer_quadratic: Vector3::new(5e-7, -4e-7, 3e-7),
            accelerometer_arms: Matrix3::new(0.02, 0.01, -0.01, 0.0, 0.03, 0.01, 0.01, -0.02, 0.03),
            gyroscope_g_sensitivity: Matrix3::from_diagonal(&Vector3::new(1e-10, 2e-10, -1e-10)),
            accelerometer_delay_s: 3e-4,
        };
    });
    let all = turning(&settings);
    let (before, (truth, sample), after) = (all[CRUISE - 1].0, all[CRUISE], all[CRUISE + 1].0);
    let change = |get: fn(&TruthSample) -> Vector3<f64>| (get(&after) - get(&before)) / 0.02;
    let (rate, force) = settings.errors.corrupt(&BlockMotion {
        rate: truth.angular_rate,
        rate_derivative: change(|truth| truth.angular_rate),
        force: truth.specific_force,
        force_derivative: change(|truth| truth.specific_force),
    });
    assert!((rate - sample.angular_rate).norm() < 1e-13);
    assert!(
        (force - sample.specific_force).norm() < 1e-7,
        "{}",
        force - sample.specific_force
    );
}
