//! Self-calibration behind its stream: intervals in, events out.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::aiding::Aiding;
use super::alignment::Gathering;
use super::beginning::Beginning;
use super::judge::{Evidence, Judge, Witness};
use super::reference_choice::{GoneOver, LEAST_POSITIONS, by_reference};
use super::running::Running;
use super::schedule::Schedule;
use super::sensor_knowledge::SensorKnowledge;
use super::ship_motion::ShipMotion;
use super::smoothing::Guide;
use super::{Estimate, Event, NoiseFrom, Phase, Reference, SampleReport, Settings, Thresholds};
use crate::earth::Position;
use crate::earth::rotation::HeadingPitchRoll;
use crate::error::Error;
use crate::estimation::measurement::UpdateCounts;
use crate::estimation::smoother::Tape;
use crate::machines::unseen_motion::Passage;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::ImuSample;
use crate::stream::order::EpochCause;
use crate::stream::{Interval, Item, Stream};
use crate::time::Stamp;

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Stage {
    /// No sample has come yet.
    Idle,
    Gathering(Box<Gathering>),
    Running(Box<Running>),
}

/// Alignment, filter and judge. It has no clock and no queues of its own.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::machines) struct Estimator {
    settings: Settings,
    /// Where the ship lies in this epoch: the first position of it.
    position: Option<Position>,
    newest_position: Option<Position>,
    stage: Stage,
    /// What was known of the sensors before the first sample.
    known_before: Option<SensorKnowledge>,
    /// The judge of the alignment before this one.
    judge_before: Option<Judge>,
    last: Option<Estimate>,
    phase_told: Phase,
    missing_velocities: u64,
    /// What became of the measurements of the alignments before this one.
    updates_before: UpdateCounts,
    #[serde(skip)]
    events: VecDeque<Event>,
    /// Its filters write down what smoothing needs.
    #[serde(skip)]
    records: bool,
    /// What those before the present one have written.
    #[serde(skip)]
    tape: Option<Tape>,
    /// What it is linear about where this is not its first pass.
    #[serde(skip)]
    guide: Option<Arc<Guide>>,
}

impl Estimator {
    pub(in crate::machines) fn new(settings: Settings) -> Result<Self, Error> {
        settings.check()?;
        Ok(Self {
            settings,
            position: None,
            newest_position: None,
            stage: Stage::Idle,
            known_before: None,
            judge_before: None,
            last: None,
            phase_told: Phase::WaitingForPosition,
            missing_velocities: 0,
            updates_before: UpdateCounts::default(),
            events: VecDeque::new(),
            records: false,
            tape: None,
            guide: None,
        })
    }

    /// Goes over a record for another time.
    #[must_use]
    pub(super) fn guided(mut self, guide: Arc<Guide>) -> Self {
        self.guide = Some(guide);
        self
    }

    /// Writes down what smoothing needs from here on, or no longer.
    pub(super) fn record(&mut self, records: bool) {
        self.records = records;
        self.tape = None;
        if let Stage::Running(run) = &mut self.stage {
            run.filter.record(records);
        }
    }

    /// What has been written since the last time.
    pub(super) fn take_tape(&mut self) -> Option<Tape> {
        let own = match &mut self.stage {
            Stage::Running(run) => run.filter.take_tape(),
            Stage::Idle | Stage::Gathering(_) => None,
        };
        match (self.tape.take(), own) {
            (Some(mut before), Some(own)) => {
                before.append(own);
                Some(before)
            }
            (before, own) => before.or(own),
        }
    }

    /// Length of what has been written \[bytes\].
    pub(super) fn tape_bytes(&self) -> usize {
        let own = match &self.stage {
            Stage::Running(run) => run.filter.tape_bytes(),
            Stage::Idle | Stage::Gathering(_) => 0,
        };
        own + self.tape.as_ref().map_or(0, Tape::bytes)
    }

    /// Whether another pass would be about another point; `None` while no filter runs.
    pub(super) fn wants_another_pass(&self) -> Option<bool> {
        match &self.stage {
            Stage::Running(run) => Some(run.wants_another_pass()),
            Stage::Idle | Stage::Gathering(_) => None,
        }
    }

    /// Refuses what no estimator of these settings holds.
    pub(super) fn check(&self) -> Result<(), Error> {
        for position in [self.position, self.newest_position].into_iter().flatten() {
            position.checked()?;
        }
        if let Some(last) = &self.last {
            last.navigation.check()?;
            last.errors.compensation()?;
        }
        match &self.stage {
            Stage::Running(run) => run.check(&self.settings),
            Stage::Idle | Stage::Gathering(_) => Ok(()),
        }
    }

    /// Begins with what is known of the sensors.
    #[must_use]
    pub(in crate::machines) fn knowing(mut self, known: SensorKnowledge) -> Self {
        self.known_before = Some(known);
        self
    }

    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    pub(super) fn set_thresholds(&mut self, thresholds: Thresholds) {
        self.settings.thresholds = thresholds;
    }

    pub(in crate::machines) fn take_position(&mut self, position: Position) {
        self.newest_position = Some(position);
        self.position.get_or_insert(position);
    }

    #[inline]
    pub(in crate::machines) fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    pub(super) fn last(&self) -> Option<&Estimate> {
        self.last.as_ref()
    }

    /// Forgets everything but the position.
    pub(super) fn reset(&mut self) {
        self.stage = Stage::Idle;
        if let Some(tape) = &mut self.tape {
            tape.cut();
        }
        self.judge_before = None;
        self.last = None;
        self.missing_velocities = 0;
        self.updates_before = UpdateCounts::default();
        self.events.clear();
    }

    pub(super) fn samples(&self, stream: &Stream) -> SampleReport {
        let updates = match &self.stage {
            Stage::Running(run) => run.filter.counts(),
            Stage::Idle | Stage::Gathering(_) => UpdateCounts::default(),
        };
        SampleReport {
            counts: stream.counts(),
            missing_velocities: self.missing_velocities,
            updates: self.updates_before + updates,
        }
    }

    pub(super) fn coarse_progress(&self) -> f64 {
        match &self.stage {
            Stage::Idle => 0.0,
            Stage::Gathering(g) => (g.seconds() / self.settings.coarse_alignment_s).min(1.0),
            Stage::Running(_) => 1.0,
        }
    }

    pub(super) fn phase(&self, stream: &Stream) -> Phase {
        match &self.stage {
            Stage::Idle | Stage::Gathering(_) if self.position.is_none() => {
                Phase::WaitingForPosition
            }
            Stage::Idle | Stage::Gathering(_) => Phase::CoarseAlignment,
            Stage::Running(run) => Evidence {
                innovations: run.judge.report(),
                counts: &stream.counts(),
                covariance: &run.filter.named_covariance(),
                prior: Some(&run.prior),
                findings: &run.findings,
                turned: run.turned,
            }
            .phase(&self.settings),
        }
    }

    /// Takes what the stream hands out.
    #[inline]
    pub(in crate::machines) fn take(&mut self, item: Item, stream: &Stream) {
        match item {
            Item::Refused(refused) => self.events.push_back(Event::Refused(refused)),
            Item::Epoch { sample, cause } => self.begin(sample.stamp, cause, stream),
            Item::Interval(interval, sample) => self.advance(interval, &sample, stream),
        }
    }

    /// An epoch begins: attitude and velocity are found anew, and what is known of the sensors goes on.
    pub(in crate::machines) fn begin(&mut self, stamp: Stamp, cause: EpochCause, stream: &Stream) {
        self.tape = self.take_tape();
        let known = match std::mem::replace(&mut self.stage, Stage::Idle) {
            Stage::Idle => self.known_before.clone(),
            Stage::Gathering(gathering) => gathering.known,
            Stage::Running(run) => {
                let known = run.knowledge();
                if let Some(tape) = &mut self.tape {
                    tape.epoch(run.filter.base_state());
                }
                self.updates_before = self.updates_before + run.filter.counts();
                self.judge_before = Some(run.judge);
                Some(known)
            }
        };
        self.stage = Stage::Gathering(Box::new(Gathering::new(stamp, known.as_ref())));
        if cause != EpochCause::First {
            // The ship may have been moved meanwhile.
            self.position = self.newest_position;
            self.events.push_back(Event::Restarted {
                stamp,
                cause,
                sensors_kept: known.is_some(),
            });
        }
        self.tell_phase(stamp, stream);
    }

    #[inline]
    fn advance(&mut self, interval: Interval, sample: &ImuSample, stream: &Stream) {
        match &mut self.stage {
            Stage::Idle => {}
            Stage::Running(run) => {
                let stamp = interval.stamp;
                let advance = match run.advance(&interval, &self.settings, Some(stream.joints())) {
                    Ok(advance) => advance,
                    Err(error) => {
                        // Numbers that are none do not come back: everything is found anew.
                        self.tape = match (self.tape.take(), run.filter.take_tape()) {
                            (Some(mut before), Some(own)) => {
                                before.append(own);
                                Some(before)
                            }
                            (before, own) => before.or(own),
                        };
                        if let Some(tape) = &mut self.tape {
                            tape.cut();
                        }
                        self.updates_before = self.updates_before + run.filter.counts();
                        let known = self.known_before.as_ref();
                        self.stage = Stage::Gathering(Box::new(Gathering::new(stamp, known)));
                        return self.fail(stamp, &error, stream);
                    }
                };
                self.missing_velocities += u64::from(advance.velocity_missing);
                if let Some(passage) = advance.passage {
                    let seconds = interval.increment.interval_s;
                    self.events.push_back(crossed(stamp, seconds, passage));
                }
                if advance.stepped {
                    self.tell_estimate(stamp, stream);
                }
            }
            Stage::Gathering(gathering) => {
                let stamp = interval.stamp;
                gathering.take(interval, sample, self.settings.turntable);
                let seconds = gathering.seconds();
                if self.position.is_some() && seconds >= self.settings.coarse_alignment_s {
                    if let Err(error) = self.start_filter(stream) {
                        self.fail(stamp, &error, stream);
                    }
                } else if seconds >= 2.0 * self.settings.coarse_alignment_s {
                    // Still no position: gather afresh rather than without end.
                    let known = gathering.known.take();
                    **gathering = Gathering::new(stamp, known.as_ref());
                } else if self.phase_told == Phase::WaitingForPosition && self.position.is_some() {
                    self.tell_phase(stamp, stream);
                }
            }
        }
    }

    fn fail(&mut self, stamp: Stamp, error: &Error, stream: &Stream) {
        let reason = match error {
            Error::Alignment { reason } => format!("coarse alignment: {reason}"),
            other => other.to_string(),
        };
        self.events
            .push_back(Event::AlignmentFailed { stamp, reason });
        self.tell_phase(stamp, stream);
    }

    /// No more will come: an alignment that has gathered enough is finished with what there is.
    pub(super) fn finish(&mut self, stream: &Stream) -> Result<Estimate, Error> {
        let gathered_s = match &self.stage {
            Stage::Idle => Some(0.0),
            Stage::Gathering(gathering) => Some(gathering.seconds()),
            Stage::Running(_) => None,
        };
        if let Some(seconds) = gathered_s {
            if self.position.is_none() {
                return Err(Error::Alignment {
                    reason: "no position: expected a valid fix before the samples ended".into(),
                });
            }
            let least_s = self.settings.coarse_alignment_min_s;
            if seconds < least_s && self.last.is_none() {
                return Err(Error::Alignment {
                    // Cut off, not rounded: what is too short must not look long enough. Stamps are whole nanoseconds:
                    // what half of one is short of a digit is the rounding of the sum.
                    reason: format!(
                        "{:.3} s of samples, expected at least {least_s} s",
                        (seconds * 1e3 + 5e-7).floor() * 1e-3
                    ),
                });
            }
            if seconds >= least_s {
                self.start_filter(stream)?;
            }
        }
        let mut last = self.last.clone().ok_or_else(|| Error::Alignment {
            reason: "the samples ended before the first estimate".into(),
        })?;
        // The estimate stands at the last covariance step; the samples after it have been looked at all the same.
        last.samples = self.samples(stream);
        last.phase = last.evidence().phase(&self.settings);
        Ok(last)
    }

    /// Solves the coarse alignment and takes the filter over everything gathered.
    fn start_filter(&mut self, stream: &Stream) -> Result<(), Error> {
        let gathered = std::mem::replace(&mut self.stage, Stage::Idle);
        let (Stage::Gathering(gathering), Some(position)) = (gathered, self.position) else {
            return Ok(());
        };
        let last = gathering
            .backlog
            .last()
            .map_or(gathering.start, |interval| interval.stamp);
        let known = gathering.known.clone();
        // Where this alignment fails, the next one begins here.
        self.stage = Stage::Gathering(Box::new(Gathering::new(last, known.as_ref())));
        let coarse = gathering.coarse.solve(
            position.latitude_rad,
            position.height_m,
            self.settings.coarse_residual_limit_m_s,
        )?;
        let place = NavigationState {
            attitude: coarse.at_start,
            velocity: Vector3::zeros(),
            position,
        };
        let guided = self
            .guide
            .as_ref()
            .and_then(|guide| guide.at(gathering.start).copied());
        let guide = self.guide.clone().filter(|_| guided.is_some());
        let at_rest = match self.settings.noise_from {
            NoiseFrom::Samples => None,
            NoiseFrom::Rest => gathering.at_rest.whole(),
        };
        let noise = self.settings.noise.or(at_rest);
        let noise = noise.unwrap_or_else(|| gathering.noise());
        let beginning = Beginning {
            place,
            known: known.as_ref(),
            now: last,
            walk: self.settings.walk,
            noise,
            guide: guide.as_deref().zip(guided),
        };
        let gone_over = |reference: Reference, motion: Option<ShipMotion>| -> GoneOver {
            let schedule = Schedule::new(gathering.start, self.settings.step_s);
            let (mut filter, prior) = beginning.any_filter(&self.settings, reference)?;
            filter.record(self.records);
            filter.mark(gathering.start);
            let judge = self.judge_before.as_ref().map_or_else(
                || Judge::new(&self.settings),
                |before| before.of_next_alignment(&self.settings),
            );
            let aiding = Aiding::new(reference, schedule);
            let mut run = Running::new((filter, prior), gathering.start, aiding, judge);
            run.guide.clone_from(&guide);
            run.motion = motion;
            if self.settings.witness {
                let moves_m_s = motion.map_or(0.0, |motion| motion.sigma_m_s(0));
                let witness = Witness::new(place, noise, &self.settings, reference, moves_m_s)?;
                run.witness = Some(witness);
            }
            let (mut last_update, mut missing) = (None, 0);
            for interval in &gathering.backlog {
                let advance = run.advance(interval, &self.settings, None)?;
                missing += u64::from(advance.velocity_missing);
                if advance.stepped {
                    last_update = Some(interval.stamp);
                }
            }
            Ok((run, last_update, missing))
        };
        let positions = gathering.backlog.iter().filter(|i| i.position.is_some());
        let has_positions = positions.count() >= LEAST_POSITIONS;
        let (mut run, last_update, missing) = by_reference(
            self.settings.reference,
            has_positions,
            coarse.residual_m_s,
            &gone_over,
        )?;
        self.missing_velocities += missing;
        if run.guide.is_none() {
            run.filter.close_loop();
        }
        if let Some(witness) = &mut run.witness {
            witness.close_loop();
        }
        run.azimuth_rad = run.azimuth_sigma_rad();
        run.reference_attitude = run.filter.believed().attitude;
        run.turned |= known.is_some_and(|known| known.turned);
        if let Some(stamp) = last_update {
            run.reference_vehicle = self.vehicle_attitude(&run, stamp, stream);
        }
        self.stage = Stage::Running(Box::new(run));
        if let Some(stamp) = last_update {
            self.tell_estimate(stamp, stream);
        }
        Ok(())
    }

    fn tell_estimate(&mut self, stamp: Stamp, stream: &Stream) {
        let Stage::Running(run) = &self.stage else {
            return;
        };
        let estimate = self.estimate(run, stamp, stream);
        self.change_phase(stamp, estimate.phase);
        self.events
            .push_back(Event::Estimate(Box::new(estimate.clone())));
        self.last = Some(estimate);
    }

    pub(super) fn tell_phase(&mut self, stamp: Stamp, stream: &Stream) {
        self.change_phase(stamp, self.phase(stream));
    }

    fn change_phase(&mut self, stamp: Stamp, to: Phase) {
        let from = std::mem::replace(&mut self.phase_told, to);
        if from != to {
            self.events
                .push_back(Event::PhaseChanged { stamp, from, to });
        }
    }

    /// The block's attitude with both joints turned back to zero.
    fn vehicle_attitude(
        &self,
        run: &Running,
        stamp: Stamp,
        stream: &Stream,
    ) -> UnitQuaternion<f64> {
        let angles = stream.joints().angles_at(stamp);
        run.filter.believed().attitude * self.settings.turntable.attitude(angles).inverse()
    }

    fn estimate(&self, run: &Running, stamp: Stamp, stream: &Stream) -> Estimate {
        let vehicle = self.vehicle_attitude(run, stamp, stream);
        let mut estimate = Estimate {
            stamp,
            phase: Phase::FineAlignment,
            vehicle: HeadingPitchRoll::from_attitude(&vehicle),
            vehicle_turn_rad: vehicle.angle_to(&run.reference_vehicle),
            navigation: run.filter.believed(),
            errors: run.filter.sensor_errors(),
            table: run.filter.believed_installation().table,
            states: run.filter.estimate_about_believed(),
            prior: run.prior.clone(),
            innovations: run.judge.report(),
            turned: run.turned,
            testimony: run.witness.as_ref().map(Witness::testimony),
            findings: run.findings.clone(),
            encoders: run.encoders.usage(),
            noise: *run.filter.noise(),
            noise_at_rest: run.noise_at_rest.densities(),
            ship_motion_m_s: run.motion.map(|motion| motion.sigmas_m_s()),
            samples: self.samples(stream),
            duration_s: stamp.seconds_since(run.start),
        };
        estimate.phase = estimate.evidence().phase(&self.settings);
        estimate
    }
}

fn crossed(stamp: Stamp, seconds: f64, passage: Passage) -> Event {
    let (sigma_rad, held) = match passage {
        Passage::Bridged([angle, _]) => (angle, false),
        Passage::Held(crossing) => (crossing.misalignment_sigma_rad.amax(), true),
    };
    Event::HoleCrossed {
        stamp,
        seconds,
        sigma_rad,
        held,
    }
}
