//! What the node keeps of its state, and how it goes on from it.
//!
//! The machine is kept whole. When the node comes back the time since is a hole in the samples like any other. How long it was, only
//! the stamps say: so the first samples decide whether the state is young enough.

use std::path::{Path, PathBuf};

use checkpoint::Kind;
use serde::{Deserialize, Serialize};
use sins::Stamp;
use sins::machines::self_calibration::{Estimate, SelfCalibration, Settings, Snapshot};
use sins::sensor::ImuSample;
use sins::table::JointSample;

use crate::calibrator::Calibrator;

/// Rises where something of the node itself is kept that was not, or no longer.
const NODE_VERSION: u32 = 1;

/// The checkpoint of this node.
pub const KIND: Kind = Kind {
    name: "self_calibrator",
    version: 1000 * NODE_VERSION + Snapshot::VERSION,
};

/// Two samples that are closer than this agree about the time \[s\].
const AGREE_S: f64 = 1.0;
/// So many joint states are kept until the samples say what the time is.
const MOST_JOINTS: usize = 1000;
/// And so many samples, where no two of them agree.
const MOST_SAMPLES: usize = 100;

/// What is kept.
#[derive(Debug, Serialize, Deserialize)]
pub struct Kept {
    machine: Snapshot,
    latest: Option<Estimate>,
    good: Option<Estimate>,
    converged_published: bool,
    finish: Option<Stamp>,
    frame_id: String,
}

/// A state that waits for the first samples.
#[derive(Debug)]
pub(crate) struct Waking {
    path: PathBuf,
    oldest_s: f64,
    newest: Stamp,
    machine: SelfCalibration,
    kept: Kept,
    joints: Vec<JointSample>,
    samples: Vec<ImuSample>,
}

impl Waking {
    /// A state of these settings.
    ///
    /// # Errors
    /// Why it cannot be gone on with.
    fn new(
        kept: Kept,
        settings: &Settings,
        path: &Path,
        oldest_s: f64,
    ) -> Result<Self, sins::Error> {
        let newest = kept.machine.newest().unwrap_or_default();
        let machine = SelfCalibration::resume(settings.clone(), kept.machine.clone())?;
        Ok(Self {
            path: path.to_owned(),
            oldest_s,
            newest,
            machine,
            kept,
            joints: Vec::new(),
            samples: Vec::new(),
        })
    }

    /// Takes a reading of the joints.
    pub(crate) fn joints(&mut self, joints: JointSample) {
        if self.joints.len() < MOST_JOINTS {
            self.joints.push(joints);
        }
    }

    /// Takes a sample; says how long the hole is once two samples agree about the time \[s\].
    fn sample(&mut self, sample: &ImuSample) -> Option<f64> {
        let agrees = |before: &ImuSample| {
            let apart_s = sample.stamp.seconds_since(before.stamp);
            apart_s > 0.0 && apart_s < AGREE_S
        };
        let first = self.samples.iter().find(|before| agrees(before));
        let seconds = first.map(|first| first.stamp.seconds_since(self.newest));
        if self.samples.len() < MOST_SAMPLES {
            self.samples.push(*sample);
        }
        seconds
    }

    /// Why a state that is so old is not gone on with.
    fn refusal(&self, seconds: f64) -> Option<String> {
        if seconds <= 0.0 {
            return Some(format!(
                "it is of a time {:.1} s after that of the samples",
                -seconds
            ));
        }
        (seconds > self.oldest_s).then(|| {
            format!(
                "it is {seconds:.1} s old, expected at most {} s (checkpoint_oldest_s)",
                self.oldest_s
            )
        })
    }
}

impl Calibrator {
    /// The state as it stands; none where there is nothing to keep, or where the first samples have not yet said whether to go on
    /// from an older one.
    pub fn keep(&self) -> Option<Kept> {
        self.machine.samples().counts.samples.checked_sub(1)?;
        self.waking.is_none().then(|| Kept {
            machine: self.machine.snapshot(),
            latest: self.latest.clone(),
            good: self.good.clone(),
            converged_published: self.converged_published,
            finish: self.finish,
            frame_id: self.frame_id.clone(),
        })
    }

    /// Is to go on from a state, if the first samples say that it is young enough.
    pub fn wake_from(&mut self, kept: Kept, path: &Path, oldest_s: f64) {
        match Waking::new(kept, self.machine.settings(), path, oldest_s) {
            Ok(waking) => {
                tracing::info!(
                    "checkpoint {}: phase {}, {} samples; waits for samples to go on",
                    path.display(),
                    waking.machine.phase().name(),
                    waking.machine.samples().counts.samples
                );
                self.waking = Some(Box::new(waking));
            }
            Err(error) => checkpoint::put_aside(path, &error.to_string()),
        }
    }

    /// Takes a sample while it is not known yet whether to go on.
    pub(crate) fn wake(&mut self, sample: &ImuSample) {
        let Some(mut waking) = self.waking.take() else {
            return self.machine.push_imu(sample);
        };
        let Some(seconds) = waking.sample(sample) else {
            self.waking = Some(waking);
            return;
        };
        let samples = std::mem::take(&mut waking.samples);
        if let Some(why) = waking.refusal(seconds) {
            checkpoint::put_aside(&waking.path, &why);
        } else {
            self.go_on(*waking, seconds);
        }
        for sample in &samples {
            self.machine.push_imu(sample);
        }
    }

    fn go_on(&mut self, waking: Waking, seconds: f64) {
        let Waking {
            machine,
            kept,
            joints,
            path,
            ..
        } = waking;
        self.machine = machine;
        self.machine.set_thresholds(self.own_thresholds.clone());
        for joints in joints {
            // One that is not finite was refused when it came.
            let _refused = self.machine.push_joints(joints);
        }
        self.latest = kept.latest;
        self.good = kept.good;
        self.converged_published = kept.converged_published;
        self.finish = kept.finish;
        self.frame_id = kept.frame_id;
        self.phase = self.machine.phase();
        tracing::info!(
            "goes on from checkpoint {} after {seconds:.1} s: phase {}",
            path.display(),
            self.phase.name()
        );
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::time::Duration;

    use super::*;

    fn sample(seconds: f64) -> ImuSample {
        ImuSample::at_rest(Stamp::default().plus_seconds(seconds), 9.8)
    }

    fn calibrator() -> Calibrator {
        Calibrator::new(&Settings::default(), "n", Duration::from_secs(3)).unwrap()
    }

    /// Of a calibrator that has taken samples up to 2000 s.
    fn kept() -> Kept {
        let mut calibrator = calibrator();
        for k in 199_000..=200_000 {
            calibrator.machine.push_imu(&sample(f64::from(k) * 0.01));
            while calibrator.machine.poll().is_some() {}
        }
        calibrator.keep().unwrap()
    }

    /// Where samples go on within the time that is permitted the state goes on too; an old one, or one of a time to come, is refused
    /// and put aside. A single wild stamp decides nothing, and until the samples decide nothing is written over.
    #[test]
    fn the_samples_say_how_old_a_state_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.kept");
        for (start_s, goes_on) in [(2010.0, true), (2700.0, false), (100.0, false)] {
            std::fs::write(&path, "x").unwrap();
            let mut calibrator = calibrator();
            calibrator.wake_from(kept(), &path, 600.0);
            calibrator.wake(&sample(0.0));
            calibrator.wake(&sample(start_s));
            assert!(calibrator.waking.is_some() && calibrator.keep().is_none());
            for k in 1..20 {
                calibrator.wake(&sample(start_s + f64::from(k) * 0.01));
                while calibrator.machine.poll().is_some() {}
            }
            assert!(calibrator.waking.is_none());
            let samples = calibrator.machine.samples().counts.samples;
            assert_eq!(samples > 1000, goes_on, "{start_s}: {samples}");
            assert_eq!(path.exists(), goes_on, "{start_s}");
        }
    }

    /// Other settings refuse a state at once, and put it aside.
    #[test]
    fn other_settings_refuse_a_state() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.kept");
        std::fs::write(&path, "x").unwrap();
        let other = Settings {
            step_s: 0.5,
            ..Settings::default()
        };
        let mut calibrator = Calibrator::new(&other, "n", Duration::from_secs(3)).unwrap();
        calibrator.wake_from(kept(), &path, 600.0);
        assert!(calibrator.waking.is_none() && !path.exists());
        assert!(calibrator.keep().is_none(), "nothing to keep yet");
    }
}
