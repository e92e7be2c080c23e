//! `rotary-sins`: simulate, align, calibrate, navigate, inspect, report on, record and play bags.
//!
//! The commands drive the state machines of `sins` with the samples of a bag, as the nodes drive them with those of
//! DDS, and give the same numbers. Exit status: 0 done; 1 it ran and did not reach what was asked for; 2 the arguments
//! or the input cannot be used, with one line on standard error.

mod align;
mod allan;
mod ament_types;
mod assurance;
mod calibrate;
mod compare;
mod demo;
mod design_scheme;
mod experiment;
mod filter_options;
mod info;
mod monitor;
mod navigate;
mod observability;
mod output;
mod parameter_options;
mod passes;
mod play;
mod progress;
mod record;
mod run_report;
mod scheme_options;
mod sensor_input;
mod simulate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[global_allocator]
static ALLOCATOR: ros_node::BoundedAllocator = ros_node::BoundedAllocator;

/// Self-calibration of a dual-axis rotary strapdown inertial navigation system.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Say what is in a bag, and whether it is whole
    Info(info::Options),
    /// Simulate a ship, a turntable and an IMU into a bag
    Simulate(simulate::Options),
    /// Find heading, roll and pitch at rest
    Align(align::Options),
    /// Estimate gyroscope drifts and accelerometer biases while the table turns
    Calibrate(calibrate::Options),
    /// Navigate freely with and without a calibration
    Navigate(navigate::Options),
    /// Find the noise of the sensors in a bag at rest: Allan deviations, and the noises in them
    Allan(allan::Options),
    /// Reproduce the paper's simulations, and judge its claims
    Compare(compare::Options),
    /// Repeat the paper's experiment on simulated IMUs
    Experiment(experiment::Options),
    /// Draw worlds, inside the model and outside, and say how often the judge is wrong
    Assurance(assurance::Options),
    /// Say what a rotation scheme can show of the errors, and how well
    Observability(observability::Options),
    /// Search for rotation schemes that show the errors better or sooner
    DesignScheme(design_scheme::Options),
    /// Make a page about one recorded run: estimates, consistency, steps, gaps, verdict
    Report(run_report::Options),
    /// Show how the calibration goes, on one page of a terminal
    Monitor(monitor::Options),
    /// Record topics of any type into a bag, until Ctrl-C
    Record(record::Options),
    /// Play the topics of a bag
    Play(play::Options),
    /// Run the whole suite in accelerated simulated time and hold the result against the truth
    Demo(demo::Options),
}

/// How a command ended that did run.
enum Outcome {
    /// It reached what was asked for.
    Reached,
    /// It did not.
    Missed,
    /// What was read is damaged.
    Damaged,
}

fn main() -> ExitCode {
    // What comes behind --ros-args is for the node of `record`, `play` and `monitor`.
    let told: Result<Vec<String>, _> = std::env::args_os()
        .map(std::ffi::OsString::into_string)
        .collect();
    let mut arguments = match told {
        Ok(arguments) => arguments,
        Err(argument) => {
            let argument = argument.to_string_lossy();
            return refused(&format!("argument {argument:?} is no UTF-8"));
        }
    };
    let ros_from = arguments
        .iter()
        .position(|argument| argument == "--ros-args");
    let ros_arguments = ros_from
        .map(|at| arguments.split_off(at))
        .unwrap_or_default();
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(asked) if !asked.use_stderr() => asked.exit(),
        Err(error) => return refused(what_is_wrong(&error.to_string())),
    };
    match dispatch(cli.command, ros_arguments) {
        Ok(status) => status,
        Err(error) => refused(&format!("{error:#}")),
    }
}

/// Says in one line what was refused, whatever the causes wrote.
fn refused(text: &str) -> ExitCode {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    output::note(line);
    ExitCode::from(2)
}

/// What clap says without its advice on how to ask.
fn what_is_wrong(text: &str) -> &str {
    let end = ["\nUsage:", "\nFor more information"]
        .iter()
        .filter_map(|advice| text.find(advice))
        .min();
    let text = &text[..end.unwrap_or(text.len())];
    text.strip_prefix("error: ").unwrap_or(text)
}

fn dispatch(command: Command, ros_arguments: Vec<String>) -> anyhow::Result<ExitCode> {
    let outcome = match command {
        Command::Record(options) => return Ok(record::run(&options, ros_arguments)),
        Command::Play(options) => return play::run(&options, ros_arguments),
        Command::Monitor(options) => return Ok(monitor::run(&options, ros_arguments)),
        _ if !ros_arguments.is_empty() => {
            anyhow::bail!("--ros-args is for record, play and monitor")
        }
        Command::Info(options) => info::run(&options)?,
        Command::Simulate(options) => simulate::run(&options)?,
        Command::Align(options) => align::run(&options)?,
        Command::Calibrate(options) => calibrate::run(&options)?,
        Command::Navigate(options) => navigate::run(&options)?,
        Command::Allan(options) => allan::run(&options)?,
        Command::Compare(options) => compare::run(&options)?,
        Command::Experiment(options) => experiment::run(&options)?,
        Command::Assurance(options) => assurance::run(&options)?,
        Command::Observability(options) => observability::run(&options)?,
        Command::DesignScheme(options) => design_scheme::run(&options)?,
        Command::Report(options) => run_report::run(&options)?,
        Command::Demo(options) => demo::run(&options)?,
    };
    Ok(match outcome {
        Outcome::Reached => ExitCode::SUCCESS,
        Outcome::Missed => ExitCode::from(1),
        Outcome::Damaged => ExitCode::from(3),
    })
}
