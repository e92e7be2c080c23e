//! `rotary-sins calibrate`: gyroscope drifts and accelerometer biases from a bag.

use std::{fmt::Write, path::PathBuf};

use analysis::Notes;
use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use nalgebra::Vector3;
use serde::Serialize;
use sins::{
    estimation::groups::{
        bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
        navigation::{MISALIGNMENT, POSITION, VELOCITY},
        table::BASE_ATTITUDE,
        vertical,
    },
    estimation::model,
    machines::self_calibration::{Estimate, ModelChoice, Verdict},
    units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G},
};

use crate::{
    Outcome,
    filter_options::{FilterOptions, ThresholdOptions},
    output,
    passes::{PassOptions, SmoothedBag},
    sensor_input::SensorInput,
};

/// Options of `calibrate`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    /// Write the calibration to this file
    #[arg(long, value_name = "FILE.yaml")]
    output: Option<PathBuf>,
    /// Write JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    passes: PassOptions,
    #[command(flatten)]
    filter: FilterOptions,
    #[command(flatten)]
    thresholds: ThresholdOptions,
}

/// The result; SI units, covariance row-major.
#[derive(Serialize)]
struct Report {
    phase: &'static str,
    gyroscope_drift_rad_s: [f64; 3],
    gyroscope_drift_std_rad_s: [f64; 3],
    accelerometer_bias_m_s2: [f64; 3],
    accelerometer_bias_std_m_s2: [f64; 3],
    misalignment_std_rad: [f64; 3],
    attitude_xyzw: [f64; 4],
    heading_deg: f64,
    heading_deg_std: f64,
    roll_deg: f64,
    roll_deg_std: f64,
    pitch_deg: f64,
    pitch_deg_std: f64,
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
    stamp_ns: i64,
    duration_s: f64,
    samples: u64,
    gaps: u64,
    lost_samples: u64,
    repeated_samples: u64,
    backward_samples: u64,
    alone_samples: u64,
    not_finite_samples: u64,
    beyond_range_samples: u64,
    spike_samples: u64,
    reordered_samples: u64,
    missing_velocities: u64,
    gated_measurements: u64,
    refused_measurements: u64,
    undecodable_messages: u64,
    restarts: u64,
    nis: f64,
    nis_window_mean: f64,
    nis_upper_bound: f64,
    nis_failures: u64,
    verdict: Verdict,
    model: &'static str,
    state_names: Vec<String>,
    state: Vec<f64>,
    covariance: Vec<f64>,
    /// One-sigma before anything was measured; null where nothing was said of a state.
    prior_std: Vec<Option<f64>>,
    unobservable: Vec<String>,
    encoders: String,
    /// So many times the record was gone over.
    passes: u32,
    /// Where every epoch of it stands, smoothed.
    #[serde(skip_serializing_if = "Option::is_none")]
    smoothed: Option<SmoothedBag>,
    /// White noise that the filter took, gyroscopes (rad/√s) and accelerometers (m/s/√s).
    noise_density: [f64; 6],
    /// The same as the samples at rest show it; null where an axis does not rest.
    noise_density_at_rest: [Option<f64>; 6],
    /// One-sigma of the ship's velocity, east, north, up; null where it is measured.
    ship_motion_std_m_s: Option<[f64; 3]>,
    warnings: Vec<String>,
}

/// Runs the whole bag through the machine.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let bag = options.input.open()?;
    if let Some(path) = &options.output {
        output::check(path, Some(bag.path()), options.passes.force)?;
    }
    let mut settings = options.filter.machine(options.input.turntable()?)?;
    settings.thresholds = options.thresholds.thresholds()?;
    let passed = options.passes.run(&options.input, &bag, &settings)?;
    let (estimate, mut notes) = (&passed.estimate, passed.notes);
    let verdict = estimate.verdict(&settings);
    let is_reached = verdict.converged && verdict.consistent;
    if let Some(doubt) = estimate.axes_doubt() {
        let line = format!("{}: {doubt}", bag.path().display());
        output::note(&line);
        notes.lines.push(line);
    }
    if let Some(path) = &options.output {
        let source = bag.path().display().to_string();
        let text = calibration_file::text(&estimate.calibration(), &source)?;
        output::file(path, &text, Some(bag.path()))?;
    }
    if options.json {
        let mut report = report(estimate, settings.model, verdict, notes);
        report.passes = passed.passes;
        report.smoothed = passed.smoothed;
        output::json(&report)?;
    } else {
        let mut text = text(estimate, &verdict);
        if passed.passes > 1 {
            let _ = write!(text, "\n{} passes", passed.passes);
        }
        if let Some(smoothed) = &passed.smoothed {
            let _ = write!(text, "\n{smoothed}");
        }
        output::text_line(&text)?;
    }
    Ok(if is_reached {
        Outcome::Reached
    } else {
        Outcome::Missed
    })
}

fn report(estimate: &Estimate, model: ModelChoice, verdict: Verdict, notes: Notes) -> Report {
    let (navigation, vehicle, sigma) = (
        &estimate.navigation,
        estimate.vehicle,
        estimate.vehicle_sigma(),
    );
    let (counts, innovations) = (&estimate.samples.counts, &estimate.innovations);
    let q = navigation.attitude;
    Report {
        phase: estimate.phase.name(),
        gyroscope_drift_rad_s: estimate.gyroscope_drift().into(),
        gyroscope_drift_std_rad_s: estimate.gyroscope_drift_sigma().into(),
        accelerometer_bias_m_s2: estimate.accelerometer_bias().into(),
        accelerometer_bias_std_m_s2: estimate.accelerometer_bias_sigma().into(),
        misalignment_std_rad: estimate.misalignment_sigma().into(),
        attitude_xyzw: [q.i, q.j, q.k, q.w],
        heading_deg: vehicle.heading.to_degrees(),
        heading_deg_std: sigma.heading.to_degrees(),
        roll_deg: vehicle.roll.to_degrees(),
        roll_deg_std: sigma.roll.to_degrees(),
        pitch_deg: vehicle.pitch.to_degrees(),
        pitch_deg_std: sigma.pitch.to_degrees(),
        latitude_deg: navigation.position.latitude_rad.to_degrees(),
        longitude_deg: navigation.position.longitude_rad.to_degrees(),
        height_m: navigation.position.height_m,
        stamp_ns: estimate.stamp.nanos(),
        duration_s: estimate.duration_s,
        samples: counts.samples,
        gaps: counts.gaps,
        lost_samples: counts.lost,
        repeated_samples: counts.repeated,
        backward_samples: counts.backward,
        alone_samples: counts.alone,
        not_finite_samples: counts.not_finite,
        beyond_range_samples: counts.beyond_range,
        spike_samples: counts.spikes,
        reordered_samples: counts.reordered,
        missing_velocities: estimate.samples.missing_velocities,
        gated_measurements: estimate.samples.updates.gated,
        refused_measurements: estimate.samples.refused_measurements(),
        undecodable_messages: notes.undecodable_messages,
        restarts: counts.restarts,
        nis: innovations.last,
        nis_window_mean: innovations.window_mean,
        nis_upper_bound: innovations.window_bound,
        nis_failures: innovations.failures,
        verdict,
        model: model.name(),
        state_names: estimate.states.states().iter().map(Into::into).collect(),
        state: estimate.states.values().to_vec(),
        covariance: estimate.covariance().row_major(),
        prior_std: prior(estimate),
        unobservable: estimate
            .unobservable()
            .into_iter()
            .map(Into::into)
            .collect(),
        encoders: estimate.encoders.to_string(),
        passes: 1,
        smoothed: None,
        noise_density: noise_density(estimate),
        noise_density_at_rest: estimate.noise_at_rest,
        ship_motion_std_m_s: estimate.ship_motion_m_s,
        warnings: notes.lines,
    }
}

fn prior(estimate: &Estimate) -> Vec<Option<f64>> {
    let of = |name| estimate.prior.value(name).filter(|sigma| *sigma > 0.0);
    estimate.states.states().iter().map(of).collect()
}

fn noise_density(estimate: &Estimate) -> [f64; 6] {
    let noise = &estimate.noise;
    let [gx, gy, gz]: [f64; 3] = noise.gyroscope.into();
    let [ax, ay, az]: [f64; 3] = noise.accelerometer.into();
    [gx, gy, gz, ax, ay, az]
}

/// What the filter took the noise and the ship's motion for, beside what the samples show.
fn ground(estimate: &Estimate) -> String {
    let ratios = |axes: std::ops::Range<usize>| -> String {
        let told = noise_density(estimate);
        let seen = axes.map(|axis| estimate.noise_at_rest[axis].map(|seen| seen / told[axis]));
        let words: Vec<String> = seen
            .map(|ratio| ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}")))
            .collect();
        words.join(" ")
    };
    let noise = format!(
        "noise at rest over what was told: gyroscopes {}, accelerometers {}",
        ratios(0..3),
        ratios(3..6)
    );
    estimate.ship_motion_m_s.map_or(noise.clone(), |sigmas| {
        let largest = sigmas.into_iter().fold(0.0, f64::max);
        format!("{noise}; the ship is taken to move by {largest:.3} m/s (1 sigma)")
    })
}

/// One line of an estimate.
pub fn short(estimate: &Estimate) -> String {
    format!(
        "{}: 1 sigma at most {:.4} deg/h, {:.1} ug, azimuth {:.0} arcsec",
        estimate.phase.name(),
        estimate.gyroscope_drift_sigma().max() / DEG_PER_HOUR,
        estimate.accelerometer_bias_sigma().max() / MICRO_G,
        estimate.misalignment_sigma().z / ARC_SECOND
    )
}

fn text(estimate: &Estimate, verdict: &Verdict) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(["", "estimate", "1 sigma", ""]);
    let mut rows = |name: &str,
                    unit: &str,
                    scale: f64,
                    value: Vector3<f64>,
                    sigma: Vector3<f64>,
                    digits: usize| {
        for (axis, label) in ["x", "y", "z"].into_iter().enumerate() {
            table.add_row([
                format!("{name} {label}"),
                format!("{:.digits$}", value[axis] / scale),
                format!("{:.digits$}", sigma[axis] / scale),
                unit.to_owned(),
            ]);
        }
    };
    let (drift, bias) = (estimate.gyroscope_drift(), estimate.accelerometer_bias());
    rows(
        "gyroscope drift",
        "deg/h",
        DEG_PER_HOUR,
        drift,
        estimate.gyroscope_drift_sigma(),
        5,
    );
    rows(
        "accelerometer bias",
        "ug",
        MICRO_G,
        bias,
        estimate.accelerometer_bias_sigma(),
        2,
    );
    let sigma = estimate.vehicle_sigma();
    for (name, value, sigma) in [
        ("heading", estimate.vehicle.heading, sigma.heading),
        ("roll", estimate.vehicle.roll, sigma.roll),
        ("pitch", estimate.vehicle.pitch, sigma.pitch),
    ] {
        let degrees = [value, sigma].map(|angle| format!("{:.5}", angle.to_degrees()));
        let [value, sigma] = degrees;
        table.add_row([name.to_owned(), value, sigma, "deg".to_owned()]);
    }
    align_right(&mut table, &[1, 2]);
    let counts = &estimate.samples.counts;
    let mut text = format!(
        "{table}\n{} after {:.1} s: {} samples, {} gaps, {} lost, {} refused",
        estimate.phase.name(),
        estimate.duration_s,
        counts.samples,
        counts.gaps,
        counts.lost,
        counts.refused()
    );
    if let Some(left_out) = estimate.samples.measurements_left_out() {
        text.push('\n');
        text.push_str(&left_out);
    }
    if let Some(further) = further(estimate) {
        text = format!("{further}\n{text}\n{}", estimate.encoders);
    }
    text.push('\n');
    text.push_str(&ground(estimate));
    for reason in &verdict.reasons {
        text.push_str("\n  ");
        text.push_str(reason);
    }
    text
}

/// Whether a state stands in the table of every model, or in none because its estimate has been fed back.
fn is_of_every_model(name: &str) -> bool {
    let navigation = POSITION.into_iter().chain(VELOCITY).chain(MISALIGNMENT);
    let vertical = [vertical::HEIGHT, vertical::VELOCITY_UP];
    navigation
        .chain(vertical)
        .chain(BASE_ATTITUDE)
        .chain(GYROSCOPE_DRIFT)
        .chain(ACCELEROMETER_BIAS)
        .any(|known| known == name)
}

/// What the model has beyond drifts and biases, in field units: what was known before, and the share that has been learned.
/// `None` where it has nothing more.
fn further(estimate: &Estimate) -> Option<Table> {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(["", "estimate", "1 sigma", "", "prior", "learned"]);
    for name in estimate.states.states().iter() {
        let Some(label) = model::label(name).filter(|_| !is_of_every_model(name)) else {
            continue;
        };
        let number = |value: Option<f64>| {
            value.map_or_else(String::new, |value| format!("{:.4}", value / label.scale))
        };
        let learned = match estimate.learned(name) {
            Some(_) if estimate.unobservable().contains(&name) => "not seen".to_owned(),
            Some(share) => format!("{:.0} %", 100.0 * share),
            None => String::new(),
        };
        table.add_row([
            label.words.to_owned(),
            number(estimate.states.value(name)),
            number(estimate.states.sigma(name)),
            label.unit.to_owned(),
            number(estimate.prior.value(name)),
            learned,
        ]);
    }
    align_right(&mut table, &[1, 2, 4, 5]);
    (table.row_count() > 0).then_some(table)
}

fn align_right(table: &mut Table, columns: &[usize]) {
    for column in columns {
        if let Some(column) = table.column_mut(*column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}
