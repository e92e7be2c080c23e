//! What is wrong with a real table, and the attitude of the block that its encoders then stand for.
//!
//! With the true joint angles θ, the axes of the joints o (outer) and i (inner), n = o × i, and p, q the two axes that
//! follow i in the order x, y, z, x (for an inner axis y: z and x), the block (b) stands in the base (v) at
//!
//! ```text
//! C_b^v = R(o, θ_outer) R(n, γ) R(i, θ_inner) R(τ_1 p + τ_2 q)
//! ```
//!
//! where R(a, α) turns by α about a. The non-orthogonality γ turns the inner axis away from a right angle to the outer one,
//! and the tilts τ_1, τ_2 lay that axis askew in the block. An encoder with zero z and an eccentricity of s and c reads
//!
//! ```text
//! θ̃ = θ + z + s sin θ + c cos θ
//! ```

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::Turntable;

/// Errors of a table and its encoders, measured minus true. By default none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableErrors {
    /// γ: the angle between the axes beyond 90 deg, about outer × inner \[rad\].
    pub nonorthogonality_rad: f64,
    /// τ_1, τ_2: the inner axis in the block, about the two axes that follow it in the order x, y, z, x \[rad\].
    pub inner_axis_tilt_rad: [f64; 2],
    /// Zero of the outer encoder. No filter finds it: it is the same as an attitude of the base \[rad\].
    pub encoder_zero_outer_rad: f64,
    /// Zero of the inner encoder \[rad\].
    pub encoder_zero_inner_rad: f64,
    /// Once a turn of the outer encoder: sine and cosine \[rad\].
    pub encoder_eccentricity_outer_rad: [f64; 2],
    /// Once a turn of the inner encoder: sine and cosine \[rad\].
    pub encoder_eccentricity_inner_rad: [f64; 2],
}

/// How the block turns in its own axes, for each of what [`Turntable::attitude_with`] is told: C(p + δ) = C(p) (I + (D δ)×).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeDerivatives {
    /// By the encoders' readings, outer and inner \[rad/rad\].
    pub readings: [Vector3<f64>; 2],
    /// By γ \[rad/rad\].
    pub nonorthogonality: Vector3<f64>,
    /// By τ_1 and τ_2 \[rad/rad\].
    pub inner_axis_tilt: [Vector3<f64>; 2],
    /// By the zeros of the outer and of the inner encoder \[rad/rad\].
    pub encoder_zero: [Vector3<f64>; 2],
    /// By sine and cosine of the outer encoder's eccentricity \[rad/rad\].
    pub encoder_eccentricity_outer: [Vector3<f64>; 2],
    /// By sine and cosine of the inner encoder's eccentricity \[rad/rad\].
    pub encoder_eccentricity_inner: [Vector3<f64>; 2],
}

impl AttitudeDerivatives {
    /// Of what a filter finds, in the order of its states: γ, τ_1, τ_2, the inner zero, sine and cosine of the outer and of the
    /// inner encoder \[rad/rad\].
    pub fn of_states(&self) -> [Vector3<f64>; 8] {
        [
            self.nonorthogonality,
            self.inner_axis_tilt[0],
            self.inner_axis_tilt[1],
            self.encoder_zero[1],
            self.encoder_eccentricity_outer[0],
            self.encoder_eccentricity_outer[1],
            self.encoder_eccentricity_inner[0],
            self.encoder_eccentricity_inner[1],
        ]
    }
}

impl TableErrors {
    /// Whether nothing is wrong.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }

    /// All of them, as the fields are named \[rad\].
    pub fn values(&self) -> [f64; 9] {
        let Self {
            nonorthogonality_rad,
            inner_axis_tilt_rad: [first, second],
            encoder_zero_outer_rad,
            encoder_zero_inner_rad,
            encoder_eccentricity_outer_rad: [outer_sine, outer_cosine],
            encoder_eccentricity_inner_rad: [inner_sine, inner_cosine],
        } = *self;
        [
            nonorthogonality_rad,
            first,
            second,
            encoder_zero_outer_rad,
            encoder_zero_inner_rad,
            outer_sine,
            outer_cosine,
            inner_sine,
            inner_cosine,
        ]
    }

    /// The zero of each encoder, and sine and cosine of its eccentricity, outer first.
    fn encoders(&self) -> [(f64, [f64; 2]); 2] {
        [
            (
                self.encoder_zero_outer_rad,
                self.encoder_eccentricity_outer_rad,
            ),
            (
                self.encoder_zero_inner_rad,
                self.encoder_eccentricity_inner_rad,
            ),
        ]
    }

    /// What the encoders (outer, inner) read, without noise, where the joints truly stand at `angles` \[rad\].
    pub fn readings(&self, angles: [f64; 2]) -> [f64; 2] {
        let mut readings = angles;
        for (reading, (zero, [sine, cosine])) in readings.iter_mut().zip(self.encoders()) {
            let (sin, cos) = reading.sin_cos();
            *reading += zero + sine * sin + cosine * cos;
        }
        readings
    }

    /// By how much a reading grows where the true angle does, outer and inner \[rad/rad\].
    pub fn reading_slopes(&self, angles: [f64; 2]) -> [f64; 2] {
        let encoders = self.encoders();
        [0, 1].map(|joint| {
            let (sin, cos) = angles[joint].sin_cos();
            let (_, [sine, cosine]) = encoders[joint];
            1.0 + sine * cos - cosine * sin
        })
    }

    /// The true angles (outer, inner) at which the encoders read `readings` \[rad\]. The eccentricity is below 0.1 rad.
    pub fn angles(&self, readings: [f64; 2]) -> [f64; 2] {
        let mut angles = readings;
        for (angle, (zero, [sine, cosine])) in angles.iter_mut().zip(self.encoders()) {
            let reading = *angle - zero;
            *angle = reading;
            if sine == 0.0 && cosine == 0.0 {
                continue;
            }
            // Newton's steps: for an eccentricity of arc seconds the first is exact to rounding.
            for _ in 0..4 {
                let (sin, cos) = angle.sin_cos();
                *angle -= (*angle + sine * sin + cosine * cos - reading)
                    / (1.0 + sine * cos - cosine * sin);
            }
        }
        angles
    }
}

impl Turntable {
    /// p and q, the axes that follow the inner one in the order x, y, z, x.
    fn tilt_axes(self) -> [Vector3<f64>; 2] {
        let inner = self.inner.unit();
        let next = Vector3::new(inner.z, inner.x, inner.y);
        [next, inner.cross(&next)]
    }

    /// Turns the block into the inner link.
    fn tilt(self, errors: &TableErrors) -> UnitQuaternion<f64> {
        let [p, q] = self.tilt_axes();
        let [first, second] = errors.inner_axis_tilt_rad;
        UnitQuaternion::from_scaled_axis(p * first + q * second)
    }

    /// About this axis the inner axis leaves its right angle.
    fn square_axis(self) -> Vector3<f64> {
        self.outer.unit().cross(&self.inner.unit())
    }

    /// Rotation of the block (b) against the base (v) where the **encoders** read `readings` (outer, inner) \[rad\] and the
    /// table has these errors: `v = C_b^v b`. Without errors it is [`Turntable::attitude`].
    pub fn attitude_with(&self, readings: [f64; 2], errors: &TableErrors) -> UnitQuaternion<f64> {
        self.true_attitude(errors.angles(readings), errors)
    }

    /// The same where the joints **truly** stand at `angles` (outer, inner) \[rad\].
    pub fn true_attitude(&self, angles: [f64; 2], errors: &TableErrors) -> UnitQuaternion<f64> {
        let turn = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
        turn(self.outer.unit(), angles[0])
            * turn(self.square_axis(), errors.nonorthogonality_rad)
            * turn(self.inner.unit(), angles[1])
            * self.tilt(errors)
    }

    /// The axes of the joints (outer, inner) in the block, where these truly stand at `angles` \[rad\].
    pub fn joint_axes(&self, angles: [f64; 2], errors: &TableErrors) -> [Vector3<f64>; 2] {
        let inner = self.inner.unit();
        let untilt = self.tilt(errors).inverse();
        let unturn = UnitQuaternion::from_scaled_axis(-inner * angles[1]);
        let square =
            UnitQuaternion::from_scaled_axis(-self.square_axis() * errors.nonorthogonality_rad);
        [
            untilt * (unturn * (square * self.outer.unit())),
            untilt * inner,
        ]
    }

    /// The derivatives of [`Turntable::attitude_with`] by everything that it is told.
    pub fn attitude_derivatives(
        &self,
        readings: [f64; 2],
        errors: &TableErrors,
    ) -> AttitudeDerivatives {
        let angles = errors.angles(readings);
        let axes = self.joint_axes(angles, errors);
        let tilt = self.tilt(errors);
        let unturn = UnitQuaternion::from_scaled_axis(-self.inner.unit() * angles[1]);
        let half_tilt = 0.5 * tilt.scaled_axis();
        // At a given reading an encoder's error turns the joint the other way.
        let encoder = |joint: usize| {
            let (sin, cos) = angles[joint].sin_cos();
            let (_, [sine, cosine]) = errors.encoders()[joint];
            let by_reading = axes[joint] / (1.0 + sine * cos - cosine * sin);
            (by_reading, [-by_reading * sin, -by_reading * cos])
        };
        let (outer, encoder_eccentricity_outer) = encoder(0);
        let (inner, encoder_eccentricity_inner) = encoder(1);
        AttitudeDerivatives {
            readings: [outer, inner],
            nonorthogonality: tilt.inverse() * (unturn * self.square_axis()),
            inner_axis_tilt: self.tilt_axes().map(|axis| axis - half_tilt.cross(&axis)),
            encoder_zero: [-outer, -inner],
            encoder_eccentricity_outer,
            encoder_eccentricity_inner,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::Axis;

    const ERRORS: TableErrors = TableErrors {
        nonorthogonality_rad: 3e-4,
        inner_axis_tilt_rad: [2e-4, -1e-4],
        encoder_zero_outer_rad: 5e-4,
        encoder_zero_inner_rad: -4e-4,
        encoder_eccentricity_outer_rad: [1e-4, 2e-4],
        encoder_eccentricity_inner_rad: [-3e-4, 1e-4],
    };

    fn tables() -> impl Iterator<Item = Turntable> {
        let axes = [Axis::X, Axis::Y, Axis::Z];
        axes.into_iter().flat_map(move |outer| {
            axes.into_iter()
                .filter_map(move |inner| Turntable::new(outer, inner).ok())
        })
    }

    /// A table without errors is the table of the drawing.
    #[test]
    fn no_errors_no_difference() {
        for table in tables() {
            let angles = [0.7, -2.3];
            let with = table.attitude_with(angles, &TableErrors::default());
            assert!(with.angle_to(&table.attitude(angles)) < 1e-15);
        }
    }

    /// Readings and true angles are each other's inverse, over several turns.
    #[test]
    fn readings_and_angles_are_inverse() {
        for k in -20..=20 {
            let angles = [0.61 * f64::from(k), -0.43 * f64::from(k)];
            let back = ERRORS.angles(ERRORS.readings(angles));
            assert!((0..2).all(|joint| (back[joint] - angles[joint]).abs() < 3e-15));
        }
    }

    /// γ alone: the inner axis stands at 90 deg + γ to the outer one. The tilts alone: in the block it leans by τ_1 to q and by
    /// −τ_2 to p.
    #[test]
    fn axes_lie_as_the_names_say() {
        for table in tables() {
            let square = TableErrors {
                nonorthogonality_rad: 1e-3,
                ..TableErrors::default()
            };
            let [outer, inner] = table.joint_axes([0.4, 1.1], &square);
            let between = outer.dot(&inner).acos();
            assert!((between - std::f64::consts::FRAC_PI_2 - 1e-3).abs() < 1e-12);
            let tilted = TableErrors {
                inner_axis_tilt_rad: [3e-5, -2e-5],
                ..TableErrors::default()
            };
            let [_, inner] = table.joint_axes([0.4, 1.1], &tilted);
            let [p, q] = table.tilt_axes();
            assert!((inner.dot(&q) - 3e-5).abs() < 1e-9, "{}", inner.dot(&q));
            assert!((inner.dot(&p) - 2e-5).abs() < 1e-9, "{}", inner.dot(&p));
        }
    }

    /// A zero is read on top of the angle; an eccentricity is read once a turn, sine and cosine.
    #[test]
    fn encoder_errors_are_measured_minus_true() {
        let [outer, inner] = ERRORS.readings([0.0, std::f64::consts::FRAC_PI_2]);
        assert!((outer - (5e-4 + 2e-4)).abs() < 1e-15);
        assert!((inner - std::f64::consts::FRAC_PI_2 - (-4e-4 - 3e-4)).abs() < 1e-15);
    }

    /// Every derivative is the numerical one, in every order of the axes.
    #[test]
    fn derivatives_are_numerical_ones() {
        const STEP: f64 = 1e-5;
        type Change = fn(&mut TableErrors, f64);
        for table in tables() {
            let readings = [0.9, -2.2];
            let derivatives = table.attitude_derivatives(readings, &ERRORS);
            let numerical = |at: &dyn Fn(f64) -> UnitQuaternion<f64>| {
                (at(-STEP).inverse() * at(STEP)).scaled_axis() / (2.0 * STEP)
            };
            let same = |name: &str, analytic: Vector3<f64>, numerical: Vector3<f64>| {
                assert!(
                    (analytic - numerical).norm() < 2e-8,
                    "{name}: {analytic} {numerical}"
                );
            };
            for joint in 0..2 {
                let by_reading = numerical(&|step| {
                    let mut moved = readings;
                    moved[joint] += step;
                    table.attitude_with(moved, &ERRORS)
                });
                same("reading", derivatives.readings[joint], by_reading);
            }
            let changes: [(&str, Change, Vector3<f64>); 9] = [
                (
                    "nonorthogonality",
                    |e, d| e.nonorthogonality_rad += d,
                    derivatives.nonorthogonality,
                ),
                (
                    "tilt 1",
                    |e, d| e.inner_axis_tilt_rad[0] += d,
                    derivatives.inner_axis_tilt[0],
                ),
                (
                    "tilt 2",
                    |e, d| e.inner_axis_tilt_rad[1] += d,
                    derivatives.inner_axis_tilt[1],
                ),
                (
                    "zero outer",
                    |e, d| e.encoder_zero_outer_rad += d,
                    derivatives.encoder_zero[0],
                ),
                (
                    "zero inner",
                    |e, d| e.encoder_zero_inner_rad += d,
                    derivatives.encoder_zero[1],
                ),
                (
                    "outer sine",
                    |e, d| e.encoder_eccentricity_outer_rad[0] += d,
                    derivatives.encoder_eccentricity_outer[0],
                ),
                (
                    "outer cosine",
                    |e, d| e.encoder_eccentricity_outer_rad[1] += d,
                    derivatives.encoder_eccentricity_outer[1],
                ),
                (
                    "inner sine",
                    |e, d| e.encoder_eccentricity_inner_rad[0] += d,
                    derivatives.encoder_eccentricity_inner[0],
                ),
                (
                    "inner cosine",
                    |e, d| e.encoder_eccentricity_inner_rad[1] += d,
                    derivatives.encoder_eccentricity_inner[1],
                ),
            ];
            for (name, change, analytic) in changes {
                let by_error = numerical(&|step| {
                    let mut errors = ERRORS;
                    change(&mut errors, step);
                    table.attitude_with(readings, &errors)
                });
                same(name, analytic, by_error);
            }
        }
    }

    /// The attitude that an independent simulation (outer x, inner y, γ 5", tilts 4" and −3") has at joints of −90 and 90 deg.
    #[test]
    fn signs_are_those_of_an_independent_simulation() {
        let second = crate::units::ARC_SECOND;
        let errors = TableErrors {
            nonorthogonality_rad: 5.0 * second,
            inner_axis_tilt_rad: [4.0 * second, -3.0 * second],
            ..TableErrors::default()
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        let (table, angles) = (Turntable::default(), [-quarter, quarter]);
        let turned = table.attitude(angles).inverse() * table.true_attitude(angles, &errors);
        let expected = Vector3::new(-8.0, 0.0, 4.0) * second;
        assert!((turned.scaled_axis() - expected).norm() < 1e-9, "{turned}");
    }
}
