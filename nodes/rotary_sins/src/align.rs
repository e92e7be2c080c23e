//! `rotary-sins align`: heading, roll and pitch at rest.

use std::ops::ControlFlow;

use anyhow::Context;
use bags::Sample;
use clap::Args;
use serde::Serialize;
use sins::{
    machines::self_calibration::{Estimate, Event, Phase, SelfCalibration},
    time::Stamp,
};

use crate::{Outcome, filter_options::AlignmentOptions, output, sensor_input::SensorInput};

/// A joint that is further than this from where it stood at first turns \[rad\].
const TURN_RAD: f64 = 1e-4;

/// Options of `align`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    #[command(flatten)]
    filter: AlignmentOptions,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Alignment {
    heading_deg: f64,
    heading_deg_std: f64,
    roll_deg: f64,
    roll_deg_std: f64,
    pitch_deg: f64,
    pitch_deg_std: f64,
    attitude_xyzw: [f64; 4],
    latitude_deg: f64,
    longitude_deg: f64,
    stamp_ns: i64,
    duration_s: f64,
    samples: u64,
    gaps: u64,
    lost_samples: u64,
    phase: &'static str,
    innovations_window_mean: f64,
    innovations_window_bound: f64,
    warnings: Vec<String>,
}

/// Aligns on all samples up to the first turn of the table.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let bag = options.input.open()?;
    let mut calibrator = SelfCalibration::new(options.filter.machine(options.input.turntable()?)?)?;
    // The last estimate, and the one before it: the last one may already be of a block that turns.
    let mut aligned: [Option<Estimate>; 2] = [None, None];
    let mut first_joints: Option<[f64; 2]> = None;
    let mut last_rest: Option<Stamp> = None;
    let mut notes = options
        .input
        .feed(&bag, "aligning", |sample: Sample, told| {
            let turns = if let Sample::Joints(joints) = &sample {
                let first = *first_joints.get_or_insert(joints.position);
                let moved = |joint: usize| (joints.position[joint] - first[joint]).abs() > TURN_RAD;
                let turns = moved(0) || moved(1);
                if !turns {
                    last_rest = Some(joints.stamp);
                }
                turns
            } else {
                false
            };
            if let Some(reading) = sample.reading() {
                calibrator.push(&reading)?;
            }
            // An IMU without encoders shows by itself that it turns.
            let has_turned =
                |e: &Estimate| matches!(e.phase, Phase::Calibrating | Phase::Converged);
            let mut turns_by_itself = false;
            while let Some(event) = calibrator.poll() {
                told.event(&event);
                if let Event::Estimate(estimate) = event {
                    turns_by_itself |= has_turned(&estimate);
                    if !turns && !turns_by_itself {
                        told.progress.message(line(&estimate));
                        aligned = [Some(*estimate), aligned[0].take()];
                    }
                }
            }
            if turns || turns_by_itself {
                told.progress
                    .note("the block turns; aligned on what came before");
                return Ok(ControlFlow::Break(()));
            }
            Ok(ControlFlow::Continue(()))
        })?;
    let [last, before] = aligned;
    let is_at_rest = |e: &Estimate| last_rest.is_none_or(|rest| e.stamp <= rest);
    let estimate = match last.filter(is_at_rest).or(before) {
        Some(estimate) => estimate,
        None => calibrator
            .finish()
            .with_context(|| options.input.what_is_missing(&bag))?,
    };
    notes.tell(&output::Screen);
    let sigma = estimate.vehicle_sigma();
    let q = estimate.navigation.attitude;
    let result = Alignment {
        heading_deg: estimate.vehicle.heading.to_degrees(),
        heading_deg_std: sigma.heading.to_degrees(),
        roll_deg: estimate.vehicle.roll.to_degrees(),
        roll_deg_std: sigma.roll.to_degrees(),
        pitch_deg: estimate.vehicle.pitch.to_degrees(),
        pitch_deg_std: sigma.pitch.to_degrees(),
        attitude_xyzw: [q.i, q.j, q.k, q.w],
        latitude_deg: estimate.navigation.position.latitude_rad.to_degrees(),
        longitude_deg: estimate.navigation.position.longitude_rad.to_degrees(),
        stamp_ns: estimate.stamp.nanos(),
        duration_s: estimate.duration_s,
        samples: estimate.samples.counts.samples,
        gaps: estimate.samples.counts.gaps,
        lost_samples: estimate.samples.counts.lost,
        phase: estimate.phase.name(),
        innovations_window_mean: estimate.innovations.window_mean,
        innovations_window_bound: estimate.innovations.window_bound,
        warnings: std::mem::take(&mut notes.lines),
    };
    if options.json {
        output::json(&result)?;
    } else {
        output::text_line(&line(&estimate))?;
    }
    Ok(if estimate.phase == Phase::Inconsistent {
        Outcome::Missed
    } else {
        Outcome::Reached
    })
}

fn line(estimate: &Estimate) -> String {
    let sigma = estimate.vehicle_sigma();
    format!(
        "heading {:.4} ± {:.4} deg, roll {:.4} ± {:.4} deg, pitch {:.4} ± {:.4} deg",
        estimate.vehicle.heading.to_degrees(),
        sigma.heading.to_degrees(),
        estimate.vehicle.roll.to_degrees(),
        sigma.roll.to_degrees(),
        estimate.vehicle.pitch.to_degrees(),
        sigma.pitch.to_degrees()
    )
}
