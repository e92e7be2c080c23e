//! The vertical channel: errors of height and of the vertical velocity.
//!
//! δḣ = δv_U, δv̇_U = (fⁿ × φ)_U + (C_b^n δf)_U − \[(2ω_ie + ω_en) × δv + …\]_U − (dg/dh) δh. Normal gravity falls with
//! height, so by itself the channel is unstable (1/e in 9 min): something measures height or vertical velocity. At a mooring
//! the mean heave is zero.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::estimation::group::{Coupling, Group, Interval};
use crate::estimation::groups::navigation::{LATITUDE, LONGITUDE};
use crate::estimation::state::StateLabel;
use crate::mechanization::strapdown::{NavigationState, Strapdown};

/// Name of the error of the height.
pub const HEIGHT: &str = "height_error_m";
/// Name of the error of the vertical velocity.
pub const VELOCITY_UP: &str = "velocity_error_up_m_s";

/// What is known of height and vertical velocity before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Vertical {
    /// One-sigma of the height \[m\].
    pub height_m: f64,
    /// One-sigma of the vertical velocity \[m/s\].
    pub velocity_m_s: f64,
}

impl Group for Vertical {
    const LABELS: &'static [StateLabel] = &[
        StateLabel::new(HEIGHT, "δh", "height error", "m", 1.0),
        StateLabel::new(VELOCITY_UP, "δvU", "velocity error up", "m/s", 1.0),
    ];
    const VELOCITY_UP: Option<usize> = Some(1);

    type Gathered = ();

    fn prior(&self, _place: &NavigationState, sigma: &mut [f64]) {
        sigma[0] = self.height_m;
        sigma[1] = self.velocity_m_s;
    }

    fn couple(&self, (): &(), interval: &Interval, into: &mut Coupling<'_>) {
        let Interval {
            seconds,
            earth,
            velocity: v,
            ..
        } = interval;
        let frame_rate = earth.earth_rate() + earth.transport_rate(v);
        let coriolis = -(earth.earth_rate() + frame_rate).cross(&Vector3::z());
        into.drives(1, Some(coriolis * *seconds), None);
        // The radii grow with height, so that angles and rates of a given velocity shrink.
        let (north, east) = (
            earth.meridian_curvature_per_m,
            earth.transverse_curvature_per_m,
        );
        let transport = Vector3::new(
            v.y * north * north,
            -v.x * east * east,
            -v.x * east * east * earth.tan_latitude,
        );
        let gravity = Vector3::z() * -earth.gravity_gradient_per_s2;
        into.drives(
            0,
            Some((gravity - transport.cross(v)) * *seconds),
            Some(transport * *seconds),
        );
        into.add(LATITUDE, 0, -transport.x * seconds);
        into.add(LONGITUDE, 0, transport.y / earth.cos_latitude * seconds);
        into.rises(0, 1, *seconds);
    }

    fn correct_navigation(x: &[f64], strapdown: &mut Strapdown) {
        strapdown.correct(&Vector3::zeros(), &Vector3::new(0.0, 0.0, x[1]), [0.0; 2]);
        strapdown.correct_height(x[0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::column_test::columns_hold;
    use crate::estimation::model::Whole;

    /// Both columns, for a ship that flies fast enough for every term to be seen.
    #[test]
    fn columns_are_the_derivative_of_the_machine() {
        columns_hold::<Whole, { Whole::M }, { Whole::N }>(Vertical::LABELS);
    }
}
