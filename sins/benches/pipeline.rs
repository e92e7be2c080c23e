//! Four hours at 100 Hz through the machines, in memory: `cargo bench -p sins`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use sins::earth::Position;
use sins::machines::self_calibration::{SelfCalibration, Settings};
use sins::sensor::sample::ImuSample;
use sins::simulation::{Run, Simulator, SimulatorSettings};
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

fn pipeline(criterion: &mut Criterion) {
    let samples: Vec<ImuSample> = simulation().map(|tick| tick.unwrap().imu).collect();
    let mut group = criterion.benchmark_group("4 h at 100 Hz");
    group.sample_size(10);
    group.bench_function("mechanization and filter", |b| {
        b.iter(|| {
            let mut machine = SelfCalibration::new(Settings::default()).unwrap();
            machine
                .push_position(Position {
                    latitude_rad: 0.8,
                    longitude_rad: 2.2,
                    height_m: 0.0,
                })
                .unwrap();
            for sample in &samples {
                machine.push_imu(sample);
                while let Some(event) = machine.poll() {
                    black_box(event);
                }
            }
        });
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
