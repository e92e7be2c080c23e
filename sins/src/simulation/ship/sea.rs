//! Waves and what they make of a hull.
//!
//! A wave system is a spectrum of JONSWAP's form, S(ω) ∝ ω⁻⁵ exp(−5/4 (ω_p/ω)⁴) γ^exp(−(ω/ω_p − 1)²/2σ²) with σ = 0.07 below and 0.09
//! above the peak (Hasselmann 1973); γ = 1 is Pierson and Moskowitz's (1964). It is cut into bands of equal energy, and each
//! band is one long-crested wave of deep water, k = ω²/g, whose frequency and phase are drawn: the variance of the elevation is
//! (H_s/4)² exactly.
//!
//! The hull answers as simple oscillators, H(ω) = 1/(1 − (ω/ω_0)² + 2iζ ω/ω_0) at the frequency at which she meets a wave, by which
//! heave follows the elevation, and roll and pitch the slope across and along; she is carried to and fro by the orbits of the
//! water, and yaws by the product of both slopes' directions. What is shorter than the hull averages out over her length and beam,
//! by sin(x)/x each. That is a model to try a filter on, not one of a real hull.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::earth::STANDARD_GRAVITY_M_S2;
use crate::error::Error;
use crate::range;

/// Steps of the numerical integral of a spectrum.
const SPECTRUM_STEPS: usize = 4000;
/// Where a spectrum is cut off, as multiples of the peak's frequency.
const CUT_OFF: (f64, f64) = (0.5, 4.0);

/// Waves that come from one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WaveSystem {
    /// Significant height, four standard deviations of the elevation; 0: none \[m\].
    pub significant_height_m: f64,
    /// Period of the peak \[s\].
    pub peak_period_s: f64,
    /// γ: 1 is Pierson-Moskowitz, 3.3 JONSWAP's mean, 7 and more a narrow swell.
    pub peakedness: f64,
    /// Where they come from, clockwise from true north \[rad\].
    pub from_direction_rad: f64,
}

impl WaveSystem {
    /// A calm; what a wind sea is where only its height is given.
    pub const WIND_SEA: Self = Self {
        significant_height_m: 0.0,
        peak_period_s: 7.0,
        peakedness: 3.3,
        from_direction_rad: 1.0,
    };
    /// A calm; what a swell is where only its height is given.
    pub const SWELL: Self = Self {
        significant_height_m: 0.0,
        peak_period_s: 13.0,
        peakedness: 10.0,
        from_direction_rad: 2.2,
    };

    /// The elevation's standard deviation \[m\].
    pub fn elevation_std_m(&self) -> f64 {
        0.25 * self.significant_height_m
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        range::not_negative(
            "significant height of the waves [m]",
            self.significant_height_m,
        )?;
        range::positive("peak period of the waves [s]", self.peak_period_s)?;
        range::finite("direction of the waves [rad]", self.from_direction_rad)?;
        if !(1.0..=100.0).contains(&self.peakedness) {
            return Err(Error::setting(
                "peakedness of the waves",
                self.peakedness,
                "1 to 100",
            ));
        }
        Ok(())
    }

    /// The spectrum's shape at a multiple of the peak's frequency.
    fn shape(&self, ratio: f64) -> f64 {
        let width = if ratio < 1.0 { 0.07 } else { 0.09 };
        let enhancement = (-0.5 * ((ratio - 1.0) / width).powi(2)).exp();
        ratio.powi(-5) * (-1.25 * ratio.powi(-4)).exp() * self.peakedness.powf(enhancement)
    }

    /// Frequencies \[rad/s\] of `count` bands of equal energy, drawn within each.
    fn frequencies(&self, count: usize, generator: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let peak = TAU / self.peak_period_s;
        let step = (CUT_OFF.1 - CUT_OFF.0) / SPECTRUM_STEPS as f64;
        let ratio = |k: usize| CUT_OFF.0 + step * (k as f64 + 0.5);
        let total: f64 = (0..SPECTRUM_STEPS).map(|k| self.shape(ratio(k))).sum();
        let mut targets = (0..count)
            .map(|band| (band as f64 + generator.random::<f64>()) / count as f64 * total)
            .peekable();
        let (mut frequencies, mut sum) = (Vec::with_capacity(count), 0.0);
        for k in 0..SPECTRUM_STEPS {
            let energy = self.shape(ratio(k));
            while let Some(target) = targets.next_if(|target| *target <= sum + energy) {
                let within = (target - sum) / energy - 0.5;
                frequencies.push(peak * (ratio(k) + step * within));
            }
            sum += energy;
        }
        // Rounding may leave the last target at the very end.
        frequencies.resize(count, peak * CUT_OFF.1);
        frequencies
    }
}

/// How the hull answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hull {
    /// Length of the waterline; 0: she is a point to the waves \[m\].
    pub length_m: f64,
    /// Beam \[m\].
    pub beam_m: f64,
    /// Natural period of heave; 0: she follows the water \[s\].
    pub heave_period_s: f64,
    /// Natural period of roll; 0: she follows the slope \[s\].
    pub roll_period_s: f64,
    /// Natural period of pitch; 0: she follows the slope \[s\].
    pub pitch_period_s: f64,
    /// Damping of heave and pitch, as a part of the critical one.
    pub damping: f64,
    /// Damping of roll, as a part of the critical one.
    pub roll_damping: f64,
    /// Yaw by slope, both in rad, in waves at 45 deg; half of what the product of the directions gives there.
    pub yaw_per_slope: f64,
}

impl Default for Hull {
    /// A ship of some thousand tons.
    fn default() -> Self {
        Self {
            length_m: 60.0,
            beam_m: 11.0,
            heave_period_s: 5.5,
            roll_period_s: 10.0,
            pitch_period_s: 5.5,
            damping: 0.4,
            roll_damping: 0.1,
            yaw_per_slope: 0.2,
        }
    }
}

impl Hull {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the value.
    pub fn validate(&self) -> Result<(), Error> {
        for (name, period) in [
            ("length of the hull [m]", self.length_m),
            ("beam of the hull [m]", self.beam_m),
            ("natural period of heave [s]", self.heave_period_s),
            ("natural period of roll [s]", self.roll_period_s),
            ("natural period of pitch [s]", self.pitch_period_s),
        ] {
            range::not_negative(name, period)?;
        }
        range::positive("damping of heave and pitch", self.damping)?;
        range::positive("damping of roll", self.roll_damping)?;
        range::finite("yaw by slope", self.yaw_per_slope)?;
        Ok(())
    }
}

/// Gain and lag \[rad\] of an oscillator.
fn oscillator(frequency: f64, natural_period_s: f64, damping: f64) -> (f64, f64) {
    let ratio = frequency * natural_period_s / TAU;
    let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * damping * ratio);
    (1.0 / real.hypot(imaginary), imaginary.atan2(real))
}

/// sin(x)/x: what is left of a wave over a length of which half is x \[rad of the wave\].
fn averaged(x: f64) -> f64 {
    if x.abs() < 1e-6 { 1.0 } else { x.sin() / x }
}

/// A motion of one degree of freedom with its two derivatives.
pub(super) type Jet = [f64; 3];

/// What the waves do to the hull: each with its first and second derivative by time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WaveMotion {
    /// To the East, to the North \[m\].
    pub drift: [Jet; 2],
    /// Upwards \[m\].
    pub heave: Jet,
    /// To be added to heading, pitch and roll \[rad\].
    pub angles: [Jet; 3],
}

/// Cosine and sine amplitude of one degree of freedom by one wave.
type Amplitudes = [f64; 2];

/// One wave and what it does.
#[derive(Clone, Copy, Debug)]
struct Wave {
    frequency: f64,
    phase: f64,
    /// Wave number times the direction it goes to (East, North) \[rad/m\].
    number: Vector2<f64>,
    /// East, North, up, heading, pitch, roll.
    answers: [Amplitudes; 6],
}

/// The waves of all systems.
#[derive(Clone, Debug, Default)]
pub(super) struct Waves {
    waves: Vec<Wave>,
}

impl Waves {
    /// Adds a system of `count` waves on a hull that heads so \[rad\] at this speed \[m/s\].
    pub fn add(
        &mut self,
        system: &WaveSystem,
        hull: &Hull,
        (heading_rad, speed_m_s): (f64, f64),
        count: usize,
        generator: &mut Xoshiro256PlusPlus,
    ) {
        if system.significant_height_m == 0.0 {
            return;
        }
        let amplitude = system.elevation_std_m() * (2.0 / count as f64).sqrt();
        let (from_sin, from_cos) = system.from_direction_rad.sin_cos();
        let goes_to = -Vector2::new(from_sin, from_cos);
        let (sin, cos) = heading_rad.sin_cos();
        let along = goes_to.dot(&Vector2::new(sin, cos));
        let across = goes_to.dot(&Vector2::new(cos, -sin));
        for frequency in system.frequencies(count, generator) {
            let number = frequency * frequency / STANDARD_GRAVITY_M_S2;
            let amplitude = amplitude
                * averaged(0.5 * number * along * hull.length_m)
                * averaged(0.5 * number * across * hull.beam_m);
            let slope = amplitude * number;
            let met = (frequency - number * along * speed_m_s).abs();
            let (heave, heave_lag) = oscillator(met, hull.heave_period_s, hull.damping);
            let (pitch, pitch_lag) = oscillator(met, hull.pitch_period_s, hull.damping);
            let (roll, roll_lag) = oscillator(met, hull.roll_period_s, hull.roll_damping);
            // With Φ = ωt − k·x the elevation is a cos Φ, the slope the way it goes is a k sin Φ, and the orbit's displacement a sin Φ.
            let cosine = |gain: f64, lag: f64| [gain * lag.cos(), gain * lag.sin()];
            let sine = |gain: f64, lag: f64| [-gain * lag.sin(), gain * lag.cos()];
            self.waves.push(Wave {
                frequency,
                phase: TAU * generator.random::<f64>(),
                number: goes_to * number,
                answers: [
                    sine(amplitude * goes_to.x, 0.0),
                    sine(amplitude * goes_to.y, 0.0),
                    cosine(amplitude * heave, heave_lag),
                    cosine(
                        2.0 * slope * along * across * hull.yaw_per_slope * pitch,
                        pitch_lag,
                    ),
                    sine(slope * along * pitch, pitch_lag),
                    // Starboard goes down where the water rises to port.
                    sine(-slope * across * roll, roll_lag),
                ],
            });
        }
    }

    /// Whether there are none.
    pub fn is_calm(&self) -> bool {
        self.waves.is_empty()
    }

    /// What they do `seconds` after the start to a ship whose track (East, North) has this place, velocity and acceleration \[m, s\].
    pub fn at(&self, seconds: f64, track: &[Jet; 2]) -> WaveMotion {
        let mut sums = [[0.0; 3]; 6];
        for wave in &self.waves {
            let [place, rate, change] = [0, 1, 2]
                .map(|order| -(wave.number.x * track[0][order] + wave.number.y * track[1][order]));
            let (sin, cos) = (wave.frequency * seconds + wave.phase + place).sin_cos();
            let rate = wave.frequency + rate;
            for (sum, [in_phase, quadrature]) in sums.iter_mut().zip(&wave.answers) {
                let value = in_phase * cos + quadrature * sin;
                let slope = quadrature * cos - in_phase * sin;
                sum[0] += value;
                sum[1] += rate * slope;
                sum[2] += change * slope - rate * rate * value;
            }
        }
        let [east, north, heave, heading, pitch, roll] = sums;
        WaveMotion {
            drift: [east, north],
            heave,
            angles: [heading, pitch, roll],
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand::SeedableRng;

    use super::*;

    const FOLLOWS: Hull = Hull {
        length_m: 0.0,
        beam_m: 0.0,
        heave_period_s: 0.0,
        roll_period_s: 0.0,
        pitch_period_s: 0.0,
        damping: 1.0,
        roll_damping: 1.0,
        yaw_per_slope: 0.0,
    };

    fn waves(system: &WaveSystem, hull: &Hull, heading_rad: f64) -> Waves {
        let mut waves = Waves::default();
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(5);
        waves.add(system, hull, (heading_rad, 0.0), 40, &mut generator);
        waves
    }

    fn mean_square(waves: &Waves, value: impl Fn(&WaveMotion) -> f64) -> f64 {
        let n = 200_000;
        let at = |k: i32| value(&waves.at(0.37 * f64::from(k), &[[0.0; 3]; 2])).powi(2);
        (0..n).map(at).sum::<f64>() / f64::from(n)
    }

    /// The variance of the heave of a hull that follows the water is (H_s/4)², by a wide and by a narrow spectrum.
    #[test]
    fn heave_has_the_variance_of_the_sea() {
        for peakedness in [1.0, 3.3, 10.0] {
            let system = WaveSystem {
                significant_height_m: 2.0,
                peakedness,
                ..WaveSystem::WIND_SEA
            };
            let variance = mean_square(&waves(&system, &FOLLOWS, 0.0), |motion| motion.heave[0]);
            assert!(
                (variance / 0.25 - 1.0).abs() < 0.02,
                "{peakedness}: {variance}"
            );
        }
    }

    /// Frequencies have the spectrum's moments: the mean zero-crossing period of Pierson-Moskowitz's is 0.710 of the peak's and JONSWAP's
    /// 0.777; without the waves shorter than a quarter of that period, by the integrals, 0.739 and 0.801.
    #[test]
    fn periods_are_those_of_the_spectrum() {
        for (peakedness, expected) in [(1.0, 0.739), (3.3, 0.801)] {
            let system = WaveSystem {
                significant_height_m: 1.0,
                peak_period_s: 8.0,
                peakedness,
                ..WaveSystem::WIND_SEA
            };
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
            let frequencies: Vec<f64> = (0..500)
                .flat_map(|_| system.frequencies(40, &mut generator))
                .collect();
            let second = frequencies.iter().map(|f| f * f).sum::<f64>() / frequencies.len() as f64;
            let ratio = TAU / second.sqrt() / 8.0;
            assert!((ratio - expected).abs() < 0.004, "{peakedness}: {ratio}");
        }
    }

    /// A hull as long as a wave from ahead does not see it; a short one does.
    #[test]
    fn short_waves_average_out() {
        assert!(averaged(std::f64::consts::PI).abs() < 1e-15);
        assert!((averaged(0.1) - (1.0 - 0.01 / 6.0)).abs() < 1e-6 && averaged(0.0) == 1.0);
    }

    /// At her natural period a hull rolls 1/(2ζ) times the slope, a quarter of a period late; far above it she lies still; far below she
    /// follows.
    #[test]
    fn oscillators_answer_as_the_formula() {
        let (gain, lag) = oscillator(TAU / 10.0, 10.0, 0.1);
        assert!((gain - 5.0).abs() < 1e-12 && (lag - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!(oscillator(TAU, 10.0, 0.1).0 < 0.011);
        assert!((oscillator(TAU / 1000.0, 10.0, 0.1).0 - 1.0).abs() < 1e-3);
    }

    /// Waves from ahead pitch her and do not roll her; waves from abeam roll her; the roll is that of the slope, H_s/4 k.
    #[test]
    fn directions_decide_what_moves() {
        let narrow = WaveSystem {
            significant_height_m: 1.0,
            peakedness: 100.0,
            from_direction_rad: 0.3,
            ..WaveSystem::WIND_SEA
        };
        let (ahead, abeam) = (
            waves(&narrow, &FOLLOWS, 0.3),
            waves(&narrow, &FOLLOWS, 0.3 + TAU / 4.0),
        );
        let rms = |waves: &Waves, index: usize| {
            mean_square(waves, |motion| motion.angles[index][0]).sqrt()
        };
        let slope = {
            let waves = &ahead.waves;
            (waves.iter().map(|w| w.number.norm_squared()).sum::<f64>() / waves.len() as f64).sqrt()
                * 0.25
        };
        assert!((rms(&ahead, 1) / slope - 1.0).abs() < 0.02 && rms(&ahead, 2) < 1e-12);
        assert!((rms(&abeam, 2) / slope - 1.0).abs() < 0.02 && rms(&abeam, 1) < 1e-12);
        // From port abeam: while the elevation grows to starboard she heels to port.
        let motion = abeam.at(0.0, &[[0.0; 3]; 2]);
        let east = abeam.at(
            0.0,
            &[
                [1e-3 * (0.3f64 + TAU / 4.0).cos(), 0.0, 0.0],
                [-1e-3 * (0.3f64 + TAU / 4.0).sin(), 0.0, 0.0],
            ],
        );
        let slope_across = (east.heave[0] - motion.heave[0]) / 1e-3;
        assert!(
            (motion.angles[2][0] + slope_across).abs() < 1e-4,
            "{slope_across}"
        );
    }

    /// All derivatives are the numerical ones, under way in a turn too.
    #[test]
    fn derivatives_are_numerical_ones() {
        let system = WaveSystem {
            significant_height_m: 2.0,
            ..WaveSystem::WIND_SEA
        };
        let waves = waves(&system, &Hull::default(), 0.3);
        let track = |t: f64| {
            [
                [6.0 * t + 0.02 * t * t, 6.0 + 0.04 * t, 0.04],
                [-3.0 * t, -3.0, 0.0],
            ]
        };
        let jets = |t: f64| {
            let WaveMotion {
                drift,
                heave,
                angles,
            } = waves.at(t, &track(t));
            [drift[0], drift[1], heave, angles[0], angles[1], angles[2]]
        };
        let h = 1e-5;
        for t in [0.0, 11.0, 73.0] {
            for ((before, now), after) in jets(t - h).iter().zip(jets(t)).zip(jets(t + h)) {
                assert!(((after[0] - before[0]) / (2.0 * h) - now[1]).abs() < 1e-6);
                assert!(((after[1] - before[1]) / (2.0 * h) - now[2]).abs() < 1e-6);
            }
        }
    }
}
