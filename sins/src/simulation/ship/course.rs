//! Slow motion of a ship: the swing round a mooring, and a course with turns.
//!
//! Both are functions of time on a chart, East and North in metres from the start, with their derivatives.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

use super::sea::Jet;
use crate::error::Error;
use crate::range;

/// Nodes and weights of the Gauss-Legendre rule of five nodes on −1..1.
const NODES: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
/// Panels of the integral over a turn.
const PANELS: u32 = 12;

/// How a ship swings round her mooring: heading by two slow waves of this amplitude together, while her bow stays at the end of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swing {
    /// √2 standard deviations of the heading; 0: she does not swing \[rad\].
    pub amplitude_rad: f64,
    /// Period of the greater of both waves; the other has 1.63 of it \[s\].
    pub period_s: f64,
    /// From the mooring to the ship's centre \[m\].
    pub radius_m: f64,
}

impl Default for Swing {
    fn default() -> Self {
        Self {
            amplitude_rad: 0.0,
            period_s: 240.0,
            radius_m: 30.0,
        }
    }
}

/// A programme of speed and heading: from the heading of the start straight on, then legs that turn to starboard and back in
/// turn. A turn begins and ends without a jump of its rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Course {
    /// Speed on the chart; 0: she stays \[m/s\].
    pub speed_m_s: f64,
    /// When she begins to move \[s\].
    pub start_s: f64,
    /// Greatest acceleration while she gathers way \[m/s²\].
    pub acceleration_m_s2: f64,
    /// Length of a straight leg \[s\].
    pub leg_s: f64,
    /// Angle of a turn; 0: she goes straight on \[rad\].
    pub turn_rad: f64,
    /// Greatest rate in a turn \[rad/s\].
    pub turn_rate_rad_s: f64,
}

impl Default for Course {
    fn default() -> Self {
        Self {
            speed_m_s: 0.0,
            start_s: 0.0,
            acceleration_m_s2: 0.05,
            leg_s: 600.0,
            turn_rad: 1.0,
            turn_rate_rad_s: 0.02,
        }
    }
}

/// Where slow motion has brought the ship, each with its first and second derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Track {
    /// East, North of the start \[m\].
    pub place: [Jet; 2],
    /// To be added to the heading of the start \[rad\].
    pub heading: Jet,
}

impl Swing {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        range::within("swing round the mooring [rad]", self.amplitude_rad, PI)?;
        range::positive("period of the swing [s]", self.period_s)?;
        range::not_negative("radius of the swing [m]", self.radius_m)?;
        Ok(())
    }

    /// The swing with these phases, for a ship that lies at this heading in the mean \[rad\].
    pub(super) fn at(&self, seconds: f64, heading_rad: f64, phases: [f64; 2]) -> Track {
        let mut swung = [0.0; 3];
        for ((part, stretch), phase) in [(0.8, 1.0), (0.6, 1.63)].iter().zip(phases) {
            let frequency = TAU / (self.period_s * stretch);
            let amplitude = self.amplitude_rad * part;
            let (sin, cos) = (frequency * seconds + phase).sin_cos();
            swung[0] += amplitude * sin;
            swung[1] += amplitude * frequency * cos;
            swung[2] -= amplitude * frequency * frequency * sin;
        }
        let [angle, rate, change] = swung;
        let (sin, cos) = (heading_rad + angle).sin_cos();
        let (mean_sin, mean_cos) = heading_rad.sin_cos();
        let radius = self.radius_m;
        Track {
            place: [
                [
                    radius * (mean_sin - sin),
                    -radius * cos * rate,
                    radius * (sin * rate * rate - cos * change),
                ],
                [
                    radius * (mean_cos - cos),
                    radius * sin * rate,
                    radius * (cos * rate * rate + sin * change),
                ],
            ],
            heading: swung,
        }
    }
}

/// The part (0..1) of a smooth step and its two derivatives by `u`, which runs from 0 to 1: u − sin(2πu)/2π.
fn smooth_step(u: f64) -> Jet {
    let (sin, cos) = (TAU * u).sin_cos();
    [u - sin / TAU, 1.0 - cos, TAU * sin]
}

impl Course {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        range::not_negative("speed [m/s]", self.speed_m_s)?;
        range::not_negative("start of the course [s]", self.start_s)?;
        range::positive("acceleration of the ship [m/s²]", self.acceleration_m_s2)?;
        range::positive("length of a leg [s]", self.leg_s)?;
        range::within("turn of the ship [rad]", self.turn_rad, PI)?;
        range::positive("turning rate of the ship [rad/s]", self.turn_rate_rad_s)?;
        Ok(())
    }

    /// Time of a turn \[s\].
    pub fn turn_s(&self) -> f64 {
        2.0 * self.turn_rad.abs() / self.turn_rate_rad_s
    }

    /// Heading over that of the start, `seconds` into a turn that goes from `from` by `by` \[rad\].
    fn turning(&self, seconds: f64, from: f64, by: f64) -> Jet {
        let duration = self.turn_s();
        let [part, rate, change] = smooth_step(seconds / duration);
        [
            from + by * part,
            by * rate / duration,
            by * change / (duration * duration),
        ]
    }

    /// East and North gained `seconds` into a turn \[m\].
    fn gained(&self, seconds: f64, from: f64, by: f64) -> [f64; 2] {
        let half = 0.5 * seconds / f64::from(PANELS);
        let mut sum = [0.0; 2];
        for panel in 0..PANELS {
            for (node, weight) in NODES {
                let t = half * (f64::from(2 * panel + 1) + node);
                let (sin, cos) = self.turning(t, from, by)[0].sin_cos();
                sum[0] += weight * half * self.speed_m_s * sin;
                sum[1] += weight * half * self.speed_m_s * cos;
            }
        }
        sum
    }

    /// The track from a start at this heading \[rad\].
    pub(super) fn at(&self, seconds: f64, heading_rad: f64) -> Track {
        let speed = self.speed_m_s;
        let since = seconds - self.start_s;
        if speed == 0.0 || since <= 0.0 {
            return Track::default();
        }
        let along = |heading: f64, way: Jet| {
            let (sin, cos) = heading.sin_cos();
            [way.map(|x| x * sin), way.map(|x| x * cos)]
        };
        let gathering_s = 2.0 * speed / self.acceleration_m_s2;
        if since < gathering_s {
            let u = since / gathering_s;
            let [part, rate, _] = smooth_step(u);
            let gone = 0.5 * u * u + ((TAU * u).cos() - 1.0) / (TAU * TAU);
            let way = [
                speed * gathering_s * gone,
                speed * part,
                speed * rate / gathering_s,
            ];
            return Track {
                place: along(heading_rad, way),
                heading: [0.0; 3],
            };
        }
        let way = 0.5 * speed * gathering_s;
        let [[east, _, _], [north, _, _]] = along(heading_rad, [way, 0.0, 0.0]);
        let (mut place, mut left) = ([east, north], since - gathering_s);
        if self.turn_rad == 0.0 {
            let [[east, ve, _], [north, vn, _]] = along(heading_rad, [speed * left, speed, 0.0]);
            return Track {
                place: [[place[0] + east, ve, 0.0], [place[1] + north, vn, 0.0]],
                heading: [0.0; 3],
            };
        }
        let turn_s = self.turn_s();
        // A leg, a turn to starboard, a leg, and the turn back.
        let halves = [(0.0, self.turn_rad), (self.turn_rad, -self.turn_rad)];
        let gains = halves.map(|(from, by)| {
            let [[east, ..], [north, ..]] =
                along(heading_rad + from, [speed * self.leg_s, 0.0, 0.0]);
            let turned = self.gained(turn_s, heading_rad + from, by);
            [east + turned[0], north + turned[1]]
        });
        let half_s = self.leg_s + turn_s;
        let cycles = (left / (2.0 * half_s)).floor();
        left -= cycles * 2.0 * half_s;
        for axis in 0..2 {
            place[axis] += cycles * (gains[0][axis] + gains[1][axis]);
        }
        let second = left >= half_s;
        if second {
            left -= half_s;
            place = [place[0] + gains[0][0], place[1] + gains[0][1]];
        }
        let (from, by) = halves[usize::from(second)];
        let straight_s = left.min(self.leg_s);
        let [[east, ..], [north, ..]] = along(heading_rad + from, [speed * straight_s, 0.0, 0.0]);
        place = [place[0] + east, place[1] + north];
        let heading = if left <= self.leg_s {
            [from, 0.0, 0.0]
        } else {
            let into = left - self.leg_s;
            let turned = self.gained(into, heading_rad + from, by);
            place = [place[0] + turned[0], place[1] + turned[1]];
            self.turning(into, from, by)
        };
        let (sin, cos) = (heading_rad + heading[0]).sin_cos();
        Track {
            place: [
                [place[0], speed * sin, speed * cos * heading[1]],
                [place[1], speed * cos, -speed * sin * heading[1]],
            ],
            heading,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn derivatives_hold(track: impl Fn(f64) -> Track, times: &[f64]) {
        let h = 1e-3;
        for t in times {
            let jets = |t: f64| {
                let Track { place, heading } = track(t);
                [place[0], place[1], heading]
            };
            for ((before, now), after) in jets(t - h).iter().zip(jets(*t)).zip(jets(t + h)) {
                let (rate, change) = (
                    (after[0] - before[0]) / (2.0 * h),
                    (after[1] - before[1]) / (2.0 * h),
                );
                assert!((rate - now[1]).abs() < 1e-6, "{t}: {rate} {}", now[1]);
                assert!((change - now[2]).abs() < 1e-6, "{t}: {change} {}", now[2]);
            }
        }
    }

    /// Velocity and acceleration are the derivatives of the place at rest, gathering way, on a leg, in both turns and over many cycles; and
    /// her speed is the one given.
    #[test]
    fn a_course_is_smooth() {
        let course = Course {
            speed_m_s: 8.0,
            start_s: 100.0,
            ..Course::default()
        };
        let gathered = 100.0 + 2.0 * 8.0 / 0.05;
        let times = [
            50.0,
            150.0,
            gathered - 1.0,
            gathered,
            gathered + 1.0,
            gathered + 600.0,
            gathered + 650.0,
            gathered + 700.0,
            gathered + 1000.0,
            gathered + 1320.0,
            gathered + 1400.0,
            gathered + 9876.0,
        ];
        derivatives_hold(|t| course.at(t, 0.4), &times);
        let track = course.at(gathered + 640.0, 0.4);
        assert!((track.place[0][1].hypot(track.place[1][1]) - 8.0).abs() < 1e-12);
        assert_eq!(course.at(gathered + 750.0, 0.4).heading, [1.0, 0.0, 0.0]);
    }

    /// A turn by a full half circle brings her abeam of its beginning, starboard of her old course.
    #[test]
    fn turns_go_to_starboard() {
        let course = Course {
            speed_m_s: 5.0,
            turn_rad: PI,
            ..Course::default()
        };
        let begin = 2.0 * 5.0 / 0.05 + 600.0;
        let (before, after) = (
            course.at(begin, 0.0),
            course.at(begin + course.turn_s(), 0.0),
        );
        assert!(after.place[0][0] - before.place[0][0] > 100.0);
        assert!((after.place[1][0] - before.place[1][0]).abs() < 1e-6);
    }

    /// While she swings her centre stays on the circle round the mooring, and everything is smooth.
    #[test]
    fn a_swing_goes_round_the_mooring() {
        let swing = Swing {
            amplitude_rad: 0.1,
            ..Swing::default()
        };
        let at = |t: f64| swing.at(t, 2.0, [0.3, 4.0]);
        derivatives_hold(at, &[0.0, 37.0, 500.0]);
        let mooring = [30.0 * 2.0f64.sin(), 30.0 * 2.0f64.cos()];
        let track = at(81.0);
        let distance = (track.place[0][0] - mooring[0]).hypot(track.place[1][0] - mooring[1]);
        assert!((distance - 30.0).abs() < 1e-12);
    }
}
