//! What a sequencer is told: tolerances, times.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::range;

/// What counts as arrived, and how long to wait for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequencerSettings {
    /// A joint has arrived within this of its target \[rad\].
    pub position_tolerance_rad: f64,
    /// A joint rests below this rate \[rad/s\].
    pub rate_tolerance_rad_s: f64,
    /// Both must hold for this long before the table counts as arrived; the dwell counts from the beginning of it \[s\].
    pub settling_s: f64,
    /// Fault where the table has not arrived this long after the planned end of a rotation \[s\].
    pub arrival_timeout_s: f64,
    /// A rotation is commanded this long before it starts; 0: when it is due, to start at once \[s\].
    pub command_lead_s: f64,
    /// A longer step between two joint states is reported as a gap \[s\].
    pub joint_state_gap_s: f64,
    /// Finished this long after the beginning of the first dwell, whatever the program has left \[s\].
    pub stop_after_s: Option<f64>,
    /// Where the stamps run back (a simulator or a player was started again), start the program again instead of a fault.
    pub restart_when_time_runs_back: bool,
}

impl Default for SequencerSettings {
    fn default() -> Self {
        Self {
            position_tolerance_rad: 0.01_f64.to_radians(),
            rate_tolerance_rad_s: 0.01_f64.to_radians(),
            settling_s: 1.0,
            arrival_timeout_s: 30.0,
            command_lead_s: 10.0,
            joint_state_gap_s: 1.0,
            stop_after_s: None,
            restart_when_time_runs_back: false,
        }
    }
}

impl SequencerSettings {
    /// Checks that every value means something.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the setting.
    pub fn validate(&self) -> Result<(), Error> {
        for (name, value, zero_is_good) in [
            (
                "position tolerance [rad]",
                self.position_tolerance_rad,
                false,
            ),
            ("rate tolerance [rad/s]", self.rate_tolerance_rad_s, false),
            ("settling time [s]", self.settling_s, true),
            ("arrival time-out [s]", self.arrival_timeout_s, false),
            ("command lead [s]", self.command_lead_s, true),
            ("joint state gap [s]", self.joint_state_gap_s, false),
            ("stop after [s]", self.stop_after_s.unwrap_or(1.0), false),
        ] {
            if zero_is_good {
                range::not_negative(name, value)?;
            } else {
                range::positive(name, value)?;
            }
        }
        Ok(())
    }
}
