//! How often a record is gone over, and its smoothed epochs.
//!
//! The first pass is whoever's who has the record, because each tells of it in its own way; what follows stands here.

use std::ops::ControlFlow;

use sins::Error;
use sins::estimation::smoother::Smoothed;
use sins::machines::self_calibration::{
    Estimate, Event, Guide, SelfCalibration, Settings, Smoothing,
};
use sins::stream::Reading;

/// More passes than this change nothing any more.
pub const MOST_PASSES: u32 = 9;
/// At most so many are made where nobody says how many.
const PASSES_BY_ITSELF: u32 = 4;

/// How a record is gone over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passes {
    /// So many passes; `None`: one, or more where the azimuth was uncertain by more than a degree at first.
    pub asked: Option<u32>,
    /// Whether the smoothed epochs are wanted.
    pub smooths: bool,
}

/// The first pass, which remembers what the next ones and the smoother need, as long as they may be wanted.
#[derive(Debug)]
pub struct FirstPass {
    smoothing: Smoothing,
    may_be_enough: bool,
}

impl FirstPass {
    /// Begins it.
    pub fn new(passes: Passes, machine: SelfCalibration) -> Self {
        let mut smoothing = Smoothing::new(machine);
        if !passes.smooths && passes.asked == Some(1) {
            smoothing.keep_nothing();
        }
        Self {
            smoothing,
            may_be_enough: !passes.smooths && passes.asked.is_none(),
        }
    }

    /// The smoothing machine, to push to.
    pub fn smoothing(&mut self) -> &mut Smoothing {
        &mut self.smoothing
    }

    /// What happened next. The first estimate says whether this pass is enough; then nothing is remembered any more.
    pub fn poll(&mut self) -> Option<Event> {
        let event = self.smoothing.poll()?;
        if self.may_be_enough && matches!(event, Event::Estimate(_)) {
            self.may_be_enough = false;
            if self.smoothing.machine().wants_another_pass() == Some(false) {
                self.smoothing.keep_nothing();
            }
        }
        Some(event)
    }
}

/// What came of all passes.
#[derive(Debug)]
pub struct Passed {
    /// The last pass's last estimate.
    pub estimate: Estimate,
    /// Their number.
    pub passes: u32,
    smoothing: Smoothing,
}

/// Makes the further passes that were asked for or are wanted. `again` hands every reading of the record to what it is given, until
/// that breaks, and is told what for.
///
/// # Errors
/// What `again` gives; [`Error::Alignment`] where a pass comes to no estimate, or has no epoch to be linear about.
pub fn go_over<E: From<Error>>(
    first: FirstPass,
    estimate: Estimate,
    passes: Passes,
    settings: &Settings,
    mut again: impl FnMut(&str, &mut dyn FnMut(&Reading) -> ControlFlow<()>) -> Result<(), E>,
) -> Result<Passed, E> {
    let mut passed = Passed {
        estimate,
        passes: 1,
        smoothing: first.smoothing,
    };
    let most = passes.asked.unwrap_or(PASSES_BY_ITSELF);
    while passed.passes < most
        && (passes.asked.is_some() || passed.smoothing.machine().wants_another_pass() == Some(true))
    {
        let epochs = epochs(passed.smoothing, &mut again)?;
        let guide = Guide::new(&epochs, &passed.estimate).ok_or_else(|| Error::Alignment {
            reason: "a further pass: the one before has no epoch".to_owned(),
        })?;
        let number = passed.passes + 1;
        let mut smoothing = Smoothing::new(SelfCalibration::new(settings.clone())?.guided(guide));
        again(&format!("pass {number}"), &mut |reading| {
            // What is refused has been said in the first pass.
            smoothing.push(reading).ok();
            while smoothing.poll().is_some() {}
            ControlFlow::Continue(())
        })?;
        passed = Passed {
            estimate: smoothing.finish()?,
            passes: number,
            smoothing,
        };
    }
    Ok(passed)
}

impl Passed {
    /// What the last pass went by.
    pub fn settings(&self) -> &Settings {
        self.smoothing.machine().settings()
    }

    /// The smoothed epochs.
    ///
    /// # Errors
    /// As [`go_over`].
    pub fn into_epochs<E: From<Error>>(
        self,
        again: impl FnMut(&str, &mut dyn FnMut(&Reading) -> ControlFlow<()>) -> Result<(), E>,
    ) -> Result<Vec<Smoothed>, E> {
        epochs(self.smoothing, again)
    }
}

/// The smoothed epochs; what did not fit into the memory is read again.
fn epochs<E: From<Error>>(
    mut smoothing: Smoothing,
    mut again: impl FnMut(&str, &mut dyn FnMut(&Reading) -> ControlFlow<()>) -> Result<(), E>,
) -> Result<Vec<Smoothed>, E> {
    while let Some(replay) = smoothing.rewind() {
        let (first, end) = (replay.skip, replay.skip + replay.count);
        let mut count = 0;
        again("smoothing", &mut |reading| {
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
