//! A place on the earth.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::LocalEarth;
use crate::error::Error;

/// Beyond this latitude a local-level frame has no usable north \[deg\].
const HIGHEST_LATITUDE_DEG: f64 = 89.5;

/// Geodetic position, WGS-84.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Longitude \[rad\]; not wrapped where it was integrated.
    pub longitude_rad: f64,
    /// Height above the ellipsoid \[m\].
    pub height_m: f64,
}

impl Position {
    /// From degrees and metres, as messages and files have it.
    pub fn from_degrees(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Self {
        Self {
            latitude_rad: latitude_deg.to_radians(),
            longitude_rad: longitude_deg.to_radians(),
            height_m,
        }
    }

    /// This position where one can navigate at it, or what is wrong with it.
    ///
    /// # Errors
    /// [`Error::Setting`] where a coordinate is not finite, off the globe, or at a pole.
    pub fn checked(self) -> Result<Self, Error> {
        if self.latitude_rad.is_nan() || self.latitude_rad.abs() > HIGHEST_LATITUDE_DEG.to_radians()
        {
            return Err(Error::setting(
                "latitude of the fix in degrees",
                self.latitude_rad.to_degrees(),
                "-89.5 .. 89.5 (a local-level frame needs a north)",
            ));
        }
        if self.longitude_rad.is_nan()
            || self.longitude_rad.abs() > 361f64.to_radians()
            || !(HEIGHT_RANGE_M.0..=HEIGHT_RANGE_M.1).contains(&self.height_m)
        {
            return Err(Error::setting(
                "longitude in degrees and height in m of the fix",
                format!("{}, {}", self.longitude_rad.to_degrees(), self.height_m),
                "finite numbers, longitude within a turn, height -1000 .. 10000 m",
            ));
        }
        Ok(self)
    }

    /// Offset (E, N, U) \[m\] of another position from this one: distances along the ellipsoid with the radii half way, so that
    /// they serve as position errors too. Longitude may be wrapped or not.
    pub fn offset_m(&self, to: &Self) -> Vector3<f64> {
        let middle = LocalEarth::at(
            0.5 * (self.latitude_rad + to.latitude_rad),
            0.5 * (self.height_m + to.height_m),
        );
        let mut turn = to.longitude_rad - self.longitude_rad;
        if turn.abs() > std::f64::consts::PI {
            turn -= std::f64::consts::TAU.copysign(turn);
        }
        Vector3::new(
            turn * middle.transverse_radius_m * middle.cos_latitude,
            (to.latitude_rad - self.latitude_rad) * middle.meridian_radius_m,
            to.height_m - self.height_m,
        )
    }
}

/// Heights at which a ship, a truck or an aircraft on the ground may be \[m\].
const HEIGHT_RANGE_M: (f64, f64) = (-1000.0, 10_000.0);

#[cfg(test)]
mod tests {
    use super::*;

    /// A pole, a longitude beyond a turn, and a height off the earth are refused; Lima harbour and Lhasa are not.
    #[test]
    fn off_the_globe_is_refused() {
        for (latitude, longitude, height, good) in [
            (-12.05, -77.15, 0.0, true),
            (29.65, 91.1, 3656.0, true),
            (95.0, 0.0, 0.0, false),
            (f64::NAN, 0.0, 0.0, false),
            (45.0, 400.0, 0.0, false),
            (45.0, f64::INFINITY, 0.0, false),
            (45.0, 0.0, 1e300, false),
        ] {
            let position = Position::from_degrees(latitude, longitude, height);
            assert_eq!(position.checked().is_ok(), good, "{position:?}");
        }
    }

    /// A minute of latitude is a nautical mile, give or take; longitude wraps.
    #[test]
    fn offsets_are_distances() {
        let origin = Position {
            latitude_rad: 0.8,
            longitude_rad: 3.1,
            height_m: 10.0,
        };
        let minute = (1.0 / 60.0f64).to_radians();
        let north = origin.offset_m(&Position {
            latitude_rad: origin.latitude_rad + minute,
            ..origin
        });
        assert!((north.y - 1852.0).abs() < 5.0 && north.x == 0.0, "{north}");
        let west = origin.offset_m(&Position {
            longitude_rad: origin.longitude_rad + std::f64::consts::TAU - minute,
            height_m: 12.0,
            ..origin
        });
        assert!(
            (west.x + 1855.0 * 0.8f64.cos()).abs() < 5.0 && west.z == 2.0,
            "{west}"
        );
    }
}
