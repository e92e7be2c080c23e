//! The inverse of the sensor error model: samples without their errors.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::errors::{BlockMotion, SensorErrors, by_arms};
use super::increment::Increment;
use crate::error::Error;

impl SensorErrors {
    /// The inverse of this model.
    ///
    /// # Errors
    /// [`Error::Setting`] where I + K cannot be inverted or a value is not finite.
    pub fn compensation(&self) -> Result<Compensation, Error> {
        let invert = |name: &str, k: &Matrix3<f64>| {
            (Matrix3::identity() + k)
                .try_inverse()
                .filter(|m| m.iter().all(|v| v.is_finite()))
                .ok_or_else(|| {
                    Error::setting(name, k, "a matrix K for which I + K can be inverted")
                })
        };
        let finite = |name: &str, values: &[f64]| {
            values
                .iter()
                .all(|x| x.is_finite())
                .then_some(())
                .ok_or_else(|| Error::setting(name, format!("{values:?}"), "finite numbers"))
        };
        finite("gyroscope_drift_rad_s", self.gyroscope_drift.as_slice())?;
        finite(
            "accelerometer_bias_m_s2",
            self.accelerometer_bias.as_slice(),
        )?;
        if self.is_constant() {
            return Ok(Compensation {
                errors: *self,
                gyroscope_inverse: Matrix3::identity(),
                accelerometer_inverse: Matrix3::identity(),
                constant: true,
            });
        }
        finite(
            "accelerometer_quadratic_per_m_s2",
            self.accelerometer_quadratic.as_slice(),
        )?;
        finite("accelerometer_arm_m", self.accelerometer_arms.as_slice())?;
        finite(
            "gyroscope_g_sensitivity_rad_s_per_m_s2",
            self.gyroscope_g_sensitivity.as_slice(),
        )?;
        finite("accelerometer_delay_s", &[self.accelerometer_delay_s])?;
        Ok(Compensation {
            errors: *self,
            gyroscope_inverse: invert("gyroscope_matrix", &self.gyroscope_matrix)?,
            accelerometer_inverse: invert("accelerometer_matrix", &self.accelerometer_matrix)?,
            constant: false,
        })
    }
}

/// Takes the sensor errors out of samples.
///
/// With w the reported rate and a the reported specific force:
/// f' = (I + K_a)⁻¹ (a − ∇ − K_2 f'²), f = f' − arms + τ ḟ, ω = (I + K_g)⁻¹ (w − ε − G_g f).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compensation {
    errors: SensorErrors,
    gyroscope_inverse: Matrix3<f64>,
    accelerometer_inverse: Matrix3<f64>,
    /// Whether drift and bias are all there is.
    constant: bool,
}

impl Compensation {
    /// The errors that are taken out.
    pub fn errors(&self) -> &SensorErrors {
        &self.errors
    }

    /// (I + K_g)⁻¹.
    pub fn gyroscope_inverse(&self) -> &Matrix3<f64> {
        &self.gyroscope_inverse
    }

    /// (I + K_a)⁻¹.
    pub fn accelerometer_inverse(&self) -> &Matrix3<f64> {
        &self.accelerometer_inverse
    }

    /// True rate \[rad/s\] and specific force \[m/s²\] from measured ones, of a block whose rate and specific force are steady.
    pub fn apply(&self, rate: &Vector3<f64>, force: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        Compensator::new(*self).averages(1.0, rate, force)
    }

    /// f' from what was reported, without bias: K_2 is so small that two rounds are exact to rounding.
    #[inline]
    fn felt(&self, unbiased: &Vector3<f64>) -> Vector3<f64> {
        let linear = self.accelerometer_inverse * unbiased;
        let quadratic = &self.errors.accelerometer_quadratic;
        let square = |f: &Vector3<f64>| quadratic.component_mul(&f.component_mul(f));
        let first = self.accelerometer_inverse * (unbiased - square(&linear));
        self.accelerometer_inverse * (unbiased - square(&first))
    }
}

/// What the sample before the present one said, compensated for all that needs no memory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Before {
    interval_s: f64,
    /// ω \[rad/s\].
    rate: Vector3<f64>,
    /// f' \[m/s²\].
    felt: Vector3<f64>,
}

/// A compensation that follows a stream of samples: arms and delay need the change from sample to sample.
///
/// Differences are taken against the sample before, half an interval late. What they add telescopes, so that the lateness
/// costs only the turn of the block within it: at 100 Hz, 5 deg/s and 2 ms of delay 2e-5 m/s in a rotation of 180 deg.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compensator {
    compensation: Compensation,
    follows: bool,
    before: Option<Before>,
}

/// A sample without its errors, and how rate and specific force changed since the sample before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensated {
    /// What the sensors gathered.
    pub increment: Increment,
    /// Change of the angular rate over the interval \[rad/s\].
    pub rate_change: Vector3<f64>,
    /// Change of the specific force, block axes, over the interval \[m/s²\].
    pub force_change: Vector3<f64>,
}

impl Compensator {
    /// Begins before the first sample.
    pub fn new(compensation: Compensation) -> Self {
        Self {
            compensation,
            follows: false,
            before: None,
        }
    }

    /// Tells the changes from sample to sample even where the compensation does not need them.
    #[must_use]
    pub fn following_changes(mut self, follows: bool) -> Self {
        self.follows = follows;
        self
    }

    /// What is taken out.
    pub fn compensation(&self) -> &Compensation {
        &self.compensation
    }

    /// Takes out something else from the next sample on.
    pub fn set(&mut self, compensation: Compensation) {
        self.compensation = compensation;
    }

    /// The next sample does not follow the last one.
    pub fn forget(&mut self) {
        self.before = None;
    }

    /// The next increment without its errors, with the changes that the model's derivatives need.
    #[inline]
    pub fn next(&mut self, increment: &Increment) -> Compensated {
        let Self {
            compensation,
            follows,
            before,
        } = self;
        let errors = &compensation.errors;
        let seconds = increment.interval_s;
        let angle = increment.angle - errors.gyroscope_drift * seconds;
        let velocity = increment.velocity - errors.accelerometer_bias * seconds;
        if compensation.constant {
            let change = if *follows {
                change(before, seconds, angle / seconds, velocity / seconds)
            } else {
                [Vector3::zeros(); 2]
            };
            return Compensated {
                increment: Increment {
                    interval_s: seconds,
                    angle,
                    velocity,
                },
                rate_change: change[0],
                force_change: change[1],
            };
        }
        let felt = compensation.felt(&(velocity / seconds));
        let linear = compensation.gyroscope_inverse * (angle / seconds);
        let [rate_change, felt_change] = change(before, seconds, linear, felt);
        let motion = BlockMotion {
            rate: linear,
            rate_derivative: rate_change / seconds,
            ..BlockMotion::default()
        };
        let force = felt - by_arms(&motion.arm_matrix(), &errors.accelerometer_arms)
            + errors.accelerometer_delay_s / seconds * felt_change;
        let sensed = errors.gyroscope_g_sensitivity * force;
        let rate = linear - compensation.gyroscope_inverse * sensed;
        Compensated {
            increment: Increment {
                interval_s: seconds,
                angle: rate * seconds,
                velocity: force * seconds,
            },
            rate_change,
            force_change: felt_change,
        }
    }

    /// The next averages without their errors: rate \[rad/s\] and specific force \[m/s²\].
    pub fn averages(
        &mut self,
        interval_s: f64,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let done = self.next(&Increment::from_averages(interval_s, rate, force));
        (
            done.increment.angle / interval_s,
            done.increment.velocity / interval_s,
        )
    }
}

/// How rate and f' changed over the interval since the sample before, which this one replaces.
#[inline]
fn change(
    before: &mut Option<Before>,
    interval_s: f64,
    rate: Vector3<f64>,
    felt: Vector3<f64>,
) -> [Vector3<f64>; 2] {
    let now = Before {
        interval_s,
        rate,
        felt,
    };
    match before.replace(now) {
        // Averages lie in the middle of their intervals.
        Some(before) if before.interval_s == interval_s => [rate - before.rate, felt - before.felt],
        Some(before) => {
            let share = 2.0 * interval_s / (before.interval_s + interval_s);
            [(rate - before.rate) * share, (felt - before.felt) * share]
        }
        None => [Vector3::zeros(); 2],
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn whole() -> SensorErrors {
        SensorErrors {
            gyroscope_drift: Vector3::new(1e-7, -2e-7, 3e-7),
            accelerometer_bias: Vector3::new(1e-3, 2e-3, -3e-3),
            gyroscope_matrix: Matrix3::new(1e-4, 2e-4, -1e-4, 3e-4, -1e-4, 5e-5, 1e-5, 2e-5, 7e-5),
            accelerometer_matrix: Matrix3::new(1e-4, 0.0, 0.0, 3e-4, -1e-4, 0.0, 1e-5, 2e-5, 7e-5),
            accelerometer_quadratic: Vector3::new(1e-6, -2e-6, 3e-6),
            accelerometer_arms: Matrix3::new(0.03, -0.02, 0.01, 0.02, 0.04, -0.01, 0.0, 0.01, 0.03),
            gyroscope_g_sensitivity: Matrix3::new(
                1e-9, 2e-9, 0.0, -1e-9, 2e-9, 0.0, 0.0, 0.0, 3e-9,
            ),
            accelerometer_delay_s: 1e-3,
        }
    }

    /// Compensation undoes the full model for a block that turns evenly: drift, bias, matrices, squares, arms, g-sensitivity.
    #[test]
    fn compensation_is_the_inverse() {
        let errors = whole();
        let motion = BlockMotion::steady(Vector3::new(0.1, -0.2, 0.3), Vector3::new(1.0, 2.0, 9.0));
        let (rate, force) = errors.corrupt(&motion);
        let mut compensator = Compensator::new(errors.compensation().unwrap());
        for _ in 0..3 {
            let (w, f) = compensator.averages(0.01, &rate, &force);
            assert!(
                (w - motion.rate).norm() < 1e-15,
                "{}",
                (w - motion.rate).norm()
            );
            // (The arms are taken at a rate that still has the g-sensitivity in it: 1e-8 rad/s.)
            assert!((f - motion.force).norm() < 1e-9);
        }
    }

    /// Arms and delay are undone for a block that speeds up: what they add over the whole motion is gone, but for half an
    /// interval's turn.
    #[test]
    fn arms_and_delay_telescope() {
        let errors = SensorErrors {
            accelerometer_arms: whole().accelerometer_arms,
            accelerometer_delay_s: 1e-3,
            ..SensorErrors::default()
        };
        let (dt, acceleration, jerk) = (0.01, Vector3::new(0.04, -0.02, 0.01), 0.5);
        let mut compensator = Compensator::new(errors.compensation().unwrap());
        let (mut compensated, mut raw, mut truth) =
            (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        for k in 0..100 {
            let t = (f64::from(k) + 0.5) * dt;
            let motion = BlockMotion {
                rate: acceleration * t,
                rate_derivative: acceleration,
                force: Vector3::new(jerk * t, 0.0, 9.8),
                force_derivative: Vector3::new(jerk, 0.0, 0.0),
            };
            let (w, f) = errors.corrupt(&motion);
            compensated += compensator.averages(dt, &w, &f).1 * dt;
            raw += f * dt;
            truth += motion.force * dt;
        }
        // The first interval has none before it: one of a hundred is left.
        let (left, whole) = ((compensated - truth).norm(), (raw - truth).norm());
        assert!(left < 0.011 * whole, "{left} of {whole}");
    }

    /// A matrix that folds space is refused with its name, and so is a value that is none.
    #[test]
    fn what_cannot_be_inverted_is_refused() {
        let folded = SensorErrors {
            gyroscope_matrix: -Matrix3::identity(),
            ..SensorErrors::default()
        };
        let refused = |errors: SensorErrors| errors.compensation().unwrap_err().to_string();
        assert!(refused(folded).contains("gyroscope_matrix"));
        let late = SensorErrors {
            accelerometer_delay_s: f64::NAN,
            ..SensorErrors::default()
        };
        assert!(refused(late).contains("accelerometer_delay_s"));
    }
}
