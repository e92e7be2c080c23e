//! Scale factors and installation angles: the matrices K_g and K_a of the sensor model, a group for each kind of sensor.
//!
//! The gyroscopes have nine: ω̃ = (I + K_g) ω, so φ̇ = −C_b^n (I + K_g)⁻¹ δK_g ω. The accelerometers have six, for they define
//! the block's axes (lower triangle): δv̇ = C_b^n (I + K_a)⁻¹ δK_a f. Column (i, j) of a matrix needs ∫C_b^n ω_j dt.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval, Span};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;
use crate::units::ARC_SECOND;

/// Names of the gyroscopes' scale factors.
pub const GYROSCOPE_SCALE_FACTOR: [&str; 3] = [
    "gyroscope_scale_factor_x",
    "gyroscope_scale_factor_y",
    "gyroscope_scale_factor_z",
];
/// Names of the accelerometers' scale factors.
pub const ACCELEROMETER_SCALE_FACTOR: [&str; 3] = [
    "accelerometer_scale_factor_x",
    "accelerometer_scale_factor_y",
    "accelerometer_scale_factor_z",
];

/// One part in a million.
const PPM: f64 = 1e-6;

/// Elements of K_g, in the order of the states.
const GYROSCOPE_ELEMENTS: [(usize, usize); 9] = [
    (0, 0),
    (1, 1),
    (2, 2),
    (0, 1),
    (0, 2),
    (1, 0),
    (1, 2),
    (2, 0),
    (2, 1),
];
/// Elements of K_a, in the order of the states.
const ACCELEROMETER_ELEMENTS: [(usize, usize); 6] =
    [(0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1)];

/// ∫C_b^n s_j dt for the components j of a sensor's quantity s.
type Weighted = [Matrix3<f64>; 3];

fn couple(
    elements: &[(usize, usize)],
    gathered: &Weighted,
    inverse: &Matrix3<f64>,
    mut column: impl FnMut(usize, nalgebra::Vector3<f64>),
) {
    for (state, (row, component)) in elements.iter().enumerate() {
        column(state, gathered[*component] * inverse.column(*row));
    }
}

#[inline]
fn gather(gathered: &mut Weighted, attitude: &Matrix3<f64>, quantity: &nalgebra::Vector3<f64>) {
    for (sum, component) in gathered.iter_mut().zip(quantity.iter()) {
        *sum += attitude * *component;
    }
}

fn prior(scale: f64, angle_rad: f64, sigma: &mut [f64]) {
    let (scales, angles) = sigma.split_at_mut(3);
    scales.fill(scale);
    angles.fill(angle_rad);
}

/// What is known before of the gyroscopes' scale factors and installation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GyroscopeMatrix {
    /// One-sigma of a scale factor.
    pub scale_factor: f64,
    /// One-sigma of an installation angle \[rad\].
    pub installation_rad: f64,
}

impl Group for GyroscopeMatrix {
    const LABELS: &'static [StateLabel] = &[
        StateLabel::new(
            GYROSCOPE_SCALE_FACTOR[0],
            "Kgx",
            "gyroscope scale factor x",
            "ppm",
            PPM,
        ),
        StateLabel::new(
            GYROSCOPE_SCALE_FACTOR[1],
            "Kgy",
            "gyroscope scale factor y",
            "ppm",
            PPM,
        ),
        StateLabel::new(
            GYROSCOPE_SCALE_FACTOR[2],
            "Kgz",
            "gyroscope scale factor z",
            "ppm",
            PPM,
        ),
        angle(
            "gyroscope_installation_xy_rad",
            "Kgxy",
            "gyroscope installation xy",
        ),
        angle(
            "gyroscope_installation_xz_rad",
            "Kgxz",
            "gyroscope installation xz",
        ),
        angle(
            "gyroscope_installation_yx_rad",
            "Kgyx",
            "gyroscope installation yx",
        ),
        angle(
            "gyroscope_installation_yz_rad",
            "Kgyz",
            "gyroscope installation yz",
        ),
        angle(
            "gyroscope_installation_zx_rad",
            "Kgzx",
            "gyroscope installation zx",
        ),
        angle(
            "gyroscope_installation_zy_rad",
            "Kgzy",
            "gyroscope installation zy",
        ),
    ];

    type Gathered = Weighted;

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        prior(self.scale_factor, self.installation_rad, sigma);
    }

    #[inline]
    fn gather(gathered: &mut Weighted, span: &Span) {
        gather(gathered, &span.attitude, &span.angular_rate());
    }

    fn couple(&self, gathered: &Weighted, interval: &Interval, into: &mut Coupling<'_>) {
        couple(
            &GYROSCOPE_ELEMENTS,
            gathered,
            &interval.inverses[0],
            |state, turn| {
                into.drives(state, None, Some(-turn));
            },
        );
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        for (value, element) in x.iter().zip(GYROSCOPE_ELEMENTS) {
            errors.gyroscope_matrix[element] += value;
        }
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        for (value, element) in x.iter_mut().zip(GYROSCOPE_ELEMENTS) {
            *value = errors.gyroscope_matrix[element];
        }
    }
}

const fn angle(name: &'static str, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(name, symbol, words, "arcsec", ARC_SECOND)
}

/// What is known before of the accelerometers' scale factors and installation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccelerometerMatrix {
    /// One-sigma of a scale factor.
    pub scale_factor: f64,
    /// One-sigma of an installation angle \[rad\].
    pub installation_rad: f64,
}

impl Group for AccelerometerMatrix {
    const LABELS: &'static [StateLabel] = &[
        scale(
            ACCELEROMETER_SCALE_FACTOR[0],
            "Kax",
            "accelerometer scale factor x",
        ),
        scale(
            ACCELEROMETER_SCALE_FACTOR[1],
            "Kay",
            "accelerometer scale factor y",
        ),
        scale(
            ACCELEROMETER_SCALE_FACTOR[2],
            "Kaz",
            "accelerometer scale factor z",
        ),
        angle(
            "accelerometer_installation_yx_rad",
            "Kayx",
            "accelerometer installation yx",
        ),
        angle(
            "accelerometer_installation_zx_rad",
            "Kazx",
            "accelerometer installation zx",
        ),
        angle(
            "accelerometer_installation_zy_rad",
            "Kazy",
            "accelerometer installation zy",
        ),
    ];

    type Gathered = Weighted;

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        prior(self.scale_factor, self.installation_rad, sigma);
    }

    #[inline]
    fn gather(gathered: &mut Weighted, span: &Span) {
        gather(gathered, &span.attitude, &span.specific_force());
    }

    fn couple(&self, gathered: &Weighted, interval: &Interval, into: &mut Coupling<'_>) {
        couple(
            &ACCELEROMETER_ELEMENTS,
            gathered,
            &interval.inverses[1],
            |state, push| {
                into.drives(state, Some(push), None);
            },
        );
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        for (value, element) in x.iter().zip(ACCELEROMETER_ELEMENTS) {
            errors.accelerometer_matrix[element] += value;
        }
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        for (value, element) in x.iter_mut().zip(ACCELEROMETER_ELEMENTS) {
            *value = errors.accelerometer_matrix[element];
        }
    }
}

const fn scale(name: &'static str, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(name, symbol, words, "ppm", PPM)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::column_test::columns_hold;
    use crate::estimation::model::Matrices;

    /// Every column of the gyroscopes' nine.
    #[test]
    fn gyroscope_columns_are_the_derivative_of_the_machine() {
        columns_hold::<Matrices, { Matrices::M }, { Matrices::N }>(GyroscopeMatrix::LABELS);
    }

    /// Every column of the accelerometers' six.
    #[test]
    fn accelerometer_columns_are_the_derivative_of_the_machine() {
        columns_hold::<Matrices, { Matrices::M }, { Matrices::N }>(AccelerometerMatrix::LABELS);
    }
}
