//! The antenna's arm from the table's centre, in the ship: a position measures where the antenna is, so that a ship that rolls and
//! yaws shows the arm. It couples into nothing and stands still.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval};
use crate::estimation::installation::Installation;
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::NavigationState;

/// Names of the arm's components: starboard, forward, up.
pub const ANTENNA_ARM: [&str; 3] = ["antenna_arm_x_m", "antenna_arm_y_m", "antenna_arm_z_m"];

/// What is known before of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Antenna {
    /// One-sigma of every component \[m\].
    pub arm_m: f64,
}

const fn label(axis: usize, symbol: &'static str, words: &'static str) -> StateLabel {
    StateLabel::new(ANTENNA_ARM[axis], symbol, words, "m", 1.0)
}

impl Group for Antenna {
    const LABELS: &'static [StateLabel] = &[
        label(0, "lx", "antenna arm starboard"),
        label(1, "ly", "antenna arm forward"),
        label(2, "lz", "antenna arm up"),
    ];
    const OF_ANTENNA: bool = true;

    type Gathered = ();

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma.fill(self.arm_m);
    }

    fn couple(&self, (): &(), _interval: &Interval, _into: &mut Coupling<'_>) {}

    fn correct_installation(x: &[f64], installation: &mut Installation) {
        installation.antenna_arm_m += Vector3::from_column_slice(x);
    }

    fn found_of_installation(installation: &Installation, x: &mut [f64]) {
        x.copy_from_slice(installation.antenna_arm_m.as_slice());
    }
}
