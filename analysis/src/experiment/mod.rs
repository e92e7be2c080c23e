//! The paper's experiment (its section 5) on simulated IMUs, through the machines that a ship would run.
//!
//! Rest of 0.7 h, then the eight positions to 4 h, through coarse alignment and the filter as `calibrate` has them; then
//! free-inertial navigation with the calibration and without it.

use comfy_table::{CellAlignment, Table, presets};
use nalgebra::{SVector, Vector3};
use rayon::prelude::*;
use report::{Axis, Band, Figure, Page, Panel, Series};
use serde::Serialize;
use sins::earth::Position;
use sins::{
    estimation::error_state::{BIAS, DRIFT, STATE_LABELS},
    machines::self_calibration::{Estimate, Event, SelfCalibration, Settings},
    sensor::errors::SensorErrors,
    simulation::{
        ImuErrorSettings, NoiseReading, PlantSettings, Run, Ship, Simulator, SimulatorSettings,
    },
    studies::monte_carlo::{Departure, TrueErrors, Voyage, VoyageTrack},
    table::scheme::{Scheme, Sequencer, sequencer::SequencerSettings},
    units::NAUTICAL_MILE_M,
};

use crate::{Error, Listener, compare::PAPER_NMI, significant};

/// Length of calibration in the paper \[h\].
const HOURS: f64 = 4.0;
/// Times at which the position error is told \[h\].
const TOLD_H: [f64; 5] = [4.0, 8.0, 12.0, 24.0, 72.0];
/// Estimates of the first IMU are kept at this distance \[s\].
const KEPT_S: f64 = 60.0;
/// Biases and drifts.
const SENSOR_STATES: usize = 6;

/// What the experiment is to do.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Number of IMUs, all with the errors of Table 1, each with its own noise.
    pub runs: u64,
    /// Samples of the IMU a second.
    pub rate_hz: f64,
    /// White noise of the sensors.
    pub noise: NoiseReading,
    /// Decides all noise.
    pub seed: u64,
    /// The ship.
    pub ship: Ship,
}

/// One estimate on the way.
struct Kept {
    time_s: f64,
    value: SVector<f64, SENSOR_STATES>,
    sigma: SVector<f64, SENSOR_STATES>,
}

/// One IMU's experiment.
pub struct Trial {
    estimate: Estimate,
    azimuth_error_rad: f64,
    history: Vec<Kept>,
    track: VoyageTrack,
}

#[derive(Serialize)]
struct StateRow {
    state: &'static str,
    unit: &'static str,
    truth: f64,
    mean_estimate: f64,
    rms_error: f64,
    sigma: f64,
}

#[derive(Serialize)]
struct PositionRow {
    hours: f64,
    median_compensated_nmi: f64,
    worst_compensated_nmi: f64,
    median_uncompensated_nmi: f64,
    worst_uncompensated_nmi: f64,
}

/// The experiment as JSON.
#[derive(Serialize)]
pub struct Report {
    command: String,
    /// How many IMUs converged.
    pub converged: usize,
    runs: u64,
    states: Vec<StateRow>,
    azimuth_rms_arcsec: f64,
    azimuth_sigma_arcsec: f64,
    position: Vec<PositionRow>,
    paper_uncompensated_nmi: f64,
    paper_compensated_nmi: f64,
}

/// Runs the experiment on all cores, and tells every IMU that is done.
///
/// # Errors
/// Where the ship or the rate is refused.
pub fn run(plan: &Plan, listener: &dyn Listener) -> Result<Vec<Trial>, Error> {
    (0..plan.runs)
        .into_par_iter()
        .map(|run| {
            let trial = trial(plan, run);
            listener.advance(1);
            trial
        })
        .collect()
}

fn trial(plan: &Plan, run: u64) -> Result<Trial, Error> {
    let truth = TrueErrors::table_1();
    let errors = SensorErrors::constant(truth.gyroscope_drift, truth.accelerometer_bias);
    let scheme = Scheme::paper_experiment();
    let turntable = scheme.default_table();
    let seed = plan.seed.wrapping_mul(1_000_003).wrapping_add(run);
    let simulator = Simulator::new(SimulatorSettings {
        plant: PlantSettings {
            ship: plan.ship,
            turntable,
            imu_rate_hz: plan.rate_hz,
            ..PlantSettings::default()
        },
        imu: ImuErrorSettings {
            errors,
            noise: plan.noise.density(),
        },
        seed,
        ..SimulatorSettings::default()
    })?;
    let mut machine = SelfCalibration::new(Settings {
        turntable,
        ..Settings::default()
    })?;
    let sequencer = Sequencer::new(scheme.program(turntable)?, SequencerSettings::default())?;
    machine.push_joints(simulator.first_joints())?;
    let mut simulation = Run::new(simulator, sequencer, HOURS * 3600.0);
    let mut history = Vec::new();
    for tick in simulation.by_ref() {
        let tick = tick?;
        if let Some(fix) = &tick.position {
            machine.push_position(Position {
                latitude_rad: fix.latitude_rad,
                longitude_rad: fix.longitude_rad,
                height_m: fix.height_m,
            })?;
        }
        if let Some(joints) = tick.joints {
            machine.push_joints(joints)?;
        }
        machine.push_imu(&tick.imu);
        while let Some(event) = machine.poll() {
            let Event::Estimate(estimate) = event else {
                continue;
            };
            if run != 0 || estimate.duration_s < history.len() as f64 * KEPT_S {
                continue;
            }
            history.push(Kept {
                time_s: estimate.duration_s,
                value: estimate
                    .state
                    .fixed_rows::<SENSOR_STATES>(BIAS)
                    .into_owned(),
                sigma: estimate
                    .sigma()
                    .fixed_rows::<SENSOR_STATES>(BIAS)
                    .into_owned(),
            });
        }
    }
    let estimate = machine.finish()?;
    let attitude = simulation.simulator().plant().attitude();
    let left = -(estimate.navigation.attitude * attitude.inverse()).scaled_axis();
    let voyage = Voyage {
        turn_rad: 0.0,
        duration_s: TOLD_H[TOLD_H.len() - 1] * 3600.0,
        noise: plan.noise.density(),
        every_s: 300.0,
    };
    let track = voyage.sail(&Departure {
        calibration: estimate.calibration(),
        attitude,
        errors,
        seed: seed.wrapping_add(500),
    })?;
    Ok(Trial {
        azimuth_error_rad: left.z,
        estimate,
        history,
        track,
    })
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / count).sqrt()
}

/// Sums the trials up.
pub fn summarize(plan: &Plan, trials: &[Trial], command: &str) -> Report {
    let truth = TrueErrors::table_1();
    let true_value = |state: usize| {
        if state < DRIFT {
            truth.accelerometer_bias[state - BIAS]
        } else {
            truth.gyroscope_drift[state - DRIFT]
        }
    };
    let states = (BIAS..DRIFT + 3)
        .map(|state| {
            let label = &STATE_LABELS[state];
            let mean =
                trials.iter().map(|t| t.estimate.state[state]).sum::<f64>() / trials.len() as f64;
            StateRow {
                state: label.words,
                unit: label.unit,
                truth: true_value(state) / label.scale,
                mean_estimate: mean / label.scale,
                rms_error: rms(trials
                    .iter()
                    .map(|t| t.estimate.state[state] - true_value(state)))
                    / label.scale,
                sigma: rms(trials.iter().map(|t| t.estimate.sigma()[state])) / label.scale,
            }
        })
        .collect();
    let position = TOLD_H
        .into_iter()
        .map(|hours| {
            let of = |which: usize| {
                let mut values: Vec<f64> = trials
                    .iter()
                    .map(|t| t.track.greatest_m(hours * 3600.0)[which] / NAUTICAL_MILE_M)
                    .collect();
                values.sort_by(f64::total_cmp);
                (values[values.len() / 2], values[values.len() - 1])
            };
            let (with, without) = (of(0), of(1));
            PositionRow {
                hours,
                median_compensated_nmi: with.0,
                worst_compensated_nmi: with.1,
                median_uncompensated_nmi: without.0,
                worst_uncompensated_nmi: without.1,
            }
        })
        .collect();
    let arcsec = sins::units::ARC_SECOND;
    Report {
        command: command.to_owned(),
        converged: trials
            .iter()
            .filter(|t| t.estimate.phase == sins::machines::self_calibration::Phase::Converged)
            .count(),
        runs: plan.runs,
        states,
        azimuth_rms_arcsec: rms(trials.iter().map(|t| t.azimuth_error_rad)) / arcsec,
        azimuth_sigma_arcsec: rms(trials.iter().map(|t| t.estimate.misalignment_sigma().z))
            / arcsec,
        position,
        paper_uncompensated_nmi: PAPER_NMI[0],
        paper_compensated_nmi: PAPER_NMI[1],
    }
}

/// The experiment as text.
pub fn text(report: &Report) -> String {
    let table = |header: &[&str], rows: Vec<Vec<String>>| {
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header(header);
        for row in rows {
            table.add_row(row);
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.to_string()
    };
    let states = report
        .states
        .iter()
        .map(|s| {
            let mut row = vec![s.state.to_owned()];
            row.extend([s.truth, s.mean_estimate, s.rms_error, s.sigma].map(significant));
            row.push(s.unit.to_owned());
            row
        })
        .collect();
    let position = report
        .position
        .iter()
        .map(|p| {
            [
                p.hours,
                p.median_uncompensated_nmi,
                p.worst_uncompensated_nmi,
                p.median_compensated_nmi,
                p.worst_compensated_nmi,
                p.median_uncompensated_nmi / p.median_compensated_nmi,
            ]
            .map(significant)
            .to_vec()
        })
        .collect();
    format!(
        "{}\n{} of {} IMUs converged; 0.7 h at rest, then the eight positions to {HOURS} h\n\n{}\n\nazimuth: rms error {} arcsec, sigma {} arcsec\n\n\
         Greatest position error (nmi) of free-inertial navigation at rest; the paper's ship: {} without compensation, {} with it, {:.2} times smaller\n{}",
        report.command,
        report.converged,
        report.runs,
        table(
            &["", "truth", "mean estimate", "rms error", "sigma", "unit"],
            states
        ),
        significant(report.azimuth_rms_arcsec),
        significant(report.azimuth_sigma_arcsec),
        report.paper_uncompensated_nmi,
        report.paper_compensated_nmi,
        report.paper_uncompensated_nmi / report.paper_compensated_nmi,
        table(
            &[
                "within, h",
                "median without",
                "worst without",
                "median with",
                "worst with",
                "times smaller"
            ],
            position
        ),
    )
}

/// The experiment as a page.
///
/// # Errors
/// Where a figure cannot be drawn.
pub fn page(report: &Report, trials: &[Trial]) -> Result<Page, Error> {
    let mut page = Page::new("Rotary SINS: the paper's experiment");
    page.subtitle("Sensors 2015, 15, 3154, section 5, on simulated IMUs");
    page.meta("command", &report.command)
        .meta("version", env!("CARGO_PKG_VERSION"));
    page.section(2, "Result").preformatted(text(report));
    page.note(
        "The paper's figures are those of its own ship, sensors and hours, which it does not give in full; ours are those of Table 1's errors at rest.",
    );
    page.section(2, "Estimates of the first IMU");
    for (id, title, states) in [
        ("biases", "Accelerometer biases", BIAS..DRIFT),
        ("drifts", "Gyroscope drifts", DRIFT..DRIFT + 3),
    ] {
        let mut figure = Figure::new(id, title, Axis::new("time", "h"))
            .x_range(0.0, HOURS)
            .caption("Estimate with ±3σ; the table turns from 0.7 h on.");
        for state in states {
            let label = &STATE_LABELS[state];
            let k = state - BIAS;
            let points = |of: &dyn Fn(&Kept) -> f64| {
                trials[0]
                    .history
                    .iter()
                    .map(|kept| (kept.time_s / 3600.0, of(kept) / label.scale))
                    .collect::<Vec<_>>()
            };
            let truth: Vector3<f64> = if state < DRIFT {
                TrueErrors::table_1().accelerometer_bias
            } else {
                TrueErrors::table_1().gyroscope_drift
            };
            let band = trials[0]
                .history
                .iter()
                .map(|kept| {
                    let three = 3.0 * kept.sigma[k];
                    (
                        kept.time_s / 3600.0,
                        (kept.value[k] - three) / label.scale,
                        (kept.value[k] + three) / label.scale,
                    )
                })
                .collect();
            figure = figure.panel(
                Panel::new("", Axis::new(label.symbol, label.unit))
                    .band(Band::new("±3σ", band))
                    .series(Series::new("estimate", points(&|kept| kept.value[k])).colour(2))
                    .horizontal(truth[k % 3] / label.scale, "truth")
                    .vertical(0.7, "rotation begins"),
            );
        }
        page.figure(&figure)?;
    }
    page.section(2, "Position error");
    let curves = |which: usize| {
        let tracks = trials.iter().map(|t| &t.track);
        tracks
            .map(|t| {
                let errors = [&t.compensated_m, &t.uncompensated_m][which];
                t.times_s
                    .iter()
                    .zip(errors)
                    .map(|(s, m)| (s / 3600.0, m / NAUTICAL_MILE_M))
                    .collect::<Vec<_>>()
            })
            .take(20)
            .collect::<Vec<_>>()
    };
    let mut figure = Figure::new(
        "position",
        "Position error after calibration",
        Axis::new("time", "h"),
    )
    .caption("Every line one IMU (the first twenty), at rest after calibration.");
    for (which, title) in [(0, "with compensation"), (1, "without compensation")] {
        let mut panel = Panel::new(title, Axis::new("position error", "nmi"));
        for points in curves(which) {
            panel = panel.series(
                Series::new("single IMUs", points)
                    .line(report::Line::Thin)
                    .colour(which),
            );
        }
        figure = figure.panel(panel);
    }
    page.figure(&figure)?;
    Ok(page)
}
