//! What a rotation scheme can show of the errors, before anything is measured.
//!
//! - [`global`]: the conditions of the paper's section 2. At rest in position i the gyroscopes measure ω_i + ε and the
//!   accelerometers f_i + ∇, and |ω_i| and |f_i| are known: ε lies on a sphere round each measured vector, and so does ∇. Four
//!   spheres whose centres are not in one plane meet in one point.
//! - [`stripped`]: rank of the stripped observability matrix after every dwell, and the directions that are still hidden.
//! - [`degree`]: how well the measurements of a whole run show every state, in units of what was known before.
//! - [`bound`]: the covariance that no filter with these noises can beat, against time.
//!
//! All of it for a ship at rest whose table follows the program exactly.

pub mod bound;
pub mod degree;
pub mod global;
mod path;
pub mod stripped;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::earth::{LocalEarth, Position};
use crate::estimation::filter::InitialUncertainty;
use crate::estimation::group::{Interval, Span};
use crate::estimation::kalman::Dynamics;
use crate::estimation::model::{Model, Paper};
use crate::mechanization::strapdown::NavigationState;
use crate::sensor::Increment;
use crate::sensor::sample::NoiseDensity;
use crate::simulation::{NoiseReading, Ship};
use crate::studies::paper;

/// What degrees and bounds depend on beside the program.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Setting {
    /// The ship, at rest.
    pub ship: Ship,
    /// Length of the run \[s\].
    pub duration_s: f64,
    /// What is known before.
    pub initial: InitialUncertainty,
    /// White noise of the sensors.
    pub noise: NoiseDensity,
    /// One-sigma of a velocity measurement, one a second \[m/s\].
    pub velocity_sigma_m_s: f64,
}

impl Default for Setting {
    /// The paper's simulation: its place, heading 0, 4 h, Table 1, noise read as D.
    fn default() -> Self {
        Self {
            ship: Ship::default(),
            duration_s: 4.0 * 3600.0,
            initial: paper::initial_uncertainty(),
            noise: NoiseReading::D.density(),
            velocity_sigma_m_s: 0.01,
        }
    }
}

/// A = F · 1 s of the paper's states for a block at rest on the earth, with the mean C_b^n of that second.
fn dynamics_at_rest(
    model: &Paper,
    earth: LocalEarth,
    body_to_navigation: &Matrix3<f64>,
) -> Dynamics<{ Paper::M }, { Paper::N }> {
    let up = nalgebra::Vector3::z() * earth.gravity_m_s2;
    let mut gathered = <Paper as Model<{ Paper::M }, { Paper::N }>>::Gathered::default();
    let span = Span {
        attitude: *body_to_navigation,
        increment: Increment::from_averages(
            1.0,
            &(body_to_navigation.transpose() * earth.earth_rate()),
            &(body_to_navigation.transpose() * up),
        ),
        rate_change: nalgebra::Vector3::zeros(),
        force_change: nalgebra::Vector3::zeros(),
    };
    Paper::gather(&mut gathered, &span);
    let interval = Interval::constant(1.0, earth, nalgebra::Vector3::zeros(), up);
    model.dynamics(&gathered, &interval)
}

impl Setting {
    fn dynamics(&self, body_to_navigation: &Matrix3<f64>) -> Dynamics<{ Paper::M }, { Paper::N }> {
        let earth = LocalEarth::at(self.ship.latitude_rad, self.ship.height_m);
        dynamics_at_rest(&self.initial.model(), earth, body_to_navigation)
    }

    /// The ship's attitude and position, at rest, with both joints at zero.
    fn place(&self) -> NavigationState {
        let ship = self.ship.at(0.0);
        NavigationState {
            attitude: ship.attitude,
            velocity: nalgebra::Vector3::zeros(),
            position: Position {
                latitude_rad: ship.latitude_rad,
                longitude_rad: ship.longitude_rad,
                height_m: ship.height_m,
            },
        }
    }
}
