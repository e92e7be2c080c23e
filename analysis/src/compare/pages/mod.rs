//! The report of `compare`.

mod claims;
mod tables;

use report::{Figure, Page};
use sins::{simulation::NoiseReading, studies::observability::Setting};

use super::{
    campaign::Campaign,
    cases::Simulation,
    claims::Claim,
    figures::{self, GROUPS},
    voyages::{TURNS_DEG, VOYAGE_H},
};
use crate::{
    Error,
    observability::{self, Analysis},
    words::capital,
};
use claims::claims_section;
use tables::{drawn_voyage_table, end_table, nees_table, voyage_table};

/// The page, and the figures in it.
///
/// # Errors
/// Where a figure cannot be drawn.
pub fn page(
    campaign: &Campaign,
    claims: &[Claim],
    command: &str,
) -> Result<(Page, Vec<Figure>), Error> {
    let plan = &campaign.plan;
    let mut page = Page::new("Rotary SINS: the paper's simulations, reproduced");
    page.subtitle(
        "Sensors 2015, 15, 3154: static, eight positions about x-y, eight positions about y-z; what its claims are worth",
    );
    page.meta("command", command)
        .meta("version", env!("CARGO_PKG_VERSION"))
        .meta(
            "runs",
            format!(
                "{} of every case, {} h at {} Hz",
                plan.runs, plan.hours, plan.rate_hz
            ),
        )
        .meta("seed", plan.seed.to_string())
        .meta(
            "place",
            format!(
                "latitude {:.2} deg, heading {:.0} deg",
                plan.ship.latitude_rad.to_degrees(),
                plan.ship.heading_rad.to_degrees()
            ),
        );
    let mut drawn = Vec::new();

    claims_section(&mut page, claims);
    setting_section(&mut page, campaign);
    calibration_section(&mut page, &mut drawn, campaign)?;
    consistency_section(&mut page, &mut drawn, campaign)?;
    voyage_section(&mut page, &mut drawn, campaign)?;

    page.section(2, "Observability of the schemes");
    for (simulation, table) in Simulation::ALL
        .into_iter()
        .flat_map(|s| s.tables().into_iter().map(move |t| (s, t)))
    {
        let setting = Setting {
            ship: plan.ship,
            duration_s: plan.hours * 3600.0,
            ..Setting::default()
        };
        let analysis = Analysis::of(&simulation.scheme().program(table)?, &setting)?;
        observability::section(&mut page, 3, &analysis);
    }
    Ok((page, drawn))
}

fn setting_section(page: &mut Page, campaign: &Campaign) {
    page.section(2, "Setting");
    page.key_values([
        (
            "errors drawn",
            "from P0 for every run: misalignment (0.01, 0.01, 0.05) deg, ∇ 100 ug, ε 0.01 deg/h, position 10 m, velocity 0.01 m/s; in the voyages Table 1's own values",
        ),
        ("noise D", "0.001 deg/√h and 10 ug/√Hz"),
        ("noise H", "0.001 deg/h/√Hz (1.667e-5 deg/√h) and 10 ug/√Hz"),
        ("measurement", "velocity error of the moored ship, 0.01 m/s, once a second, noise and R equal"),
        ("table", "5 deg/s, 2.5 deg/s², dwell 500 s in every position"),
    ]);
    page.note(format!(
        "The paper gives its noise as '0.001 deg/h' without a bandwidth: both readings are run. Its figure numbers are given by section, not one by one. \
         Times of convergence are those of the covariance bound; {} runs measure whether the filter keeps to it.",
        campaign.plan.runs
    ));
}

fn calibration_section(
    page: &mut Page,
    drawn: &mut Vec<Figure>,
    campaign: &Campaign,
) -> Result<(), Error> {
    page.section(2, "Joint angles (the paper's Figure 3)");
    for simulation in [Simulation::Xy, Simulation::Yz] {
        let scheme = simulation.scheme();
        let program = scheme.program(scheme.default_table())?;
        add(
            page,
            drawn,
            figures::joint_angles(&program, campaign.plan.hours),
        )?;
    }
    for reading in [NoiseReading::D, NoiseReading::H] {
        let letter = reading.letter();
        page.section(
            2,
            format!("Calibration errors, noise {letter} (the paper's Figures 4 to 10)"),
        );
        page.section(
            3,
            format!("The three simulations side by side, noise {letter}"),
        );
        for group in &GROUPS {
            add(page, drawn, figures::sigmas(campaign, reading, group))?;
        }
        for result in figures::default_cases(campaign, reading) {
            page.section(3, capital(&figures::title(result.case)));
            for group in &GROUPS {
                add(page, drawn, figures::errors(result, group, campaign))?;
            }
        }
        page.section(3, format!("At the end, noise {letter}"));
        for result in campaign.cases.iter().filter(|r| r.case.reading == reading) {
            page.table(end_table(result, campaign));
        }
    }
    Ok(())
}

fn consistency_section(
    page: &mut Page,
    drawn: &mut Vec<Figure>,
    campaign: &Campaign,
) -> Result<(), Error> {
    page.section(2, "Is the filter consistent?");
    page.paragraph(
        "A filter is consistent where its errors are as large as it says. The normalized estimation error squared (NEES) of nine states is 9 on \
         average; rms over sigma of every state is 1.",
    );
    page.table(nees_table(campaign));
    for reading in [NoiseReading::D, NoiseReading::H] {
        add(page, drawn, figures::nees(campaign, reading))?;
    }
    page.section(2, "Against heading");
    page.paragraph(
        "The ship's heading decides which sensors stand east and which north, and with that what a scheme shows first. The paper works at one heading.",
    );
    for reading in [NoiseReading::D, NoiseReading::H] {
        add(page, drawn, figures::heading_sweep(campaign, reading))?;
    }
    Ok(())
}

fn voyage_section(
    page: &mut Page,
    drawn: &mut Vec<Figure>,
    campaign: &Campaign,
) -> Result<(), Error> {
    if campaign.cases.iter().all(|r| r.voyages.is_empty()) {
        return Ok(());
    }
    page.section(
        2,
        "Position error after calibration (the paper's Figure 14)",
    );
    page.paragraph(
        "A static calibration looks good until the ship turns: its errors lie where they cancel at the heading of the mooring. So every IMU navigates twice, \
         once lying as she was calibrated and once after a turn by 90 deg. Table 1 gives all axes the same errors, which hides much of this; \
         IMUs with errors drawn from P0 do not.",
    );
    page.table(voyage_table(campaign));
    page.table(drawn_voyage_table(campaign));
    for result in &campaign.cases {
        if result.voyages.is_empty() || !figures::has_position_figure(result.case.simulation) {
            continue;
        }
        for (turn, turn_deg) in TURNS_DEG.into_iter().enumerate() {
            for long_h in VOYAGE_H {
                let figure = figures::position_error(result, turn, turn_deg, long_h, campaign);
                add(page, drawn, figure)?;
            }
        }
    }
    Ok(())
}

fn add(page: &mut Page, drawn: &mut Vec<Figure>, figure: Figure) -> Result<(), Error> {
    page.figure(&figure)?;
    drawn.push(figure);
    Ok(())
}
