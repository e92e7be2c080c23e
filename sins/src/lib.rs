//! Mathematics of a dual-axis rotary strapdown inertial navigation system.
//!
//! No ROS, no files, no clock, no threads: every machine in this crate is fed samples and hands back results, and a node and
//! the command line drive the same ones. Start with [`machines::self_calibration::SelfCalibration`] (aligns and estimates sensor errors),
//! [`machines::navigator::Navigator`] (navigates with them taken out), [`table::scheme::Sequencer`] (turns the table) and
//! [`simulation::Run`] (a ship, a table and an IMU to try them on).
//!
//! # Conventions
//!
//! 1. **n** is the navigation frame: local level, East-North-Up. Latitude L, longitude λ, WGS-84, normal gravity.
//! 2. **b** is the block (`imu_link`): at zero joint angles right-forward-up. The attitude turns b into n,
//!    `v_n = q * v_b`, Hamilton, nalgebra's own `UnitQuaternion`.
//! 3. Heading is that of the y axis with both joints at zero, clockwise from **true** north, 0..360 deg. At heading 0 x is East and
//!    y North: the paper's position A. `base_link` is forward-left-up (REP-103), so its x is the block's y.
//! 4. Misalignment φ: the calculated frame n' is n turned by φ, `C' = (I − φ×) C`. Then
//!    φ̇ = −ω_in × φ + δω_in − C_b^n ε and δv̇ = fⁿ × φ + C_b^n ∇ − (2ω_ie + ω_en) × δv − (2δω_ie + δω_en) × v.
//! 5. Errors are measured minus true: drift ε, bias ∇, and δL, δλ, δv. The paper calls latitude L in one place and longitude in
//!    another; here they are spelled out.
//! 6. Joints are counter-clockwise positive and continuous. The outer axis is fixed in the ship and the inner one is carried by
//!    it; which body axis each turns about is configuration (default outer x, inner y).
//! 7. A sample is the average over the interval that **ends** at its stamp. Stamps are integer nanoseconds; only differences
//!    become `f64`. Nothing depends on when a sample arrives.
//! 8. SI everywhere; a name carries its unit where the type does not. Field units are in [`units`] and only people meet them.
//! 9. White noise is given as density (rad/√s, m/s/√s); σ of a sample is density/√dt.
//!
//! # Equations
//!
//! | what | where | source |
//! | --- | --- | --- |
//! | WGS-84 radii and normal gravity | [`earth`] | NIMA TR8350.2 |
//! | coning, sculling, rotation; unequal intervals | [`mechanization::strapdown`] | Savage 1998; derived for unequal ones |
//! | coarse alignment in the inertial frame | [`mechanization::coarse_alignment`] | Wahba's problem, Markley 1988 |
//! | F, G, H of the 13 states | [`estimation::groups`] | Sensors 2015, 15, 3154, equations 25 to 29 |
//! | Joseph form, scalar updates | [`estimation::kalman`] | Bucy and Joseph 1968 |
//! | chi-square test of the innovations | [`estimation::consistency`] | Bar-Shalom 2001 |
//! | global conditions, stripped matrix, degrees, bound | [`studies::observability`] | the paper's section 2; Goshen-Meskin and Bar-Itzhack 1992 |
//! | sensor error model | [`sensor::errors`] | the paper, with K_a lower triangular |
//! | exact interval averages of the simulated IMU | [`simulation`] | Gauss-Legendre quadrature |

pub mod earth;
pub mod error;
pub mod estimation;
pub mod machines;
pub mod mechanization;
pub mod range;
pub mod sensor;
pub mod simulation;
pub mod stream;
pub mod studies;
pub mod table;
pub mod time;
pub mod units;

pub use error::Error;
pub use time::Stamp;
