//! One page about one recorded run.

mod diagnostics;
mod estimates;
mod faults;
mod figures;
mod gather;
mod groups;
mod page;
mod scheme;
mod streams;
mod summary;
mod thin;
mod topics;
mod truth;
mod verdict;

use std::path::Path;

use bags::Bag;
use report::{Figure, Page, Verdict};
use sins::machines::self_calibration::{SelfCalibration, Settings};

use crate::{Error, Listener, SensorSource};
use figures::{Clock, Drawing};
use page::Head;
use verdict::End;

pub use summary::Summary;
pub use verdict::Finding;

/// What is asked for.
pub struct Request<'a> {
    /// The bag.
    pub bag: &'a Bag,
    /// Which samples of it.
    pub source: &'a SensorSource,
    /// Of the calibration, where the bag has no estimates.
    pub settings: &'a Settings,
    /// The command that gives the page again.
    pub command: &'a str,
    /// Where the page will stand.
    pub path: &'a Path,
}

/// A page about a run, and the numbers behind it.
pub struct RunReport {
    /// The page.
    pub page: Page,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// The numbers.
    pub summary: Summary,
    /// What was looked at, faults first.
    pub findings: Vec<Finding>,
}

impl RunReport {
    /// Reads the bag.
    ///
    /// # Errors
    /// Where the bag cannot be read, has no topic of the kind, or does not lead to an estimate.
    pub fn of(request: &Request<'_>, listener: &dyn Listener) -> Result<Self, Error> {
        let &Request { bag, settings, .. } = request;
        let calibrator = SelfCalibration::new(settings.clone())?;
        let mut run = gather::gather(request.source, bag, calibrator, listener)?;
        let (points, singles) = run.history.take_series();
        let joints = std::mem::take(&mut run.joints).finish();
        let (start, end_stamp) = run.span();
        let clock = Clock::new(start, end_stamp);
        let end = End::new(points.last(), &run);
        let findings = verdict::findings(&run, &end);
        let positions = run.tracks().each_ref().map(|track| track.points.points());
        let figures = Drawing {
            run: &run,
            thresholds: settings.thresholds.clone(),
            clock,
            points: &points,
            singles: &singles,
            joints: &joints,
            positions: &positions,
        }
        .figures();
        let head = Head {
            bag,
            command: request.command,
            clock,
            end: end_stamp,
        };
        let page = page::page(&head, &run, &end, &findings, &figures)?;
        let summary = summary::summary(
            &head,
            &run,
            &end,
            &findings,
            &figures,
            points.last(),
            request.path,
        );
        Ok(Self {
            page,
            figures,
            summary,
            findings,
        })
    }

    /// Whether nothing was found that makes the run doubtful.
    pub fn is_good(&self) -> bool {
        self.findings.iter().all(|f| f.verdict != Verdict::Bad)
    }

    /// The findings in one line.
    pub fn verdict(&self) -> String {
        let texts: Vec<_> = self.findings.iter().map(|f| f.text.as_str()).collect();
        texts.join("; ")
    }
}
