//! Schemes from YAML text.

use serde::Deserialize;

use super::{About, CableLimits, Rotation, Scheme};
use crate::error::Error;
use crate::table::{Axis, Joint};

/// Keys of a scheme file. Field units, and the keys say so.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SchemeFile {
    name: Option<String>,
    rotations: Vec<RotationEntry>,
    dwell_s: Option<f64>,
    first_dwell_s: Option<f64>,
    rate_deg_per_s: Option<f64>,
    acceleration_deg_per_s2: Option<f64>,
    cycles: Option<u32>,
    limits: Option<LimitsEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RotationEntry {
    axis: Option<Axis>,
    joint: Option<Joint>,
    angle_deg: f64,
    dwell_s: Option<f64>,
    rate_deg_per_s: Option<f64>,
    acceleration_deg_per_s2: Option<f64>,
    position: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsEntry {
    outer_deg: Option<[f64; 2]>,
    inner_deg: Option<[f64; 2]>,
}

impl Scheme {
    /// Reads a scheme file. `name` is the file's name; it stands in every error and is the scheme's name where the
    /// file gives none.
    ///
    /// ```
    /// let text = "
    /// rotations:
    ///   - {axis: x, angle_deg: 180}
    ///   - {joint: inner, angle_deg: -90, dwell_s: 300, position: tipped}
    ///   - {joint: inner, angle_deg: 90}
    ///   - {axis: x, angle_deg: -180}
    /// dwell_s: 500
    /// first_dwell_s: 2520             # the dwell that comes first; dwell_s where absent
    /// rate_deg_per_s: 5
    /// acceleration_deg_per_s2: 2.5
    /// cycles: 2                       # until stopped where absent
    /// limits: {outer_deg: [-200, 200], inner_deg: [-100, 100]}
    /// ";
    /// let scheme = sins::table::scheme::Scheme::from_yaml("four.yaml", text)?;
    /// assert_eq!(scheme.rotations.len(), 4);
    /// # Ok::<(), sins::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Scheme`] naming the file and the key: text that is not YAML, an unknown key (with the known ones), a
    /// value out of its range.
    pub fn from_yaml(name: &str, text: &str) -> Result<Self, Error> {
        let fail = |reason: String| Error::Scheme {
            name: name.to_owned(),
            reason,
        };
        let file: SchemeFile =
            serde_saphyr::from_str(text).map_err(|e| fail(first_line(&e.to_string())))?;
        let mut scheme = Self::new(file.name.unwrap_or_else(|| name.to_owned()), Vec::new());
        for (index, entry) in file.rotations.into_iter().enumerate() {
            let about = match (entry.axis, entry.joint) {
                (Some(axis), None) => About::Axis(axis),
                (None, Some(joint)) => About::Joint(joint),
                _ => {
                    return Err(fail(format!(
                        "rotations[{index}]: expected either `axis` (x, y, z) or `joint` (outer, inner)"
                    )));
                }
            };
            scheme.rotations.push(Rotation {
                about,
                angle_rad: entry.angle_deg.to_radians(),
                dwell_s: entry.dwell_s,
                rate_rad_s: entry.rate_deg_per_s.map(f64::to_radians),
                acceleration_rad_s2: entry.acceleration_deg_per_s2.map(f64::to_radians),
                position: entry.position,
            });
        }
        if let Some(dwell_s) = file.dwell_s {
            scheme.dwell_s = dwell_s;
        }
        scheme.first_dwell_s = file.first_dwell_s;
        if let Some(rate) = file.rate_deg_per_s {
            scheme.rate_rad_s = rate.to_radians();
        }
        if let Some(acceleration) = file.acceleration_deg_per_s2 {
            scheme.acceleration_rad_s2 = acceleration.to_radians();
        }
        scheme.cycles = file.cycles;
        if let Some(limits) = file.limits {
            let range = |deg: Option<[f64; 2]>, default: (f64, f64)| {
                deg.map_or(default, |[min, max]| (min.to_radians(), max.to_radians()))
            };
            let default = CableLimits::default();
            scheme.limits = CableLimits {
                outer: range(limits.outer_deg, default.outer),
                inner: range(limits.inner_deg, default.inner),
            };
        }
        scheme.validate().map_err(|e| match e {
            Error::Scheme { reason, .. } => fail(reason),
            other => other,
        })?;
        Ok(scheme)
    }

    /// Checks every value by itself; [`Scheme::program`](Scheme::program) checks what the table makes of them.
    pub(super) fn validate(&self) -> Result<(), Error> {
        let number = |key: String, value: f64, good: bool, expected: &str| {
            if good && value.is_finite() {
                Ok(())
            } else {
                Err(self.error(format!("{key} is {value}, expected {expected}")))
            }
        };
        number(
            "dwell_s".into(),
            self.dwell_s,
            self.dwell_s >= 0.0,
            "0 or more seconds",
        )?;
        if let Some(first) = self.first_dwell_s {
            number(
                "first_dwell_s".into(),
                first,
                first >= 0.0,
                "0 or more seconds",
            )?;
        }
        let rate = self.rate_rad_s.to_degrees();
        number(
            "rate_deg_per_s".into(),
            rate,
            rate > 0.0,
            "a positive number",
        )?;
        let acceleration = self.acceleration_rad_s2.to_degrees();
        number(
            "acceleration_deg_per_s2".into(),
            acceleration,
            acceleration > 0.0,
            "a positive number",
        )?;
        if self.cycles == Some(0) {
            return Err(
                self.error("cycles is 0, expected 1 or more, or no such key: until stopped")
            );
        }
        if self.rotations.is_empty() && self.first_dwell_s.unwrap_or(self.dwell_s) == 0.0 {
            return Err(self.error("dwell_s is 0 and there are no rotations: nothing to do"));
        }
        for (index, rotation) in self.rotations.iter().enumerate() {
            let angle = rotation.angle_rad.to_degrees();
            number(
                format!("rotations[{index}].angle_deg"),
                angle,
                angle.abs() >= 1e-3,
                "an angle of 0.001 deg or more, either way",
            )?;
            if let Some(dwell) = rotation.dwell_s {
                number(
                    format!("rotations[{index}].dwell_s"),
                    dwell,
                    dwell >= 0.0,
                    "0 or more seconds",
                )?;
            }
            if let Some(rate) = rotation.rate_rad_s.map(f64::to_degrees) {
                number(
                    format!("rotations[{index}].rate_deg_per_s"),
                    rate,
                    rate > 0.0,
                    "a positive number",
                )?;
            }
            if let Some(a) = rotation.acceleration_rad_s2.map(f64::to_degrees) {
                number(
                    format!("rotations[{index}].acceleration_deg_per_s2"),
                    a,
                    a > 0.0,
                    "a positive number",
                )?;
            }
        }
        for joint in [Joint::Outer, Joint::Inner] {
            let (min, max) = self.limits.of(joint);
            // Written so that a NaN fails too.
            if !(min <= 0.0 && max >= 0.0) {
                let key = if joint == Joint::Outer {
                    "limits.outer_deg"
                } else {
                    "limits.inner_deg"
                };
                let (min, max) = (min.to_degrees(), max.to_degrees());
                return Err(self.error(format!(
                    "{key} is [{min}, {max}], expected [min, max] with 0 between them"
                )));
            }
        }
        Ok(())
    }
}

/// The parser draws the place below its message; one line is what a person gets here.
fn first_line(message: &str) -> String {
    message.lines().next().unwrap_or(message).to_owned()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn refused(text: &str) -> String {
        let message = Scheme::from_yaml("mine.yaml", text)
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("mine.yaml") && !message.contains('\n'),
            "{message}"
        );
        message
    }

    /// Every key of a full file arrives where it belongs, in SI units; `y` is an axis and no boolean.
    #[test]
    fn full_file_is_read() {
        let scheme = Scheme::from_yaml(
            "mine.yaml",
            "name: mine\nrotations:\n  - {axis: y, angle_deg: 180, rate_deg_per_s: 2}\n  - {joint: outer, angle_deg: -90, dwell_s: 300, position: Q}\n\
             dwell_s: 60\nrate_deg_per_s: 10\nacceleration_deg_per_s2: 4\ncycles: 3\nlimits: {outer_deg: [-300, 0]}\n",
        )
        .unwrap();
        assert_eq!(scheme.name, "mine");
        assert_eq!(scheme.rotations[0].about, About::Axis(Axis::Y));
        assert_eq!(scheme.rotations[0].rate_rad_s, Some(2f64.to_radians()));
        assert_eq!(scheme.rotations[1].about, About::Joint(Joint::Outer));
        assert_eq!(scheme.rotations[1].angle_rad, (-90f64).to_radians());
        assert_eq!(
            (
                scheme.rotations[1].dwell_s,
                scheme.rotations[1].position.as_deref()
            ),
            (Some(300.0), Some("Q"))
        );
        assert_eq!((scheme.dwell_s, scheme.cycles), (60.0, Some(3)));
        assert_eq!(scheme.limits.outer, ((-300f64).to_radians(), 0.0));
        assert_eq!(scheme.limits.inner, CableLimits::default().inner);
    }

    /// An unknown key is refused with the keys that are known.
    #[test]
    fn unknown_key_is_refused() {
        let message = refused("rotations: []\ndwel_s: 5\n");
        assert!(
            message.contains("dwel_s") && message.contains("dwell_s"),
            "{message}"
        );
        let message = refused("rotations: [{axis: x, angle: 5}]\n");
        assert!(message.contains("angle_deg"), "{message}");
    }

    /// A value out of its range is refused by the name of its key.
    #[test]
    fn bad_values_are_refused_by_key() {
        for (text, key) in [
            (
                "rotations: [{axis: x, angle_deg: 0}]",
                "rotations[0].angle_deg",
            ),
            (
                "rotations: [{axis: x, angle_deg: .nan}]",
                "rotations[0].angle_deg",
            ),
            (
                "rotations: [{axis: x, angle_deg: 9, dwell_s: -1}]",
                "rotations[0].dwell_s",
            ),
            ("rotations: [{angle_deg: 90}]", "rotations[0]"),
            (
                "rotations: [{axis: x, joint: outer, angle_deg: 90}]",
                "rotations[0]",
            ),
            ("rotations: [{axis: q, angle_deg: 90}]", "`q`"),
            ("rotations: []\ndwell_s: -5", "dwell_s"),
            ("rotations: []\nrate_deg_per_s: 0", "rate_deg_per_s"),
            (
                "rotations: []\nacceleration_deg_per_s2: .inf",
                "acceleration_deg_per_s2",
            ),
            ("rotations: []\ncycles: 0", "cycles"),
            (
                "rotations: []\nlimits: {inner_deg: [10, 20]}",
                "limits.inner_deg",
            ),
            ("dwell_s: 5", "rotations"),
        ] {
            let message = refused(text);
            assert!(message.contains(key), "{text}: {message}");
        }
    }
}
