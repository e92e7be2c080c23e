//! How far a table may be from the motion it was told.

use super::{JOINT_NAMES, JointState};

/// What is permitted of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTolerance {
    /// Difference of the angle; infinite: any \[rad\].
    pub position_rad: f64,
    /// Difference of the rate; infinite: any \[rad/s\].
    pub rate_rad_s: f64,
}

impl JointTolerance {
    /// Anything goes.
    pub const NONE: Self = Self {
        position_rad: f64::INFINITY,
        rate_rad_s: f64::INFINITY,
    };
}

/// The first joint (outer, inner) that is further from where it should be than its tolerance, for a person.
pub fn violation(
    desired: &JointState,
    actual: &JointState,
    tolerances: &[JointTolerance; 2],
) -> Option<String> {
    for (joint, name) in JOINT_NAMES.iter().enumerate() {
        for (what, unit, desired, actual, tolerance) in [
            (
                "is at",
                "deg",
                desired.position[joint],
                actual.position[joint],
                tolerances[joint].position_rad,
            ),
            (
                "turns at",
                "deg/s",
                desired.velocity[joint],
                actual.velocity[joint],
                tolerances[joint].rate_rad_s,
            ),
        ] {
            if (desired - actual).abs() > tolerance {
                return Some(format!(
                    "{name} {what} {:.4} {unit}, desired {:.4}, tolerance {:.4}",
                    actual.to_degrees(),
                    desired.to_degrees(),
                    tolerance.to_degrees()
                ));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Angle and rate of each joint are held against its own tolerance, and the message names what is wrong.
    #[test]
    fn names_what_is_violated() {
        let tolerances = [
            JointTolerance {
                position_rad: 0.1,
                rate_rad_s: f64::INFINITY,
            },
            JointTolerance {
                position_rad: f64::INFINITY,
                rate_rad_s: 0.01,
            },
        ];
        let at = |position, velocity| JointState { position, velocity };
        let here = at([0.0; 2], [0.0; 2]);
        let check = |actual| violation(&here, &actual, &tolerances);
        assert_eq!(check(at([0.1, 5.0], [9.0, 0.01])), None);
        let message = check(at([-0.11, 0.0], [0.0; 2])).unwrap();
        assert!(
            message.starts_with("outer_joint is at -6.3025 deg"),
            "{message}"
        );
        let message = check(at([0.0; 2], [0.0, 0.02])).unwrap();
        assert!(message.starts_with("inner_joint turns at"), "{message}");
        assert_eq!(
            violation(&here, &at([1e9; 2], [1e9; 2]), &[JointTolerance::NONE; 2]),
            None
        );
    }
}
