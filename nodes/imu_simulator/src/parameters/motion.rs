//! How the ship moves.

use node_parameters::units::{DEGREE, DEGREE_PER_SECOND};
use ros_node::{ParameterSet, Unit};
use sins::simulation::MotionSettings;

const METRE_PER_SECOND2: Unit = Unit::new("m/s^2", 1.0);

/// A system of waves; keys begin with its name.
fn waves(
    set: ParameterSet<MotionSettings>,
    name: &str,
    place: [fn(&mut MotionSettings) -> &mut f64; 4],
) -> ParameterSet<MotionSettings> {
    let [height, period, peakedness, direction] = place;
    set.number(
        &format!("{name}_significant_height_m"),
        Unit::METRE,
        0.0..=30.0,
        height,
        &format!("Significant height of the {name}; 0: there is none"),
    )
    .number(
        &format!("{name}_peak_period_s"),
        Unit::SECOND,
        1.0..=60.0,
        period,
        &format!("Period of the {name}'s peak"),
    )
    .number(
        &format!("{name}_peakedness"),
        Unit::NONE,
        1.0..=100.0,
        peakedness,
        &format!(
            "Peakedness of the {name}: 1 is Pierson-Moskowitz, 3.3 JONSWAP, more a narrow one"
        ),
    )
    .number(
        &format!("{name}_direction_deg"),
        DEGREE,
        -360.0..=360.0,
        direction,
        &format!("Where the {name} comes from, clockwise from true north"),
    )
}

/// How the ship moves.
pub fn motion() -> ParameterSet<MotionSettings> {
    let set = ParameterSet::new("Ship's motion", MotionSettings::default());
    let set = waves(
        set,
        "sea",
        [
            |s| &mut s.sea.significant_height_m,
            |s| &mut s.sea.peak_period_s,
            |s| &mut s.sea.peakedness,
            |s| &mut s.sea.from_direction_rad,
        ],
    );
    let swell: [fn(&mut MotionSettings) -> &mut f64; 4] = [
        |s| &mut s.swell.significant_height_m,
        |s| &mut s.swell.peak_period_s,
        |s| &mut s.swell.peakedness,
        |s| &mut s.swell.from_direction_rad,
    ];
    let set = waves(set, "swell", swell);
    course(hull(set))
}

fn hull(set: ParameterSet<MotionSettings>) -> ParameterSet<MotionSettings> {
    set.number(
        "hull_length_m",
        Unit::METRE,
        0.0..=500.0,
        |s| &mut s.hull.length_m,
        "Length of the waterline; shorter waves average out",
    )
    .number(
        "hull_beam_m",
        Unit::METRE,
        0.0..=100.0,
        |s| &mut s.hull.beam_m,
        "Beam; shorter waves average out",
    )
    .number(
        "heave_period_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.hull.heave_period_s,
        "Natural period of heave; 0: she follows the water",
    )
    .number(
        "roll_period_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.hull.roll_period_s,
        "Natural period of roll; 0: she follows the slope",
    )
    .number(
        "pitch_period_s",
        Unit::SECOND,
        0.0..=60.0,
        |s| &mut s.hull.pitch_period_s,
        "Natural period of pitch; 0: she follows the slope",
    )
    .number(
        "hull_damping",
        Unit::NONE,
        0.001..=10.0,
        |s| &mut s.hull.damping,
        "Damping of heave and pitch, as a part of the critical one",
    )
    .number(
        "roll_damping",
        Unit::NONE,
        0.001..=10.0,
        |s| &mut s.hull.roll_damping,
        "Damping of roll, as a part of the critical one",
    )
    .number(
        "yaw_per_slope",
        Unit::NONE,
        -10.0..=10.0,
        |s| &mut s.hull.yaw_per_slope,
        "Yaw over the slope of waves at 45 deg",
    )
    .numbers(
        "table_arm_m",
        Unit::METRE,
        -500.0..=500.0,
        |s| s.table_arm_m.as_mut_slice(),
        "The table's centre from the ship's centre of motion: starboard, forward, up",
    )
}

fn course(set: ParameterSet<MotionSettings>) -> ParameterSet<MotionSettings> {
    set.number(
        "swing_amplitude_deg",
        DEGREE,
        0.0..=180.0,
        |s| &mut s.swing.amplitude_rad,
        "Swing of the heading round the mooring, 1.4 sigma; 0: none",
    )
    .number(
        "swing_period_s",
        Unit::SECOND,
        10.0..=1e5,
        |s| &mut s.swing.period_s,
        "Period of the swing's greater part",
    )
    .number(
        "swing_radius_m",
        Unit::METRE,
        0.0..=1e4,
        |s| &mut s.swing.radius_m,
        "From the mooring to the ship's centre",
    )
    .number(
        "ship_speed_m_per_s",
        Unit::METRE_PER_SECOND,
        0.0..=50.0,
        |s| &mut s.course.speed_m_s,
        "Speed under way; 0: she stays",
    )
    .number(
        "ship_acceleration_m_per_s2",
        METRE_PER_SECOND2,
        1e-4..=10.0,
        |s| &mut s.course.acceleration_m_s2,
        "Greatest acceleration while she gathers way",
    )
    .number(
        "course_start_s",
        Unit::SECOND,
        0.0..=1e9,
        |s| &mut s.course.start_s,
        "When she begins to move",
    )
    .number(
        "course_leg_s",
        Unit::SECOND,
        1.0..=1e9,
        |s| &mut s.course.leg_s,
        "Length of a straight leg",
    )
    .number(
        "course_turn_deg",
        DEGREE,
        -180.0..=180.0,
        |s| &mut s.course.turn_rad,
        "Turn after a leg, and back after the next; 0: she goes straight on",
    )
    .number(
        "course_turn_rate_deg_per_s",
        DEGREE_PER_SECOND,
        0.001..=20.0,
        |s| &mut s.course.turn_rate_rad_s,
        "Greatest rate of a turn",
    )
}
