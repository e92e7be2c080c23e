//! The pictures of a run.

use report::{Axis, Band, Figure, Line, Panel, Series, palette};
use sins::{
    estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT},
    estimation::groups::navigation::MISALIGNMENT,
    estimation::model,
    estimation::state::StateLabel,
    machines::self_calibration::Thresholds,
    table::JOINT_NAMES,
    time::Stamp,
    units::NAUTICAL_MILE_M,
};

use super::{
    estimates::{PhaseChange, Point, phase_name},
    gather::GatheredRun,
    scheme::RecordedStep,
};

/// Marks of phases in one picture.
const PHASE_MARKS: usize = 8;
/// Letters of positions in one picture.
const POSITION_MARKS: usize = 45;

/// Time on the x axis, from the start of the run.
#[derive(Clone, Copy)]
pub struct Clock {
    /// Its zero.
    pub start: Stamp,
    unit: &'static str,
    unit_s: f64,
    end: f64,
}

impl Clock {
    /// Hours, or minutes where the run is short.
    pub fn new(start: Stamp, end: Stamp) -> Self {
        let length_s = end.seconds_since(start).max(1.0);
        let (unit, unit_s) = if length_s > 5000.0 {
            ("h", 3600.0)
        } else {
            ("min", 60.0)
        };
        Self {
            start,
            unit,
            unit_s,
            // The axis ends at a round number where the last sample is hardly short of one.
            end: (length_s / unit_s * 100.0).round().max(1.0) / 100.0,
        }
    }

    fn axis(&self) -> Axis {
        Axis::new("time", self.unit)
    }

    /// On the axis.
    pub fn at(&self, stamp: Stamp) -> f64 {
        stamp.seconds_since(self.start) / self.unit_s
    }

    /// For tables.
    pub fn seconds(&self, stamp: Stamp) -> String {
        format!("{:.3}", stamp.seconds_since(self.start))
    }
}

/// What the pictures are drawn from.
pub struct Drawing<'a> {
    /// The run.
    pub run: &'a GatheredRun,
    /// Below them an estimate counts as found.
    pub thresholds: Thresholds,
    /// Its time.
    pub clock: Clock,
    /// Its estimates, thinned.
    pub points: &'a [Point],
    /// The greatest single NIS of every spacing.
    pub singles: &'a [(Stamp, f64)],
    /// Joint angles.
    pub joints: &'a [(Stamp, [f64; 2])],
    /// Position errors with and without the calibration \[m\].
    pub positions: &'a [Vec<(Stamp, f64)>; 2],
}

/// Labels of three states with their axes.
fn labels(names: [&'static str; 3]) -> impl Iterator<Item = (usize, &'static StateLabel)> {
    names.into_iter().filter_map(model::label).enumerate()
}

impl Drawing<'_> {
    /// All that there is something to be seen in.
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        if !self.points.is_empty() {
            figures.extend(self.misalignment());
            figures.extend([
                self.sensor_errors("drift", "Gyroscope drift", GYROSCOPE_DRIFT, |p| p.drift),
                self.sensor_errors("bias", "Accelerometer bias", ACCELEROMETER_BIAS, |p| p.bias),
                self.sigmas(),
                self.nis(),
            ]);
        }
        if !self.joints.is_empty() {
            figures.push(self.joint_angles());
        }
        if self.positions.iter().any(|track| !track.is_empty()) {
            figures.push(self.position_error());
        }
        figures
    }

    fn figure(&self, id: &str, title: impl Into<String>) -> Figure {
        Figure::new(id, title, self.clock.axis()).x_range(0.0, self.clock.end)
    }

    /// Marks where a phase begins.
    fn phases(&self, mut panel: Panel) -> Panel {
        for change in self.shown_phases() {
            panel = panel.vertical(self.clock.at(change.stamp), phase_name(change.phase));
        }
        panel
    }

    /// Changes of phase that are marked: not those at the very beginning.
    fn shown_phases(&self) -> impl Iterator<Item = &PhaseChange> {
        let phases = self.run.history.phases.iter();
        phases
            .filter(|change| self.clock.at(change.stamp) > 0.01 * self.clock.end)
            .take(PHASE_MARKS)
    }

    fn phase_words(&self) -> &'static str {
        if self.run.history.phases.len() > PHASE_MARKS + 2 {
            " The first changes of phase are marked; the table has more."
        } else {
            ""
        }
    }

    /// Error of the attitude, where the truth is known.
    fn misalignment(&self) -> Option<Figure> {
        let errors = self.run.truth.errors();
        if errors.is_empty() {
            return None;
        }
        let mut figure = self
            .figure("misalignment", "Misalignment: error and ±3σ")
            .caption(format!(
                "Error of the attitude against the recorded truth about East, North and Up, within ±3σ of the filter.{}",
                self.phase_words()
            ));
        for (axis, label) in labels(MISALIGNMENT) {
            let band = self.points.iter().map(|p| {
                let three = 3.0 * p.misalignment_sigma[axis] / label.scale;
                (self.clock.at(p.stamp), -three, three)
            });
            let curve = errors
                .iter()
                .map(|(stamp, error)| (self.clock.at(*stamp), error[axis] / label.scale));
            let panel = Panel::new("", Axis::new(label.symbol, label.unit))
                .band(Band::new("±3σ of the filter", band.collect()))
                .series(Series::new("error", curve.collect()).colour(palette::VERMILION));
            figure = figure.panel(self.phases(panel));
        }
        Some(figure)
    }

    /// How well everything is known, against what is asked for.
    fn sigmas(&self) -> Figure {
        let mut figure = self
            .figure("sigma", "One sigma of the estimates")
            .caption(format!(
                "1 sigma of the filter for attitude, gyroscope drifts and accelerometer biases. The dashed lines are the thresholds that this command was given, or the usual ones; that of the attitude is for the azimuth. Above them the angles of the joints: every turn shows something that was hidden.{}",
                self.phase_words()
            ));
        if !self.joints.is_empty() {
            let panel = Panel::new("", Axis::new("joints", "deg"));
            let curves = (0..JOINT_NAMES.len()).map(|joint| self.joint(joint));
            figure = figure.panel(self.positions(curves.fold(panel, Panel::series)));
        }
        for (names, name, of) in [
            (
                MISALIGNMENT,
                "σ φ",
                (|p| p.misalignment_sigma) as fn(&Point) -> [f64; 3],
            ),
            (GYROSCOPE_DRIFT, "σ ε", |p| p.drift[1]),
            (ACCELEROMETER_BIAS, "σ ∇", |p| p.bias[1]),
        ] {
            let unit = labels(names)
                .next()
                .map_or(("", 1.0), |(_, l)| (l.unit, l.scale));
            let (unit, scale) = unit;
            let mut panel = Panel::new("", Axis::new(name, unit)).log();
            for (axis, label) in labels(names) {
                let curve = self
                    .points
                    .iter()
                    .map(|p| (self.clock.at(p.stamp), of(p)[axis] / scale));
                panel = panel.series(Series::new(label.symbol, curve.collect()).colour(axis));
            }
            if let Some(threshold) = names.iter().find_map(|name| self.thresholds.of(name)) {
                panel = panel.horizontal(threshold / scale, "");
            }
            figure = figure.panel(self.phases(panel));
        }
        figure
    }

    fn sensor_errors(
        &self,
        id: &str,
        title: &str,
        names: [&'static str; 3],
        of: fn(&Point) -> [[f64; 3]; 2],
    ) -> Figure {
        let truth = self.run.truth.calibration.as_ref().map(|truth| {
            if names == GYROSCOPE_DRIFT {
                truth.gyroscope_drift
            } else {
                truth.accelerometer_bias
            }
        });
        let truth_words = if truth.is_some() {
            " The dashed line is the recorded truth."
        } else {
            ""
        };
        let mut figure = self
            .figure(id, format!("{title}: estimate and ±3σ"))
            .caption(format!(
                "Estimate of every axis of the block within ±3σ of the filter.{truth_words}{}",
                self.phase_words()
            ));
        for (axis, label) in labels(names) {
            let value = |p: &Point| {
                let [estimate, sigma] = of(p);
                (
                    estimate[axis] / label.scale,
                    3.0 * sigma[axis] / label.scale,
                )
            };
            let band = self.points.iter().map(|p| {
                let (estimate, three) = value(p);
                (self.clock.at(p.stamp), estimate - three, estimate + three)
            });
            let curve = self
                .points
                .iter()
                .map(|p| (self.clock.at(p.stamp), value(p).0));
            let mut panel = Panel::new("", Axis::new(label.symbol, label.unit))
                .band(Band::new("±3σ of the filter", band.collect()))
                .series(Series::new("estimate", curve.collect()));
            if let Some(truth) = truth {
                let level = truth[axis] / label.scale;
                let line = vec![(0.0, level), (self.clock.end, level)];
                panel = panel.series(
                    Series::new("truth", line)
                        .line(Line::Dashed)
                        .colour(palette::BLACK),
                );
            }
            figure = figure.panel(self.phases(panel));
        }
        figure
    }

    fn nis(&self) -> Figure {
        let mean = self
            .points
            .iter()
            .map(|p| (self.clock.at(p.stamp), p.nis_mean))
            .collect();
        let bound = self
            .points
            .iter()
            .map(|p| (self.clock.at(p.stamp), p.nis_bound))
            .collect();
        let singles = self
            .singles
            .iter()
            .map(|(stamp, value)| (self.clock.at(*stamp), *value))
            .collect();
        let window = Panel::new("", Axis::new("mean NIS", ""))
            .log()
            .series(Series::new("mean of the window", mean))
            .series(
                Series::new("its bound", bound)
                    .line(Line::Dashed)
                    .colour(palette::BLACK),
            );
        let single = Panel::new("", Axis::new("single NIS", "")).series(
            Series::new("single values, the greatest of each moment", singles)
                .line(Line::Thin)
                .colour(palette::VERMILION),
        );
        self.figure("nis", "Normalized innovations squared")
            .caption(format!(
                "Two degrees of freedom: 2 on average where the filter is consistent. A full window above its bound is a fault; a ship that lies stiller than the measurement's sigma stays far below.{}",
                self.phase_words()
            ))
            .panel(self.phases(window))
            .panel(self.phases(single))
    }

    fn joint_angles(&self) -> Figure {
        let marks = position_marks(&self.run.scheme.steps);
        let caption = match (self.run.scheme.steps.is_empty(), marks.is_empty()) {
            (true, _) => "The bag has no status of a scheme, so its positions have no names.",
            (false, true) => "The table of steps has the names of the positions.",
            (false, false) => "A mark with the letter of its position stands where a dwell begins.",
        };
        let mut figure = self.figure("joints", "Joint angles").caption(caption);
        for joint in 0..JOINT_NAMES.len() {
            let curve = self.joint(joint);
            let panel = Panel::new("", Axis::new(curve.name.clone(), "deg"));
            figure = figure.panel(self.positions(panel.series(curve.unlisted())));
        }
        figure
    }

    /// The angle of one joint.
    fn joint(&self, joint: usize) -> Series {
        let name = JOINT_NAMES[joint].replace('_', " ");
        let curve = self.joints.iter();
        let curve =
            curve.map(|(stamp, angles)| (self.clock.at(*stamp), angles[joint].to_degrees()));
        Series::new(name, curve.collect()).colour(joint)
    }

    /// Marks where a dwell begins.
    fn positions(&self, mut panel: Panel) -> Panel {
        for (stamp, letter) in position_marks(&self.run.scheme.steps) {
            panel = panel.vertical(self.clock.at(stamp), letter);
        }
        panel
    }

    fn position_error(&self) -> Figure {
        let mut panel = Panel::new("", Axis::new("position error", "nmi"));
        for (which, (name, line)) in [
            ("with the calibration", Line::Solid),
            ("without it", Line::Dashed),
        ]
        .into_iter()
        .enumerate()
        {
            let curve: Vec<_> = self.positions[which]
                .iter()
                .map(|(stamp, metres)| (self.clock.at(*stamp), metres / NAUTICAL_MILE_M))
                .collect();
            if !curve.is_empty() {
                panel = panel.series(Series::new(name, curve).line(line).colour(which));
            }
        }
        let first = self.positions.iter().filter_map(|track| track.first());
        let first = first.map(|(stamp, _)| self.clock.at(*stamp));
        let from = first.fold(self.clock.end, f64::min);
        self.figure("position", "Position error of free navigation")
            .x_range(from, self.clock.end)
            .caption("Distance of the compensator's position from the recorded truth, since it navigates freely.")
            .panel(self.phases(panel))
    }
}

/// Where dwells begin, with the letters of the positions; none where they would stand too close.
fn position_marks(steps: &[RecordedStep]) -> Vec<(Stamp, String)> {
    if steps.len() > POSITION_MARKS {
        return Vec::new();
    }
    steps
        .iter()
        .filter_map(|step| Some((step.dwell?, step.position.clone())))
        .collect()
}
