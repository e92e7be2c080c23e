//! What a stream can do wrong, through the whole machines: nothing that was known is lost, nothing is believed that cannot be.
#![allow(clippy::unwrap_used, missing_docs)]

use nalgebra::Vector3;
use sins::earth::Position;
use sins::machines::self_calibration::{
    Estimate, Event, ModelChoice, Phase, Reference, SelfCalibration, Settings,
};
use sins::sensor::VelocityMeasurement;
use sins::simulation::{Run, Simulator, SimulatorSettings, Tick};
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};
use sins::units::{DEG_PER_HOUR, MICRO_G};

const RATE_HZ: f64 = 20.0;

/// The eight positions at 20 Hz with encoders at 20 Hz.
fn ticks(hours: f64, seed: u64) -> Vec<Tick> {
    let mut settings = SimulatorSettings {
        seed,
        joint_state_rate_hz: RATE_HZ,
        ..SimulatorSettings::default()
    };
    settings.plant.imu_rate_hz = RATE_HZ;
    let program = Scheme::eight_position()
        .program(settings.plant.turntable)
        .unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    Run::new(Simulator::new(settings).unwrap(), sequencer, hours * 3600.0)
        .map(Result::unwrap)
        .collect()
}

struct Outcome {
    machine: SelfCalibration,
    estimate: Estimate,
    events: Vec<Event>,
}

impl Outcome {
    fn restarts(&self) -> usize {
        let is_restart = |event: &&Event| matches!(event, Event::Restarted { .. });
        self.events.iter().filter(is_restart).count()
    }

    /// Drifts and biases lie within 4 of their own sigmas of the truth (Table 1).
    fn assert_true(&self) {
        let drift = (self.estimate.gyroscope_drift() - Vector3::repeat(0.01 * DEG_PER_HOUR))
            .component_div(&self.estimate.gyroscope_drift_sigma());
        let bias = (self.estimate.accelerometer_bias() - Vector3::repeat(100.0 * MICRO_G))
            .component_div(&self.estimate.accelerometer_bias_sigma());
        assert!(drift.amax() < 4.0 && bias.amax() < 4.0, "{drift} {bias}");
    }

    fn worst_drift_sigma(&self) -> f64 {
        self.estimate.gyroscope_drift_sigma().max() / DEG_PER_HOUR
    }
}

/// Runs ticks through a machine; `alter` may change a tick, or leave out its sample.
fn run(
    settings: &Settings,
    ticks: &[Tick],
    mut alter: impl FnMut(usize, &mut Tick) -> bool,
) -> Outcome {
    let mut machine = SelfCalibration::new(settings.clone()).unwrap();
    let mut events = Vec::new();
    for (k, tick) in ticks.iter().enumerate() {
        let mut tick = *tick;
        let has_sample = alter(k, &mut tick);
        if let Some(fix) = tick.position {
            let position = Position {
                latitude_rad: fix.latitude_rad,
                longitude_rad: fix.longitude_rad,
                height_m: fix.height_m,
            };
            machine.push_position(position).unwrap();
        }
        if let Some(joints) = tick.joints {
            machine.push_joints(joints).unwrap();
        }
        if has_sample {
            machine.push_imu(&tick.imu);
        }
        events.extend(std::iter::from_fn(|| machine.poll()));
    }
    let estimate = machine.finish().unwrap();
    events.extend(std::iter::from_fn(|| machine.poll()));
    Outcome {
        machine,
        estimate,
        events,
    }
}

/// One bad stamp late in a run (zero, an hour off, ten seconds ahead) loses one sample and nothing else.
#[test]
fn a_bad_stamp_loses_one_sample() {
    let ticks = ticks(0.5, 1);
    let good = run(&Settings::default(), &ticks, |_, _| true);
    let at = ticks.len() * 4 / 5;
    for seconds in [3600.0, -3600.0, 10.0, f64::NAN] {
        let bad = run(&Settings::default(), &ticks, |k, tick| {
            if k == at {
                tick.imu.stamp = if seconds.is_nan() {
                    sins::Stamp::default()
                } else {
                    tick.imu.stamp.plus_seconds(seconds)
                };
            }
            true
        });
        let counts = bad.estimate.samples.counts;
        assert_eq!((counts.alone, counts.lost, counts.restarts), (1, 1, 0));
        assert_eq!(counts.samples + 1, good.estimate.samples.counts.samples);
        assert!((bad.estimate.duration_s - good.estimate.duration_s).abs() < 1e-9);
        assert!(bad.worst_drift_sigma() < 1.01 * good.worst_drift_sigma());
    }
}

/// A hole of 6 s forgets nothing: the encoders tell what was turned in it, and the run goes on without an alignment. Without encoders
/// the attitude is found anew, and what is known of the sensors is kept.
#[test]
fn a_hole_forgets_nothing() {
    let ticks = ticks(2.0, 2);
    let settings = Settings::default();
    let rate = RATE_HZ as usize;
    // In the middle of a turn, and at rest.
    for at in [505 * rate, 5400 * rate] {
        let in_hole = move |k: usize| (at..at + 6 * rate).contains(&k);
        let told = run(&settings, &ticks, |k, _| !in_hole(k));
        assert_eq!(told.restarts(), 0, "hole at {at}");
        assert_eq!(told.estimate.samples.counts.gaps, 1);
        // At rest the rates at both ends are the surer way; in a turn the encoders are.
        let is_turning = at == 505 * rate;
        let crossed =
            |event: &Event| matches!(event, Event::HoleCrossed { held, .. } if *held == is_turning);
        assert!(told.events.iter().any(crossed), "{at}");
        told.assert_true();
        assert!(told.estimate.duration_s > 7190.0);
    }
    let at = 5400 * rate;
    let blind = run(&settings, &ticks, |k, tick| {
        tick.joints = None;
        !(at..at + 6 * rate).contains(&k)
    });
    assert_eq!(blind.restarts(), 1);
    blind.assert_true();
    let whole = run(&settings, &ticks, |_, _| true);
    // The half hour after the hole alone would leave ten times as much.
    assert!(
        blind.worst_drift_sigma() < 1.5 * whole.worst_drift_sigma(),
        "{} {}",
        blind.worst_drift_sigma(),
        whole.worst_drift_sigma()
    );
}

/// A turn in a hole of less than 5 s, with rest at both of its ends: the encoders say what was turned, and without them the estimate
/// knows that it does not know.
#[test]
fn a_turn_in_a_hole_is_told_or_doubted() {
    let ticks = ticks(0.4, 3);
    let settings = Settings::default();
    let rate = RATE_HZ as usize;
    // The block is turned by hand, 5 deg about x, while no samples come.
    let at = 400 * rate;
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 5f64.to_radians());
    for told in [true, false] {
        let mut before = None;
        let outcome = run(&settings, &ticks[..480 * rate], |k, tick| {
            let is_after = k >= at + 4 * rate;
            if is_after {
                tick.imu.angular_rate = turn.inverse() * tick.imu.angular_rate;
                tick.imu.specific_force = turn.inverse() * tick.imu.specific_force;
            }
            if !told {
                tick.joints = None;
            } else if let Some(joints) = &mut tick.joints
                && k >= at + 2 * rate
            {
                joints.position[0] += 5f64.to_radians();
            }
            before.get_or_insert(k);
            !(at..at + 4 * rate).contains(&k)
        });
        assert_eq!(outcome.restarts(), 0);
        let sigma = outcome.events.iter().find_map(|event| match event {
            Event::HoleCrossed {
                sigma_rad, held, ..
            } => Some((*sigma_rad, *held)),
            _ => None,
        });
        let (sigma_rad, held) = sigma.unwrap();
        assert_eq!(held, told);
        assert_eq!(sigma_rad < 1e-3, told, "{sigma_rad}");
        assert_ne!(outcome.estimate.phase, Phase::Inconsistent, "told: {told}");
    }
}

/// A clock that is set back by 4 s in a turn is a new epoch, never an interval: the attitude is found anew and the sensors are kept.
#[test]
fn a_clock_set_back_in_a_turn_is_no_interval() {
    let ticks = ticks(1.2, 4);
    let rate = RATE_HZ as usize;
    let at = 520 * rate;
    let outcome = run(&Settings::default(), &ticks, |k, tick| {
        if k >= at {
            tick.imu.stamp = tick.imu.stamp.plus_seconds(-4.0);
            if let Some(joints) = &mut tick.joints {
                joints.stamp = joints.stamp.plus_seconds(-4.0);
            }
        }
        true
    });
    assert_eq!(outcome.restarts(), 1);
    assert_eq!(outcome.estimate.samples.counts.restarts, 1);
    assert_eq!(
        outcome.estimate.samples.counts.samples,
        ticks.len() as u64,
        "counts go on"
    );
    outcome.assert_true();
}

/// What no sensor gives is refused, counted and told; the estimate is what it is without those samples, and never NaN.
#[test]
fn wild_samples_leave_no_trace() {
    let ticks = ticks(0.5, 5);
    let wild = |k: usize| k > 4000 && k.is_multiple_of(3000);
    let altered = run(&Settings::default(), &ticks, |k, tick| {
        if wild(k) {
            match k / 3000 % 4 {
                0 => tick.imu.angular_rate.x = 1e30,
                1 => tick.imu.angular_rate.y += 1.0,
                2 => tick.imu.specific_force.z = f64::NAN,
                _ => tick.imu.angular_rate_variance.x = f64::NAN,
            }
        }
        true
    });
    let estimate = &altered.estimate;
    assert!(estimate.covariance().matrix().iter().all(|v| v.is_finite()));
    assert!(
        estimate
            .covariance()
            .sigmas()
            .iter()
            .all(|sigma| *sigma > 0.0)
    );
    let counts = estimate.samples.counts;
    assert!(counts.beyond_range > 0 && counts.spikes > 0 && counts.not_finite > 0);
    let told = |event: &&Event| matches!(event, Event::Refused(_));
    assert_eq!(
        altered.events.iter().filter(told).count() as u64,
        counts.refused()
    );
    altered.assert_true();
}

/// Half of the samples with a stamp that stands still: whatever the sigmas say, this is not converged, and the reason is said.
#[test]
fn half_of_the_samples_refused_is_not_converged() {
    let ticks = ticks(0.4, 6);
    let mut still = None;
    let outcome = run(&Settings::default(), &ticks, |k, tick| {
        if k.is_multiple_of(2) {
            still = Some(tick.imu.stamp);
        } else if let Some(stamp) = still {
            tick.imu.stamp = stamp;
        }
        true
    });
    let counts = outcome.estimate.samples.counts;
    assert_eq!(counts.repeated, ticks.len() as u64 / 2);
    let verdict = outcome.estimate.verdict(outcome.machine.settings());
    assert!(!verdict.converged && !verdict.samples);
    assert!(
        verdict.reasons.iter().any(|r| r.contains("refused")),
        "{verdict:?}"
    );
}

/// A source that plays its record again, with measured velocities: they are used in every round, and those that were missing are
/// counted as they were.
#[test]
fn a_looped_source_keeps_its_velocities() {
    let ticks = ticks(0.15, 7);
    let settings = Settings {
        reference: Reference::Measured { patience_s: 2.0 },
        ..Settings::default()
    };
    let mut machine = SelfCalibration::new(settings).unwrap();
    let mut estimates = 0;
    let place = Position::from_degrees(45.78, 126.67, 0.0);
    machine.push_position(place).unwrap();
    for round in 0..3 {
        let before = estimates;
        for (k, tick) in ticks.iter().enumerate() {
            machine.push_imu(&tick.imu);
            if k % 20 == 7 {
                let measured = VelocityMeasurement {
                    east_north: [0.0; 2],
                    sigma: [0.01; 2],
                };
                machine.push_velocity(tick.imu.stamp, measured).unwrap();
            }
            while let Some(event) = machine.poll() {
                estimates += usize::from(matches!(event, Event::Estimate(_)));
            }
        }
        // 540 s, of which 300 are gathered first.
        assert!(estimates - before > 230, "round {round}: {estimates}");
    }
    let samples = machine.samples();
    assert_eq!(samples.counts.restarts, 2);
    assert!(samples.missing_velocities <= 9, "{samples:?}");
}

/// A machine that was reset is a fresh one, but for what it counted: the same samples give the same estimate to the last bit.
#[test]
fn reset_is_a_fresh_machine() {
    let ticks = ticks(0.3, 8);
    let place = Position::from_degrees(45.78, 126.67, 0.0);
    let feed = |machine: &mut SelfCalibration| {
        for tick in &ticks {
            machine.push_imu(&tick.imu);
            while machine.poll().is_some() {}
        }
        machine.finish().unwrap()
    };
    let mut fresh = SelfCalibration::new(Settings::default()).unwrap();
    fresh.push_position(place).unwrap();
    let expected = feed(&mut fresh);
    let mut used = SelfCalibration::new(Settings::default()).unwrap();
    used.push_position(place).unwrap();
    for tick in &ticks[..9000] {
        let mut sample = tick.imu;
        sample.specific_force.x += 0.001;
        sample.stamp = sample.stamp.plus_seconds(-1e6);
        used.push_imu(&sample);
        while used.poll().is_some() {}
    }
    used.reset();
    let found = feed(&mut used);
    assert_eq!(found.states, expected.states);
    assert_eq!(found.navigation, expected.navigation);
    assert_eq!(found.innovations, expected.innovations);
}

/// In which order topics arrive does not matter, as it does not through DDS: joint states that come 25 s after the samples of
/// their time give the same estimate to the last bit, whatever the model.
#[test]
fn arrival_does_not_matter() {
    let ticks = ticks(0.5, 12);
    for model in [ModelChoice::Paper, ModelChoice::Whole] {
        let settings = Settings {
            model,
            reference: Reference::Auto {
                sigma_m_s: 0.01,
                patience_s: 30.0,
            },
            ..Settings::default()
        };
        let in_time = run(&settings, &ticks, |_, _| true).estimate;
        let late = delayed(&ticks, 500);
        let late = run(&settings, &late, |k, _| k < ticks.len()).estimate;
        assert_eq!(in_time.states, late.states, "{model:?}");
        assert_eq!(in_time.navigation, late.navigation, "{model:?}");
        assert_eq!(in_time.stamp, late.stamp, "{model:?}");
        let verdict = |estimate: &Estimate| estimate.verdict(&settings);
        assert_eq!(verdict(&in_time), verdict(&late), "{model:?}");
    }
}

/// The same, but joint states come so many ticks after their samples. The first minute is in time: an alignment begins by itself.
fn delayed(ticks: &[Tick], by: usize) -> Vec<Tick> {
    let in_time = 1200;
    let mut late = ticks.to_vec();
    for k in (in_time..ticks.len()).rev() {
        late[k].joints = (k >= in_time + by).then(|| ticks[k - by].joints).flatten();
    }
    // What is on its way at the end arrives at the end.
    late.extend(ticks[ticks.len() - by..].iter().copied());
    late
}
