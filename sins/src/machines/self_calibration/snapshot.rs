//! The whole machine at a moment, to be kept and gone on with.
//!
//! What has been gathered, filters, judge, what waits in the stream and all counts are in it, to the last bit. A machine that goes
//! on from it and one that never stopped and did not get what came meanwhile are the same machine: the time since is a
//! hole in the samples, and is crossed as every hole is.

use serde::{Deserialize, Serialize};

use super::{Phase, SelfCalibration, Settings, Thresholds};
use crate::error::Error;
use crate::time::Stamp;

/// A machine as it stood.
///
/// ```
/// use sins::Stamp;
/// use sins::machines::self_calibration::{SelfCalibration, Settings};
/// use sins::sensor::ImuSample;
///
/// let mut machine = SelfCalibration::new(Settings::default())?;
/// for k in 0..100 {
///     machine.push_imu(&ImuSample::at_rest(Stamp::from_nanos(k * 10_000_000), 9.8));
///     while machine.poll().is_some() {}
/// }
/// let snapshot = machine.snapshot();
/// let resumed = SelfCalibration::resume(Settings::default(), snapshot.clone())?;
/// assert_eq!(resumed.samples(), machine.samples());
///
/// let other = Settings { step_s: 2.0, ..Settings::default() };
/// let refused = SelfCalibration::resume(other, snapshot).unwrap_err();
/// assert!(refused.to_string().contains("step_s: 1.0"));
/// # Ok::<(), sins::Error>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Snapshot {
    machine: SelfCalibration,
}

impl Snapshot {
    /// Rises with every change of what is in a snapshot: one of another version cannot be read.
    pub const VERSION: u32 = 2;

    /// Stamp of the newest sample in it.
    pub fn newest(&self) -> Option<Stamp> {
        self.machine.stream.newest()
    }

    /// Where the machine stood.
    pub fn phase(&self) -> Phase {
        self.machine.phase()
    }
}

impl SelfCalibration {
    /// The machine as it stands. Events that have not been polled are not in it.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            machine: self.clone(),
        }
    }

    /// Goes on from a snapshot. The thresholds are those of `settings`; nothing else may differ from the settings that the snapshot was
    /// made with, for its numbers would be those of another filter.
    ///
    /// # Errors
    /// [`Error::Snapshot`] with the first setting that differs, or with what cannot be in it.
    pub fn resume(settings: Settings, snapshot: Snapshot) -> Result<Self, Error> {
        settings.check()?;
        let mut machine = snapshot.machine;
        let asked = Settings {
            thresholds: Thresholds::NONE,
            ..settings.clone()
        };
        machine.estimator.set_thresholds(Thresholds::NONE);
        if *machine.settings() != asked {
            return Err(Error::Snapshot {
                reason: difference(machine.settings(), &asked),
            });
        }
        machine.check()?;
        machine.estimator.set_thresholds(settings.thresholds);
        Ok(machine)
    }

    /// Refuses what no machine of these settings holds.
    fn check(&self) -> Result<(), Error> {
        let stream = self.estimator.settings().stream();
        if *self.stream.settings() != stream {
            return Err(Error::Snapshot {
                reason: "the stream has other settings than the machine".to_owned(),
            });
        }
        self.estimator.check()
    }
}

/// The first line in which two settings differ.
fn difference(kept: &Settings, asked: &Settings) -> String {
    let (kept, asked) = (format!("{kept:#?}"), format!("{asked:#?}"));
    // What a line belongs to is the last line before it that is less far in.
    let mut above: Vec<&str> = Vec::new();
    for (kept, asked) in kept.lines().zip(asked.lines()) {
        let depth = (kept.len() - kept.trim_start().len()) / 4;
        above.truncate(depth.saturating_sub(1));
        let clean = |line: &str| {
            line.trim()
                .trim_end_matches([',', '{', '[', '('])
                .trim_end()
                .to_owned()
        };
        if kept != asked {
            let names = above
                .iter()
                .map(|line| line.trim().split([':', ' ']).next().unwrap_or_default());
            let within = names.fold(String::new(), |within, name| within + name + ": ");
            return format!(
                "it was made with {within}{}, the settings say {within}{}",
                clean(kept),
                clean(asked)
            );
        }
        if depth > 0 {
            above.push(kept);
        }
    }
    "it was made with other settings".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The setting that differs is named with both values, and with what it belongs to.
    #[test]
    fn the_setting_that_differs_is_named() {
        let kept = Settings::default();
        let mut asked = Settings::default();
        asked.prior.misalignment_rad.z = 0.5;
        let told = difference(&kept, &asked);
        assert!(told.contains("prior: misalignment_rad: "), "{told}");
        assert!(told.contains("0.5") && told.contains("0.17453"), "{told}");
        let asked = Settings {
            noise: Some(super::super::default_noise()),
            ..Settings::default()
        };
        let told = difference(&kept, &asked);
        assert!(
            told.contains("noise: None") && told.contains("noise: Some"),
            "{told}"
        );
    }
}
