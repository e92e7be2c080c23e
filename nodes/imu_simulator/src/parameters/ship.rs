//! Where the ship lies and how.

use node_parameters::units::DEGREE;
use ros_node::{ParameterSet, Unit};
use sins::simulation::Ship;

/// Where the ship lies and how.
pub fn ship() -> ParameterSet<Ship> {
    ParameterSet::new("Ship", Ship::default())
        .number(
            "latitude_deg",
            DEGREE,
            -89.9..=89.9,
            |s| &mut s.latitude_rad,
            "Latitude of the ship, WGS-84, north positive",
        )
        .number(
            "longitude_deg",
            DEGREE,
            -180.0..=360.0,
            |s| &mut s.longitude_rad,
            "Longitude of the ship, east positive",
        )
        .number(
            "height_m",
            Unit::METRE,
            -500.0..=20_000.0,
            |s| &mut s.height_m,
            "Height of the ship above the ellipsoid",
        )
        .number(
            "heading_deg",
            DEGREE,
            -360.0..=360.0,
            |s| &mut s.heading_rad,
            "Heading of the y axis, clockwise from true north",
        )
        .number(
            "roll_deg",
            DEGREE,
            -90.0..=90.0,
            |s| &mut s.roll_rad,
            "Roll about the y axis, starboard down positive",
        )
        .number(
            "pitch_deg",
            DEGREE,
            -89.0..=89.0,
            |s| &mut s.pitch_rad,
            "Pitch about the x axis, bow up positive",
        )
}
