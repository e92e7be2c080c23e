//! Schemes as YAML text: what [`Scheme::from_yaml`] reads.

use std::fmt::Write;

use super::{About, Rotation, Scheme};
use crate::table::Joint;

impl Scheme {
    /// The scheme as the text of a file.
    pub fn to_yaml(&self) -> String {
        let mut lines = vec![
            // JSON's quotes are YAML's: any name is one.
            format!("name: {:?}", self.name),
            format!("dwell_s: {}", self.dwell_s),
        ];
        if let Some(first) = self.first_dwell_s {
            lines.push(format!("first_dwell_s: {first}"));
        }
        lines.push(format!("rate_deg_per_s: {}", degrees(self.rate_rad_s)));
        lines.push(format!(
            "acceleration_deg_per_s2: {}",
            degrees(self.acceleration_rad_s2)
        ));
        if let Some(cycles) = self.cycles {
            lines.push(format!("cycles: {cycles}"));
        }
        let range = |joint: Joint| {
            let (min, max) = self.limits.of(joint);
            format!("[{}, {}]", limit(min), limit(max))
        };
        lines.push(format!(
            "limits: {{outer_deg: {}, inner_deg: {}}}",
            range(Joint::Outer),
            range(Joint::Inner)
        ));
        let rotations = if self.rotations.is_empty() { " []" } else { "" };
        lines.push(format!("rotations:{rotations}"));
        lines.extend(self.rotations.iter().map(rotation));
        lines.join("\n") + "\n"
    }
}

fn rotation(rotation: &Rotation) -> String {
    let about = match rotation.about {
        About::Axis(axis) => format!("axis: {axis}"),
        About::Joint(Joint::Outer) => "joint: outer".to_owned(),
        About::Joint(Joint::Inner) => "joint: inner".to_owned(),
    };
    let mut line = format!("  - {{{about}, angle_deg: {}", degrees(rotation.angle_rad));
    let own = [
        ("dwell_s", rotation.dwell_s),
        ("rate_deg_per_s", rotation.rate_rad_s.map(degrees)),
        (
            "acceleration_deg_per_s2",
            rotation.acceleration_rad_s2.map(degrees),
        ),
    ];
    for (key, value) in own {
        if let Some(value) = value {
            // Writing into a string does not fail.
            let _ = write!(line, ", {key}: {value}");
        }
    }
    if let Some(position) = &rotation.position {
        let _ = write!(line, ", position: {position:?}");
    }
    line + "}"
}

/// Degrees to a millionth: what a person wrote comes back as it was.
fn degrees(rad: f64) -> f64 {
    (rad.to_degrees() * 1e6).round() / 1e6
}

fn limit(rad: f64) -> String {
    if rad.is_finite() {
        degrees(rad).to_string()
    } else if rad > 0.0 {
        ".inf".to_owned()
    } else {
        "-.inf".to_owned()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::table::scheme::CableLimits;

    /// What is written is read as the same scheme, with every key and with as few as there can be.
    #[test]
    fn text_comes_back() {
        let mut full = Scheme::paper_experiment();
        full.cycles = Some(3);
        full.limits = CableLimits::NONE;
        full.rotations[1].dwell_s = Some(60.5);
        full.rotations[2].rate_rad_s = Some(2f64.to_radians());
        full.rotations[3].acceleration_rad_s2 = Some(1f64.to_radians());
        full.rotations[4].position = Some("a \"b\"".to_owned());
        full.rotations[5].about = About::Joint(Joint::Inner);
        for scheme in [full, Scheme::stationary(), Scheme::eight_position_yz()] {
            let text = scheme.to_yaml();
            let back = Scheme::from_yaml("file.yaml", &text).unwrap();
            assert_eq!(back.name, scheme.name);
            assert_eq!(back.to_yaml(), text);
            assert_eq!(
                (back.cycles, back.dwell_s, back.first_dwell_s),
                (scheme.cycles, scheme.dwell_s, scheme.first_dwell_s)
            );
            for (one, other) in back.rotations.iter().zip(&scheme.rotations) {
                assert_eq!(
                    (one.about, one.dwell_s, &one.position),
                    (other.about, other.dwell_s, &other.position)
                );
                assert!((one.angle_rad - other.angle_rad).abs() < 1e-9);
            }
            assert_eq!(back.rotations.len(), scheme.rotations.len());
        }
    }
}
