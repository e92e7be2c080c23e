//! Stop or turn again: what a scheme that is under way will still bring, when every threshold will be met, and which single
//! rotation would bring most.
//!
//! It is a covariance bound of [`stretch`](super::stretch)es, begun at the covariance that the filter has now instead of at a prior. The
//! ship lies still in it, the table arrives when it should, and the measurements stay as good as they are; what the innovations
//! will say is not foreseen.

mod ahead;

use ahead::Ahead;

use crate::error::Error;
use crate::estimation::state::StateValues;
use crate::machines::self_calibration::{Estimate, Settings};
use crate::table::scheme::{CableLimits, Program, SegmentKind};
use crate::table::{Axis, Joint};

/// A scheme with more cycles left is foreseen to the end of the present one.
const MOST_CYCLES: u32 = 10;
/// Suggested rotations are multiples of this \[rad\].
const QUARTER_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// Up to a whole turn either way.
const MOST_QUARTERS: i32 = 4;
/// A joint at its limit is within it by rounding \[rad\].
const AT_LIMIT_RAD: f64 = 1e-6;

/// Where a scheme stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Which cycle, from 0.
    pub cycle: u32,
    /// 0: the first dwell; k: the k-th rotation of the cycle and the dwell after it.
    pub step: u32,
    /// Whether the table rests or turns.
    pub kind: SegmentKind,
    /// For how long it has rested or turned \[s\].
    pub for_s: f64,
}

/// What is asked about.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// What the filter knows.
    pub estimate: &'a Estimate,
    /// What it works with.
    pub settings: &'a Settings,
    /// The scheme under way, on the table of the settings.
    pub program: &'a Program,
    /// How far the cables let the joints turn.
    pub limits: CableLimits,
    /// How long a suggested rotation is to be followed by rest \[s\].
    pub dwell_s: f64,
    /// Where the scheme stands at the time of the estimate.
    pub standing: Standing,
}

/// A place in the time line of a scheme, at which a dwell ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Which cycle, from 0.
    pub cycle: u32,
    /// Step of the cycle.
    pub step: u32,
}

/// What the end of the scheme, or of its present cycle, will bring.
#[derive(Clone, Debug, PartialEq)]
pub struct End {
    /// From now \[s\].
    pub in_s: f64,
    /// The last step.
    pub place: Place,
    /// It is the end of the scheme; else that of the present cycle.
    pub is_of_scheme: bool,
    /// One-sigma of the states then, SI.
    pub sigma: StateValues,
}

/// When every threshold will be met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// From now; 0 where all of them are \[s\].
    pub in_s: f64,
    /// In this step.
    pub place: Place,
}

/// A state that does not get below its threshold.
#[derive(Clone, Debug, PartialEq)]
pub struct Short {
    /// Its name.
    pub name: String,
    /// Its one-sigma after the scheme and one more cycle, SI; infinite where the filter does not have it.
    pub sigma: f64,
    /// What is asked for, SI.
    pub limit: f64,
}

/// A rotation and the dwell after it, from where the table rests, or comes to rest, now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suggestion {
    /// The joint to turn.
    pub joint: Joint,
    /// The axis of the block, at zero joint angles, that it turns about.
    pub axis: Axis,
    /// By how much, counter-clockwise positive; 0: rest on \[rad\].
    pub angle_rad: f64,
    /// The dwell after it \[s\].
    pub dwell_s: f64,
    /// How far the thresholds then are: the sum of ln(sigma over threshold) of those above theirs.
    pub distance: f64,
}

/// What lies ahead.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlook {
    /// What the scheme will still bring.
    pub end: End,
    /// When every threshold will be met; `None` where neither the scheme nor one more cycle gets there.
    pub met: Option<Met>,
    /// What is in the way; empty where every threshold will be met.
    pub short: Vec<Short>,
    /// How far the thresholds are now, as in [`Suggestion::distance`].
    pub distance: f64,
    /// Every rotation by quarters of a turn that the cables permit, and resting on for the same time, the best first. Empty where every
    /// threshold is met.
    pub next: Vec<Suggestion>,
}

/// Foresees.
///
/// # Errors
/// [`Error::Setting`] where the ship's velocity or position is measured (she is not at rest, and what she will do is not known), or
/// the scheme does not stand where the question says.
pub fn outlook(question: &Question<'_>) -> Result<Outlook, Error> {
    let mut ahead = Ahead::new(question)?;
    let thresholds = &question.settings.thresholds;
    let distance = ahead.distance(thresholds);
    let next = if distance > 0.0 {
        suggestions(question, &ahead)?
    } else {
        Vec::new()
    };
    let steps = question.program.steps.len() as u32;
    let Standing { cycle, step, .. } = question.standing;
    let last_cycle = question.program.cycles.map(|cycles| cycles.max(1) - 1);
    let is_near = |last: &u32| last.saturating_sub(cycle) <= MOST_CYCLES;
    let whole = last_cycle.filter(is_near);
    let last = Place {
        cycle: whole.unwrap_or(cycle),
        step: steps,
    };
    let mut place = Place { cycle, step };
    let mut met = (distance <= 0.0).then_some(Met { in_s: 0.0, place });
    let mut end = None;
    // The scheme as it would go on.
    let mut endless = question.program.clone();
    endless.cycles = None;
    ahead.finish_segment(&endless, &question.standing, |so_far| {
        so_far.meet(&mut met, thresholds, place);
    })?;
    loop {
        if place == last {
            end = Some(End {
                in_s: ahead.time_s(),
                place,
                is_of_scheme: whole.is_some(),
                sigma: ahead.sigma()?,
            });
        }
        if place.cycle > last.cycle && place.step == steps {
            break;
        }
        let Some((cycle, step)) = endless.next(place.cycle, place.step) else {
            // Without rotations there is rest, and one more of it.
            place.cycle += 1;
            ahead.rest(
                endless.target(0, 0),
                endless.first_dwell_nanos as f64 / 1e9,
                |so_far| so_far.meet(&mut met, thresholds, place),
            );
            continue;
        };
        place = Place { cycle, step };
        ahead.step(&endless, place, |so_far| {
            so_far.meet(&mut met, thresholds, place);
        })?;
    }
    let short = if met.is_some() {
        Vec::new()
    } else {
        let above = thresholds.iter().map(|(label, limit)| Short {
            name: label.name.to_owned(),
            sigma: ahead.sigma_of(label.name),
            limit,
        });
        above.filter(|short| short.sigma > short.limit).collect()
    };
    Ok(Outlook {
        end: end.ok_or_else(|| wrong_place(question))?,
        met,
        short,
        distance,
        next,
    })
}

fn wrong_place(question: &Question<'_>) -> Error {
    let Standing { cycle, step, .. } = question.standing;
    let program = question.program;
    Error::setting(
        "place in the scheme",
        format!("cycle {cycle}, step {step}"),
        format!(
            "a place of {} with {} steps a cycle",
            program.name,
            program.steps.len()
        ),
    )
}

/// Every rotation that may be suggested, the best first. A dwell may be broken off, a rotation may not.
fn suggestions(question: &Question<'_>, now: &Ahead<'_>) -> Result<Vec<Suggestion>, Error> {
    let (program, standing) = (question.program, &question.standing);
    let mut begun = now.clone();
    if standing.kind == SegmentKind::Rotation {
        begun.finish_rotation(program, standing)?;
    }
    let from = program.target(standing.cycle, standing.step);
    let table = program.table;
    let axis = |joint| match joint {
        Joint::Outer => table.outer,
        Joint::Inner => table.inner,
    };
    let mut all = Vec::new();
    let mut try_one = |joint: Joint, angle_rad: f64| -> Result<(), Error> {
        let mut ahead = begun.clone();
        ahead.turn_and_rest(program, joint, from, angle_rad, question.dwell_s)?;
        all.push(Suggestion {
            joint,
            axis: axis(joint),
            angle_rad,
            dwell_s: question.dwell_s,
            distance: ahead.distance(&question.settings.thresholds),
        });
        Ok(())
    };
    try_one(Joint::Outer, 0.0)?;
    for joint in [Joint::Outer, Joint::Inner] {
        let (min, max) = question.limits.of(joint);
        for quarters in -MOST_QUARTERS..=MOST_QUARTERS {
            let angle_rad = f64::from(quarters) * QUARTER_RAD;
            let to = from[joint.index()] + angle_rad;
            if quarters != 0 && to >= min - AT_LIMIT_RAD && to <= max + AT_LIMIT_RAD {
                try_one(joint, angle_rad)?;
            }
        }
    }
    // Of equal ones the shortest turn.
    all.sort_by(|a, b| {
        let rounded = |suggestion: &Suggestion| (suggestion.distance * 1e6).round();
        let by_distance = rounded(a).total_cmp(&rounded(b));
        by_distance.then(a.angle_rad.abs().total_cmp(&b.angle_rad.abs()))
    });
    Ok(all)
}

#[cfg(test)]
mod tests;
