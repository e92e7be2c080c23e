//! What is known before of the groups of the whole model, and the grade that says what is not given.

use std::fmt;
use std::str::FromStr;

use ros_node::{ParameterSet, Unit};
use sins::estimation::grade::{Grade, GroupPriors};

use crate::units::{
    ARC_SECOND, DEGREE_PER_HOUR_PER_G, DEGREE_PER_HOUR_SQRT_HOUR, MICRO_G_PER_G2,
    MICRO_G_PER_SQRT_HOUR, MILLIMETRE, MILLISECOND, PPM,
};

/// Key, unit, field and words of a prior.
type Row = (
    &'static str,
    Unit,
    fn(&mut GroupPriors) -> &mut f64,
    &'static str,
);

const ROWS: [Row; 17] = [
    (
        "prior_height_m",
        Unit::METRE,
        |s| &mut s.height_m,
        "1 sigma of the height; negative: by the grade",
    ),
    (
        "prior_gyroscope_scale_factor_ppm",
        PPM,
        |s| &mut s.gyroscope_scale_factor,
        "1 sigma of the gyroscopes' scale factors; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_gyroscope_installation_arcsec",
        ARC_SECOND,
        |s| &mut s.gyroscope_installation_rad,
        "1 sigma of the gyroscopes' installation angles; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_accelerometer_scale_factor_ppm",
        PPM,
        |s| &mut s.accelerometer_scale_factor,
        "1 sigma of the accelerometers' scale factors; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_accelerometer_installation_arcsec",
        ARC_SECOND,
        |s| &mut s.accelerometer_installation_rad,
        "1 sigma of the accelerometers' installation angles; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_accelerometer_quadratic_ug_per_g2",
        MICRO_G_PER_G2,
        |s| &mut s.accelerometer_quadratic_per_m_s2,
        "1 sigma of the accelerometers' quadratic coefficients; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_accelerometer_arm_mm",
        MILLIMETRE,
        |s| &mut s.accelerometer_arm_m,
        "1 sigma of the accelerometers' arms from the table's centre; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_gyroscope_g_sensitivity_deg_per_hour_per_g",
        DEGREE_PER_HOUR_PER_G,
        |s| &mut s.gyroscope_g_sensitivity_rad_s_per_m_s2,
        "1 sigma of the gyroscopes' g-sensitivity; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_accelerometer_delay_ms",
        MILLISECOND,
        |s| &mut s.accelerometer_delay_s,
        "1 sigma of the accelerometers' delay against the gyroscopes; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_table_nonorthogonality_arcsec",
        ARC_SECOND,
        |s| &mut s.table_nonorthogonality_rad,
        "1 sigma of the non-orthogonality of the table's axes; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_inner_axis_tilt_arcsec",
        ARC_SECOND,
        |s| &mut s.inner_axis_tilt_rad,
        "1 sigma of the inner axis' tilts in the block; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_encoder_zero_arcsec",
        ARC_SECOND,
        |s| &mut s.encoder_zero_rad,
        "1 sigma of the inner encoder's zero; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_encoder_eccentricity_arcsec",
        ARC_SECOND,
        |s| &mut s.encoder_eccentricity_rad,
        "1 sigma of the encoders' eccentricities; negative: by the grade; 0: not estimated",
    ),
    (
        "prior_antenna_arm_m",
        Unit::METRE,
        |s| &mut s.antenna_arm_m,
        "1 sigma of the antenna's arm beyond antenna_arm_m; negative: by the grade; 0: not estimated",
    ),
    (
        "whole_gyroscope_drift_walk_deg_per_hour_sqrt_hour",
        DEGREE_PER_HOUR_SQRT_HOUR,
        |s| &mut s.gyroscope_drift_walk_rad_s_sqrt_s,
        "Walk of the gyroscope drifts in the whole model; negative: by the grade",
    ),
    (
        "whole_accelerometer_bias_walk_ug_per_sqrt_hour",
        MICRO_G_PER_SQRT_HOUR,
        |s| &mut s.accelerometer_bias_walk_m_s2_sqrt_s,
        "Walk of the accelerometer biases in the whole model; negative: by the grade",
    ),
    (
        "turn_noise_ppm",
        PPM,
        |s| &mut s.turn_noise,
        "What a turn costs that no state describes, as a share of 180 deg; negative: by the grade",
    ),
];

/// The same priors, where those that the grade tells are -1 in the unit that people read.
pub(crate) fn readable(priors: GroupPriors) -> GroupPriors {
    by_grade(priors, |unit| unit.to_si(-1.0))
}

/// The same priors as the machine's own defaults have those that the grade tells: -1.
pub(crate) fn told(priors: GroupPriors) -> GroupPriors {
    by_grade(priors, |_| -1.0)
}

/// Puts another negative number where the grade tells a prior.
fn by_grade(mut priors: GroupPriors, negative: impl Fn(Unit) -> f64) -> GroupPriors {
    for (_, unit, field, _) in ROWS {
        let prior = field(&mut priors);
        if *prior < 0.0 {
            *prior = negative(unit);
        }
    }
    priors
}

/// Parameters of the groups.
pub(crate) fn groups() -> ParameterSet<GroupPriors> {
    let set = ParameterSet::new("Prior", readable(GroupPriors::BY_GRADE));
    ROWS.into_iter()
        .fold(set, |set, (key, unit, field, words)| {
            set.number(key, unit, -1e9..=1e9, field, words)
        })
}

/// A grade, or that the noise is to tell it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GradeChoice(Option<Grade>);

impl From<Option<Grade>> for GradeChoice {
    fn from(grade: Option<Grade>) -> Self {
        Self(grade)
    }
}

impl From<GradeChoice> for Option<Grade> {
    fn from(choice: GradeChoice) -> Self {
        choice.0
    }
}

impl GradeChoice {
    /// What may be chosen.
    pub const NAMES: [&str; 4] = ["auto", "ring-laser", "fibre-optic", "mems"];
}

impl fmt::Display for GradeChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.map_or("auto", Grade::name))
    }
}

impl FromStr for GradeChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self(None));
        }
        let grade = text.parse::<Grade>();
        grade
            .map(|grade| Self(Some(grade)))
            .map_err(|_| format!("'{text}' is none of {}", Self::NAMES.join(", ")))
    }
}
