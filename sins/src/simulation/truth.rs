//! What is true of one sampling interval: averages of all that a sensor on the block can feel.

use nalgebra::{Matrix3, Vector3};

use super::block::Felt;
use crate::table::JointSample;
use crate::time::Stamp;

/// What is true of one sampling interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthSample {
    /// End of the interval.
    pub stamp: Stamp,
    /// Length of the interval \[ns\].
    pub interval_nanos: i64,
    /// Average of ω_ib^b over the interval \[rad/s\].
    pub angular_rate: Vector3<f64>,
    /// Average of |ω_ib^b|, axis by axis \[rad/s\].
    pub angular_rate_magnitude: Vector3<f64>,
    /// Average of f^b at the table's centre over the interval \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// What the accelerometers feel, in their own interval, which ends earlier by their delay.
    pub accelerometers: AccelerometerTruth,
    /// Joints at the end of the interval, where they truly stand.
    pub joints: JointSample,
}

/// Averages over the interval of the accelerometers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerometerTruth {
    /// Average of f^b at the table's centre \[m/s²\].
    pub specific_force: Vector3<f64>,
    /// Average of its squares, axis by axis \[m²/s⁴\].
    pub specific_force_square: Vector3<f64>,
    /// Average of a ↦ ω × (ω × a) + ω̇ × a: row i times an arm is what accelerometer i feels there beside f \[1/s²\].
    pub lever: Matrix3<f64>,
}

impl TruthSample {
    /// An interval in which rate \[rad/s\] and specific force \[m/s²\] hold still in the block.
    pub fn steady(
        stamp: Stamp,
        interval_nanos: i64,
        angular_rate: Vector3<f64>,
        specific_force: Vector3<f64>,
    ) -> Self {
        let felt = Felt {
            rate: angular_rate,
            rate_change: Vector3::zeros(),
            force: specific_force,
        };
        let joints = JointSample {
            stamp,
            position: [0.0; 2],
            velocity: [0.0; 2],
        };
        let averages = Averages::of(&felt);
        averages.sample(&averages, stamp, interval_nanos, joints)
    }
}

/// Averages over an interval.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Averages {
    rate: Vector3<f64>,
    rate_magnitude: Vector3<f64>,
    force: Vector3<f64>,
    force_square: Vector3<f64>,
    lever: Matrix3<f64>,
}

impl Averages {
    /// Of an interval in which nothing changes.
    pub fn of(felt: &Felt) -> Self {
        Self {
            rate: felt.rate,
            rate_magnitude: felt.rate.abs(),
            force: felt.force,
            force_square: felt.force.component_mul(&felt.force),
            lever: felt.lever(),
        }
    }

    /// Adds a moment with its weight.
    pub fn add(&mut self, felt: &Felt, weight: f64) {
        self.rate += felt.rate * weight;
        self.rate_magnitude += felt.rate.abs() * weight;
        self.force += felt.force * weight;
        self.force_square += felt.force.component_mul(&felt.force) * weight;
        self.lever += felt.lever() * weight;
    }

    /// Sums over an interval of this length \[s\] as averages.
    pub fn over(self, interval_s: f64) -> Self {
        Self {
            rate: self.rate / interval_s,
            rate_magnitude: self.rate_magnitude / interval_s,
            force: self.force / interval_s,
            force_square: self.force_square / interval_s,
            lever: self.lever / interval_s,
        }
    }

    /// The truth of an interval, with the averages over the accelerometers' own.
    pub fn sample(
        &self,
        accelerometers: &Self,
        stamp: Stamp,
        interval_nanos: i64,
        joints: JointSample,
    ) -> TruthSample {
        TruthSample {
            stamp,
            interval_nanos,
            angular_rate: self.rate,
            angular_rate_magnitude: self.rate_magnitude,
            specific_force: self.force,
            accelerometers: AccelerometerTruth {
                specific_force: accelerometers.force,
                specific_force_square: accelerometers.force_square,
                lever: accelerometers.lever,
            },
            joints,
        }
    }
}
