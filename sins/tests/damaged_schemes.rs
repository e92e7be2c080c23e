//! Scheme files that somebody has damaged.
#![allow(missing_docs)]

use proptest::prelude::*;
use sins::table::scheme::Scheme;

const FULL: &str = "name: four
rotations:
  - {axis: x, angle_deg: 180, position: B}
  - {axis: y, angle_deg: -90, dwell_s: 300}
  - {joint: outer, angle_deg: -180, rate_deg_per_s: 4, acceleration_deg_per_s2: 2}
  - axis: y
    angle_deg: 90
dwell_s: 250
first_dwell_s: 500
rate_deg_per_s: 5
acceleration_deg_per_s2: 2.5
cycles: 2
limits: {outer_deg: [-200, 200], inner_deg: [-100, 100]}
";

proptest! {
    #![proptest_config(damage::drawn(3000))]

    /// A damaged scheme is refused in one line with its name, or is one whose every number is finite.
    #[test]
    fn damaged_schemes_are_told(bytes in damage::damaged(FULL.as_bytes().to_vec())) {
        let text = String::from_utf8_lossy(&bytes);
        match Scheme::from_yaml("four.yaml", &text) {
            Ok(scheme) => {
                prop_assert!(scheme.dwell_s.is_finite() && scheme.rate_rad_s > 0.0);
                let angles = scheme.rotations.iter().map(|rotation| rotation.angle_rad);
                prop_assert!(angles.into_iter().all(f64::is_finite));
            }
            Err(error) => {
                let told = error.to_string();
                prop_assert!(told.contains("four.yaml"), "{told}");
                prop_assert!(!told.contains('\n') && told.len() < 1000, "{told}");
            }
        }
    }
}
