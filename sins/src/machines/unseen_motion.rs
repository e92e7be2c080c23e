//! What ship and table may have done in a hole of the samples, and how a machine gets over it.
//!
//! Two ways lead over a hole. **Bridged**: the rates are taken half way between its ends, and a table whose rate may change by α
//! is off by up to α T² / 4 then (it may turn away and stop again), rest at both ends or not. **Held**: the ship keeps her attitude
//! against the earth, and the encoders say what the block turned against her; nothing is integrated. The surer way is taken.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::earth::STANDARD_GRAVITY_M_S2;
use crate::error::Error;
use crate::estimation::filter::Crossing;
use crate::stream::Hole;
use crate::table::Turntable;
use crate::units::ARC_SECOND;

/// What may happen unseen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnseenMotion {
    /// Greatest rate of a joint \[rad/s\].
    pub table_rate_rad_s: f64,
    /// Greatest acceleration of a joint \[rad/s²\].
    pub table_acceleration_rad_s2: f64,
    /// One-sigma of an encoder's reading \[rad\].
    pub encoder_sigma_rad: f64,
    /// How fast the attitude of a moored ship becomes uncertain, each axis, one-sigma \[rad/s\].
    pub mooring_wander_rad_s: f64,
    /// How uncertain it becomes at most, one-sigma \[rad\].
    pub mooring_limit_rad: f64,
    /// How fast the heading of a ship under way becomes uncertain, one-sigma \[rad/s\].
    pub turn_rate_rad_s: f64,
    /// How uncertain her level becomes, one-sigma \[rad\].
    pub sway_rad: f64,
    /// How fast her velocity becomes uncertain, one-sigma \[m/s²\].
    pub acceleration_m_s2: f64,
}

impl Default for UnseenMotion {
    /// The table of the paper (5 deg/s, 2.5 deg/s²), encoders of 3 arcsec, a mooring that gives 6 arcsec a second and 1 deg at
    /// most, and a ship that turns by half a degree a second, rolls by 3 deg and changes her speed by 0.05 m/s a second.
    fn default() -> Self {
        Self {
            table_rate_rad_s: 5f64.to_radians(),
            table_acceleration_rad_s2: 2.5f64.to_radians(),
            encoder_sigma_rad: 3.0 * ARC_SECOND,
            mooring_wander_rad_s: 3e-5,
            mooring_limit_rad: 0.02,
            turn_rate_rad_s: 0.01,
            sway_rad: 0.05,
            acceleration_m_s2: 0.05,
        }
    }
}

/// The way over a hole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passage {
    /// Integrate the interval by the mean of its ends; one-sigma of the angle \[rad\] and of the velocity \[m/s\] in it.
    Bridged([f64; 2]),
    /// Do not integrate.
    Held(Crossing),
}

impl UnseenMotion {
    /// Refuses values that mean nothing.
    ///
    /// # Errors
    /// [`Error::Setting`] with the name of the value.
    pub fn check(&self) -> Result<(), Error> {
        for (name, value) in [
            ("table_rate_rad_s", self.table_rate_rad_s),
            ("table_acceleration_rad_s2", self.table_acceleration_rad_s2),
            ("encoder_sigma_rad", self.encoder_sigma_rad),
            ("mooring_wander_rad_s", self.mooring_wander_rad_s),
            ("mooring_limit_rad", self.mooring_limit_rad),
            ("turn_rate_rad_s", self.turn_rate_rad_s),
            ("sway_rad", self.sway_rad),
            ("acceleration_m_s2", self.acceleration_m_s2),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                let name = format!("unseen.{name}");
                return Err(Error::setting(name, value, "a number that is not negative"));
            }
        }
        Ok(())
    }

    /// Over a hole of a ship at her mooring, whose velocity is zero within `rest_sigma_m_s`.
    pub fn moored(&self, hole: &Hole, turntable: &Turntable, rest_sigma_m_s: f64) -> Passage {
        let bridged = self.bridge(hole);
        let Some((turn, encoder)) = self.table_turn(hole, *turntable) else {
            return Passage::Bridged(bridged);
        };
        let wander = (self.mooring_wander_rad_s * hole.interval_s).min(self.mooring_limit_rad);
        let sigma = encoder.hypot(wander);
        if bridged[0] <= sigma {
            return Passage::Bridged(bridged);
        }
        Passage::Held(Crossing {
            turn,
            seconds: hole.interval_s,
            misalignment_sigma_rad: Vector3::repeat(sigma),
            rest_sigma_m_s: Some(rest_sigma_m_s),
            velocity_sigma_m_s: 0.0,
        })
    }

    /// Over a hole of a ship that may sail: bridged where it is no longer than `longest_bridge_s`, else she keeps course and speed.
    pub fn under_way(&self, hole: &Hole, turntable: &Turntable, longest_bridge_s: f64) -> Passage {
        if hole.interval_s <= longest_bridge_s {
            return Passage::Bridged(self.bridge(hole));
        }
        let seconds = hole.interval_s;
        let half_turn = std::f64::consts::PI / 3f64.sqrt();
        // What the table did unseen may have been anything.
        let (turn, table) = self
            .table_turn(hole, *turntable)
            .unwrap_or((UnitQuaternion::identity(), self.unseen_turn(hole)));
        let level = self.sway_rad.hypot(table.min(half_turn));
        let heading = (self.turn_rate_rad_s * seconds).hypot(table);
        Passage::Held(Crossing {
            turn,
            seconds,
            misalignment_sigma_rad: Vector3::new(level, level, heading.min(half_turn)),
            rest_sigma_m_s: None,
            velocity_sigma_m_s: self.acceleration_m_s2 * seconds,
        })
    }

    /// One-sigma of angle and velocity over a bridged hole: half the difference of its ends, and what the table may have done.
    fn bridge(&self, hole: &Hole) -> [f64; 2] {
        let [before, after] = &hole.ends;
        let half = 0.5 * hole.interval_s;
        let mut unseen = self.unseen_turn(hole);
        if let Some(turned) = hole.turned {
            let moved = (0..2).map(|i| (turned.to[i] - turned.from[i]).abs());
            let is_at_rest = moved.fold(0.0, f64::max) < 4.0 * self.encoder_sigma_rad;
            if is_at_rest {
                unseen = unseen.min(self.encoders(turned.sigma_rad));
            }
        }
        let angle = half * (before.angular_rate - after.angular_rate).norm();
        let velocity = half * (before.specific_force - after.specific_force).norm();
        [
            angle.hypot(unseen),
            velocity.hypot(half * STANDARD_GRAVITY_M_S2 * unseen),
        ]
    }

    /// How far a table may have turned unseen and come to rest again, as a one-sigma of an even distribution \[rad\].
    fn unseen_turn(&self, hole: &Hole) -> f64 {
        let seconds = hole.interval_s * hole.lost as f64 / (hole.lost + 1) as f64;
        let greatest = (0.25 * self.table_acceleration_rad_s2 * seconds * seconds)
            .min(self.table_rate_rad_s * seconds);
        greatest / 3f64.sqrt()
    }

    fn encoders(&self, apart_rad: f64) -> f64 {
        (std::f64::consts::SQRT_2 * self.encoder_sigma_rad).hypot(apart_rad)
    }

    /// What the encoders say the block turned, and its one-sigma \[rad\].
    fn table_turn(&self, hole: &Hole, turntable: Turntable) -> Option<(UnitQuaternion<f64>, f64)> {
        let turned = hole.turned?;
        let turn = turntable.attitude(turned.from).inverse() * turntable.attitude(turned.to);
        Some((turn, self.encoders(turned.sigma_rad)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::ImuSample;
    use crate::stream::TableTurn;
    use crate::time::Stamp;

    fn hole(seconds: f64, turned: Option<f64>) -> Hole {
        let sample = ImuSample::at_rest(Stamp::default(), 9.8);
        Hole {
            interval_s: seconds,
            lost: (seconds * 100.0).round() as u64 - 1,
            ends: [sample; 2],
            turned: turned.map(|outer| TableTurn {
                from: [0.1, 0.0],
                to: [0.1 + outer, 0.0],
                sigma_rad: 0.0,
            }),
        }
    }

    /// A hole that the table may have turned in costs uncertainty though both ends rest; encoders make it small again.
    #[test]
    fn rest_at_both_ends_is_no_proof() {
        let unseen = UnseenMotion::default();
        let table = Turntable::default();
        let Passage::Bridged([angle, velocity]) = unseen.moored(&hole(5.0, None), &table, 0.01)
        else {
            panic!("no encoders, nothing to hold by")
        };
        assert!((angle.to_degrees() - 0.25 * 2.5 * 24.9 / 3f64.sqrt()).abs() < 0.05);
        assert!(velocity > 1.0);
        let Passage::Held(crossing) = unseen.moored(&hole(5.0, Some(0.2)), &table, 0.01) else {
            panic!("the encoders know better")
        };
        assert!((crossing.turn.angle() - 0.2).abs() < 1e-12);
        assert!(crossing.misalignment_sigma_rad.x < 40.0 * ARC_SECOND);
        // A single sample at a hundred a second costs what the table can do in that time.
        let Passage::Bridged([angle, _]) = unseen.moored(&hole(0.02, None), &table, 0.01) else {
            panic!("bridged")
        };
        assert!(angle < ARC_SECOND);
    }

    /// Under way a long hole makes the heading more uncertain than the level, and the position by the velocity.
    #[test]
    fn under_way_course_and_speed_are_kept() {
        let unseen = UnseenMotion::default();
        let table = Turntable::default();
        let passage = unseen.under_way(&hole(60.0, Some(0.0)), &table, 5.0);
        let Passage::Held(crossing) = passage else {
            panic!("too long to be bridged")
        };
        assert_eq!(crossing.rest_sigma_m_s, None);
        assert!(crossing.misalignment_sigma_rad.z > 10.0 * crossing.misalignment_sigma_rad.x);
        assert!((crossing.velocity_sigma_m_s - 3.0).abs() < 1e-12);
    }
}
