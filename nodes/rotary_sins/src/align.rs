//! `rotary-sins align`: heading, roll and pitch at rest.

use analysis::Aligner;
use anyhow::Context;
use clap::Args;
use serde::Serialize;
use sins::machines::self_calibration::{Estimate, Event, Phase};

use crate::{Outcome, filter_options::AlignmentOptions, output, sensor_input::SensorInput};

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
    let mut aligner = Aligner::new(options.filter.machine(options.input.turntable()?)?)?;
    let mut notes = options.input.feed(&bag, "aligning", |sample, told| {
        let flow = aligner.push(&sample, |event| {
            told.event(event);
            if let Event::Estimate(estimate) = event {
                told.progress.message(line(estimate));
            }
        })?;
        if flow.is_break() {
            told.progress
                .note("the block turns; aligned on what came before");
        }
        Ok(flow)
    })?;
    let estimate = aligner
        .finish()
        .with_context(|| options.input.what_is_missing(&bag))?;
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
