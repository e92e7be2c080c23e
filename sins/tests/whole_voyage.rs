//! What the whole model is for: a real sensor, calibrated by thirteen states and by all, and the voyages that follow.
#![allow(clippy::unwrap_used, missing_docs)]

use nalgebra::Vector3;
use sins::earth::{LocalEarth, Position, STANDARD_GRAVITY_M_S2};
use sins::estimation::groups::navigation::POSITION;
use sins::estimation::model::{Model, Whole};
use sins::estimation::state::NamedCovariance;
use sins::machines::navigator::{Navigator, NavigatorEvent, NavigatorOutput, NavigatorSettings};
use sins::machines::self_calibration::{
    Calibration, EncoderUse, Event, ModelChoice, Phase, SelfCalibration, Settings,
};
use sins::sensor::ImuSample;
use sins::simulation::{
    DrawnSensor, ImuErrorSettings, NoiseReading, PlantSettings, Run, SensorGrade, Simulator,
    SimulatorSettings, Tick,
};
use sins::studies::monte_carlo::{Departure, Voyage};
use sins::table::TableErrors;
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};
use sins::units::NAUTICAL_MILE_M;

const DAY_S: f64 = 86_400.0;

/// The eight positions with a sensor.
fn record(drawn: &DrawnSensor, seed: u64, hours: f64) -> Run {
    let scheme = Scheme::eight_position();
    let settings = SimulatorSettings {
        plant: PlantSettings {
            imu_rate_hz: 20.0,
            turntable: scheme.default_table(),
            table_errors: drawn.table,
            accelerometer_delay_s: drawn.imu.errors.accelerometer_delay_s,
            ..PlantSettings::default()
        },
        imu: drawn.imu,
        encoder: drawn.encoder,
        joint_state_rate_hz: 10.0,
        seed,
        ..SimulatorSettings::default()
    };
    let program = scheme.program(settings.plant.turntable).unwrap();
    // The encoders read what their zeros and eccentricities make of a position.
    let tolerant = SequencerSettings {
        position_tolerance_rad: 1e-3,
        ..SequencerSettings::default()
    };
    let sequencer = Sequencer::new(program, tolerant).unwrap();
    Run::new(Simulator::new(settings).unwrap(), sequencer, hours * 3600.0)
}

fn place(tick: &Tick) -> Option<Position> {
    tick.position.map(|fix| Position {
        latitude_rad: fix.latitude_rad,
        longitude_rad: fix.longitude_rad,
        height_m: fix.height_m,
    })
}

/// Calibrations by both models, and the departure as it truly is.
fn calibrations(grade: SensorGrade, seed: u64) -> [Departure; 2] {
    let mut machines = [ModelChoice::Paper, ModelChoice::Whole].map(|model| {
        let settings = Settings {
            model,
            ..Settings::default()
        };
        SelfCalibration::new(settings).unwrap()
    });
    let mut run = record(&grade.draw(seed), seed, 4.0);
    for tick in run.by_ref() {
        let tick = tick.unwrap();
        for machine in &mut machines {
            if let Some(fix) = place(&tick) {
                machine.push_position(fix).unwrap();
            }
            if let Some(joints) = tick.joints {
                machine.push_joints(joints).unwrap();
            }
            machine.push_imu(&tick.imu);
            while machine.poll().is_some() {}
        }
    }
    let simulator = run.simulator();
    machines.map(|mut machine| Departure {
        calibration: machine.finish().unwrap().calibration(),
        attitude: simulator.plant().attitude(),
        errors: simulator.sensor_errors(),
        seed,
    })
}

/// Two hours and a day after a quarter turn of the ship: a fibre-optic block that was calibrated whole sails many times better than
/// by thirteen states, which took a turn's scale error for drift and bias. (Over twelve blocks, root mean square: 45 and 4.1 nmi
/// after 2 h, 350 and 18 nmi after a day. A ring laser's residuals are so small that noise decides: 0.43 and 0.30 nmi, 1.5 and
/// 1.8 nmi.)
#[test]
fn a_voyage_needs_the_whole_calibration() {
    for seed in [1, 2] {
        let voyage = Voyage {
            turn_rad: 0.5 * std::f64::consts::PI,
            duration_s: DAY_S,
            noise: NoiseReading::D.density(),
            every_s: 60.0,
        };
        let tracks = calibrations(SensorGrade::FibreOptic, seed)
            .map(|departure| voyage.sail(&departure).unwrap());
        for hours in [2.0, 24.0] {
            let [paper, whole] = tracks
                .each_ref()
                .map(|track| track.greatest_m(hours * 3600.0)[0] / NAUTICAL_MILE_M);
            println!("seed {seed}, {hours} h: {paper:.2} nmi by 13 states, {whole:.2} by all");
            assert!(whole < 0.5 * paper, "{hours} h: {whole} {paper}");
        }
    }
}

/// What the navigator says of a voyage after some hours: how far it is off, and one sigma of that \[nmi\].
fn navigated(voyage: &Voyage, departure: &Departure, hours: &[f64]) -> Vec<[f64; 2]> {
    let mooring = &departure.calibration;
    // Thirteen states are refused by the judge for such a sensor, and by the navigator with him: what would they have cost?
    let calibration = Calibration {
        phase: Phase::Converged,
        ..mooring.clone()
    };
    let mut navigator = Navigator::new(NavigatorSettings::default()).unwrap();
    let mut found = Vec::new();
    for (index, sample) in voyage.samples(departure).unwrap().enumerate() {
        navigator.push_imu(&sample);
        if index == 0 {
            navigator.push_calibration(calibration.clone()).unwrap();
        }
        while let Some(event) = navigator.poll() {
            let NavigatorEvent::Sample {
                output: Some(output),
                ..
            } = event
            else {
                continue;
            };
            let seconds = sample.stamp.seconds_since(mooring.stamp);
            if hours.get(found.len()).is_none_or(|h| seconds < h * 3600.0) {
                continue;
            }
            let solution = &output.compensated;
            let (there, here) = (solution.navigation.position, mooring.position);
            let earth = LocalEarth::at(here.latitude_rad, here.height_m);
            let north = (there.latitude_rad - here.latitude_rad) * earth.meridian_radius_m;
            let east = (there.longitude_rad - here.longitude_rad)
                * earth.transverse_radius_m
                * earth.cos_latitude;
            let sigma = POSITION.map(|name| solution.covariance.sigma(name).unwrap());
            let sigma_m = f64::hypot(
                sigma[0] * earth.meridian_radius_m,
                sigma[1] * earth.transverse_radius_m * earth.cos_latitude,
            );
            found.push([north.hypot(east), sigma_m].map(|metres| metres / NAUTICAL_MILE_M));
        }
    }
    found
}

/// Twelve ring lasers with their residuals, calibrated by both models, a day and three days after a quarter turn: the errors are as
/// large as the navigator's own sigma says after a whole calibration (root mean square over root of the mean variance).
#[test]
#[ignore = "two minutes; the table of docs/whole-model.md"]
fn position_errors_are_as_large_as_their_sigmas() {
    let hours = [2.0, 24.0, 72.0];
    let voyage = Voyage {
        turn_rad: 0.5 * std::f64::consts::PI,
        duration_s: 3.0 * DAY_S,
        noise: NoiseReading::D.density(),
        every_s: 3600.0,
    };
    let mut squares = [[[0.0; 2]; 3]; 2];
    let seeds = 1..=12;
    let count = f64::from(u32::try_from(seeds.clone().count()).unwrap());
    for seed in seeds {
        let departures = calibrations(SensorGrade::RingLaser, seed);
        for (model, departure) in departures.iter().enumerate() {
            for (at, found) in navigated(&voyage, departure, &hours).iter().enumerate() {
                for (sum, value) in squares[model][at].iter_mut().zip(found) {
                    *sum += value * value / count;
                }
            }
        }
    }
    for (model, name) in ["13 states", "whole"].into_iter().enumerate() {
        for (at, hours) in hours.iter().enumerate() {
            let [error, sigma] = squares[model][at].map(f64::sqrt);
            println!("{name}, {hours} h: {error:.2} nmi rms, {sigma:.2} nmi 1 sigma");
            // Chi-square of two by twelve at 1e-4, both ways.
            let ratio = (error / sigma).powi(2);
            assert!(model == 0 || (0.25..2.5).contains(&ratio), "{ratio}");
        }
    }
}

/// A quarter of an hour of the navigator on a table that turns, with a calibration that is the truth: what it hands on as rate and
/// specific force is what the block felt, arms and delay included; and its covariance holds the groups of the calibration.
#[test]
fn samples_are_handed_on_without_any_error() {
    let mut drawn = SensorGrade::RingLaser.draw(4);
    drawn.imu = ImuErrorSettings {
        errors: drawn.imu.errors,
        ..ImuErrorSettings::perfect()
    };
    let mut run = record(&drawn, 4, 0.25);
    let simulator = run.simulator();
    let errors = simulator.sensor_errors();
    let names = Whole::STATES.map(|state| (state.name, 1e-9));
    let calibration = Calibration {
        stamp: simulator.plant().now(),
        phase: Phase::Converged,
        errors,
        table: TableErrors::default(),
        attitude: simulator.plant().attitude(),
        position: Position {
            latitude_rad: simulator.plant().ship().latitude_rad,
            longitude_rad: simulator.plant().ship().longitude_rad,
            height_m: simulator.plant().ship().height_m,
        },
        covariance: NamedCovariance::from_sigmas(names).unwrap(),
        samples: 1,
        gaps: 0,
    };
    let first = ImuSample::at_rest(calibration.stamp, STANDARD_GRAVITY_M_S2);
    let mut navigator = Navigator::new(NavigatorSettings::default()).unwrap();
    navigator.push_imu(&first);
    navigator.push_calibration(calibration).unwrap();
    let compensation = errors.compensation().unwrap();
    let (mut rate, mut turning) = (0.0_f64, 0.0_f64);
    // What is gained too much, m/s: as it is handed on, and by a compensation without memory.
    let (mut gained, mut without_memory) = (Vector3::zeros(), Vector3::zeros());
    let mut last: Option<Box<NavigatorOutput>> = None;
    for tick in run.by_ref() {
        let tick = tick.unwrap();
        navigator.push_imu(&tick.imu);
        while let Some(event) = navigator.poll() {
            let NavigatorEvent::Sample {
                output: Some(output),
                ..
            } = event
            else {
                continue;
            };
            let (truth, solution) = (&tick.truth, &output.compensated);
            rate = rate.max((solution.angular_rate - truth.angular_rate).norm());
            let seconds = truth.interval_nanos as f64 / 1e9;
            gained += (solution.specific_force - truth.specific_force) * seconds;
            let (_, force) = compensation.apply(&tick.imu.angular_rate, &tick.imu.specific_force);
            without_memory += (force - truth.specific_force) * seconds;
            turning = turning.max(truth.angular_rate.norm());
            last = Some(output);
        }
    }
    let (gained, without_memory) = (gained.norm(), without_memory.norm());
    println!("rate {rate:e} rad/s; {gained:e} m/s too much, {without_memory:e} without memory");
    assert!(turning > 0.08, "the table turned by {turning} rad/s");
    assert!(rate < 1e-9, "{rate:e}");
    assert!(
        gained < 0.05 * without_memory,
        "{gained:e} {without_memory:e}"
    );
    let covariance = last.unwrap().compensated.covariance;
    assert!(covariance.sigma("gyroscope_scale_factor_z").is_some());
    assert!(covariance.sigma("height_error_m").is_none());
}

/// Readings of the encoders that come behind their samples, as they may over a network, give the same estimate to the last bit as
/// those that come before.
#[test]
fn encoders_may_come_late() {
    let drawn = SensorGrade::RingLaser.draw(5);
    let by_delay = [0, 3].map(|delay: usize| {
        let settings = Settings {
            model: ModelChoice::Whole,
            ..Settings::default()
        };
        let mut machine = SelfCalibration::new(settings).unwrap();
        let mut late = std::collections::VecDeque::new();
        let mut last = None;
        for tick in record(&drawn, 5, 0.3) {
            let tick = tick.unwrap();
            if let Some(fix) = place(&tick) {
                machine.push_position(fix).unwrap();
            }
            late.push_back(tick.joints);
            if delay > 0 {
                machine.push_imu(&tick.imu);
            }
            if late.len() > delay
                && let Some(joints) = late.pop_front().flatten()
            {
                machine.push_joints(joints).unwrap();
            }
            if delay == 0 {
                machine.push_imu(&tick.imu);
            }
            while let Some(event) = machine.poll() {
                // The last samples of the late one still wait for their readings.
                if let Event::Estimate(estimate) = event
                    && estimate.duration_s < 1000.5
                {
                    last = Some(estimate);
                }
            }
        }
        last.unwrap()
    });
    let [before, behind] = by_delay;
    assert!(matches!(before.encoders, EncoderUse::Used(n) if n > 100));
    assert_eq!(before.stamp, behind.stamp);
    assert_eq!(before.encoders, behind.encoders);
    assert_eq!(before.states, behind.states);
}
