//! The table's drives and encoders.

use node_parameters::units::{ARC_SECOND, DEGREE, DEGREE_PER_SECOND, DEGREE_PER_SECOND2};
use ros_node::ParameterSet;
use sins::simulation::{EncoderSettings, TableSettings};

/// What the drives of the table can do, and where it stands.
pub fn drives() -> ParameterSet<TableSettings> {
    ParameterSet::new("Table", TableSettings::default())
        .numbers(
            "start_angles_deg",
            DEGREE,
            -3600.0..=3600.0,
            |s| &mut s.start,
            "Where the joints stand at first: outer, inner",
        )
        .number(
            "max_rate_deg_per_s",
            DEGREE_PER_SECOND,
            0.001..=3600.0,
            |s| &mut s.max_rate_rad_s,
            "A trajectory that asks for more is refused",
        )
        .number(
            "stop_deceleration_deg_per_s2",
            DEGREE_PER_SECOND2,
            0.001..=3600.0,
            |s| &mut s.stop_deceleration_rad_s2,
            "With this an empty trajectory stops the joints",
        )
        .value(
            "stuck_joint",
            "none".to_owned(),
            "Joint whose drive is blocked, to see what becomes of it: it takes commands and stays where it is",
            |s, name: String| {
                s.stuck = ["outer", "inner"].map(|joint| name == joint || name == "both");
                Ok(())
            },
        )
        .one_of(&["none", "outer", "inner", "both"])
}

/// Errors of the encoders.
pub fn encoders() -> ParameterSet<EncoderSettings> {
    ParameterSet::new("Encoders", EncoderSettings::default())
        .number(
            "encoder_resolution_arcsec",
            ARC_SECOND,
            0.0..=1e6,
            |s| &mut s.resolution_rad,
            "Smallest step of a joint angle; 0: none",
        )
        .number(
            "encoder_noise_arcsec",
            ARC_SECOND,
            0.0..=1e6,
            |s| &mut s.position_std_rad,
            "1 sigma of a joint angle",
        )
        .number(
            "encoder_rate_noise_deg_per_s",
            DEGREE_PER_SECOND,
            0.0..=1e6,
            |s| &mut s.rate_std_rad_s,
            "1 sigma of a joint rate",
        )
}
