//! What the node keeps of its state, and how it goes on from it.
//!
//! The sequencer is kept whole. When the node comes back, the first joint states say how long it was away; a scheme that ran goes on
//! where it stood, and one that was paused, aborted or finished stays so. A node that is ended in order stops the table
//! and keeps nothing.

use std::path::{Path, PathBuf};

use checkpoint::Kind;
use sins::Stamp;
use sins::table::JointSample;
use sins::table::scheme::sequencer::{SequencerSettings, Snapshot};
use sins::table::scheme::{Program, Sequencer};

/// The checkpoint of this node.
pub const KIND: Kind = Kind {
    name: "scheme_sequencer",
    version: Snapshot::VERSION,
};

/// Two joint states that are closer than this agree about the time \[s\].
const AGREE_S: f64 = 2.0;

/// A sequencer that waits for the first joint states.
pub struct Waking {
    sequencer: Sequencer,
    newest: Stamp,
    path: PathBuf,
    oldest_s: f64,
    before: Option<Stamp>,
}

/// What the joint states say of it.
pub enum Woken {
    /// Not enough yet.
    Waiting,
    /// It goes on, after so many seconds.
    GoesOn(Box<Sequencer>, f64),
    /// It does not.
    Refused(PathBuf, String),
}

impl Waking {
    /// A sequencer of this program.
    ///
    /// # Errors
    /// Why it cannot be gone on with.
    pub fn new(
        snapshot: Snapshot,
        program: &Program,
        settings: SequencerSettings,
        path: &Path,
        oldest_s: f64,
    ) -> Result<Self, sins::Error> {
        let newest = snapshot.newest().unwrap_or_default();
        Ok(Self {
            sequencer: Sequencer::go_on(program, settings, snapshot)?,
            newest,
            path: path.to_owned(),
            oldest_s,
            before: None,
        })
    }

    /// It is not gone on with, for this reason.
    pub fn put_aside(self, why: &str) {
        checkpoint::put_aside(&self.path, why);
    }

    /// Takes a joint state.
    pub fn look(&mut self, sample: &JointSample) -> Woken {
        let before = self.before.replace(sample.stamp);
        let apart_s = before.map(|before| sample.stamp.seconds_since(before));
        if apart_s.is_none_or(|apart_s| !(apart_s > 0.0 && apart_s < AGREE_S)) {
            return Woken::Waiting;
        }
        let seconds = sample.stamp.seconds_since(self.newest);
        let refused = |why: String| Woken::Refused(self.path.clone(), why);
        if seconds <= 0.0 {
            return refused(format!(
                "it is of a time {:.1} s after that of the joint states",
                -seconds
            ));
        }
        if seconds > self.oldest_s {
            return refused(format!(
                "it is {seconds:.1} s old, expected at most {} s (checkpoint_oldest_s)",
                self.oldest_s
            ));
        }
        Woken::GoesOn(Box::new(self.sequencer.clone()), seconds)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use sins::table::Turntable;
    use sins::table::scheme::Scheme;
    use sins::table::scheme::sequencer::State;

    use super::*;

    fn at(seconds: f64) -> JointSample {
        JointSample {
            stamp: Stamp::default().plus_seconds(seconds),
            position: [0.0; 2],
            velocity: [0.0; 2],
        }
    }

    /// Two joint states that agree decide: within the time that is permitted the scheme goes on, else it is refused with the time.
    #[test]
    fn the_joint_states_say_how_old_it_is() {
        let program = Scheme::eight_position()
            .program(Turntable::default())
            .unwrap();
        let settings = SequencerSettings::default();
        let mut sequencer = Sequencer::new(program.clone(), settings).unwrap();
        sequencer.start().unwrap();
        for k in 0..100 {
            sequencer.ingest(&at(1000.0 + f64::from(k)));
        }
        let waking = || {
            let path = Path::new("s.kept");
            Waking::new(sequencer.snapshot(), &program, settings, path, 60.0).unwrap()
        };
        let mut good = waking();
        assert!(matches!(good.look(&at(0.0)), Woken::Waiting));
        assert!(matches!(good.look(&at(1130.0)), Woken::Waiting));
        let Woken::GoesOn(sequencer, seconds) = good.look(&at(1130.1)) else {
            panic!("goes on")
        };
        assert_eq!(sequencer.state(), State::Dwelling);
        assert!((seconds - 31.1).abs() < 1e-6);
        for (seconds, words) in [(5000.0, "checkpoint_oldest_s"), (10.0, "after that of")] {
            let mut waking = waking();
            waking.look(&at(seconds));
            let Woken::Refused(_, why) = waking.look(&at(seconds + 0.1)) else {
                panic!("refused")
            };
            assert!(why.contains(words), "{why}");
        }
    }
}
