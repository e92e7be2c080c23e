//! What the ship tells the calibrator: its position and its velocity, with noise.

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{ShipState, Stream, generator};
use crate::earth::LocalEarth;
use crate::error::Error;
use crate::range;
use crate::time::Stamp;

/// Noise and rates of the aiding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AidingSettings {
    /// One sigma of the velocity on every axis \[m/s\].
    pub velocity_std_m_s: f64,
    /// Velocities a second \[Hz\].
    pub velocity_rate_hz: f64,
    /// One sigma of the position, East and North \[m\].
    pub horizontal_std_m: f64,
    /// One sigma of the height \[m\].
    pub vertical_std_m: f64,
    /// Positions a second \[Hz\].
    pub position_rate_hz: f64,
}

impl Default for AidingSettings {
    fn default() -> Self {
        Self {
            velocity_std_m_s: 0.01,
            velocity_rate_hz: 1.0,
            horizontal_std_m: 1.0,
            vertical_std_m: 2.0,
            position_rate_hz: 1.0,
        }
    }
}

/// A measured position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionFix {
    /// When the ship was there.
    pub stamp: Stamp,
    /// Geodetic latitude, WGS-84 \[rad\].
    pub latitude_rad: f64,
    /// Longitude \[rad\].
    pub longitude_rad: f64,
    /// Height above the ellipsoid \[m\].
    pub height_m: f64,
    /// Variance East, North, Up \[m²\].
    pub variance_m2: Vector3<f64>,
}

/// A measured velocity over the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityFix {
    /// When the ship had it.
    pub stamp: Stamp,
    /// East, North, Up \[m/s\].
    pub velocity: Vector3<f64>,
    /// Variance of the same \[m²/s²\].
    pub variance: Vector3<f64>,
}

/// Measures position and velocity of the ship.
#[derive(Clone, Debug)]
pub struct Aiding {
    settings: AidingSettings,
    position: Xoshiro256PlusPlus,
    velocity: Xoshiro256PlusPlus,
}

impl Aiding {
    /// Aiding with this noise and seed.
    ///
    /// # Errors
    /// [`Error::Setting`] where a sigma is negative or not finite.
    pub fn new(settings: AidingSettings, seed: u64) -> Result<Self, Error> {
        for (name, value) in [
            ("velocity aiding sigma [m/s]", settings.velocity_std_m_s),
            ("horizontal position sigma [m]", settings.horizontal_std_m),
            ("vertical position sigma [m]", settings.vertical_std_m),
        ] {
            range::not_negative(name, value)?;
        }
        Ok(Self {
            settings,
            position: generator(seed, Stream::Position),
            velocity: generator(seed, Stream::Velocity),
        })
    }

    /// Measures the position.
    pub fn position(&mut self, stamp: Stamp, ship: &ShipState) -> PositionFix {
        let AidingSettings {
            horizontal_std_m,
            vertical_std_m,
            ..
        } = self.settings;
        let std = Vector3::new(horizontal_std_m, horizontal_std_m, vertical_std_m);
        let error = normals(&mut self.position).component_mul(&std);
        let earth = LocalEarth::at(ship.latitude_rad, ship.height_m);
        PositionFix {
            stamp,
            latitude_rad: ship.latitude_rad + error.y / earth.meridian_radius_m,
            longitude_rad: ship.longitude_rad
                + error.x / (earth.transverse_radius_m * earth.cos_latitude),
            height_m: ship.height_m + error.z,
            variance_m2: std.component_mul(&std),
        }
    }

    /// Measures the velocity.
    pub fn velocity(&mut self, stamp: Stamp, ship: &ShipState) -> VelocityFix {
        let std = self.settings.velocity_std_m_s;
        VelocityFix {
            stamp,
            velocity: ship.velocity + normals(&mut self.velocity) * std,
            variance: Vector3::repeat(std * std),
        }
    }
}

fn normals(generator: &mut Xoshiro256PlusPlus) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(generator))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::simulation::Ship;

    /// A metre of noise is a metre on the ground, East as well as North.
    #[test]
    fn position_noise_is_in_metres() {
        let ship = Ship::default().at(0.0);
        let mut aiding = Aiding::new(AidingSettings::default(), 1).unwrap();
        let (mut east, mut north, n) = (0.0, 0.0, 10_000);
        for _ in 0..n {
            let fix = aiding.position(Stamp::default(), &ship);
            let earth = LocalEarth::at(ship.latitude_rad, 0.0);
            east += ((fix.longitude_rad - ship.longitude_rad)
                * earth.transverse_radius_m
                * earth.cos_latitude)
                .powi(2);
            north += ((fix.latitude_rad - ship.latitude_rad) * earth.meridian_radius_m).powi(2);
        }
        assert!(
            (east / f64::from(n) - 1.0).abs() < 0.1 && (north / f64::from(n) - 1.0).abs() < 0.1
        );
    }

    /// The position's noise is its own: asking for velocities in between does not change it.
    #[test]
    fn streams_are_apart() {
        let ship = Ship::default().at(0.0);
        let mut alone = Aiding::new(AidingSettings::default(), 1).unwrap();
        let mut mixed = alone.clone();
        mixed.velocity(Stamp::default(), &ship);
        assert_eq!(
            alone.position(Stamp::default(), &ship),
            mixed.position(Stamp::default(), &ship)
        );
    }
}
