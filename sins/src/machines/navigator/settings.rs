//! What the navigator is told, and the phases it goes through.

use crate::error::Error;
use crate::machines::self_calibration::Settings;
use crate::stream::StreamSettings;
use serde::{Deserialize, Serialize};

/// Settings of the navigator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NavigatorSettings {
    /// Settings of its own alignment (prior, coarse alignment, noise, table, longest bridge over a hole).
    pub alignment: Settings,
    /// Length of its own alignment \[s\]; longer than coarse alignment, because the heading goes on improving.
    pub alignment_s: f64,
    /// How long samples are kept for a calibration that arrives after them \[s\].
    pub history_s: f64,
    /// Whether a calibration's attitude may start the navigation; otherwise it always aligns itself.
    pub start_from_calibration: bool,
    /// How much later than a sample its joint state may come \[s\].
    pub joint_patience_s: f64,
    /// A longer hole in the samples begins an alignment, whatever the encoders tell: they know what the table turned, nothing of
    /// what the ship did \[s\].
    pub longest_hole_s: f64,
    /// A ship that is slower than this, by its own solution, lies at her mooring \[m/s\].
    pub moored_speed_m_s: f64,
}

impl Default for NavigatorSettings {
    fn default() -> Self {
        Self {
            alignment: Settings::default(),
            alignment_s: 900.0,
            history_s: 60.0,
            start_from_calibration: true,
            joint_patience_s: 0.0,
            longest_hole_s: 300.0,
            moored_speed_m_s: 0.5,
        }
    }
}

impl NavigatorSettings {
    /// Refuses what is out of range.
    ///
    /// # Errors
    /// [`Error::Setting`] with the name of the setting.
    pub fn check(&self) -> Result<(), Error> {
        self.alignment.check()?;
        for (name, value) in [
            ("alignment_s", self.alignment_s),
            ("history_s", self.history_s),
            ("joint_patience_s", self.joint_patience_s),
            ("longest_hole_s", self.longest_hole_s),
            ("moored_speed_m_s", self.moored_speed_m_s),
        ] {
            if !value.is_finite() || value < 0.0 {
                return Err(Error::setting(name, value, "a number that is not negative"));
            }
        }
        Ok(())
    }

    /// The settings of the stream that it takes its samples from.
    pub fn stream(&self) -> StreamSettings {
        let longest_s = self.longest_hole_s.max(self.alignment.restart_gap_s);
        StreamSettings {
            joint_patience_s: self.joint_patience_s,
            longest_bridge_s: longest_s,
            longest_told_hole_s: longest_s,
            ..self.alignment.stream()
        }
    }
}

/// Where the navigator stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NavigatorPhase {
    /// No calibration has come yet.
    WaitingForCalibration,
    /// It aligns itself on compensated samples.
    Aligning,
    /// Both solutions run.
    Navigating,
}

impl NavigatorPhase {
    /// The name that diagnostics carry.
    pub fn name(self) -> &'static str {
        match self {
            Self::WaitingForCalibration => "waiting_for_calibration",
            Self::Aligning => "aligning",
            Self::Navigating => "navigating",
        }
    }
}
