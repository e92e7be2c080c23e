//! The report of `compare`.

use report::{Cell, Figure, Page, Table, Verdict};
use sins::{
    estimation::error_state::{MISALIGNMENT, STATE_LABELS, STATES},
    simulation::NoiseReading,
    studies::monte_carlo::{Point, mean_nees_bounds},
    studies::observability::{Setting, stripped::RANK_TOLERANCE},
    units::NAUTICAL_MILE_M,
};

use super::{
    campaign::{Campaign, CaseResult, Simulation, TURNS_DEG, VOYAGE_H},
    claims::Claim,
    figures::{self, CONFIDENCE, GROUPS},
    summary::settled_h,
};
use crate::{
    Error,
    observability::{Analysis, dropped, rotations_line, spread_line},
    significant,
};

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
        observability_section(&mut page, 3, &analysis);
    }
    Ok((page, drawn))
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

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars
        .next()
        .map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

fn claims_section(page: &mut Page, claims: &[Claim]) {
    page.section(2, "The paper's claims");
    page.paragraph(
        "Every claim is judged in every cell that it speaks of: both readings of the noise, both gimbal orders, headings from 0 to 180 deg every 15 deg, or every voyage. \
         It holds where it holds in all cells, in part where it holds in some. The criteria were fixed before the runs, and nothing is tuned.",
    );
    let mut table = Table::new(
        "What the paper says, and what was measured.",
        ["claim", "verdict", "cells", "criterion"],
    );
    for claim in claims {
        let holding = claim.cells.iter().filter(|c| c.holds).count();
        let verdict = match claim.verdict {
            "holds" => Verdict::Good,
            "does not hold" => Verdict::Bad,
            _ => Verdict::Warn,
        };
        table = table.row([
            Cell::text(&claim.text),
            Cell::verdict(verdict, claim.verdict),
            Cell::number(format!("{holding} of {}", claim.cells.len())),
            Cell::text(&claim.criterion),
        ]);
    }
    page.table(table);
    page.section(3, "Where, and by how much");
    for claim in claims {
        let mut table = Table::new(
            format!(
                "{}: {}. Measured: {}.",
                claim.text, claim.verdict, claim.criterion
            ),
            [
                "noise".to_owned(),
                "setting".to_owned(),
                format!(
                    "at heading {:.0} ({})",
                    claim.cells[0].heading_deg, claim.unit
                ),
                "over all headings".to_owned(),
                "holds".to_owned(),
            ],
        );
        for f in &claim.findings {
            let verdict = match (f.everywhere, f.nowhere) {
                (true, _) => Verdict::Good,
                (_, true) => Verdict::Bad,
                _ => Verdict::Warn,
            };
            table = table.row([
                Cell::text(f.reading),
                Cell::text(&f.setting),
                Cell::number(&f.first),
                Cell::number(&f.range),
                Cell::verdict(verdict, &f.holds),
            ]);
        }
        page.table(table);
    }
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

fn end_table(result: &CaseResult, campaign: &Campaign) -> Table {
    let mut table = Table::new(
        format!(
            "{} after {} h: {}",
            capital(&figures::title(result.case)),
            campaign.plan.hours,
            figures::setting_line(result.case, campaign)
        ),
        [
            "state",
            "unit",
            "rms error",
            "sigma",
            "rms / sigma",
            "found after, h",
        ],
    );
    let Some(end) = result.statistics.end() else {
        return table;
    };
    let settled = settled_h(result);
    for (k, label) in STATE_LABELS[MISALIGNMENT..STATES].iter().enumerate() {
        let threshold = figures::GROUPS.iter().any(|g| {
            g.states.contains(&(MISALIGNMENT + k))
                && figures::threshold_applies(g, MISALIGNMENT + k)
        });
        let found = match settled[k] {
            Some(hours) => Cell::number(format!("{hours:.2}")),
            None if threshold => Cell::Warn("not".to_owned()),
            None => Cell::text(""),
        };
        table = table.row([
            Cell::text(format!("{} {}", label.symbol, label.words)),
            Cell::text(label.unit),
            Cell::number(significant(end.rms()[k] / label.scale)),
            Cell::number(significant(end.sigma()[k] / label.scale)),
            Cell::number(format!("{:.2}", end.rms_over_sigma()[k])),
            found,
        ]);
    }
    table
}

fn nees_table(campaign: &Campaign) -> Table {
    let [low, high] = mean_nees_bounds(campaign.plan.runs, CONFIDENCE);
    let whole: Vec<f64> = (1..=4)
        .map(|k| campaign.plan.hours * f64::from(k) / 4.0)
        .collect();
    let mut header = vec!["case".to_owned()];
    header.extend(whole.iter().map(|h| format!("at {h} h")));
    let mut table = Table::new(
        format!(
            "Mean NEES of {} runs; {:.0} % of consistent filters lie within {low:.2} .. {high:.2}.",
            campaign.plan.runs,
            CONFIDENCE * 100.0
        ),
        header,
    );
    for result in &campaign.cases {
        let mut row = vec![Cell::text(capital(&result.case.name()))];
        for hours in &whole {
            let nees = result
                .statistics
                .points
                .iter()
                .rfind(|p| p.time_s <= hours * 3600.0 + 1.0)
                .and_then(Point::mean_nees);
            row.push(match nees {
                Some(nees) if (low..=high).contains(&nees) => Cell::Good(format!("{nees:.2}")),
                Some(nees) => Cell::Warn(format!("{nees:.2}")),
                None => Cell::text(""),
            });
        }
        table = table.row(row);
    }
    table
}

fn voyage_table(campaign: &Campaign) -> Table {
    let mut table = Table::new(
        "Greatest position error (nmi) of an IMU with the errors of Table 1: median over the runs, and the worst run.",
        [
            "case",
            "turn, deg",
            "length, h",
            "median with",
            "worst with",
            "median without",
            "worst without",
        ],
    );
    for result in &campaign.cases {
        for (voyages, turn) in result.voyages.iter().zip(TURNS_DEG) {
            for (length, hours) in VOYAGE_H.into_iter().enumerate() {
                let cell = |metres: f64| Cell::number(format!("{:.2}", metres / NAUTICAL_MILE_M));
                table = table.row([
                    Cell::text(capital(&result.case.name())),
                    Cell::number(format!("{turn:.0}")),
                    Cell::number(format!("{hours:.0}")),
                    cell(voyages.median_greatest(length, 0)),
                    cell(voyages.worst(length, 0)),
                    cell(voyages.median_greatest(length, 1)),
                    cell(voyages.worst(length, 1)),
                ]);
            }
        }
    }
    table
}

fn drawn_voyage_table(campaign: &Campaign) -> Table {
    let mut table = Table::new(
        format!(
            "Greatest position error (nmi) within {:.0} h of IMUs with errors drawn from P0: rms over the runs, and the worst run.",
            VOYAGE_H[0]
        ),
        [
            "case",
            "turn, deg",
            "rms with",
            "worst with",
            "rms without",
            "worst without",
        ],
    );
    for result in &campaign.cases {
        for (voyages, turn) in result.drawn_voyages.iter().zip(TURNS_DEG) {
            let cell = |metres: f64| Cell::number(format!("{:.2}", metres / NAUTICAL_MILE_M));
            table = table.row([
                Cell::text(capital(&result.case.name())),
                Cell::number(format!("{turn:.0}")),
                cell(voyages.rms_greatest(0, 0)),
                cell(voyages.worst(0, 0)),
                cell(voyages.rms_greatest(0, 1)),
                cell(voyages.worst(0, 1)),
            ]);
        }
    }
    table
}

/// What a scheme can show, as a section.
pub fn observability_section(page: &mut Page, level: u8, analysis: &Analysis) {
    page.section(level, capital(&analysis.name));
    let global = &analysis.global;
    let positions: Vec<_> = global.positions.iter().map(|p| p.name.as_str()).collect();
    page.key_values([
        (
            "distinct positions",
            format!("{}: {}", positions.len(), positions.join(", ")),
        ),
        (
            "four centres out of one plane, gyroscopes",
            spread_line(&global.gyroscopes),
        ),
        (
            "four centres out of one plane, accelerometers",
            spread_line(&global.accelerometers),
        ),
        ("rotations about a horizontal axis", rotations_line(global)),
    ]);
    let mut ranks = Table::new(
        format!(
            "Rank of the stripped observability matrix after every dwell of one cycle ({STATES} states); a singular value counts above {RANK_TOLERANCE:e} of the largest."
        ),
        [
            "dwell",
            "position",
            "rank",
            "smallest kept",
            "largest dropped",
            "still hidden",
        ],
    );
    for rank in &analysis.ranks {
        let hidden: Vec<_> = rank.hidden.iter().map(|h| h.words.as_str()).collect();
        ranks = ranks.row([
            Cell::number(rank.dwell.to_string()),
            Cell::text(&rank.position),
            Cell::number(rank.rank.to_string()),
            Cell::number(format!("{:.1e}", rank.smallest_kept)),
            Cell::number(dropped(rank.largest_dropped)),
            Cell::text(hidden.join("; ")),
        ]);
    }
    page.table(ranks);
    let mut degrees = Table::new(
        "Degree of observability over the whole run: how many times better the measurements alone know a state than it was known before (0: hidden).",
        [
            "state",
            "degree",
            "signal",
            "singular value",
            "bound at the end",
            "unit",
        ],
    );
    for (state, label) in STATE_LABELS.iter().enumerate() {
        let degree = &analysis.degrees.states[state];
        let singular = analysis
            .degrees
            .directions
            .iter()
            .find(|d| d.state == state);
        let end = analysis.bound.last().map_or(f64::NAN, |p| p.sigma[state]);
        degrees = degrees.row([
            Cell::text(format!("{} {}", label.symbol, label.words)),
            Cell::number(significant(degree.degree)),
            Cell::number(significant(degree.signal)),
            Cell::number(singular.map_or_else(String::new, |d| significant(d.value))),
            Cell::number(significant(end / label.scale)),
            Cell::text(label.unit),
        ]);
    }
    page.table(degrees);
}
