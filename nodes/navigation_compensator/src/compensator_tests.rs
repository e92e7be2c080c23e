#![allow(clippy::unwrap_used)]
use nalgebra::{UnitQuaternion, Vector3};
use ros2_interfaces::sensor_msgs::NavSatStatus;
use rotary_sins_msgs::convert::{ToMessage, imu_from_sample, stamp_from_time};
use sins::earth::LocalEarth;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::model::{Model, Paper};

use super::*;
use crate::parameters::NodeSettings;

const LATITUDE_DEG: f64 = 45.0;
const DRIFT_RAD_S: f64 = 1e-6;
const INTERVAL_NANOS: i64 = 10_000_000;

fn compensator(output_rate_hz: f64) -> Compensator {
    Compensator::new(NodeSettings {
        navigator: sins::machines::navigator::NavigatorSettings {
            joint_patience_s: 0.1,
            ..sins::machines::navigator::NavigatorSettings::default()
        },
        output_rate_hz,
        imu_output_rate_hz: 0.0,
        odometry_frame_id: "odom".to_owned(),
        base_frame_id: "base_link".to_owned(),
        tf_rate_hz: 0.0,
        nmea_rate_hz: 10.0,
        azimuth_topics: true,
        silence_s: 3.0,
    })
    .unwrap()
}

/// The sample with this number of a block at rest, heading 0, whose x gyroscope drifts.
fn sample(number: i64) -> Imu {
    let earth = LocalEarth::at(LATITUDE_DEG.to_radians(), 0.0);
    let sample = ImuSample {
        stamp: Stamp::from_nanos(1_700_000_000_000_000_000 + number * INTERVAL_NANOS),
        angular_rate: earth.earth_rate() + Vector3::x() * DRIFT_RAD_S,
        specific_force: Vector3::z() * earth.gravity_m_s2,
        angular_rate_variance: Vector3::repeat(1e-13),
        specific_force_variance: Vector3::repeat(1e-7),
    };
    imu_from_sample(&sample, "imu_link")
}

/// The joints at the time of the sample with this number, at rest.
fn joints(number: i64, angle: f64) -> JointState {
    JointState {
        header: sample(number).header,
        name: vec!["outer_joint".to_owned(), "inner_joint".to_owned()],
        position: vec![angle, -0.5 * angle],
        velocity: vec![0.0; 2],
        ..JointState::default()
    }
}

fn state_names() -> Vec<String> {
    Paper::LIST.map(|label| label.name.to_owned()).to_vec()
}

fn calibration(number: i64) -> Calibration {
    Calibration {
        header: sample(number).header,
        valid: true,
        gyroscope_drift: [DRIFT_RAD_S, 0.0, 0.0],
        attitude: UnitQuaternion::identity().into(),
        latitude_deg: LATITUDE_DEG,
        longitude_deg: 126.6,
        covariance: nalgebra::DMatrix::from_diagonal_element(
            state_names().len(),
            state_names().len(),
            1e-20,
        )
        .as_slice()
        .to_vec(),
        state_names: state_names(),
        phase: 4,
        ..Calibration::default()
    }
}

fn feed(compensator: &mut Compensator, numbers: std::ops::Range<i64>) -> Vec<Output> {
    let mut outputs = Vec::new();
    for number in numbers {
        compensator.imu(&sample(number), &mut |output| outputs.push(output));
    }
    outputs
}

/// The calibration's drift is taken out: the one solution stays, the other one tilts and leaves.
#[test]
fn compensation_holds_the_position() {
    let mut compensator = compensator(0.0);
    assert!(feed(&mut compensator, 0..10).is_empty());
    compensator.calibration(&calibration(5));
    let outputs = feed(&mut compensator, 10..60_000);
    let last = outputs.last().unwrap();
    let distance = |messages: &SolutionMessages| {
        let position = messages.navigation.as_ref().unwrap().0.pose.pose.position;
        position.x.hypot(position.y)
    };
    assert!(
        distance(&last.compensated) < 0.1,
        "{}",
        distance(&last.compensated)
    );
    assert!(distance(&last.uncompensated) > 100.0);
    let imu = last.compensated.imu.as_ref().unwrap();
    assert!((imu.angular_velocity.x).abs() < 1e-12);
    let odometry = &last.compensated.navigation.as_ref().unwrap().0;
    assert_eq!(
        (
            odometry.header.frame_id.as_str(),
            odometry.child_frame_id.as_str()
        ),
        ("odom", "base_link")
    );
    // Heading 0: the ship's x (forward) is North.
    assert!((odometry.pose.pose.orientation.z - 0.5f64.sqrt()).abs() < 1e-6);
}

/// What stood on a calibration that had not converged does not stay where that one has led it.
#[test]
fn a_calibration_after_one_that_had_not_converged_starts_anew() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    // Nothing is known of the drift yet.
    compensator.calibration(&Calibration {
        phase: 3,
        converged: false,
        gyroscope_drift: [0.0; 3],
        ..calibration(5)
    });
    let distance = |outputs: &[Output]| {
        let odometry = &outputs.last().unwrap().compensated.navigation;
        let position = odometry.as_ref().unwrap().0.pose.pose.position;
        position.x.hypot(position.y)
    };
    let led_off = distance(&feed(&mut compensator, 10..20_000));
    assert!(led_off > 1.0, "{led_off}");
    compensator.calibration(&calibration(19_998));
    let anew = distance(&feed(&mut compensator, 20_000..20_100));
    assert!(anew < 0.1, "{anew}");
    // One that follows a good one refines it, and what runs goes on.
    let before = distance(&feed(&mut compensator, 20_100..20_110));
    compensator.calibration(&calibration(20_105));
    let after = distance(&feed(&mut compensator, 20_110..20_111));
    assert!((after - before).abs() < 1e-3, "{before} {after}");
}

/// The heading is told as the azimuth of the ecosystem: from true North and from true East, with its variance.
#[test]
fn azimuths_are_the_heading() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    let outputs = feed(&mut compensator, 10..20);
    let [enu, ned] = outputs.last().unwrap().azimuths.as_ref().unwrap();
    assert!((enu.azimuth - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    assert!(ned.azimuth.min(std::f64::consts::TAU - ned.azimuth) < 1e-6);
    for azimuth in [enu, ned] {
        assert_eq!((azimuth.unit, azimuth.reference), (0, 1));
        assert!(azimuth.variance > 0.0, "{azimuth:?}");
    }
    assert_eq!((enu.orientation, ned.orientation), (0, 1));
}

/// A start from a calibration needs no fix; an alignment does, and says so until one comes, after a jump too.
#[test]
fn an_alignment_without_a_fix_is_told() {
    let mut compensator = compensator(0.0);
    let waits = |compensator: &Compensator| {
        format!("{:?}", compensator.navigation_report())
            .contains("aligning waits for a valid position on fix")
    };
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    feed(&mut compensator, 10..100);
    assert_eq!(compensator.phase, NavigatorPhase::Navigating);
    assert!(!waits(&compensator));
    // The clock is set back by ten minutes.
    feed(&mut compensator, -60_000..-59_900);
    assert_eq!(compensator.phase, NavigatorPhase::Aligning);
    assert!(waits(&compensator));
    compensator.fix(&NavSatFix {
        latitude: LATITUDE_DEG,
        longitude: 126.6,
        ..NavSatFix::default()
    });
    assert!(!waits(&compensator));
}

/// A calibration that overtakes its samples starts the navigation all the same, as soon as they are there.
#[test]
fn calibration_may_overtake_its_samples() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(12));
    assert_eq!(compensator.phase, NavigatorPhase::WaitingForCalibration);
    assert_eq!(feed(&mut compensator, 10..20).len(), 7);
}

/// Samples that wait for a joint state when the stream ends are navigated all the same.
#[test]
fn the_end_leaves_no_sample_behind() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    let joints = JointSample {
        stamp: stamp_from_time(sample(9).header.stamp),
        position: [0.0; 2],
        velocity: [0.0; 2],
    };
    compensator.joints(&joints.to_message(), &mut |_| {});
    assert!(feed(&mut compensator, 10..15).is_empty());
    let mut outputs = Vec::new();
    compensator.flush(&mut |output| outputs.push(output));
    assert_eq!(outputs.len(), 5);
}

/// The output rate counts stamps.
#[test]
fn output_rate_goes_by_stamps() {
    let mut compensator = compensator(2.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    let outputs = feed(&mut compensator, 10..510);
    assert_eq!(outputs.len(), 500);
    assert_eq!(
        outputs
            .iter()
            .filter(|o| o.compensated.navigation.is_some())
            .count(),
        11
    );
}

/// A calibration that says it is not valid, or that has other states, is refused.
#[test]
fn unusable_calibrations_are_refused() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&Calibration {
        valid: false,
        ..calibration(5)
    });
    compensator.calibration(&Calibration {
        state_names: vec!["x".to_owned()],
        ..calibration(5)
    });
    assert_eq!(compensator.inputs.calibration.refused(), 2);
    assert_eq!(compensator.phase, NavigatorPhase::WaitingForCalibration);
}

/// What cannot be believed is refused with one line that names it, and what runs goes on: no solution becomes NaN.
#[test]
fn impossible_calibrations_are_refused_and_navigation_goes_on() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    let good = calibration(15);
    let impossible = [
        (
            "gyroscope_drift",
            Calibration {
                gyroscope_drift: [1e6, 0.0, 0.0],
                ..good.clone()
            },
        ),
        (
            "accelerometer_bias",
            Calibration {
                accelerometer_bias: [0.0, 1e9, 0.0],
                ..good.clone()
            },
        ),
        (
            "latitude",
            Calibration {
                latitude_deg: 95.0,
                ..good.clone()
            },
        ),
        (
            "height",
            Calibration {
                height_m: 1e300,
                ..good.clone()
            },
        ),
        (
            "inconsistent",
            Calibration {
                phase: rotary_sins_msgs::SelfCalibrationEstimate::INCONSISTENT,
                ..good
            },
        ),
    ];
    let count = impossible.len();
    for (word, message) in impossible {
        let line = super::translation::calibration(&message).unwrap_err();
        assert!(line.contains(word) && !line.contains('\n'), "{line}");
        compensator.calibration(&message);
    }
    assert_eq!(compensator.inputs.calibration.refused(), count as u64);
    assert_eq!(compensator.calibrations, 1);
    let outputs = feed(&mut compensator, 10..600);
    assert_eq!(outputs.len(), 590);
    let last = outputs.last().unwrap();
    let odometry = &last.compensated.navigation.as_ref().unwrap().0;
    let position = odometry.pose.pose.position;
    assert!(position.x.hypot(position.y) < 0.1, "{position:?}");
}

/// A calibration of tomorrow, with more states in another order, is taken for what is known here, and one with fewer for what
/// it has; one whose covariance is none is not.
#[test]
fn states_are_found_by_name() {
    let of = |names: &[&str], variances: &[f64]| {
        let count = names.len();
        let mut covariance = vec![0.0; count * count];
        for (state, variance) in variances.iter().enumerate() {
            covariance[state * count + state] = *variance;
        }
        super::translation::calibration(&Calibration {
            state_names: names.iter().map(ToString::to_string).collect(),
            covariance,
            ..calibration(5)
        })
    };
    let sigma = |calibration: sins::machines::self_calibration::Calibration, name: &str| {
        calibration.covariance.sigma(name)
    };
    let (drift, bias) = (GYROSCOPE_DRIFT[2], ACCELEROMETER_BIAS[0]);
    let names = state_names();
    let mut more: Vec<&str> = names.iter().map(String::as_str).collect();
    more.push("gyroscope_scale_factor_x");
    more.reverse();
    let variances: Vec<f64> = (0..14).map(f64::from).collect();
    let read = of(&more, &variances).unwrap();
    assert_eq!(sigma(read.clone(), drift), Some(1.0));
    assert_eq!(sigma(read, bias), Some(6f64.sqrt()));
    let read = of(&[drift], &[4.0]).unwrap();
    assert_eq!(sigma(read.clone(), drift), Some(2.0));
    assert_eq!(sigma(read, bias), None);
    let error = of(&[drift, bias], &[4.0, f64::NAN]).unwrap_err();
    assert!(error.contains(bias), "{error}");
}

/// A fix that is none does not become the origin.
#[test]
fn origin_is_the_first_valid_fix() {
    let mut compensator = compensator(0.0);
    let fix = |latitude, status| NavSatFix {
        status: NavSatStatus { status, service: 0 },
        latitude,
        ..NavSatFix::default()
    };
    compensator.fix(&fix(10.0, -1));
    compensator.fix(&fix(f64::NAN, 0));
    assert!(compensator.origin.is_none());
    compensator.fix(&fix(20.0, 0));
    compensator.fix(&fix(30.0, 0));
    assert!((compensator.origin.unwrap().latitude_rad.to_degrees() - 20.0).abs() < 1e-12);
    assert_eq!(compensator.inputs.fix.refused(), 2);
}

/// A joint state whose velocity is no number is refused and counted: the ship's turn is what the block turns less what the joints
/// do, and no NaN leaves by /odometry.
#[test]
fn joint_velocities_that_are_no_numbers_are_refused() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    let mut odometry = Vec::new();
    let mut take = |output: Output| {
        let navigation = output.compensated.navigation;
        odometry.extend(navigation.map(|messages| format!("{:?}", messages.0)));
    };
    for number in 10..110 {
        let mut message = joints(number, 0.0);
        message.velocity[0] = if number % 2 == 0 { f64::NAN } else { 0.0 };
        compensator.joints(&message, &mut take);
        compensator.imu(&sample(number), &mut take);
    }
    assert!(odometry.len() > 90, "{}", odometry.len());
    let wrong: Vec<_> = odometry
        .iter()
        .filter(|told| told.contains("NaN"))
        .collect();
    assert!(wrong.is_empty(), "{} of them: {}", wrong.len(), wrong[0]);
    assert_eq!(compensator.inputs.joints.refused(), 50);
}

/// A hole in the stamps is told.
#[test]
fn gaps_are_told() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..100);
    feed(&mut compensator, 105..200);
    let report = format!("{:?}", compensator.imu_report());
    assert!(report.contains("1 gaps, 5 samples lost"), "{report}");
}

/// The tree stands from the first sample on, follows the joints, and has the ship in it once there is a solution: down the tree
/// the block's attitude is the one that `imu/data` carries.
#[test]
fn the_tree_of_frames_is_whole() {
    let mut compensator = compensator(1.0);
    compensator.transforms_due = Decimation::or_never(10.0);
    let mut outputs = Vec::new();
    for number in 0..60 {
        compensator.joints(&joints(number, 0.4), &mut |output| outputs.push(output));
        compensator.imu(&sample(number), &mut |output| outputs.push(output));
        if number == 30 {
            compensator.calibration(&calibration(25));
        }
    }
    let frames = |message: &TFMessage| {
        message
            .transforms
            .iter()
            .map(|t| format!("{} {}", t.header.frame_id, t.child_frame_id))
            .collect::<Vec<_>>()
    };
    let first = &outputs[0];
    assert_eq!(
        frames(first.fixed_transforms.as_ref().unwrap()),
        ["turntable_inner_link imu_link"]
    );
    assert_eq!(frames(first.transforms.as_ref().unwrap()).len(), 2);
    let fixed: Vec<_> = outputs
        .iter()
        .filter_map(|o| o.fixed_transforms.as_ref())
        .collect();
    assert_eq!(fixed.len(), 2, "once at the start, once with the origin");
    assert!(frames(fixed[1]).contains(&"earth map".to_owned()));
    let last = outputs
        .iter()
        .rev()
        .find(|o| o.transforms.is_some())
        .unwrap();
    let moving = last.transforms.as_ref().unwrap();
    let turn = |child: &str| {
        let found = moving.transforms.iter().find(|t| t.child_frame_id == child);
        found.unwrap().transform.rotation.rotation().unwrap()
    };
    let block = turn("base_link") * turn("turntable_outer_link") * turn("turntable_inner_link");
    let attitude = last
        .compensated
        .imu
        .as_ref()
        .unwrap()
        .orientation
        .rotation()
        .unwrap();
    assert!(block.angle_to(&attitude) < 1e-9);
}

/// Instruments are told heading, roll, pitch, rate of turn and place of the ship.
#[test]
fn instruments_are_told_of_the_ship() {
    let mut compensator = compensator(0.0);
    feed(&mut compensator, 0..10);
    compensator.calibration(&calibration(5));
    let outputs = feed(&mut compensator, 10..210);
    let motions: Vec<_> = outputs.iter().filter_map(|o| o.motion).collect();
    assert_eq!(motions.len(), 20, "10 Hz by the stamps");
    let last = motions.last().unwrap();
    let heading = last.heading_rad.sin().atan2(last.heading_rad.cos());
    assert!(heading.abs() < 1e-6 && last.roll_rad.abs() < 1e-6 && last.pitch_rad.abs() < 1e-6);
    assert!(
        last.turn_rate_rad_s.abs() < 1e-8,
        "{}",
        last.turn_rate_rad_s
    );
    assert!((last.latitude_rad.to_degrees() - LATITUDE_DEG).abs() < 1e-6);
}
