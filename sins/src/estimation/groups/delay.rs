//! The accelerometers are late against the gyroscopes by τ: f̃(t) = f(t − τ) = f − τ ḟ, so δv̇ = −C_b^n ḟ δτ, ḟ in block axes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval, Span};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::errors::SensorErrors;

/// Name of the delay.
pub const ACCELEROMETER_DELAY: &str = "accelerometer_delay_s";

/// What is known before of the delay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccelerometerDelay {
    /// One-sigma \[s\].
    pub delay_s: f64,
}

impl Group for AccelerometerDelay {
    const LABELS: &'static [StateLabel] = &[StateLabel::new(
        ACCELEROMETER_DELAY,
        "τ",
        "accelerometer delay",
        "ms",
        1e-3,
    )];
    const FOLLOWS_CHANGES: bool = true;

    /// ∫C_b^n ḟ dt \[m/s²\].
    type Gathered = Vector3<f64>;

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma.fill(self.delay_s);
    }

    #[inline]
    fn gather(gathered: &mut Vector3<f64>, span: &Span) {
        *gathered += span.attitude * (span.force_change / span.increment.interval_s);
    }

    fn couple(&self, gathered: &Vector3<f64>, _interval: &Interval, into: &mut Coupling<'_>) {
        into.drives(0, Some(-gathered), None);
    }

    fn correct_sensors(x: &[f64], errors: &mut SensorErrors) {
        errors.accelerometer_delay_s += x[0];
    }

    fn found(errors: &SensorErrors, x: &mut [f64]) {
        x[0] = errors.accelerometer_delay_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::column_test::change_columns_hold;
    use crate::estimation::model::Whole;

    /// The column, for a block that turns against gravity.
    #[test]
    fn column_is_the_derivative_of_the_machine() {
        change_columns_hold::<Whole, { Whole::M }, { Whole::N }>(AccelerometerDelay::LABELS);
    }
}
