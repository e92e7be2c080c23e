//! A machine that is kept, killed and gone on with: what comes out is what an uninterrupted run with the same gap gives.
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::BTreeSet;

use nalgebra::UnitQuaternion;
use sins::earth::Position;
use sins::machines::self_calibration::{
    Event, ModelChoice, Phase, SelfCalibration, Settings, Snapshot, Thresholds,
};
use sins::simulation::{Run, SensorGrade, Simulator, SimulatorSettings, Tick};
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};

const RATE_HZ: f64 = 20.0;

/// What came, and how the block stood at the end.
struct Record {
    ticks: Vec<Tick>,
    attitude: UnitQuaternion<f64>,
}

/// The eight positions at 20 Hz, with a ring laser where the model has its errors; encoders are read at every second sample.
fn record(model: ModelChoice, hours: f64, seed: u64) -> Record {
    let mut settings = SimulatorSettings {
        seed,
        joint_state_rate_hz: RATE_HZ / 2.0,
        ..SimulatorSettings::default()
    };
    settings.plant.imu_rate_hz = RATE_HZ;
    if model == ModelChoice::Whole {
        let sensor = SensorGrade::RingLaser.draw(seed);
        settings.imu = sensor.imu;
        settings.plant.accelerometer_delay_s = sensor.imu.errors.accelerometer_delay_s;
    }
    let scheme = Scheme::eight_position();
    let program = scheme.program(settings.plant.turntable).unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    let mut run = Run::new(Simulator::new(settings).unwrap(), sequencer, hours * 3600.0);
    let ticks = run.by_ref().map(Result::unwrap).collect();
    let attitude = run.simulator().plant().attitude();
    Record { ticks, attitude }
}

fn feed(machine: &mut SelfCalibration, tick: &Tick) -> Vec<Event> {
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
    machine.push_imu(&tick.imu);
    std::iter::from_fn(|| machine.poll()).collect()
}

fn settings(model: ModelChoice) -> Settings {
    Settings {
        model,
        ..Settings::default()
    }
}

fn bytes(snapshot: &Snapshot) -> Vec<u8> {
    postcard::to_allocvec(snapshot).unwrap()
}

/// Kept as bytes, and gone on with.
fn killed(machine: SelfCalibration, settings: &Settings) -> SelfCalibration {
    let kept = bytes(&machine.snapshot());
    drop(machine);
    let snapshot: Snapshot = postcard::from_bytes(&kept).unwrap();
    SelfCalibration::resume(settings.clone(), snapshot).unwrap()
}

fn is_new_alignment(event: &Event) -> bool {
    matches!(
        event,
        Event::Restarted { .. } | Event::AlignmentFailed { .. }
    )
}

/// Killed while it gathers, in a dwell and in a rotation, for a gap within the rotation and one beyond it: the machine that goes on
/// is, to the last bit, the one that ran on and missed the same samples; it aligns nothing anew, and what it finds is as far
/// from the truth as its sigmas say.
#[test]
fn a_killed_run_loses_the_gap_alone() {
    for model in [ModelChoice::Paper, ModelChoice::Whole] {
        let settings = settings(model);
        let Record { ticks, attitude } = record(model, 1.0, 5);
        let at = |seconds: f64| (seconds * RATE_HZ) as usize;
        for (kill_s, gap_s) in [
            (150.0, 20.0),
            (700.0, 60.0),
            (510.05, 8.0),
            (511.0, 60.0),
            (1048.05, 300.0),
        ] {
            let hole = at(kill_s)..at(kill_s + gap_s);
            let mut whole = SelfCalibration::new(settings.clone()).unwrap();
            let mut machine = SelfCalibration::new(settings.clone()).unwrap();
            let mut crossed = 0;
            for (k, tick) in ticks.iter().enumerate() {
                if k == hole.start {
                    machine = killed(machine, &settings);
                }
                if hole.contains(&k) {
                    continue;
                }
                let events = feed(&mut whole, tick);
                assert_eq!(feed(&mut machine, tick), events, "{model} {kill_s} {k}");
                assert!(!events.iter().any(is_new_alignment), "{model} {kill_s} {k}");
                for event in events {
                    if let Event::HoleCrossed { sigma_rad, .. } = event {
                        crossed += 1;
                        println!("{model} {kill_s} {gap_s}: sigma {sigma_rad:.2e} rad");
                        // Encoders at 10 Hz in a turn, and a mooring that gives 6 arcsec a second.
                        assert!(sigma_rad < 4e-4 + 4e-5 * gap_s, "{kill_s}: {sigma_rad}");
                    }
                }
            }
            assert_eq!(crossed, u32::from(kill_s > 300.0));
            assert_eq!(bytes(&machine.snapshot()), bytes(&whole.snapshot()));
            let estimate = machine.finish().unwrap();
            assert_eq!(estimate, whole.finish().unwrap());
            assert_eq!(estimate.samples.counts.gaps, 1);
            let misalignment = -(estimate.navigation.attitude * attitude.inverse()).scaled_axis();
            let over = misalignment.component_div(&estimate.misalignment_sigma());
            println!("{model} {kill_s} {gap_s}: misalignment {over:?} sigmas");
            assert!(over.amax() < 4.0, "{model} {kill_s}: {over}");
            let verdict = estimate.verdict(&settings);
            assert_ne!(estimate.phase, Phase::Inconsistent, "{:?}", verdict.reasons);
        }
    }
}

/// Every key in a value, with what it stands in.
fn keys(value: &serde_json::Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        serde_json::Value::Object(map) => {
            for (key, value) in map {
                let path = format!("{path}.{key}");
                keys(value, &path, found);
                found.insert(path);
            }
        }
        serde_json::Value::Array(list) => {
            for value in list {
                keys(value, path, found);
            }
        }
        _ => {}
    }
}

/// What is in a snapshot belongs to its version: whoever adds, removes or renames a field has to raise [`Snapshot::VERSION`], because
/// bytes of the version before would be read as something else.
#[test]
fn the_version_belongs_to_what_is_kept() {
    let mut found = BTreeSet::new();
    for model in [ModelChoice::Paper, ModelChoice::Whole] {
        let settings = settings(model);
        let mut machine = SelfCalibration::new(settings).unwrap();
        for (k, tick) in record(model, 0.2, 5).ticks.iter().enumerate() {
            feed(&mut machine, tick);
            if k % 3000 == 0 {
                let json = serde_json::to_value(machine.snapshot()).unwrap();
                keys(&json, "", &mut found);
            }
        }
    }
    let all: Vec<String> = found.into_iter().collect();
    // FNV-1a.
    let hash = all
        .join("\n")
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    println!("{} keys", all.len());
    assert_eq!(
        (Snapshot::VERSION, hash),
        (2, 9_449_212_933_611_951_608),
        "{} keys",
        all.len()
    );
}

/// Numbers that no filter holds are refused, whatever a checksum says; other settings are refused by name, thresholds may differ.
#[test]
fn what_cannot_be_is_refused() {
    let settings = settings(ModelChoice::Whole);
    let mut machine = SelfCalibration::new(settings.clone()).unwrap();
    for tick in &record(ModelChoice::Whole, 0.15, 5).ticks {
        feed(&mut machine, tick);
    }
    let kept = bytes(&machine.snapshot());
    let resume = |kept: &[u8], settings: &Settings| {
        let snapshot = postcard::from_bytes(kept).map_err(|error| error.to_string())?;
        SelfCalibration::resume(settings.clone(), snapshot)
            .map(drop)
            .map_err(|error| error.to_string())
    };
    let asked = Settings {
        thresholds: Thresholds::NONE,
        ..settings.clone()
    };
    resume(&kept, &asked).unwrap();
    let other = Settings {
        window_updates: 200,
        ..settings.clone()
    };
    let told = resume(&kept, &other).unwrap_err();
    assert!(
        told.contains("window_updates: 300") && told.contains("window_updates: 200"),
        "{told}"
    );

    let estimate = machine.last().unwrap();
    let navigation = &estimate.navigation;
    for (what, number, instead) in [
        (
            "variance",
            estimate.covariance().matrix()[(4, 4)],
            f64::INFINITY,
        ),
        ("variance", estimate.covariance().matrix()[(9, 9)], -1e-9),
        ("latitude", navigation.position.latitude_rad, 1.66),
        ("attitude", navigation.attitude.i, 7.0),
        ("velocity", navigation.velocity.x, f64::NAN),
        ("drift", estimate.gyroscope_drift().x, f64::NAN),
    ] {
        let (number, instead) = (number.to_le_bytes(), instead.to_le_bytes());
        let mut damaged = kept.clone();
        let places: Vec<usize> = (0..kept.len() - 8)
            .filter(|at| kept[*at..at + 8] == number)
            .collect();
        assert!(!places.is_empty(), "{what}");
        for at in places {
            damaged[at..at + 8].copy_from_slice(&instead);
        }
        let told = resume(&damaged, &settings);
        assert!(told.is_err(), "{what}");
    }
}
