//! The smoother behind the whole machine, and passes that are linear about what the one before them found, on simulated records
//! whose truth is known at every epoch.
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;

use nalgebra::{SVector, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use sins::Stamp;
use sins::earth::Position;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::model::CALIBRATED_NAMES;
use sins::estimation::smoother::Smoothed;
use sins::machines::self_calibration::{
    Estimate, Event, Guide, ModelChoice, Reference, SelfCalibration, Settings, Smoothing,
};
use sins::sensor::{PositionMeasurement, SensorErrors, VelocityMeasurement};
use sins::simulation::{NoiseReading, Run, SensorGrade, Simulator, SimulatorSettings};
use sins::stream::Reading;
use sins::studies::monte_carlo::mean_nees_bounds;
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};
use sins::units::{DEG_PER_HOUR, MICRO_G};

/// What the sensors gave, and what was true.
struct Record {
    readings: Vec<Reading>,
    attitudes: BTreeMap<Stamp, UnitQuaternion<f64>>,
    errors: SensorErrors,
}

/// A record of the eight positions at 10 Hz, or of the world as it is altered. Velocities of 0.01 m/s once a second are in it.
fn record(seed: u64, hours: f64, alter: impl FnOnce(&mut SimulatorSettings)) -> Record {
    let mut world = SimulatorSettings {
        seed,
        joint_state_rate_hz: 10.0,
        ..SimulatorSettings::default()
    };
    world.plant.imu_rate_hz = 10.0;
    world.plant.ship.heading_rad = (0.7 * seed as f64).rem_euclid(std::f64::consts::TAU);
    alter(&mut world);
    let errors = world.imu.errors;
    let scheme = Scheme::eight_position();
    let program = scheme.program(world.plant.turntable).unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    let mut run = Run::new(Simulator::new(world).unwrap(), sequencer, hours * 3600.0);
    let mut record = Record {
        readings: Vec::new(),
        attitudes: BTreeMap::new(),
        errors,
    };
    while let Some(tick) = run.next() {
        let tick = tick.unwrap();
        if let Some(fix) = tick.position {
            record.readings.push(Reading::Fix(PositionMeasurement {
                stamp: fix.stamp,
                position: Position {
                    latitude_rad: fix.latitude_rad,
                    longitude_rad: fix.longitude_rad,
                    height_m: fix.height_m,
                },
                sigma_m: fix.variance_m2.map(f64::sqrt),
            }));
        }
        if let Some(joints) = tick.joints {
            record.readings.push(Reading::Joints(joints));
        }
        if let Some(velocity) = tick.velocity {
            let measurement = VelocityMeasurement {
                east_north: [velocity.velocity.x, velocity.velocity.y],
                sigma: [0.01; 2],
            };
            let reading = Reading::Velocity(velocity.stamp, measurement);
            record.readings.push(reading);
            let attitude = run.simulator().plant().attitude();
            record.attitudes.insert(velocity.stamp, attitude);
        }
        record.readings.push(Reading::Imu(tick.imu));
    }
    record
}

/// Drifts and biases drawn with these one-sigmas \[deg/h, ug\].
fn drawn(seed: u64, drift: f64, bias: f64) -> SensorErrors {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut draw = |sigma: f64| {
        Vector3::from_fn(|_, _| sigma * Distribution::<f64>::sample(&StandardNormal, &mut random))
    };
    SensorErrors::constant(draw(drift * DEG_PER_HOUR), draw(bias * MICRO_G))
}

/// Settings that measure the velocities of the record.
fn measured() -> Settings {
    Settings {
        reference: Reference::Measured { patience_s: 1.0 },
        gate_sigmas: f64::INFINITY,
        ..Settings::default()
    }
}

/// Estimates as they came, the last one, and the smoothed epochs.
struct Passed {
    on_the_way: Vec<Estimate>,
    last: Estimate,
    epochs: Vec<Smoothed>,
    replays: usize,
    wants_another: bool,
}

fn pass(machine: SelfCalibration, record: &Record, tape_bytes: usize) -> Passed {
    let mut smoothing = Smoothing::within(machine, tape_bytes);
    let mut on_the_way = Vec::new();
    for reading in &record.readings {
        smoothing.push(reading).unwrap();
        while let Some(event) = smoothing.poll() {
            if let Event::Estimate(estimate) = event {
                on_the_way.push(*estimate);
            }
        }
    }
    let last = smoothing.finish().unwrap();
    let wants_another = smoothing.machine().wants_another_pass().unwrap();
    let mut replays = 0;
    while let Some(replay) = smoothing.rewind() {
        replays += 1;
        let readings = record.readings.iter().skip(replay.skip as usize);
        for reading in readings.take(replay.count as usize) {
            smoothing.again(reading);
        }
    }
    Passed {
        on_the_way,
        last,
        epochs: smoothing.into_epochs(),
        replays,
        wants_another,
    }
}

/// The truth of the nine minus what is said of them. (What is said of the misalignment is that there is none.)
fn error(
    record: &Record,
    stamp: Stamp,
    attitude: UnitQuaternion<f64>,
    bias: Vector3<f64>,
    drift: Vector3<f64>,
) -> SVector<f64, 9> {
    let misalignment = (record.attitudes[&stamp] * attitude.inverse()).scaled_axis();
    let bias = record.errors.accelerometer_bias - bias;
    let drift = record.errors.gyroscope_drift - drift;
    SVector::from_iterator(
        [misalignment, bias, drift]
            .iter()
            .flat_map(|v| v.iter().copied()),
    )
}

fn error_of_epoch(record: &Record, epoch: &Smoothed) -> SVector<f64, 9> {
    let bias = epoch.value3(&ACCELEROMETER_BIAS).unwrap();
    let drift = epoch.value3(&GYROSCOPE_DRIFT).unwrap();
    error(record, epoch.stamp, epoch.navigation.attitude, bias, drift)
}

fn error_of_estimate(record: &Record, estimate: &Estimate) -> SVector<f64, 9> {
    error(
        record,
        estimate.stamp,
        estimate.navigation.attitude,
        estimate.accelerometer_bias(),
        estimate.gyroscope_drift(),
    )
}

fn nees_of_estimate(record: &Record, estimate: &Estimate) -> f64 {
    let error = error_of_estimate(record, estimate);
    let covariance = estimate
        .states
        .covariance()
        .block(&CALIBRATED_NAMES)
        .unwrap();
    (error.transpose() * covariance.try_inverse().unwrap() * error)[0]
}

fn nees_of_epoch(record: &Record, epoch: &Smoothed) -> f64 {
    let error = error_of_epoch(record, epoch);
    (error.transpose()
        * epoch
            .covariance()
            .unwrap()
            .block(&CALIBRATED_NAMES)
            .unwrap()
            .try_inverse()
            .unwrap()
        * error)[0]
}

/// Of eight seeds the mean normalized squared error of the nine at epochs all over the record lies within the
/// bounds of a chi-square of that many degrees, so the smoother is as good as it says, from its first epoch to its last. In its last epoch it is the filter.
/// Before it no sigma is above the filter's, and attitude and drifts are nearer the truth than the filter's were.
#[test]
fn smoothed_epochs_are_consistent_and_better_than_the_filters() {
    consistent(8, 1.5);
}

/// The same with a hundred seeds, for the figures in docs/smoother.md (some minutes).
#[test]
#[ignore = "the figures of the manual: some minutes"]
fn a_hundred_seeds_are_consistent() {
    consistent(100, 4.0);
}

fn consistent(seeds: u64, hours: f64) {
    let bounds = mean_nees_bounds(seeds, 0.999);
    let at = [0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0];
    let runs: Vec<_> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let record = record(seed, hours, |world| {
                world.imu.errors = drawn(seed, 0.01, 100.0);
            });
            let passed = pass(
                SelfCalibration::new(measured()).unwrap(),
                &record,
                usize::MAX,
            );
            let last = passed.epochs.last().unwrap();
            assert_eq!(last.stamp, passed.last.stamp);
            assert_eq!(last.navigation, passed.last.navigation);
            assert_eq!(
                last.value3(&GYROSCOPE_DRIFT).unwrap(),
                passed.last.gyroscope_drift()
            );
            let filtered = passed
                .last
                .states
                .covariance()
                .block(&CALIBRATED_NAMES)
                .unwrap();
            assert_eq!(
                last.covariance().unwrap().block(&CALIBRATED_NAMES).unwrap(),
                filtered
            );
            let by_stamp: BTreeMap<_, _> = passed.epochs.iter().map(|e| (e.stamp, e)).collect();
            let mut squares = [SVector::<f64, 9>::zeros(); 2];
            for estimate in &passed.on_the_way {
                let epoch = by_stamp[&estimate.stamp];
                for name in CALIBRATED_NAMES {
                    let (own, before) = (epoch.sigma(name), estimate.states.sigma(name));
                    assert!(own.unwrap() <= before.unwrap() * (1.0 + 1e-6), "{name}");
                }
                for (square, error) in squares.iter_mut().zip([
                    error_of_epoch(&record, epoch),
                    error_of_estimate(&record, estimate),
                ]) {
                    *square += error.component_mul(&error);
                }
            }
            let nees = at.map(|share| {
                let index = ((passed.epochs.len() - 1) as f64 * share).round() as usize;
                nees_of_epoch(&record, &passed.epochs[index])
            });
            (nees, squares)
        })
        .collect();
    for (k, share) in at.into_iter().enumerate() {
        let mean = runs.iter().map(|(nees, _)| nees[k]).sum::<f64>() / seeds as f64;
        println!("at {share} of the record: mean NEES of nine {mean:.2}");
        assert!(
            (bounds[0]..bounds[1]).contains(&mean),
            "at {share}: {mean}, expected {bounds:?}"
        );
    }
    let [smoothed, filtered] = [0, 1].map(|which| {
        let sum: SVector<f64, 9> = runs.iter().map(|(_, squares)| squares[which]).sum();
        sum.map(f64::sqrt)
    });
    let ratio = smoothed.component_div(&filtered);
    println!("rms of the record over the filter's: {ratio}");
    assert!(ratio.max() < 0.9, "{ratio}");
}

/// The whole model with encoders: little memory makes windows of which the readings are asked for once more, and the smoothed
/// epochs are the same to the last bit.
#[test]
fn windows_give_the_same_epochs() {
    let record = record(3, 0.5, |world| {
        let sensor = SensorGrade::RingLaser.draw(3);
        world.imu = sensor.imu;
        world.plant.accelerometer_delay_s = sensor.imu.errors.accelerometer_delay_s;
    });
    let settings = Settings {
        model: ModelChoice::Whole,
        ..Settings::default()
    };
    let machine = || SelfCalibration::new(settings.clone()).unwrap();
    let whole = pass(machine(), &record, usize::MAX);
    let windows = pass(machine(), &record, 8_000_000);
    assert_eq!(whole.replays, 0);
    assert!(windows.replays >= 2, "{}", windows.replays);
    assert_eq!(whole.epochs, windows.epochs);
    assert_eq!(whole.epochs.len(), 1800);
}
/// Drifts of 0.5 deg/h and biases of 300 ug, drawn from priors that say so, of a sensor so quiet that their products show (0.001
/// deg/h/√Hz): a second pass about what the first one found is consistent at its end and in the middle of its record, and the first
/// is not. A third changes nothing. Every pass says whether another one is worth it.
#[test]
fn a_second_pass_is_consistent_where_errors_are_great() {
    great_errors(6, 0.5, 10.0, NoiseReading::H, 2.0);
}

/// The same with more seeds, and with more noise and drifts of 0.5 and 3 deg/h, for the figures in docs/smoother.md (some minutes).
#[test]
#[ignore = "the figures of the manual: some minutes"]
fn second_passes_of_many_seeds_are_consistent() {
    great_errors(20, 0.5, 10.0, NoiseReading::H, 4.0);
    great_errors(20, 3.0, 20.0, NoiseReading::D, 4.0);
}

/// Drifts \[deg/h\] with a prior that says so, and one for the azimuth \[deg\].
fn great_errors(seeds: u64, drift: f64, azimuth: f64, noise: NoiseReading, hours: f64) {
    let mut settings = measured();
    settings.prior.gyroscope_drift_rad_s = Vector3::repeat(drift * DEG_PER_HOUR);
    settings.prior.accelerometer_bias_m_s2 = Vector3::repeat(300.0 * MICRO_G);
    settings.prior.misalignment_rad.z = azimuth.to_radians();
    let runs: Vec<_> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let record = record(seed, hours, |world| {
                world.imu.errors = drawn(seed, drift, 300.0);
                world.imu.noise = noise.density();
            });
            let machine = || SelfCalibration::new(settings.clone()).unwrap();
            let first = pass(machine(), &record, usize::MAX);
            let guide = Guide::new(&first.epochs, &first.last).unwrap();
            let second = pass(machine().guided(guide), &record, usize::MAX);
            let guide = Guide::new(&second.epochs, &second.last).unwrap();
            let third = pass(machine().guided(guide), &record, usize::MAX);
            let middle = second.epochs.len() / 2;
            let wants = [first.wants_another, third.wants_another];
            assert_eq!(wants, [true, false], "seed {seed}");
            [
                nees_of_estimate(&record, &first.last),
                nees_of_estimate(&record, &second.last),
                nees_of_epoch(&record, &second.epochs[middle]),
                nees_of_estimate(&record, &third.last),
            ]
        })
        .collect();
    let mean = |k: usize| runs.iter().map(|nees| nees[k]).sum::<f64>() / seeds as f64;
    let means = [0, 1, 2, 3].map(mean);
    println!(
        "drifts of {drift} deg/h: mean NEES of nine of the first pass {:.1}, the second {:.1}, in its middle {:.1}, the third {:.1}",
        means[0], means[1], means[2], means[3]
    );
    let [low, high] = mean_nees_bounds(seeds, 0.999);
    assert!(means[0] > high, "{runs:?}");
    for mean in &means[1..] {
        assert!((low..high).contains(mean), "{runs:?}");
    }
    assert!((means[3] - means[1]).abs() < 0.1, "{means:?}");
}
