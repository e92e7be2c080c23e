//! Four hours at 100 Hz through the machines, in memory: `cargo bench -p sins`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use sins::earth::Position;
use sins::machines::self_calibration::{ModelChoice, SelfCalibration, Settings};
use sins::simulation::{Run, Simulator, SimulatorSettings, Tick};
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};

fn simulation() -> Run {
    let settings = SimulatorSettings::default();
    let program = Scheme::eight_position()
        .program(settings.plant.turntable)
        .unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    Run::new(Simulator::new(settings).unwrap(), sequencer, 4.0 * 3600.0)
}

/// Everything through a machine of this model, with the judge's second filter or without it.
fn calibrate(ticks: &[Tick], model: ModelChoice, witness: bool) {
    let settings = Settings {
        model,
        witness,
        ..Settings::default()
    };
    let mut machine = SelfCalibration::new(settings).unwrap();
    machine
        .push_position(Position {
            latitude_rad: 0.8,
            longitude_rad: 2.2,
            height_m: 0.0,
        })
        .unwrap();
    for tick in ticks {
        if let Some(joints) = tick.joints {
            machine.push_joints(joints).unwrap();
        }
        machine.push_imu(&tick.imu);
        while let Some(event) = machine.poll() {
            black_box(event);
        }
    }
}

fn pipeline(criterion: &mut Criterion) {
    let ticks: Vec<Tick> = simulation().map(Result::unwrap).collect();
    let mut group = criterion.benchmark_group("4 h at 100 Hz");
    group.sample_size(10);
    group.bench_function("thirteen states, no witness", |b| {
        b.iter(|| calibrate(&ticks, ModelChoice::Paper, false));
    });
    group.bench_function("thirteen states", |b| {
        b.iter(|| calibrate(&ticks, ModelChoice::Paper, true));
    });
    group.bench_function("whole model with encoders, no witness", |b| {
        b.iter(|| calibrate(&ticks, ModelChoice::Whole, false));
    });
    group.bench_function("whole model with encoders", |b| {
        b.iter(|| calibrate(&ticks, ModelChoice::Whole, true));
    });
    group.bench_function("simulation", |b| {
        b.iter(|| {
            simulation()
                .map(|tick| tick.unwrap().imu.angular_rate.x)
                .sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, pipeline);
criterion_main!(benches);
