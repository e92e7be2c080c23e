#![allow(clippy::unwrap_used)]

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use super::*;
use crate::simulation::{
    ImuErrorSettings, OutputSettings, Run, Simulator, SimulatorSettings, Wandering,
};
use crate::table::JointSample;
use crate::table::scheme::{Scheme, Sequencer, sequencer::SequencerSettings};
use crate::units::{DEG_PER_HOUR, MICRO_G};

/// Samples of all axes by a rule, at 100 Hz.
fn analysed(count: i64, mut rule: impl FnMut() -> [f64; AXES]) -> AllanResult {
    let mut allan = Allan::new(AllanSettings::default()).unwrap();
    for k in 0..count {
        let value = rule();
        let mut sample = ImuSample::at_rest(Stamp::from_nanos(k * 10_000_000), 0.0);
        sample.angular_rate = Vector3::from_row_slice(&value[..3]);
        sample.specific_force = Vector3::from_row_slice(&value[3..]);
        allan.push(&Reading::Imu(sample)).unwrap();
    }
    allan.finish().unwrap()
}

/// Quantization, white noise, flicker and walk of known size, every axis with a generator of its own.
struct Source {
    generator: Xoshiro256PlusPlus,
    coefficients: [f64; 4],
    walk: f64,
    rounded: f64,
    /// First-order processes whose times are four times apart: together flicker.
    flicker: [f64; 12],
}

impl Source {
    const INTERVAL_S: f64 = 0.01;

    fn new(seed: u64, coefficients: [f64; 4]) -> Self {
        Self {
            generator: Xoshiro256PlusPlus::seed_from_u64(seed),
            coefficients,
            walk: 0.0,
            rounded: 0.0,
            flicker: [0.0; 12],
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.generator)
    }

    fn next(&mut self) -> f64 {
        let [quantization, white, flicker, walk] = self.coefficients;
        let root = Self::INTERVAL_S.sqrt();
        self.walk += walk * root * self.normal();
        let rounded = quantization * self.normal();
        let step = (rounded - self.rounded) / Self::INTERVAL_S;
        self.rounded = rounded;
        let mut value = self.walk + step + white / root * self.normal();
        if flicker > 0.0 {
            // One-sided spectrum B²/(π f): first-order processes of variance s², one for every factor of 4 in time,
            // sum up to s² / (f ln 4).
            let variance = flicker * flicker * 4_f64.ln() / std::f64::consts::PI;
            let mut time_s = 0.01;
            for part in 0..self.flicker.len() {
                let keep = (-Self::INTERVAL_S / time_s).exp();
                let normal = self.normal();
                self.flicker[part] =
                    keep * self.flicker[part] + (variance * (1.0 - keep * keep)).sqrt() * normal;
                time_s *= 4.0;
            }
            value += self.flicker.iter().sum::<f64>();
        }
        value
    }
}

/// Over many drawn records the errors of the fitted noises are as large as their sigmas say, and bands hold the true
/// deviation as often as they promise.
#[test]
fn sigmas_and_bands_are_honest() {
    let truth = [2e-6, 1e-4, 0.0, 3e-5];
    let mut ratios: [Vec<f64>; 4] = Default::default();
    let (mut inside, mut points) = (0.0, 0.0);
    for record in 0..8 {
        let mut sources: Vec<_> = (0..6)
            .map(|axis| Source::new(record * 6 + axis, truth))
            .collect();
        let result = analysed(1 << 17, || std::array::from_fn(|k| sources[k].next()));
        for axis in &result.axes {
            for (number, ratio) in ratios.iter_mut().enumerate() {
                if let Some((value, sigma)) = axis.fit.coefficients[number].found {
                    ratio.push((value - truth[number]) / sigma);
                }
            }
            for point in &axis.points {
                let parts = fit::NOISES.iter().zip(truth);
                let variance: f64 = parts
                    .map(|(n, c)| c * c * fit::shape(*n, point.tau_s))
                    .sum();
                let [lower, upper] = point.band;
                points += 1.0;
                inside += f64::from(u8::from((lower..=upper).contains(&variance.sqrt())));
            }
        }
    }
    for (number, [least, greatest]) in [(0, [0.4, 1.3]), (1, [0.6, 1.4]), (3, [0.6, 1.3])] {
        let all = &ratios[number];
        assert!(all.len() >= 46, "{number}: found {} times of 48", all.len());
        let rms = (all.iter().map(|r| r * r).sum::<f64>() / all.len() as f64).sqrt();
        assert!((least..greatest).contains(&rms), "{number}: rms {rms}");
    }
    // Two sigmas are crossed by chance now and then.
    assert!(
        ratios[2].len() <= 8,
        "flicker seen {} times",
        ratios[2].len()
    );
    let share = inside / points;
    assert!((0.90..0.99).contains(&share), "{share} of {points}");
}

/// Flicker of known size is found as bias instability.
#[test]
fn flicker_is_bias_instability() {
    let truth = [0.0, 1e-4, 2e-4, 0.0];
    let mut sources: Vec<_> = (100..106).map(|seed| Source::new(seed, truth)).collect();
    let result = analysed(1 << 19, || std::array::from_fn(|k| sources[k].next()));
    for axis in &result.axes {
        let (value, sigma) = axis.fit.of(NoiseType::Flicker).found.unwrap();
        assert!((value / truth[2] - 1.0).abs() < 0.1, "{value} ± {sigma}");
        let highest = axis.least().unwrap().band[1] / 0.664;
        assert!(highest > truth[2], "{highest}");
    }
}

fn simulated(scheme: &Scheme, imu: &ImuErrorSettings, duration_s: f64, rate_hz: f64) -> Allan {
    let mut settings = SimulatorSettings {
        imu: *imu,
        ..SimulatorSettings::default()
    };
    settings.plant.imu_rate_hz = rate_hz;
    let program = scheme.program(settings.plant.turntable).unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    let mut allan = Allan::new(AllanSettings::default()).unwrap();
    for tick in Run::new(Simulator::new(settings).unwrap(), sequencer, duration_s) {
        for reading in tick.unwrap().readings() {
            allan.push(&reading).unwrap();
        }
    }
    allan
}

/// The simulator's densities, its walk and its counts are found within their sigmas.
#[test]
fn what_the_simulator_was_told_is_found() {
    let imu = ImuErrorSettings {
        wandering: Wandering {
            gyroscope_walk: Vector3::repeat(0.02 * DEG_PER_HOUR / 60.0),
            accelerometer_walk: Vector3::repeat(20.0 * MICRO_G / 60.0),
            ..Wandering::default()
        },
        output: OutputSettings {
            // No greater than the noise of a sample: else the rounding follows the earth's rate and is not even.
            angle_count_rad: 1e-7,
            velocity_count_m_s: 4e-5,
            ..OutputSettings::default()
        },
        ..ImuErrorSettings::default()
    };
    let result = simulated(
        &Scheme::builtin("static").unwrap(),
        &imu,
        4.0 * 3600.0,
        20.0,
    )
    .finish()
    .unwrap();
    assert_eq!((result.stretches, result.turning), (1, 0));
    assert!((result.interval_s - 0.05).abs() < 1e-12);
    let (white, walk) = (imu.noise, imu.wandering);
    let counts = [imu.output.angle_count_rad, imu.output.velocity_count_m_s];
    for (k, axis) in result.axes.iter().enumerate() {
        let truth = if k < 3 {
            [white.gyroscope.x, walk.gyroscope_walk.x, counts[0]]
        } else {
            [white.accelerometer.x, walk.accelerometer_walk.x, counts[1]]
        };
        let count = axis.count.unwrap();
        assert!((count / truth[2] - 1.0).abs() < 1e-6, "{count}");
        // A sum that is rounded has an error that is even over a count.
        let truth = [truth[2] / 12_f64.sqrt(), truth[0], truth[1]];
        let noises = [NoiseType::Quantization, NoiseType::White, NoiseType::Walk];
        for (noise, truth) in noises.into_iter().zip(truth) {
            let (value, sigma) = axis.fit.of(noise).found.unwrap();
            assert!(
                (value - truth).abs() < 3.5 * sigma && sigma < 0.5 * truth,
                "{} {noise:?}: {value} ± {sigma}, truth {truth}",
                AXIS_NAMES[k]
            );
        }
    }
}

/// Where the table turns nothing is used, so a scheme's dwells give the same noise as a table at rest.
#[test]
fn turns_are_left_out() {
    let imu = ImuErrorSettings::default();
    let result = simulated(&Scheme::eight_position(), &imu, 5000.0, 50.0)
        .finish()
        .unwrap();
    assert!(result.stretches >= 9, "{}", result.stretches);
    assert!(result.turning > 50 * 200, "{}", result.turning);
    for (k, axis) in result.axes.iter().enumerate() {
        let truth = if k < 3 {
            imu.noise.gyroscope.x
        } else {
            imu.noise.accelerometer.x
        };
        let (value, sigma) = axis.fit.of(NoiseType::White).found.unwrap();
        assert!(
            (value - truth).abs() < 3.5 * sigma,
            "{value} ± {sigma}, {truth}"
        );
        assert!(axis.fit.of(NoiseType::Quantization).found.is_none());
        assert!(axis.points.last().unwrap().tau_s < 250.0);
    }
}

/// A few lost samples do not end a stretch, a hole does, and both are counted; joints alone, and too few samples, are
/// refused in words.
#[test]
fn holes_are_bridged_or_part() {
    let mut allan = Allan::new(AllanSettings::default()).unwrap();
    let mut source = Source::new(1, [0.0, 1e-4, 0.0, 0.0]);
    for k in 0..30_000_i64 {
        if (9000..9005).contains(&k) || (20_000..20_500).contains(&k) {
            continue;
        }
        let mut sample = ImuSample::at_rest(Stamp::from_nanos(k * 10_000_000), 9.8);
        sample.angular_rate = Vector3::repeat(source.next());
        sample.specific_force.z += source.next();
        allan.push(&Reading::Imu(sample)).unwrap();
    }
    let result = allan.finish().unwrap();
    assert_eq!((result.stretches, result.bridged), (2, 5));
    let (value, sigma) = result.axes[0].fit.of(NoiseType::White).found.unwrap();
    assert!((value - 1e-4).abs() < 3.5 * sigma, "{value} ± {sigma}");
    // The accelerometer x says the same value all the time: no noise, and no numbers that are none.
    assert!(result.axes[3].points.iter().all(|p| p.deviation == 0.0));
    assert_eq!(result.axes[3].fit, Fit::default());

    let mut empty = Allan::new(AllanSettings::default()).unwrap();
    let joints = JointSample {
        stamp: Stamp::from_nanos(0),
        position: [0.0; 2],
        velocity: [0.0; 2],
    };
    empty.push(&Reading::Joints(joints)).unwrap();
    let said = empty.finish().unwrap_err().to_string();
    assert!(said.contains("samples at rest is 0"), "{said}");
}
