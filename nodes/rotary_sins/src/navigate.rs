//! `rotary-sins navigate`: free-inertial navigation with and without a calibration, held against the positions of the bag.

use std::{ops::ControlFlow, path::PathBuf};

use analysis::{FreeNavigation, NavigationFigures};
use anyhow::{Context, ensure};
use clap::Args;
use ros_node::ParameterSet;
use serde::Serialize;
use sins::machines::navigator::{NavigatorEvent, NavigatorSettings};

use crate::{
    Outcome,
    filter_options::AlignmentOptions,
    output,
    parameter_options::{Given, Group},
    sensor_input::{SensorInput, Told},
};

/// Options of `navigate`.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    input: SensorInput,
    /// Calibration, as `calibrate --output` writes it
    #[arg(long, value_name = "FILE.yaml")]
    calibration: PathBuf,
    #[command(flatten)]
    navigation: Given<Navigation>,
    /// Write JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    filter: AlignmentOptions,
}

/// Parameters of the navigator, as the node `navigation_compensator` has them, that mean something for a bag.
#[derive(Clone, Debug)]
struct Navigation;

impl Group for Navigation {
    type Settings = NavigatorSettings;
    const HEADING: &'static str = "Navigation";

    fn set() -> ParameterSet<NavigatorSettings> {
        navigation_compensator::parameters::navigator().without(&[
            "history_s",
            "joint_patience_s",
            "start_from_calibration",
        ])
    }
}

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    figures: NavigationFigures,
    warnings: Vec<String>,
}

/// What of the navigator's events a person should know.
fn tell(told: &mut Told<'_>, event: &NavigatorEvent) {
    let topic = told.topic;
    match event {
        NavigatorEvent::Refused(refused) => told.notes.refused(told.progress, topic, refused),
        NavigatorEvent::Restarted { stamp, cause } => told.notes.say(
            told.progress,
            format!(
                "{topic}: {cause} at {} ns: navigation aligns itself anew",
                stamp.nanos()
            ),
        ),
        NavigatorEvent::HoleCrossed {
            stamp,
            seconds,
            held: true,
        } => told.notes.say(
            told.progress,
            format!(
                "{topic}: a hole of {seconds:.3} s up to {} ns: course and speed are kept, less certain",
                stamp.nanos()
            ),
        ),
        NavigatorEvent::AlignmentFailed { reason, .. } => {
            told.notes.hold(format!("{topic}: {reason}"));
        }
        _ => {}
    }
}

/// Aligns on the first part of the bag, then navigates freely.
pub fn run(options: &Options) -> anyhow::Result<Outcome> {
    let name = || options.calibration.display().to_string();
    let calibration = calibration_file::read(&options.calibration)?
        .usable()
        .with_context(name)?;
    let bag = options.input.open()?;
    let settings = options.navigation.settings()?;
    let settings = NavigatorSettings {
        alignment: options.filter.machine(options.input.turntable()?)?,
        // In a bag every joint state is there in time.
        joint_patience_s: NavigatorSettings::default().joint_patience_s,
        ..settings
    };
    let alignment_s = settings.alignment_s;
    let mut navigation = FreeNavigation::new(settings, calibration)?;
    let mut notes = options.input.feed(&bag, "navigating", |sample, told| {
        if navigation.push(&sample, |event| tell(told, event))? {
            let [with, without] = navigation.distances();
            told.progress.message(format!(
                "{:.3} nmi, uncompensated {:.3} nmi",
                with.last, without.last
            ));
        }
        Ok(ControlFlow::Continue(()))
    })?;
    let Some(navigated) = navigation.finish() else {
        anyhow::bail!(
            "{}: navigation did not begin: it stands at {}, and needs {alignment_s} s at rest and a position",
            options.input.what_is_missing(&bag),
            navigation.phase().name()
        );
    };
    notes.tell(&output::Screen);
    ensure!(
        navigated.fixes > 0,
        "{}: no position to hold the navigation against after its start",
        bag.path().display()
    );
    let report = Report {
        figures: NavigationFigures::from(&navigated),
        warnings: notes.lines,
    };
    report.print(options.json)?;
    Ok(Outcome::Reached)
}

impl Report {
    fn print(&self, json: bool) -> anyhow::Result<()> {
        if json {
            return output::json(self);
        }
        let figures = &self.figures;
        output::text_line(&format!(
            "position error at most {:.3} nmi in {:.0} s ({:.3} nmi without compensation)",
            figures.max_position_error_nmi,
            figures.navigation_s,
            figures.max_position_error_uncompensated_nmi
        ))
    }
}
