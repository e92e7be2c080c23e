//! A sequencer that is kept, and goes on where it stood.
//!
//! The table goes on by itself: it ends the motion that it was given and rests. So most of what a sequencer knew still holds when it
//! comes back, and the time since is a gap in the joint states. Only a motion that the table has not heard of, or did not
//! end, is planned anew from where it stands.

use serde::{Deserialize, Serialize};

use super::{Phase, Program, Sequencer, SequencerSettings, State};
use crate::error::Error;
use crate::table::JointSample;
use crate::time::Stamp;

/// A sequencer as it stood.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Snapshot {
    sequencer: Sequencer,
}

impl Snapshot {
    /// Rises with every change of what is in a snapshot: one of another version cannot be read.
    pub const VERSION: u32 = 1;

    /// Stamp of the newest joint state in it.
    pub fn newest(&self) -> Option<Stamp> {
        self.sequencer.last.map(|sample| sample.stamp)
    }

    /// What the sequencer was doing.
    pub fn state(&self) -> State {
        self.sequencer.state()
    }
}

impl Sequencer {
    /// The sequencer as it stands.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            sequencer: self.clone(),
        }
    }

    /// Goes on from a snapshot, with the settings as they are now.
    ///
    /// # Errors
    /// [`Error::Snapshot`] where it ran another program, or holds what no sequencer does.
    pub fn go_on(
        program: &Program,
        settings: SequencerSettings,
        snapshot: Snapshot,
    ) -> Result<Self, Error> {
        settings.validate()?;
        let refused = |reason: String| Err(Error::Snapshot { reason });
        let mut sequencer = snapshot.sequencer;
        if sequencer.program.name != program.name {
            return refused(format!(
                "it ran the scheme {:?}, now it is {:?}",
                sequencer.program.name, program.name
            ));
        }
        if sequencer.program != *program {
            return refused(format!(
                "the scheme {:?} has other steps, axes, rates or limits now",
                program.name
            ));
        }
        let is_step = |step: u32| step as usize <= program.steps.len();
        let cycles = program.cycles.unwrap_or(u32::MAX);
        let (cycle, step) = sequencer.departing;
        let is_sound = is_step(sequencer.step)
            && is_step(step)
            && sequencer.cycle.max(cycle) <= cycles
            && sequencer.at.iter().all(|angle| angle.is_finite());
        if !is_sound {
            return refused("it stands where the scheme has no place".to_owned());
        }
        sequencer.settings = settings;
        sequencer.woken = true;
        sequencer.say(format!("{}: goes on", program.name));
        Ok(sequencer)
    }

    /// Looks at the first joint state since: a drive holds where the table still works on it, or has ended it.
    pub(super) fn wake(&mut self, sample: &JointSample) {
        let Phase::Driving(leg) = self.phase else {
            return;
        };
        let now = sample.stamp;
        let joint = leg.joint.index();
        let target = self.program.target(self.cycle, self.step)[joint];
        let turns = sample.velocity[joint].abs() > self.settings.rate_tolerance_rad_s;
        let is_there =
            (sample.position[joint] - target).abs() <= self.settings.position_tolerance_rad;
        if is_there || (turns && now < leg.end) {
            return;
        }
        // Not begun, not heard of, or broken off: what is left of it begins when it was due.
        self.delay_nanos = (leg.start.nanos() - now.nanos()).max(0);
        self.phase = Phase::Stilling { deadline: None };
    }
}
