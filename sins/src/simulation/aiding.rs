//! What the ship tells the calibrator: her position and her velocity, with noise, and with all that goes wrong on a real ship.

use nalgebra::Vector3;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::{ShipMotion, Stream, generator};
use crate::earth::LocalEarth;
use crate::error::Error;
use crate::range;
use crate::time::Stamp;

/// A time, once or again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeWindow {
    /// When it begins, from the start \[s\].
    pub start_s: f64,
    /// How long it lasts; 0: it never comes \[s\].
    pub duration_s: f64,
    /// From one beginning to the next; 0: it comes once \[s\].
    pub period_s: f64,
}

impl TimeWindow {
    /// Whether `seconds` after the start lie in it.
    pub fn contains(&self, seconds: f64) -> bool {
        let since = seconds - self.start_s;
        let since = if self.period_s > 0.0 && since >= 0.0 {
            since % self.period_s
        } else {
            since
        };
        (0.0..self.duration_s).contains(&since)
    }

    fn validate(&self, name: &str) -> Result<(), Error> {
        for value in [self.start_s, self.duration_s, self.period_s] {
            range::not_negative(name, value)?;
        }
        Ok(())
    }
}

/// Noise and rates of the aiding, and what is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AidingSettings {
    /// One sigma of the velocity on every axis \[m/s\].
    pub velocity_std_m_s: f64,
    /// Velocities a second \[Hz\].
    pub velocity_rate_hz: f64,
    /// How old a velocity is at its stamp \[s\].
    pub velocity_latency_s: f64,
    /// What is added to velocities while they lie: East, North, Up \[m/s\].
    pub velocity_lie_m_s: Vector3<f64>,
    /// When velocities lie.
    pub velocity_lies: TimeWindow,
    /// One sigma of the position, East and North \[m\].
    pub horizontal_std_m: f64,
    /// One sigma of the height \[m\].
    pub vertical_std_m: f64,
    /// Positions a second \[Hz\].
    pub position_rate_hz: f64,
    /// Where position and velocity are measured, from the table's centre: starboard, forward, up \[m\].
    pub antenna_arm_m: Vector3<f64>,
    /// How old a position is at its stamp \[s\].
    pub position_latency_s: f64,
    /// Part of the positions that are outliers.
    pub outlier_probability: f64,
    /// One sigma of an outlier, every axis \[m\].
    pub outlier_std_m: f64,
    /// What is added to positions while they lie: East, North, Up \[m\].
    pub position_lie_m: Vector3<f64>,
    /// When positions lie.
    pub position_lies: TimeWindow,
    /// When neither position nor velocity comes.
    pub dropouts: TimeWindow,
    /// The variance that a position states over that of its noise; 0: it says that it does not know.
    pub stated_variance_ratio: f64,
}

impl Default for AidingSettings {
    fn default() -> Self {
        Self {
            velocity_std_m_s: 0.01,
            velocity_rate_hz: 1.0,
            velocity_latency_s: 0.0,
            velocity_lie_m_s: Vector3::zeros(),
            velocity_lies: TimeWindow::default(),
            horizontal_std_m: 1.0,
            vertical_std_m: 2.0,
            position_rate_hz: 1.0,
            antenna_arm_m: Vector3::zeros(),
            position_latency_s: 0.0,
            outlier_probability: 0.0,
            outlier_std_m: 20.0,
            position_lie_m: Vector3::zeros(),
            position_lies: TimeWindow::default(),
            dropouts: TimeWindow::default(),
            stated_variance_ratio: 1.0,
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
    /// Variance East, North, Up \[m²\]; zero where it is not known.
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
    outliers: Xoshiro256PlusPlus,
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
            ("latency of the position [s]", settings.position_latency_s),
            ("latency of the velocity [s]", settings.velocity_latency_s),
            ("sigma of an outlier [m]", settings.outlier_std_m),
            (
                "ratio of the position's stated variance",
                settings.stated_variance_ratio,
            ),
        ] {
            range::not_negative(name, value)?;
        }
        if !(0.0..=1.0).contains(&settings.outlier_probability) {
            return Err(Error::setting(
                "part of the positions that are outliers",
                settings.outlier_probability,
                "0 to 1",
            ));
        }
        for (name, vector) in [
            ("arm of the antenna [m]", &settings.antenna_arm_m),
            ("lie of the velocity [m/s]", &settings.velocity_lie_m_s),
            ("lie of the position [m]", &settings.position_lie_m),
        ] {
            vector
                .iter()
                .try_for_each(|v| range::finite(name, *v).map(|_| ()))?;
        }
        settings.dropouts.validate("dropouts of the aiding [s]")?;
        settings
            .position_lies
            .validate("time of the position's lie [s]")?;
        settings
            .velocity_lies
            .validate("time of the velocity's lie [s]")?;
        Ok(Self {
            settings,
            position: generator(seed, Stream::Position),
            velocity: generator(seed, Stream::Velocity),
            outliers: generator(seed, Stream::Outlier),
        })
    }

    /// Measures the position, `seconds` after the start; `None` in a dropout.
    pub fn position(
        &mut self,
        stamp: Stamp,
        seconds: f64,
        motion: &ShipMotion,
    ) -> Option<PositionFix> {
        let AidingSettings {
            horizontal_std_m,
            vertical_std_m,
            ..
        } = self.settings;
        let std = Vector3::new(horizontal_std_m, horizontal_std_m, vertical_std_m);
        let mut error = normals(&mut self.position).component_mul(&std);
        if self.settings.outlier_probability > 0.0 {
            let outlier = normals(&mut self.outliers) * self.settings.outlier_std_m;
            if self.outliers.random::<f64>() < self.settings.outlier_probability {
                error += outlier;
            }
        }
        if self.settings.position_lies.contains(seconds) {
            error += self.settings.position_lie_m;
        }
        if self.settings.dropouts.contains(seconds) {
            return None;
        }
        let ship = motion.at(seconds - self.settings.position_latency_s);
        let offset = ship.attitude * self.settings.antenna_arm_m + error;
        let earth = LocalEarth::at(ship.latitude_rad, ship.height_m);
        Some(PositionFix {
            stamp,
            latitude_rad: ship.latitude_rad + offset.y / earth.meridian_radius_m,
            longitude_rad: ship.longitude_rad
                + offset.x / (earth.transverse_radius_m * earth.cos_latitude),
            height_m: ship.height_m + offset.z,
            variance_m2: std.component_mul(&std) * self.settings.stated_variance_ratio,
        })
    }

    /// Measures the velocity, `seconds` after the start; `None` in a dropout.
    pub fn velocity(
        &mut self,
        stamp: Stamp,
        seconds: f64,
        motion: &ShipMotion,
    ) -> Option<VelocityFix> {
        let std = self.settings.velocity_std_m_s;
        let mut error = normals(&mut self.velocity) * std;
        if self.settings.velocity_lies.contains(seconds) {
            error += self.settings.velocity_lie_m_s;
        }
        if self.settings.dropouts.contains(seconds) {
            return None;
        }
        let ship = motion.at(seconds - self.settings.velocity_latency_s);
        let by_arm = ship.rate_over_level.cross(&self.settings.antenna_arm_m);
        Some(VelocityFix {
            stamp,
            velocity: ship.velocity + ship.attitude * by_arm + error,
            variance: Vector3::repeat(std * std),
        })
    }
}

fn normals(generator: &mut Xoshiro256PlusPlus) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(generator))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::earth::Position;
    use crate::simulation::{Course, MotionSettings, Ship, Swing};

    fn still() -> ShipMotion {
        ShipMotion::new(Ship::default(), MotionSettings::default(), 1).unwrap()
    }

    fn moving(settings: MotionSettings) -> ShipMotion {
        ShipMotion::new(Ship::default(), settings, 1).unwrap()
    }

    fn exact(settings: AidingSettings) -> Aiding {
        let settings = AidingSettings {
            velocity_std_m_s: 0.0,
            horizontal_std_m: 0.0,
            vertical_std_m: 0.0,
            ..settings
        };
        Aiding::new(settings, 1).unwrap()
    }

    /// Where a fix is, from the ship at that time \[m\].
    fn off(fix: &PositionFix, ship: &crate::simulation::ShipState) -> Vector3<f64> {
        let from = Position {
            latitude_rad: ship.latitude_rad,
            longitude_rad: ship.longitude_rad,
            height_m: ship.height_m,
        };
        from.offset_m(&Position {
            latitude_rad: fix.latitude_rad,
            longitude_rad: fix.longitude_rad,
            height_m: fix.height_m,
        })
    }

    /// A metre of noise is a metre on the ground, East as well as North.
    #[test]
    fn position_noise_is_in_metres() {
        let motion = still();
        let mut aiding = Aiding::new(AidingSettings::default(), 1).unwrap();
        let (mut east, mut north, n) = (0.0, 0.0, 10_000);
        for _ in 0..n {
            let fix = aiding.position(Stamp::default(), 0.0, &motion).unwrap();
            let offset = off(&fix, &motion.at(0.0));
            east += offset.x.powi(2);
            north += offset.y.powi(2);
        }
        assert!(
            (east / f64::from(n) - 1.0).abs() < 0.1 && (north / f64::from(n) - 1.0).abs() < 0.1
        );
    }

    /// The position's noise is its own: asking for velocities in between does not change it, nor does a dropout or an outlier.
    #[test]
    fn streams_are_apart() {
        let motion = still();
        let mut alone = Aiding::new(AidingSettings::default(), 1).unwrap();
        let mut mixed = alone.clone();
        mixed.velocity(Stamp::default(), 0.0, &motion);
        assert_eq!(
            alone.position(Stamp::default(), 0.0, &motion),
            mixed.position(Stamp::default(), 0.0, &motion)
        );
        let dropouts = AidingSettings {
            dropouts: TimeWindow {
                start_s: 5.0,
                duration_s: 1.0,
                period_s: 0.0,
            },
            ..AidingSettings::default()
        };
        let mut dropping = Aiding::new(dropouts, 1).unwrap();
        dropping.position(Stamp::default(), 0.0, &motion);
        assert_eq!(dropping.position(Stamp::default(), 5.0, &motion), None);
        alone.position(Stamp::default(), 0.0, &motion);
        assert_eq!(
            alone.position(Stamp::default(), 0.0, &motion),
            dropping.position(Stamp::default(), 6.0, &motion)
        );
    }

    /// The antenna is where its arm says, and turns with the ship: at heading 90 deg what is forward is East.
    #[test]
    fn the_antenna_stands_at_its_arm() {
        let ship = Ship {
            heading_rad: std::f64::consts::FRAC_PI_2,
            ..Ship::default()
        };
        let motion = ShipMotion::new(ship, MotionSettings::default(), 1).unwrap();
        let mut aiding = exact(AidingSettings {
            antenna_arm_m: Vector3::new(5.0, 2.0, 12.0),
            ..AidingSettings::default()
        });
        let fix = aiding.position(Stamp::default(), 0.0, &motion).unwrap();
        let offset = off(&fix, &motion.at(0.0));
        assert!(
            (offset - Vector3::new(2.0, -5.0, 12.0)).norm() < 1e-5,
            "{offset}"
        );
    }

    /// While she swings an antenna at an arm has the derivative of its own position as velocity.
    #[test]
    fn an_antenna_has_the_velocity_of_its_place() {
        let motion = moving(MotionSettings {
            swing: Swing {
                amplitude_rad: 0.5,
                period_s: 60.0,
                radius_m: 30.0,
            },
            ..MotionSettings::default()
        });
        let mut aiding = exact(AidingSettings {
            antenna_arm_m: Vector3::new(5.0, 2.0, 12.0),
            ..AidingSettings::default()
        });
        let mut at = |t: f64| aiding.position(Stamp::default(), t, &motion).unwrap();
        let [before, after] = [19.99, 20.01].map(&mut at);
        let here = motion.at(20.0);
        let numerical = (off(&after, &here) - off(&before, &here)) / 0.02;
        let measured = aiding.velocity(Stamp::default(), 20.0, &motion).unwrap();
        assert!(
            (numerical - measured.velocity).norm() < 1e-4,
            "{numerical} {}",
            measured.velocity
        );
    }

    /// At 10 m/s a latency of half a second puts the fix 5 m astern.
    #[test]
    fn a_late_fix_lies_astern() {
        let motion = moving(MotionSettings {
            course: Course {
                speed_m_s: 10.0,
                ..Course::default()
            },
            ..MotionSettings::default()
        });
        let mut aiding = exact(AidingSettings {
            position_latency_s: 0.5,
            ..AidingSettings::default()
        });
        let fix = aiding.position(Stamp::default(), 700.0, &motion).unwrap();
        let offset = off(&fix, &motion.at(700.0));
        assert!(
            (offset - Vector3::new(0.0, -5.0, 0.0)).norm() < 1e-3,
            "{offset}"
        );
    }

    /// Lies last as long as their time, and one in a hundred fixes is an outlier where that is asked for.
    #[test]
    fn lies_and_outliers_are_as_set() {
        let motion = still();
        let mut aiding = exact(AidingSettings {
            velocity_lie_m_s: Vector3::new(0.3, 0.0, 0.0),
            velocity_lies: TimeWindow {
                start_s: 100.0,
                duration_s: 60.0,
                period_s: 1000.0,
            },
            outlier_probability: 0.01,
            ..AidingSettings::default()
        });
        for (seconds, lie) in [
            (99.0, 0.0),
            (100.0, 0.3),
            (159.0, 0.3),
            (160.0, 0.0),
            (1130.0, 0.3),
        ] {
            let velocity = aiding.velocity(Stamp::default(), seconds, &motion).unwrap();
            assert_eq!(velocity.velocity.x, lie, "{seconds}");
        }
        let outliers = (0..10_000)
            .filter(|_| {
                let fix = aiding.position(Stamp::default(), 0.0, &motion).unwrap();
                off(&fix, &motion.at(0.0)).norm() > 0.1
            })
            .count();
        assert!((70..130).contains(&outliers), "{outliers}");
    }
}
