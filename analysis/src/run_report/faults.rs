//! What went wrong in a run, and when.

use sins::time::Stamp;

use super::{estimates::phase_name, gather::GatheredRun, verdict::plural};

/// Lines that are listed.
const LISTED: usize = 100;

/// One thing that went wrong.
#[derive(Clone, Debug)]
pub struct Fault {
    /// When, where that is known.
    pub stamp: Option<Stamp>,
    /// Where: a topic, or a part of the suite.
    pub place: String,
    /// What.
    pub text: String,
}

/// The faults in the order of their times, and how many more there are.
pub fn faults(run: &GatheredRun) -> (Vec<Fault>, u64) {
    let mut faults = Vec::new();
    let mut more = run.history.more_phases;
    for stream in &run.streams {
        let place = || stream.name.clone();
        if stream.is_regular() {
            faults.extend(stream.gaps.iter().map(|gap| Fault {
                stamp: Some(gap.from),
                place: place(),
                text: format!("gap of {:.3} s, {} missing", gap.length_s, gap.lost),
            }));
            more += stream.gap_count() - stream.gaps.len() as u64;
        }
        let (repeated, backward) = stream.repeated_backward();
        // Messages without a stamp of their own may well come at one time.
        if stream.is_regular() && stream.by_stamp() && repeated + backward > 0 {
            faults.push(Fault {
                stamp: None,
                place: place(),
                text: format!(
                    "{} repeated, {} run back",
                    plural(repeated, "stamp"),
                    plural(backward, "stamp")
                ),
            });
        }
    }
    let estimates = || "self-calibration".to_owned();
    faults.extend(run.history.restarts.iter().map(|stamp| Fault {
        stamp: Some(*stamp),
        place: estimates(),
        text: "the alignment began anew".to_owned(),
    }));
    let inconsistent = rotary_sins_msgs::SelfCalibrationEstimate::INCONSISTENT;
    faults.extend(
        run.history
            .phases
            .iter()
            .filter(|change| change.phase == inconsistent)
            .map(|change| Fault {
                stamp: Some(change.stamp),
                place: estimates(),
                text: format!("phase {}", phase_name(change.phase)),
            }),
    );
    faults.extend(run.scheme.events.iter().map(|event| Fault {
        stamp: Some(event.stamp),
        place: "scheme".to_owned(),
        text: event.text.clone(),
    }));
    for line in run.damage.iter().chain(&run.notes.lines) {
        faults.push(Fault {
            stamp: None,
            place: "bag".to_owned(),
            text: line.clone(),
        });
    }
    faults.sort_by_key(|fault| fault.stamp);
    more += faults.len().saturating_sub(LISTED) as u64;
    faults.truncate(LISTED);
    (faults, more)
}
