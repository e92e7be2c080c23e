//! Series that stay small however long the run is, and exact at both ends.

use sins::time::{NANOS_PER_SECOND, Stamp};

/// Points of an ordinary series: 4 h are one point in 16 s.
pub const POINTS: usize = 1500;

/// One point per spacing. The spacing doubles whenever there are too many.
pub struct Thinned<T> {
    points: Vec<(Stamp, T)>,
    newest: Option<(Stamp, T)>,
    spacing_ns: i64,
    most: usize,
}

impl<T> Thinned<T> {
    /// Never more than `most` points.
    pub fn new(most: usize) -> Self {
        Self {
            points: Vec::new(),
            newest: None,
            spacing_ns: NANOS_PER_SECOND,
            most,
        }
    }

    /// Whether a point at this time would be kept for its time alone. Where time runs back it is.
    pub fn is_due(&self, stamp: Stamp) -> bool {
        self.points
            .last()
            .is_none_or(|(last, _)| distance(*last, stamp) >= self.spacing_ns)
    }

    /// Takes a point; the newest one of all is never lost.
    pub fn push(&mut self, stamp: Stamp, value: T) {
        if self.is_due(stamp) {
            self.keep(stamp, value);
        } else {
            self.newest = Some((stamp, value));
        }
    }

    /// Takes a point that matters, whatever the spacing.
    pub fn keep(&mut self, stamp: Stamp, value: T) {
        self.newest = None;
        self.points.push((stamp, value));
        while self.points.len() > self.most {
            self.spacing_ns *= 2;
            let mut kept: Option<Stamp> = None;
            let spacing = self.spacing_ns;
            self.points.retain(|(stamp, _)| {
                let keep = kept.is_none_or(|last| distance(last, *stamp) >= spacing);
                if keep {
                    kept = Some(*stamp);
                }
                keep
            });
        }
    }

    /// Whether nothing has been pushed.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points, the last one included.
    pub fn points(&self) -> Vec<(Stamp, T)>
    where
        T: Clone,
    {
        self.points.iter().chain(&self.newest).cloned().collect()
    }

    /// The points, the last one included.
    pub fn finish(mut self) -> Vec<(Stamp, T)> {
        self.points.extend(self.newest);
        self.points
    }
}

fn distance(a: Stamp, b: Stamp) -> i64 {
    a.nanos().abs_diff(b.nanos()).cast_signed()
}

/// The greatest value of every spacing: a spike is not thinned away.
pub struct Peaks {
    points: Vec<(Stamp, f64)>,
    spacing_ns: i64,
    most: usize,
}

impl Peaks {
    /// Never more than `most` points.
    pub fn new(most: usize) -> Self {
        Self {
            points: Vec::new(),
            spacing_ns: NANOS_PER_SECOND,
            most,
        }
    }

    /// Takes a value.
    pub fn push(&mut self, stamp: Stamp, value: f64) {
        match self.points.last_mut() {
            Some((from, peak)) if distance(*from, stamp) < self.spacing_ns => {
                *peak = peak.max(value);
            }
            _ => self.points.push((stamp, value)),
        }
        if self.points.len() > self.most {
            self.spacing_ns *= 2;
            let merged = self.points.chunks(2).map(|pair| {
                let peak = pair
                    .iter()
                    .map(|(_, value)| *value)
                    .fold(f64::MIN, f64::max);
                (pair[0].0, peak)
            });
            self.points = merged.collect();
        }
    }

    /// Times and greatest values.
    pub fn finish(self) -> Vec<(Stamp, f64)> {
        self.points
    }
}

/// Joints that turn slower than this are at rest \[rad/s\].
const REST_RAD_S: f64 = 0.01;
/// A point of a motion at least so often \[rad\].
const TURN_RAD: f64 = 0.05;

/// Joint angles, with the corners where a motion begins and ends.
pub struct Corners {
    points: Thinned<[f64; 2]>,
    before: Option<(Stamp, [f64; 2])>,
    kept: [f64; 2],
    moving: bool,
}

impl Default for Corners {
    fn default() -> Self {
        Self {
            points: Thinned::new(4 * POINTS),
            before: None,
            kept: [0.0; 2],
            moving: false,
        }
    }
}

impl Corners {
    /// Takes a reading.
    pub fn push(&mut self, stamp: Stamp, angles: [f64; 2]) {
        let within = |other: [f64; 2], limit: f64| {
            other
                .iter()
                .zip(angles)
                .all(|(a, b)| (a - b).abs() <= limit)
        };
        let Some((then, before)) = self.before.replace((stamp, angles)) else {
            return self.keep(stamp, angles);
        };
        let rests = within(before, REST_RAD_S * stamp.seconds_since(then).abs());
        let was_moving = std::mem::replace(&mut self.moving, !rests);
        match (was_moving, rests) {
            (false, false) | (true, true) => {
                self.keep(then, before);
                self.points.push(stamp, angles);
            }
            (true, false) if !within(self.kept, TURN_RAD) => self.keep(stamp, angles),
            (true, false) => {}
            (false, true) => self.points.push(stamp, angles),
        }
    }

    fn keep(&mut self, stamp: Stamp, angles: [f64; 2]) {
        self.points.keep(stamp, angles);
        self.kept = angles;
    }

    /// The readings that make the curve.
    pub fn finish(mut self) -> Vec<(Stamp, [f64; 2])> {
        if let Some((stamp, angles)) = self.before {
            self.points.push(stamp, angles);
        }
        self.points.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: i64) -> Stamp {
        Stamp::from_nanos(seconds * NANOS_PER_SECOND)
    }

    /// However long it is, it stays small, evenly spaced, and has both ends.
    #[test]
    fn a_long_series_stays_small() {
        let mut thinned = Thinned::new(100);
        (0..10_007).for_each(|t| thinned.push(at(t), t));
        let points = thinned.finish();
        assert!(points.len() <= 101 && points.len() > 40, "{}", points.len());
        assert_eq!((points[0].1, points[points.len() - 1].1), (0, 10_006));
        let spacing = points[1].1 - points[0].1;
        assert!(
            points[..points.len() - 1]
                .windows(2)
                .all(|p| p[1].1 - p[0].1 == spacing)
        );
    }

    /// Time that runs back starts no endless series and loses no end.
    #[test]
    fn time_may_run_back() {
        let mut thinned = Thinned::new(100);
        (0..500).chain(0..20).for_each(|t| thinned.push(at(t), t));
        assert_eq!(thinned.finish().last().map(|p| p.1), Some(19));
    }

    /// One spike among a hundred thousand values is still there.
    #[test]
    fn a_spike_is_kept() {
        let mut peaks = Peaks::new(100);
        (0..100_000).for_each(|t| peaks.push(at(t), if t == 54_321 { 9.0 } else { 1.0 }));
        let points = peaks.finish();
        assert!(points.len() <= 100);
        assert_eq!(points.iter().filter(|p| p.1 == 9.0).count(), 1);
    }

    /// A turn between two long rests keeps its corners.
    #[test]
    fn a_turn_keeps_its_corners() {
        let mut corners = Corners::default();
        let angle = |t: i64| (f64::from(t as i32) - 500.0).clamp(0.0, 20.0) * 0.1;
        (0..1000).for_each(|t| corners.push(at(t), [angle(t), 0.0]));
        let points = corners.finish();
        let has = |t: i64| points.iter().any(|p| p.0 == at(t));
        assert!(has(0) && has(500) && has(520) && has(999), "{points:?}");
    }
}
