//! What the scheme will still bring: followed and asked here, worked out beside the node's task, told in a message.

use std::sync::Arc;

use ros2_interfaces::std_msgs::Header;
use rotary_sins_msgs::convert::{header, stamp_from_time};
use rotary_sins_msgs::interfaces::topics;
use rotary_sins_msgs::{CalibrationOutlook, SchemeStatus};
use sins::Stamp;
use sins::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use sins::estimation::groups::navigation::MISALIGNMENT;
use sins::estimation::model;
use sins::machines::self_calibration::{Estimate, Phase, Settings, Thresholds};
use sins::studies::outlook::{Outlook, Place, Question, Standing, outlook};
use sins::table::scheme::{Program, Scheme as RotationScheme, SegmentKind};
use sins::units::{ARC_SECOND, DEG_PER_HOUR, MICRO_G};

use crate::calibrator::Calibrator;

/// Between two answers while the scheme stays in a dwell \[s of the samples\].
const PERIOD_S: f64 = 60.0;
/// What stands for a time that never comes, or is not known.
const NEVER: f64 = -1.0;

/// A place of a scheme: state, cycle, step.
type At = (u8, u32, u32);

/// How the scheme came to where it is.
#[derive(Clone, Copy, Debug)]
struct Since {
    at: At,
    /// Of the first status that told it.
    stamp: Stamp,
    /// Since the start of the scheme, then \[s\].
    elapsed_s: f64,
    /// The status before told another place: it came there then. Else it was there before anybody listened.
    is_seen: bool,
}

/// The scheme under way, as the sequencer tells it.
#[derive(Debug, Default)]
pub(crate) struct Scheme {
    file: Option<Result<Arc<RotationScheme>, String>>,
    name: String,
    since: Option<Since>,
    asked: Option<(At, Stamp, Thresholds)>,
}

impl Scheme {
    /// Its text.
    pub(crate) fn take_file(&mut self, text: &str) {
        let read = RotationScheme::from_yaml(topics::SCHEME_FILE.name, text);
        self.file = Some(read.map(Arc::new).map_err(|error| error.to_string()));
        self.forget_what_was_asked();
    }

    /// Where it stands.
    pub(crate) fn follow(&mut self, status: &SchemeStatus) {
        let at = (status.state, status.cycle, status.step);
        if self.since.is_some_and(|since| since.at == at) && self.name == status.scheme {
            return;
        }
        self.name.clone_from(&status.scheme);
        self.since = Some(Since {
            at,
            stamp: stamp_from_time(status.header.stamp),
            elapsed_s: status.elapsed,
            is_seen: self.since.is_some(),
        });
    }

    /// The next answer is due at once.
    pub(crate) fn forget_what_was_asked(&mut self) {
        self.asked = None;
    }
}

/// A question with everything that its answer needs.
#[derive(Debug)]
pub(crate) struct Asked {
    estimate: Estimate,
    settings: Settings,
    scheme: Option<Result<Arc<RotationScheme>, String>>,
    name: String,
    since: Since,
    frame_id: String,
}

impl Calibrator {
    /// What is to be worked out now: with every place of the scheme, after a while in one, and where other sigmas are asked for.
    pub(crate) fn ask_ahead(&mut self) -> Option<Asked> {
        let (estimate, since) = (self.latest.as_ref()?, self.scheme.since?);
        let settings = self.machine.settings();
        // An estimate of before the scheme came there says nothing of there.
        if self.waking.is_some() || estimate.stamp < since.stamp {
            return None;
        }
        let is_fresh = self
            .scheme
            .asked
            .as_ref()
            .is_some_and(|(at, when, sigmas)| {
                let age_s = estimate.stamp.seconds_since(*when);
                *at == since.at
                    && (0.0..PERIOD_S).contains(&age_s)
                    && *sigmas == settings.thresholds
            });
        if is_fresh {
            return None;
        }
        self.scheme.asked = Some((since.at, estimate.stamp, settings.thresholds.clone()));
        Some(Asked {
            estimate: estimate.clone(),
            settings: settings.clone(),
            scheme: self.scheme.file.clone(),
            name: self.scheme.name.clone(),
            since,
            frame_id: self.frame_id.clone(),
        })
    }
}

impl Asked {
    /// The answer; why there is none, where there is none.
    pub(crate) fn answer(&self) -> CalibrationOutlook {
        let header = header(self.estimate.stamp, &self.frame_id);
        match self.foresee() {
            Ok(outlook) => self.told(header, &outlook),
            Err(reason) => CalibrationOutlook {
                header,
                scheme: self.name.clone(),
                cycle: self.since.at.1,
                step: self.since.at.2,
                end_in: NEVER,
                met_in: NEVER,
                message: format!("nothing is foreseen: {reason}"),
                ..CalibrationOutlook::default()
            },
        }
    }

    fn foresee(&self) -> Result<Outlook, String> {
        let (state, ..) = self.since.at;
        let kind = match state {
            SchemeStatus::DWELLING => SegmentKind::Dwell,
            SchemeStatus::ROTATING => SegmentKind::Rotation,
            SchemeStatus::FINISHED => return Err("the scheme is finished".to_owned()),
            _ => return Err("the scheme is not under way".to_owned()),
        };
        let scheme = match &self.scheme {
            Some(Ok(scheme)) if scheme.name == self.name => scheme,
            Some(Err(reason)) => return Err(reason.clone()),
            _ => {
                let topic = topics::SCHEME_FILE.name;
                return Err(format!(
                    "the scheme is not known, for nobody tells it on {topic}"
                ));
            }
        };
        let program = scheme.program(self.settings.turntable);
        let program = program.map_err(|error| error.to_string())?;
        let question = Question {
            estimate: &self.estimate,
            settings: &self.settings,
            program: &program,
            limits: scheme.limits,
            dwell_s: scheme.dwell_s,
            standing: self.standing(&program, kind),
        };
        outlook(&question).map_err(|error| error.to_string())
    }

    fn standing(&self, program: &Program, kind: SegmentKind) -> Standing {
        let (_, cycle, step) = self.since.at;
        let mut for_s = self.estimate.stamp.seconds_since(self.since.stamp);
        if !self.since.is_seen {
            // By the plan, as nobody saw it come.
            let is_there =
                |s: &sins::table::scheme::Segment| (s.cycle, s.step, s.kind) == (cycle, step, kind);
            let mut until = program.segments().take_while(|s| s.cycle <= cycle);
            let planned = until.find(is_there).map(|s| s.start_nanos as f64 / 1e9);
            for_s += planned.map_or(0.0, |start_s| (self.since.elapsed_s - start_s).max(0.0));
        }
        Standing {
            cycle,
            step,
            kind,
            for_s,
        }
    }

    fn told(&self, header: Header, outlook: &Outlook) -> CalibrationOutlook {
        let covariance = self.estimate.covariance();
        let (thresholds, end) = (&self.settings.thresholds, &outlook.end);
        let names = covariance.states();
        let best = outlook.next.first();
        let turn = best.filter(|best| best.angle_rad != 0.0);
        CalibrationOutlook {
            header,
            foreseen: true,
            scheme: self.name.clone(),
            cycle: self.since.at.1,
            step: self.since.at.2,
            state_names: names.iter().map(str::to_owned).collect(),
            threshold: names
                .iter()
                .map(|name| thresholds.of(name).unwrap_or(0.0))
                .collect(),
            std: covariance.sigmas(),
            std_at_end: end.sigma.as_slice().to_vec(),
            end_in: end.in_s,
            end_cycle: end.place.cycle,
            end_step: end.place.step,
            end_is_of_scheme: end.is_of_scheme,
            met_in: outlook.met.map_or(NEVER, |met| met.in_s),
            met_cycle: outlook.met.map_or(0, |met| met.place.cycle),
            met_step: outlook.met.map_or(0, |met| met.place.step),
            out_of_reach: outlook.short.iter().map(|s| s.name.clone()).collect(),
            best_joint: turn.map_or_else(String::new, |turn| turn.joint.name().to_owned()),
            best_axis: turn.map_or_else(String::new, |turn| turn.axis.to_string()),
            best_angle_rad: best.map_or(0.0, |best| best.angle_rad),
            best_dwell: best.map_or(0.0, |best| best.dwell_s),
            distance: outlook.distance,
            best_distance: best.map_or(outlook.distance, |best| best.distance),
            message: self.line(outlook),
        }
    }

    /// One line for a person, in parts behind semicolons: thresholds, end, rotation.
    fn line(&self, outlook: &Outlook) -> String {
        let at = |place: Place| format!("cycle {} step {}", place.cycle + 1, place.step);
        let thresholds = match outlook.met {
            Some(met) if met.in_s <= 0.0 => "every threshold is met".to_owned(),
            Some(met) => format!("thresholds met in {} ({})", span(met.in_s), at(met.place)),
            None => {
                let worst = outlook.short.iter().max_by(|a, b| {
                    let over = |short: &&sins::studies::outlook::Short| short.sigma / short.limit;
                    over(a).total_cmp(&over(b))
                });
                let worst = worst.map_or_else(String::new, |short| {
                    let label = model::label(&short.name);
                    let words = label.map_or(short.name.as_str(), |label| label.words);
                    if short.sigma.is_finite() {
                        let over = short.sigma / short.limit;
                        format!(": {words} ends at {over:.2} of its threshold")
                    } else {
                        format!(": {words} is not estimated")
                    }
                });
                format!("thresholds not met by one cycle more{worst}")
            }
        };
        let end = &outlook.end;
        let what = if end.is_of_scheme { "scheme" } else { "cycle" };
        let largest = |names: [&str; 3]| {
            let sigmas = names.into_iter().filter_map(|name| end.sigma.value(name));
            sigmas.fold(0.0, f64::max)
        };
        let azimuth = end.sigma.value(MISALIGNMENT[2]).unwrap_or(f64::NAN) / ARC_SECOND;
        let told = format!(
            "{thresholds}; {what}'s end ({}): azimuth {azimuth:.1} arcsec, drift {:.4} deg/h, bias {:.1} ug",
            span(end.in_s),
            largest(GYROSCOPE_DRIFT) / DEG_PER_HOUR,
            largest(ACCELEROMETER_BIAS) / MICRO_G,
        );
        let next = match outlook.next.first() {
            None => String::new(),
            Some(best) if best.angle_rad == 0.0 => "; best next: to rest".to_owned(),
            Some(best) => {
                let degrees = best.angle_rad.to_degrees();
                format!("; best next: turn about {} by {degrees:+.0} deg", best.axis)
            }
        };
        let doubt = if self.estimate.phase == Phase::Inconsistent {
            "; the innovations disagree, so that none of it may hold"
        } else {
            ""
        };
        told + &next + doubt
    }
}

/// A time as people say it.
fn span(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else if seconds < 7200.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}
