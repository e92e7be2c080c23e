//! The machine with the whole model, on worlds of the simulator: a real sensor on a ship that lies still, and one in a sea.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use nalgebra::{SVector, Vector3};
use sins::earth::Position;
use sins::estimation::groups::antenna::ANTENNA_ARM;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::MISALIGNMENT;
use sins::machines::self_calibration::{
    Antenna, EncoderUse, Estimate, ModelChoice, NoiseFrom, Reference, SelfCalibration, Settings,
};
use sins::sensor::PositionMeasurement;
use sins::simulation::{Course, Run, SensorGrade, Simulator, SimulatorSettings, Tick, TimeWindow};
use sins::table::TableErrors;
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};
use sins::units::{ARC_SECOND, MICRO_G};

/// A world of the eight positions at 10 Hz with a ring laser of this seed.
fn world(seed: u64) -> SimulatorSettings {
    let mut world = SimulatorSettings {
        seed,
        joint_state_rate_hz: 10.0,
        ..SimulatorSettings::default()
    };
    world.plant.imu_rate_hz = 10.0;
    world.plant.ship.heading_rad = 0.6;
    let sensor = SensorGrade::RingLaser.draw(seed);
    world.imu = sensor.imu;
    world.plant.accelerometer_delay_s = sensor.imu.errors.accelerometer_delay_s;
    world.plant.table_errors = TableErrors {
        nonorthogonality_rad: 5.0 * ARC_SECOND,
        inner_axis_tilt_rad: [4.0 * ARC_SECOND, -3.0 * ARC_SECOND],
        encoder_zero_inner_rad: -15.0 * ARC_SECOND,
        encoder_eccentricity_outer_rad: [4.0 * ARC_SECOND, 3.0 * ARC_SECOND],
        encoder_eccentricity_inner_rad: [-4.0 * ARC_SECOND, 3.0 * ARC_SECOND],
        ..TableErrors::default()
    };
    world
}

fn settings() -> Settings {
    Settings {
        model: ModelChoice::Whole,
        ..Settings::default()
    }
}

/// What came of a run: the last estimate, and the errors of the nine over their sigmas.
struct Outcome {
    estimate: Estimate,
    normalized: [f64; 9],
}

fn run(
    world: &SimulatorSettings,
    settings: Settings,
    hours: f64,
    mut alter: impl FnMut(&mut Tick),
) -> Outcome {
    let scheme = Scheme::eight_position();
    let program = scheme.program(world.plant.turntable).unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    let mut machine = SelfCalibration::new(settings).unwrap();
    let mut simulation = Run::new(Simulator::new(*world).unwrap(), sequencer, hours * 3600.0);
    for tick in simulation.by_ref() {
        let mut tick = tick.unwrap();
        alter(&mut tick);
        if let Some(fix) = tick.position {
            let position = Position {
                latitude_rad: fix.latitude_rad,
                longitude_rad: fix.longitude_rad,
                height_m: fix.height_m,
            };
            machine
                .push_fix(PositionMeasurement {
                    stamp: fix.stamp,
                    position,
                    sigma_m: fix.variance_m2.map(f64::sqrt),
                })
                .unwrap();
        }
        if let Some(joints) = tick.joints {
            machine.push_joints(joints).unwrap();
        }
        machine.push_imu(&tick.imu);
        while machine.poll().is_some() {}
    }
    let estimate = machine.finish().unwrap();
    let simulator = simulation.simulator();
    let errors = simulator.sensor_errors();
    let attitude = simulator.plant().attitude();
    let phi = -(estimate.navigation.attitude * attitude.inverse()).scaled_axis();
    let pairs = [
        (phi, estimate.misalignment_sigma()),
        (
            estimate.accelerometer_bias() - errors.accelerometer_bias,
            estimate.accelerometer_bias_sigma(),
        ),
        (
            estimate.gyroscope_drift() - errors.gyroscope_drift,
            estimate.gyroscope_drift_sigma(),
        ),
    ];
    let mut normalized = [0.0; 9];
    for (group, (error, sigma)) in pairs.into_iter().enumerate() {
        for axis in 0..3 {
            normalized[3 * group + axis] = error[axis] / sigma[axis];
        }
    }
    Outcome {
        estimate,
        normalized,
    }
}

impl Outcome {
    fn worst(&self) -> f64 {
        self.normalized
            .iter()
            .fold(0.0, |worst: f64, z| worst.max(z.abs()))
    }

    /// Normalized estimation error squared of the nine.
    fn nees(&self) -> f64 {
        let names = [MISALIGNMENT, ACCELEROMETER_BIAS, GYROSCOPE_DRIFT].concat();
        let names: [&str; 9] = names.try_into().unwrap();
        let covariance = self.estimate.covariance().block(&names).unwrap();
        let sigma = covariance.diagonal().map(f64::sqrt);
        let correlation = covariance.component_div(&(sigma * sigma.transpose()));
        let z = SVector::<f64, 9>::from(self.normalized);
        z.dot(&correlation.cholesky().unwrap().solve(&z))
    }

    fn is_assured(&self, settings: &Settings) -> bool {
        let verdict = self.estimate.verdict(settings);
        verdict.converged && verdict.consistent
    }
}

/// Ring lasers of 20 seeds on a still ship, with encoders: every one converges, no error is beyond 4.5 sigma, the mean NEES of the
/// nine is that of nine degrees of freedom, and a bias is known to 0.7 ug.
#[test]
fn real_sensors_are_calibrated() {
    let mut sum = 0.0;
    for seed in 1..=20 {
        let outcome = run(&world(seed), settings(), 4.0, |_| {});
        assert!(outcome.is_assured(&settings()), "seed {seed}");
        assert!(outcome.worst() < 4.5, "{seed}: {:?}", outcome.normalized);
        assert!(outcome.estimate.accelerometer_bias_sigma().amax() < 0.7 * MICRO_G);
        assert!(matches!(outcome.estimate.encoders, EncoderUse::Used(n) if n > 10_000));
        sum += outcome.nees();
    }
    let mean = sum / 20.0;
    assert!((6.2..12.4).contains(&mean), "mean NEES {mean}");
}

/// A sea of 0.3 m, a slow swing, and positions of 0.3 m with outliers.
fn in_a_sea(seed: u64) -> (SimulatorSettings, Settings) {
    let mut world = world(seed);
    world.plant.motion.sea.significant_height_m = 0.3;
    world.plant.motion.sea.peak_period_s = 7.0;
    world.plant.motion.swing.amplitude_rad = 0.05;
    world.plant.motion.swing.period_s = 260.0;
    world.plant.motion.swing.radius_m = 30.0;
    world.aiding.horizontal_std_m = 0.3;
    world.aiding.vertical_std_m = 0.3;
    world.aiding.antenna_arm_m = Vector3::new(5.0, 2.0, 12.0);
    world.aiding.outlier_probability = 0.01;
    let settings = Settings {
        reference: Reference::Auto {
            sigma_m_s: 0.01,
            patience_s: 2.0,
        },
        antenna: Antenna {
            arm_m: world.aiding.antenna_arm_m,
            latency_s: 0.0,
        },
        ..settings()
    };
    (world, settings)
}

/// In a sea the ship moves: the machine sees it while it aligns, takes positions, leaves outliers out and counts them. Her biases
/// are as well known as those of a ship that lies still (4.2 ug without encoders). Taken for still she is not assured within four
/// hours, and no error is beyond its sigmas.
#[test]
fn a_ship_in_a_sea_is_calibrated_by_her_positions() {
    let mut sum = 0.0;
    for seed in 1..=3 {
        let (world, settings) = in_a_sea(seed);
        let outcome = run(&world, settings.clone(), 4.0, |_| {});
        assert!(outcome.is_assured(&settings), "seed {seed}");
        assert!(outcome.worst() < 4.5, "{seed}: {:?}", outcome.normalized);
        assert!(outcome.estimate.accelerometer_bias_sigma().amax() < 4.4 * MICRO_G);
        let gated = outcome.estimate.samples.updates.gated;
        assert!(
            (250..700).contains(&gated),
            "{gated} of some 432 components"
        );
        sum += outcome.nees();
    }
    let mean = sum / 3.0;
    // 27 degrees of freedom in all: mean 9, one-sigma 2.4.
    assert!((3.0..18.0).contains(&mean), "mean NEES {mean}");
    let (world, settings) = in_a_sea(7);
    let moored = Settings {
        reference: Reference::Moored { sigma_m_s: 0.01 },
        ..settings
    };
    let outcome = run(&world, moored.clone(), 4.0, |_| {});
    assert!(!outcome.is_assured(&moored));
    assert!(!outcome.estimate.verdict(&moored).consistent);
    // Without the slow swing her motion is followed, and no sigma is too small.
    let mut waves = world;
    waves.plant.motion.swing.amplitude_rad = 0.0;
    let outcome = run(&waves, moored.clone(), 4.0, |_| {});
    let [east, north, up] = outcome.estimate.ship_motion_m_s.unwrap();
    assert!(up > 0.02, "{east} {north} {up}");
    // (The last estimate is older than the last sample, and she rolls: biases and drifts.)
    let of_sensors = &outcome.normalized[3..];
    assert!(of_sensors.iter().all(|z| z.abs() < 4.5), "{of_sensors:?}");
}

/// Where nobody tells the antenna's arm, the ship's own roll and swing show it, to centimetres.
#[test]
fn the_antennas_arm_is_found() {
    let (world, mut settings) = in_a_sea(9);
    settings.antenna.arm_m = Vector3::zeros();
    let outcome = run(&world, settings.clone(), 2.0, |_| {});
    assert!(outcome.worst() < 4.5, "{:?}", outcome.normalized);
    let arm = outcome.estimate.states.value3(&ANTENNA_ARM).unwrap();
    let sigma = outcome.estimate.states.sigma3(&ANTENNA_ARM).unwrap();
    let error = arm - world.aiding.antenna_arm_m;
    assert!(sigma.rows(0, 2).amax() < 0.2, "{sigma}");
    assert!(
        (0..3).all(|axis| error[axis].abs() < 4.0 * sigma[axis]),
        "{error} {sigma}"
    );
}

/// Positions fail for ten minutes, and later lie by 50 m for ten: what they say is left out, they return, and the errors stay
/// within their sigmas.
#[test]
fn positions_fail_lie_and_return() {
    let (mut world, settings) = in_a_sea(11);
    let window = |start_s: f64| TimeWindow {
        start_s,
        duration_s: 600.0,
        period_s: 0.0,
    };
    world.aiding.outlier_probability = 0.0;
    world.aiding.dropouts = window(4000.0);
    world.aiding.position_lies = window(9000.0);
    world.aiding.position_lie_m = Vector3::new(50.0, -20.0, 10.0);
    let outcome = run(&world, settings, 4.0, |_| {});
    assert!(outcome.worst() < 4.5, "{:?}", outcome.normalized);
    let samples = outcome.estimate.samples;
    assert!(
        (590..620).contains(&samples.missing_velocities),
        "{samples:?}"
    );
    assert!((1700..1900).contains(&samples.updates.gated), "{samples:?}");
}

/// Calibration goes on while the ship steams with a satellite receiver: aligned at rest, then two hours at 6 m/s with turns.
#[test]
fn calibration_goes_on_under_way() {
    let (mut world, settings) = in_a_sea(5);
    world.plant.motion.swing.amplitude_rad = 0.0;
    world.plant.motion.course = Course {
        speed_m_s: 6.0,
        start_s: 3600.0,
        leg_s: 1200.0,
        turn_rad: 1.0,
        turn_rate_rad_s: 0.01,
        ..world.plant.motion.course
    };
    let settings = Settings {
        reference: Reference::Position { patience_s: 2.0 },
        ..settings
    };
    let outcome = run(&world, settings.clone(), 3.0, |_| {});
    assert!(outcome.estimate.navigation.velocity.norm() > 4.0);
    assert!(outcome.worst() < 4.5, "{:?}", outcome.normalized);
    assert!(outcome.is_assured(&settings));
}

/// Covariances nine times too small: the samples at rest show three times the noise that they say, and the judge names it; where the
/// noise is taken from the rest it is found within what 300 s can show.
#[test]
fn noise_is_seen_at_rest() {
    let mut world = world(4);
    world.imu.output.stated_variance_ratio = 1.0 / 9.0;
    for (noise_from, seen) in [(NoiseFrom::Samples, 3.0), (NoiseFrom::Rest, 1.0)] {
        let settings = Settings {
            noise_from,
            ..settings()
        };
        let outcome = run(&world, settings.clone(), 2.0, |_| {});
        let told = outcome.estimate.noise;
        let told = told.gyroscope.iter().chain(&told.accelerometer);
        for (axis, (at_rest, told)) in outcome.estimate.noise_at_rest.iter().zip(told).enumerate() {
            let ratio = at_rest.unwrap() / told;
            assert!((ratio / seen - 1.0).abs() < 0.35, "{axis}: {ratio}");
        }
        let verdict = outcome.estimate.verdict(&settings);
        let noise = verdict.tests.iter().find(|test| test.name == "noise");
        assert_eq!(noise.unwrap().passed, noise_from == NoiseFrom::Rest);
        assert_eq!(verdict.consistent, noise_from == NoiseFrom::Rest);
    }
}
