//! How often a record is gone over, and what is written of its smoothed epochs.

use std::{
    fmt,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use analysis::Notes;
use analysis::passes::{self, FirstPass, MOST_PASSES, Passes};
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
        self_calibration::{Estimate, Event, SelfCalibration, Settings},
    },
    stream::Reading,
};

use crate::{calibrate::short, output, sensor_input::SensorInput};

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
        let passes = Passes {
            asked: self.passes,
            smooths: self.smooth || self.smoothed.is_some(),
        };
        let output = passes.smooths.then(|| self.output(bag)).transpose()?;
        let (first, estimate, notes) = first_pass(input, bag, settings, passes)?;
        let mut again = |title: &str, take: &mut dyn FnMut(&Reading) -> ControlFlow<()>| {
            input.again(bag, title, take)
        };
        let passed = passes::go_over(first, estimate, passes, settings, &mut again)?;
        let (estimate, passes) = (passed.estimate.clone(), passed.passes);
        let smoothed = match output {
            Some(path) => Some(write(&path, self.force, &passed.into_epochs(&mut again)?)?),
            None => None,
        };
        Ok(Passed {
            estimate,
            notes,
            passes,
            smoothed,
        })
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

fn first_pass(
    input: &SensorInput,
    bag: &Bag,
    settings: &Settings,
    passes: Passes,
) -> anyhow::Result<(FirstPass, Estimate, Notes)> {
    let mut first = FirstPass::new(passes, SelfCalibration::new(settings.clone())?);
    let mut said = 0.0;
    let mut notes = input.feed(bag, "calibrating", |sample, told| {
        if let Some(reading) = sample.reading() {
            first.smoothing().push(&reading)?;
        }
        while let Some(event) = first.poll() {
            told.event(&event);
            if let Event::Estimate(estimate) = &event
                && (estimate.duration_s - said).abs() >= 60.0
            {
                said = estimate.duration_s;
                told.progress.message(short(estimate));
            }
        }
        Ok(ControlFlow::Continue(()))
    })?;
    let estimate = first
        .smoothing()
        .finish()
        .with_context(|| input.what_is_missing(bag))?;
    while let Some(event) = first.poll() {
        notes.event(&output::Screen, "at the end", &event);
    }
    notes.tell(&output::Screen);
    Ok((first, estimate, notes))
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
