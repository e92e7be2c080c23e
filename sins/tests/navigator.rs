//! The navigator as a machine: jumps, holes under way, velocities in its own alignment, and samples that wait while it takes over.
#![allow(clippy::unwrap_used, missing_docs)]

use nalgebra::{UnitQuaternion, Vector3};
use sins::Stamp;
use sins::earth::{LocalEarth, Position};
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::{MISALIGNMENT, POSITION, VELOCITY};
use sins::estimation::state::NamedCovariance;
use sins::machines::navigator::{
    Navigator, NavigatorEvent, NavigatorOutput, NavigatorPhase, NavigatorSettings,
};
use sins::machines::self_calibration::{Calibration, Phase, Reference, Settings};
use sins::sensor::{ImuSample, SensorErrors, VelocityMeasurement};
use sins::stream::order::EpochCause;
use sins::table::{JointSample, TableErrors, Turntable};

const RATE_HZ: i64 = 20;
const INTERVAL_S: f64 = 1.0 / RATE_HZ as f64;
/// How she gathers way \[m/s²\].
const ACCELERATION_M_S2: f64 = 0.25;

/// A ship that lies level, her block's axes East, North and Up; at some time she gathers way northwards for a while.
struct Ship {
    start: Position,
    east_m_s: f64,
    departs_s: f64,
    gathers_for_s: f64,
}

impl Ship {
    fn moored(start: Position) -> Self {
        Self {
            start,
            east_m_s: 0.0,
            departs_s: f64::INFINITY,
            gathers_for_s: 0.0,
        }
    }

    fn gathering_s(&self, t: f64) -> f64 {
        (t - self.departs_s).clamp(0.0, self.gathers_for_s)
    }

    fn velocity(&self, t: f64) -> Vector3<f64> {
        let north = ACCELERATION_M_S2 * self.gathering_s(t);
        Vector3::new(self.east_m_s, north, 0.0)
    }

    fn north_m(&self, t: f64) -> f64 {
        let gathering = self.gathering_s(t);
        let steady = (t - self.departs_s - self.gathers_for_s).max(0.0);
        ACCELERATION_M_S2 * gathering * (0.5 * gathering + steady)
    }

    /// The sample with this number; the sensors average over the interval that it ends.
    fn sample(&self, number: i64) -> ImuSample {
        let t = (number as f64 - 0.5) * INTERVAL_S;
        let velocity = self.velocity(t);
        let mut place = self.start;
        let radius_m = LocalEarth::at(place.latitude_rad, place.height_m).meridian_radius_m;
        place.latitude_rad += self.north_m(t) / radius_m;
        let earth = LocalEarth::at(place.latitude_rad, place.height_m);
        let transport = Vector3::new(
            -velocity.y / earth.meridian_radius_m,
            velocity.x / earth.transverse_radius_m,
            velocity.x / earth.transverse_radius_m * place.latitude_rad.tan(),
        );
        let gained = self.velocity(t + 0.5 * INTERVAL_S) - self.velocity(t - 0.5 * INTERVAL_S);
        let coriolis = (2.0 * earth.earth_rate() + transport).cross(&velocity);
        let mut sample = ImuSample::at_rest(stamp(number), earth.gravity_m_s2);
        sample.angular_rate = earth.earth_rate() + transport;
        sample.specific_force += gained / INTERVAL_S + coriolis;
        sample
    }
}

fn stamp(number: i64) -> Stamp {
    Stamp::from_nanos(1_000_000_000_000 + number * (1_000_000_000 / RATE_HZ))
}

fn number(seconds: i64) -> i64 {
    seconds * RATE_HZ
}

fn place() -> Position {
    Position::from_degrees(45.0, 126.6, 0.0)
}

/// Every state known to this one-sigma.
fn known(sigma: f64) -> NamedCovariance {
    let navigation = POSITION.into_iter().chain(VELOCITY).chain(MISALIGNMENT);
    let sensors = ACCELEROMETER_BIAS.into_iter().chain(GYROSCOPE_DRIFT);
    NamedCovariance::from_sigmas(navigation.chain(sensors).map(|name| (name, sigma))).unwrap()
}

/// A calibration of sensors without errors.
fn calibration(at: i64, position: Position) -> Calibration {
    Calibration {
        stamp: stamp(at),
        phase: Phase::Converged,
        errors: SensorErrors::default(),
        table: TableErrors::default(),
        attitude: UnitQuaternion::identity(),
        position,
        covariance: known(1e-8),
        samples: 1_440_000,
        gaps: 0,
    }
}

/// An alignment of a minute, to keep the tests short.
fn settings() -> NavigatorSettings {
    NavigatorSettings {
        alignment: Settings {
            coarse_alignment_s: 60.0,
            ..Settings::default()
        },
        alignment_s: 70.0,
        ..NavigatorSettings::default()
    }
}

fn joints(at: i64) -> JointSample {
    JointSample {
        stamp: stamp(at),
        position: [0.0; 2],
        velocity: [0.0; 2],
    }
}

fn events(navigator: &mut Navigator) -> Vec<NavigatorEvent> {
    std::iter::from_fn(|| navigator.poll()).collect()
}

fn outputs(events: &[NavigatorEvent]) -> Vec<NavigatorOutput> {
    let output = |event: &NavigatorEvent| match event {
        NavigatorEvent::Sample { output, .. } => output.as_deref().cloned(),
        _ => None,
    };
    events.iter().filter_map(output).collect()
}

/// After the clock was set back she is aligned where the newest fix says, not where the first one or the calibration said.
#[test]
fn a_jump_goes_on_from_the_newest_position() {
    let mut navigator = Navigator::new(settings()).unwrap();
    let first = Ship::moored(place());
    let there = Position::from_degrees(46.0, 126.6, 0.0);
    let second = Ship::moored(there);
    navigator.push_position(place()).unwrap();
    for k in 0..number(10) {
        navigator.push_imu(&first.sample(k));
        if k == number(5) {
            navigator
                .push_calibration(calibration(k - 20, place()))
                .unwrap();
        }
    }
    assert!(!outputs(&events(&mut navigator)).is_empty());
    navigator.push_position(there).unwrap();
    // The stamps go back by 200 s.
    for k in number(-190)..number(-100) {
        navigator.push_imu(&second.sample(k));
    }
    navigator.end();
    let after = events(&mut navigator);
    let is_restart = |event: &&NavigatorEvent| matches!(event, NavigatorEvent::Restarted { .. });
    assert_eq!(after.iter().filter(is_restart).count(), 1);
    let last = outputs(&after).pop().unwrap();
    for solution in [last.compensated, last.uncompensated] {
        let off_m = there.offset_m(&solution.navigation.position).norm();
        assert!(off_m < 10.0, "{off_m} m from the newest fix");
    }
}

/// The clock is set back by 4 s while the table turns, less than what is bridged: no interval is made of it. Its own alignment begins
/// anew, once, and knows the attitude of the block that went on turning.
#[test]
fn a_clock_set_back_in_a_turn_is_no_interval() {
    const TURN_RAD_S: f64 = 0.1;
    let axis = Turntable::default().outer.unit();
    let ship = Ship::moored(place());
    // What really happened by this number, whatever its stamp says.
    let turned = |t: f64| UnitQuaternion::from_scaled_axis(axis * (TURN_RAD_S * t));
    let turning = |k: i64, set_back: i64| {
        let mut sample = ship.sample(k);
        let in_block = turned((k as f64 - 0.5) * INTERVAL_S).inverse();
        sample.angular_rate = in_block * sample.angular_rate + axis * TURN_RAD_S;
        sample.specific_force = in_block * sample.specific_force;
        sample.stamp = stamp(k - set_back);
        let joints = JointSample {
            stamp: sample.stamp,
            position: [TURN_RAD_S * k as f64 * INTERVAL_S, 0.0],
            velocity: [TURN_RAD_S, 0.0],
        };
        (sample, joints)
    };
    let mut navigator = Navigator::new(settings()).unwrap();
    navigator.push_position(place()).unwrap();
    let mut all = Vec::new();
    let at = number(20);
    for k in 0..number(120) {
        let (sample, joints) = turning(k, if k < at { 0 } else { number(4) });
        navigator.push_joints(joints).unwrap();
        navigator.push_imu(&sample);
        if k == number(5) {
            let taken = Calibration {
                attitude: turned((k - 20) as f64 * INTERVAL_S),
                ..calibration(k - 20, place())
            };
            navigator.push_calibration(taken).unwrap();
        }
        all.extend(events(&mut navigator));
    }
    navigator.end();
    all.extend(events(&mut navigator));
    let causes: Vec<_> = all
        .iter()
        .filter_map(|event| match event {
            NavigatorEvent::Restarted { cause, .. } => Some(*cause),
            NavigatorEvent::HoleCrossed { .. } | NavigatorEvent::Refused(_) => panic!("{event:?}"),
            _ => None,
        })
        .collect();
    assert!(
        matches!(causes[..], [EpochCause::SetBack { seconds }] if (seconds - 4.0).abs() < 0.1),
        "{causes:?}"
    );
    for output in outputs(&all) {
        let since_start_s = output.stamp.seconds_since(stamp(0));
        let solutions = [&output.compensated, &output.uncompensated];
        assert!(
            solutions.iter().all(|s| s.navigation.velocity.norm() < 0.1),
            "{since_start_s} s"
        );
    }
    let last = outputs(&all).pop().unwrap();
    assert_eq!(last.stamp, stamp(number(116) - 1));
    let block = turned((number(120) - 1) as f64 * INTERVAL_S);
    let off_rad = last.compensated.navigation.attitude.angle_to(&block);
    assert!(off_rad < 2e-3, "{off_rad} rad");
}

/// The encoders tell what the table turned in a hole, not what the ship did: `longest_hole_s` ends the navigation all the same.
#[test]
fn the_longest_hole_counts_whatever_the_encoders_tell() {
    for (seconds, restarts) in [(290, 0), (310, 1)] {
        let ship = Ship::moored(place());
        let mut navigator = Navigator::new(settings()).unwrap();
        navigator.push_position(place()).unwrap();
        let mut all = Vec::new();
        for k in (0..number(10)).chain(number(10 + seconds)..number(20 + seconds)) {
            navigator.push_joints(joints(k)).unwrap();
            navigator.push_imu(&ship.sample(k));
            if k == number(5) {
                let calibration = calibration(k - 20, place());
                navigator.push_calibration(calibration).unwrap();
            }
            all.extend(events(&mut navigator));
        }
        let is_restart =
            |event: &&NavigatorEvent| matches!(event, NavigatorEvent::Restarted { .. });
        assert_eq!(
            all.iter().filter(is_restart).count(),
            restarts,
            "{seconds} s"
        );
    }
}

/// A minute without samples under way: no alignment; course and speed are kept, and the covariance grows by what a ship does.
#[test]
fn a_hole_under_way_keeps_course_and_speed() {
    let ship = Ship {
        departs_s: 10.0,
        gathers_for_s: 20.0,
        ..Ship::moored(place())
    };
    let mut navigator = Navigator::new(settings()).unwrap();
    navigator.push_position(place()).unwrap();
    let feed = |numbers: std::ops::Range<i64>, navigator: &mut Navigator| {
        for k in numbers {
            navigator.push_joints(joints(k)).unwrap();
            navigator.push_imu(&ship.sample(k));
            if k == number(5) {
                navigator
                    .push_calibration(calibration(k - 20, place()))
                    .unwrap();
            }
        }
        events(navigator)
    };
    let before = feed(0..number(40), &mut navigator);
    let before = outputs(&before).pop().unwrap();
    let after = feed(number(100)..number(105), &mut navigator);
    let crossed: Vec<_> = after
        .iter()
        .filter_map(|event| match event {
            NavigatorEvent::HoleCrossed { seconds, held, .. } => Some((*seconds, *held)),
            NavigatorEvent::Sample { .. } => None,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(crossed.len(), 1);
    assert!(
        crossed[0].1 && (crossed[0].0 - 60.05).abs() < 1e-6,
        "{crossed:?}"
    );
    assert_eq!(navigator.phase(), NavigatorPhase::Navigating);

    let after = outputs(&after).pop().unwrap();
    let t = after.stamp.seconds_since(stamp(0));
    let navigation = &after.compensated.navigation;
    let sailed_m = place().offset_m(&navigation.position);
    let expected_m = ship.north_m(t);
    assert!((expected_m - 422.0).abs() < 10.0, "{expected_m} m");
    assert!(
        (sailed_m.y - expected_m).abs() < 1.0,
        "{sailed_m} {expected_m}"
    );
    assert!(sailed_m.x.abs() < 1.0, "{sailed_m}");
    assert!((navigation.velocity - ship.velocity(t)).norm() < 0.02);
    assert!(navigation.attitude.angle() < 1e-3);

    // A speed that changes by 0.05 m/s a second, and a heading that turns by 0.01 rad a second, for a minute.
    let sigma =
        |output: &NavigatorOutput, state: &str| output.compensated.covariance.sigma(state).unwrap();
    assert!(sigma(&before, VELOCITY[0]) < 0.01);
    assert!((sigma(&after, VELOCITY[0]) / 3.0 - 1.0).abs() < 0.2);
    let heading = MISALIGNMENT[2];
    assert!(sigma(&before, heading) < 1e-3);
    assert!((sigma(&after, heading) / 0.6 - 1.0).abs() < 0.1);
    let north_m = sigma(&after, POSITION[0]) * LocalEarth::at(0.8, 0.0).meridian_radius_m;
    assert!((180.0..220.0).contains(&north_m), "{north_m} m");
}

/// Told that velocities are measured, its alignment takes them: she drifts, and the solution starts with her drift. Without them it
/// starts at zero, and knows no better than its prior.
#[test]
fn its_alignment_takes_measured_velocities() {
    let ship = Ship {
        east_m_s: 0.05,
        ..Ship::moored(place())
    };
    let run = |measured: bool| {
        let mut settings = settings();
        settings.alignment.reference = Reference::Measured { patience_s: 0.5 };
        settings.alignment.prior.velocity_m_s = 0.5;
        let mut navigator = Navigator::new(settings).unwrap();
        navigator.push_position(place()).unwrap();
        navigator
            .push_calibration(calibration(-1000, place()))
            .unwrap();
        assert_eq!(navigator.phase(), NavigatorPhase::Aligning);
        for k in 0..number(100) {
            if measured && k % RATE_HZ == 0 {
                let measurement = VelocityMeasurement {
                    east_north: [ship.east_m_s, 0.0],
                    sigma: [0.01; 2],
                };
                navigator.push_velocity(stamp(k), measurement).unwrap();
            }
            navigator.push_imu(&ship.sample(k));
        }
        navigator.end();
        let first = outputs(&events(&mut navigator)).remove(0);
        (
            first.compensated.navigation.velocity.x,
            first.compensated.covariance.sigma(VELOCITY[0]).unwrap(),
        )
    };
    let ((with_m_s, with_sigma), (without_m_s, without_sigma)) = (run(true), run(false));
    println!("{with_m_s} ± {with_sigma} m/s, {without_m_s} ± {without_sigma} m/s without");
    assert!((with_m_s - ship.east_m_s).abs() < 0.005, "{with_m_s} m/s");
    assert!(with_sigma < 0.01, "{with_sigma} m/s");
    assert!(without_sigma > 0.4, "{without_sigma} m/s");
}

/// Samples that wait for their joint states while navigation begins, from a calibration or from its own alignment, are
/// integrated: she departs in just that moment, and the solution is to the bit that of a navigator that never waited.
#[test]
fn samples_that_wait_are_integrated() {
    for start_from_calibration in [true, false] {
        let departs_s = if start_from_calibration { 4 } else { 70 };
        let ship = Ship {
            departs_s: departs_s as f64,
            gathers_for_s: 10.0,
            ..Ship::moored(place())
        };
        let run = |late: i64| {
            let mut navigator = Navigator::new(NavigatorSettings {
                start_from_calibration,
                joint_patience_s: 0.5,
                ..settings()
            })
            .unwrap();
            navigator.push_position(place()).unwrap();
            navigator.push_joints(joints(0)).unwrap();
            let mut heard = Vec::new();
            let mut waited = 0;
            for k in 0..number(departs_s + 10) {
                let before = navigator.phase();
                navigator.push_imu(&ship.sample(k));
                if k >= late {
                    navigator.push_joints(joints(k - late)).unwrap();
                }
                if k == number(5) {
                    navigator
                        .push_calibration(calibration(number(4), place()))
                        .unwrap();
                }
                heard.extend(events(&mut navigator));
                if before != navigator.phase() && navigator.phase() == NavigatorPhase::Navigating {
                    waited = navigator.stream().waiting();
                }
            }
            navigator.end();
            heard.extend(events(&mut navigator));
            (outputs(&heard), waited)
        };
        let ((prompt, few), (waiting, many)) = (run(0), run(8));
        assert!(many >= few + 8, "{few} and {many} samples waited");
        let (last, same) = (prompt.last().unwrap(), waiting.last().unwrap());
        assert_eq!(last.compensated, same.compensated);
        let t = last.stamp.seconds_since(stamp(0));
        let off = (last.compensated.navigation.velocity - ship.velocity(t)).norm();
        assert!(off < 0.02, "{off} m/s");
    }
}
