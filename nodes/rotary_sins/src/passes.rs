//! How often a record is gone over, and what is written of its smoothed epochs.

use std::{
    fmt,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use analysis::Notes;
use anyhow::{Context, bail, ensure};
use bags::{Bag, BagWriter, NewTopic, WriteOptions};
use clap::Args;
use nalgebra::{Matrix6, Vector3};
use ros2_interfaces::{nav_msgs::Odometry, sensor_msgs::NavSatFix};
use rotary_sins_msgs::{
    convert::{fix_of_position, odometry_of_block, row_major},
    interfaces::topics,
};
use serde::Serialize;
use sins::{
    earth::Position,
    estimation::{
        groups::{navigation::VELOCITY, vertical::VELOCITY_UP},
        smoother::Smoothed,
    },
    machines::{
        odometry::{UNKNOWN_VARIANCE, pose_covariance},
        self_calibration::{Estimate, Event, Guide, SelfCalibration, Settings, Smoothing},
    },
};

use crate::{calibrate::short, output, sensor_input::SensorInput};

/// More passes than this change nothing any more.
const MOST_PASSES: u32 = 9;
/// At most so many are made where nobody says how many.
const PASSES_BY_ITSELF: u32 = 4;

/// Passes and smoothing.
#[derive(Args)]
pub struct PassOptions {
    /// Go over the record so many times, each linear about what the one before found [default: one, or up to 4 where
    /// the azimuth was uncertain by more than a degree at first]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PASSES)))]
    passes: Option<u32>,
    /// Smooth: attitude, velocity and position of every second, as the whole record says they were
    #[arg(long)]
    smooth: bool,
    /// Where the smoothed record goes [default: beside the bag, as BAG-smoothed.mcap]; smooths
    #[arg(long, value_name = "FILE.mcap")]
    smoothed: Option<PathBuf>,
    /// Replace the calibration and the smoothed record where they are there already
    #[arg(long)]
    pub force: bool,
}

/// What was written of the smoothed record.
#[derive(Serialize)]
pub struct SmoothedBag {
    bag: PathBuf,
    epochs: usize,
}

impl fmt::Display for SmoothedBag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} epochs smoothed", self.bag.display(), self.epochs)
    }
}

/// What came of all passes.
pub struct Passed {
    /// The last pass's last estimate.
    pub estimate: Estimate,
    /// What happened on the way.
    pub notes: Notes,
    /// Their number.
    pub passes: u32,
    /// The smoothed record, where it was asked for.
    pub smoothed: Option<SmoothedBag>,
}

impl PassOptions {
    /// Goes over the bag.
    pub fn run(
        &self,
        input: &SensorInput,
        bag: &Bag,
        settings: &Settings,
    ) -> anyhow::Result<Passed> {
        let smooths = self.smooth || self.smoothed.is_some();
        let output = smooths.then(|| self.output(bag)).transpose()?;
        let (mut smoothing, mut estimate, notes) =
            self.first_pass(input, bag, settings, smooths)?;
        let mut passes = 1;
        while passes < self.passes.unwrap_or(PASSES_BY_ITSELF)
            && (self.passes.is_some() || smoothing.machine().wants_another_pass() == Some(true))
        {
            let epochs = epochs(smoothing, input, bag)?;
            let guide = Guide::new(&epochs, &estimate)
                .context("a further pass: the first one has no epoch")?;
            passes += 1;
            let machine = SelfCalibration::new(settings.clone())?.guided(guide);
            smoothing = Smoothing::new(machine);
            input.again(bag, &format!("pass {passes}"), |reading| {
                // What is refused has been said in the first pass.
                let _ = smoothing.push(reading);
                while smoothing.poll().is_some() {}
                ControlFlow::Continue(())
            })?;
            estimate = smoothing.finish()?;
        }
        let smoothed = match output {
            Some(path) => Some(write(&path, self.force, &epochs(smoothing, input, bag)?)?),
            None => None,
        };
        Ok(Passed {
            estimate,
            notes,
            passes,
            smoothed,
        })
    }

    fn first_pass(
        &self,
        input: &SensorInput,
        bag: &Bag,
        settings: &Settings,
        smooths: bool,
    ) -> anyhow::Result<(Smoothing, Estimate, Notes)> {
        let mut smoothing = Smoothing::new(SelfCalibration::new(settings.clone())?);
        if !smooths && self.passes == Some(1) {
            smoothing.keep_nothing();
        }
        let may_be_enough = !smooths && self.passes.is_none();
        let mut said = 0.0;
        let mut is_first = true;
        let mut notes = input.feed(bag, "calibrating", |sample, told| {
            if let Some(reading) = sample.reading() {
                smoothing.push(&reading)?;
            }
            while let Some(event) = smoothing.poll() {
                told.event(&event);
                let Event::Estimate(estimate) = &event else {
                    continue;
                };
                if (estimate.duration_s - said).abs() >= 60.0 {
                    said = estimate.duration_s;
                    told.progress.message(short(estimate));
                }
                let is_enough = smoothing.machine().wants_another_pass() == Some(false);
                if std::mem::take(&mut is_first) && may_be_enough && is_enough {
                    smoothing.keep_nothing();
                }
            }
            Ok(ControlFlow::Continue(()))
        })?;
        let estimate = smoothing
            .finish()
            .with_context(|| input.what_is_missing(bag))?;
        while let Some(event) = smoothing.poll() {
            notes.event(&output::Screen, "at the end", &event);
        }
        notes.tell(&output::Screen);
        Ok((smoothing, estimate, notes))
    }

    /// Where the smoothed record goes. A record that is there is refused before hours are gone over for it.
    fn output(&self, bag: &Bag) -> anyhow::Result<PathBuf> {
        let path = self.smoothed.clone().unwrap_or_else(|| {
            let name = bag.path().file_stem().unwrap_or_default();
            let mut name = name.to_owned();
            name.push("-smoothed.mcap");
            bag.path().with_file_name(name)
        });
        if bag.file_paths().any(|file| files::is_same(&path, file)) {
            bail!(
                "{}: it is what is read, and would be written over",
                path.display()
            );
        }
        ensure!(
            self.force || !path.exists(),
            "{}: it is there already; --force replaces it",
            path.display()
        );
        Ok(path)
    }
}

/// The smoothed epochs; what did not fit into the memory is read again.
fn epochs(
    mut smoothing: Smoothing,
    input: &SensorInput,
    bag: &Bag,
) -> anyhow::Result<Vec<Smoothed>> {
    while let Some(replay) = smoothing.rewind() {
        let (first, end) = (replay.skip, replay.skip + replay.count);
        let mut count = 0;
        input.again(bag, "smoothing", |reading| {
            if count >= end {
                return ControlFlow::Break(());
            }
            if count >= first {
                smoothing.again(reading);
            }
            count += 1;
            ControlFlow::Continue(())
        })?;
    }
    Ok(smoothing.into_epochs())
}

/// Writes the smoothed record as a bag.
fn write(path: &Path, replaces: bool, epochs: &[Smoothed]) -> anyhow::Result<SmoothedBag> {
    let options = WriteOptions {
        replaces,
        ..WriteOptions::default()
    };
    let mut bag = BagWriter::create(path, options)?;
    let odometry = bag.add_topic(NewTopic::on(&topics::SMOOTHED_ODOMETRY))?;
    let fix = bag.add_topic(NewTopic::on(&topics::SMOOTHED_FIX))?;
    for epoch in epochs {
        let time = epoch.stamp.nanos().unsigned_abs();
        let (pose, place) = messages(epoch, &epochs[0].navigation.position)?;
        bag.write(odometry, time, &pose)?;
        bag.write(fix, time, &place)?;
    }
    Ok(SmoothedBag {
        bag: bag.finish()?.path,
        epochs: epochs.len(),
    })
}

/// An epoch as messages: the block's pose from where the record begins, and its place on the globe.
fn messages(epoch: &Smoothed, origin: &Position) -> anyhow::Result<(Odometry, NavSatFix)> {
    let navigation = &epoch.navigation;
    let covariance = epoch.covariance()?;
    let pose = pose_covariance(navigation, &covariance);
    // How fast the block turns is not estimated.
    let mut odometry = odometry_of_block(
        epoch.stamp,
        origin.offset_m(&navigation.position),
        navigation.attitude,
        navigation.velocity,
        Vector3::zeros(),
    );
    odometry.pose.covariance = row_major(&pose);
    let [east, north] = VELOCITY;
    let mut velocity = covariance.block_or(&[east, north, VELOCITY_UP], 0.0);
    if covariance.position(VELOCITY_UP).is_none() {
        velocity[(2, 2)] = UNKNOWN_VARIANCE;
    }
    let turn = navigation.attitude.inverse().to_rotation_matrix();
    let mut twist = Matrix6::from_diagonal_element(UNKNOWN_VARIANCE);
    twist
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&(turn * velocity * turn.transpose()));
    odometry.twist.covariance = row_major(&twist);
    let place = pose.fixed_view::<3, 3>(0, 0).into_owned();
    let fix = fix_of_position(
        epoch.stamp,
        odometry.child_frame_id.as_str(),
        &navigation.position,
        &place,
    );
    Ok((odometry, fix))
}
