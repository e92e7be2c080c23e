//! How well the states have to be known: a one-sigma for any of them, by name.

use crate::error::Error;
use crate::estimation::groups::bias::{ACCELEROMETER_BIAS, GYROSCOPE_DRIFT};
use crate::estimation::groups::navigation::MISALIGNMENT;
use crate::estimation::model;
use crate::estimation::state::{NamedCovariance, StateLabel};
use crate::units::{ARC_MINUTE, DEG_PER_HOUR, MICRO_G};

/// One-sigma below which a state counts as found, for the states that are asked for. Of the others nothing is asked.
#[derive(Clone, Debug, PartialEq)]
pub struct Thresholds {
    /// In the order of the names.
    limits: Vec<(&'static StateLabel, f64)>,
}

impl Thresholds {
    /// Nothing is asked for.
    pub const NONE: Self = Self { limits: Vec::new() };

    /// From thresholds of misalignment (E, N, U) \[rad\], accelerometer bias \[m/s²\] and gyroscope drift \[rad/s\]; a value
    /// of zero asks nothing of its state. One that means nothing is kept as NaN, which [`Settings::check`](super::Settings::check)
    /// refuses and no estimate reaches.
    pub fn new(misalignment_rad: [f64; 3], bias_m_s2: [f64; 3], drift_rad_s: [f64; 3]) -> Self {
        let mut thresholds = Self::NONE;
        for (names, values) in [
            (MISALIGNMENT, misalignment_rad),
            (ACCELEROMETER_BIAS, bias_m_s2),
            (GYROSCOPE_DRIFT, drift_rad_s),
        ] {
            for (name, value) in names.into_iter().zip(values) {
                if let Some(label) = model::label(name) {
                    thresholds.put(label, value);
                }
            }
        }
        thresholds
    }

    /// Asks for a one-sigma of a state \[the unit that its name ends in\] in place of what was asked of it before; nothing
    /// where it is zero.
    ///
    /// # Errors
    /// [`Error::Setting`] where no model has such a state, or the number is negative or none.
    pub fn ask(&mut self, name: &str, sigma: f64) -> Result<(), Error> {
        let label = model::label(name)
            .ok_or_else(|| Error::setting("state of a threshold", name, "the name of a state"))?;
        if sigma.is_nan() || sigma < 0.0 {
            let name = format!("threshold of {name}");
            return Err(Error::setting(name, sigma, "a number that is not negative"));
        }
        self.put(label, sigma);
        Ok(())
    }

    fn put(&mut self, label: &'static StateLabel, sigma: f64) {
        let sigma = if sigma < 0.0 { f64::NAN } else { sigma };
        let is_asked = sigma != 0.0 && sigma != f64::INFINITY;
        match self
            .limits
            .binary_search_by_key(&label.name, |(l, _)| l.name)
        {
            Ok(at) if is_asked => self.limits[at].1 = sigma,
            Ok(at) => {
                self.limits.remove(at);
            }
            Err(at) if is_asked => self.limits.insert(at, (label, sigma)),
            Err(_) => {}
        }
    }

    /// These, with those of `others` in their place where they ask for a state as well.
    #[must_use]
    pub fn replaced_by(mut self, others: &Self) -> Self {
        for (label, sigma) in others.iter() {
            self.put(label, sigma);
        }
        self
    }

    /// What is asked for: states with their one-sigmas.
    pub fn iter(&self) -> impl Iterator<Item = (&'static StateLabel, f64)> {
        self.limits.iter().copied()
    }

    /// What is asked of a state.
    pub fn of(&self, name: &str) -> Option<f64> {
        let asked = self.limits.iter().find(|(label, _)| label.name == name);
        asked.map(|(_, sigma)| *sigma)
    }

    /// How much of what is asked for is reached, 0..1: the least threshold over sigma; 1 where everything is. A state that the
    /// filter does not have is not reached at all.
    pub fn reached(&self, covariance: &NamedCovariance) -> f64 {
        let shares = self.limits.iter().map(|(label, limit)| {
            let sigma = covariance.sigma(label.name);
            // A limit that is none is never reached.
            let share = sigma.map_or(0.0, |sigma| limit / sigma);
            if share.is_nan() { 0.0 } else { share }
        });
        shares.fold(1.0, f64::min)
    }
}

impl Default for Thresholds {
    /// ε 0.002 deg/h, ∇ 10 ug, azimuth 1 arcmin.
    fn default() -> Self {
        Self::new(
            [0.0, 0.0, ARC_MINUTE],
            [10.0 * MICRO_G; 3],
            [0.002 * DEG_PER_HOUR; 3],
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn covariance(azimuth: f64, drift: f64) -> NamedCovariance {
        let states = [(MISALIGNMENT[0], 1e9), (MISALIGNMENT[2], azimuth)];
        let drifts = GYROSCOPE_DRIFT.map(|name| (name, drift));
        NamedCovariance::from_sigmas(states.into_iter().chain(drifts)).unwrap()
    }

    /// The worst state decides, states that nothing is asked of do not count, and more than everything is everything.
    #[test]
    fn the_worst_state_says_how_far_it_is() {
        let thresholds = Thresholds::new([0.0, 0.0, 2.0], [0.0; 3], [1.0; 3]);
        assert!((thresholds.reached(&covariance(4.0, 3.0)) - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(thresholds.reached(&covariance(1.0, 0.1)), 1.0);
    }

    /// A threshold that means nothing is reached by nothing, and no machine begins with it.
    #[test]
    fn what_means_nothing_is_not_reached() {
        for wrong in [f64::NAN, -1.0] {
            let thresholds = Thresholds::new([0.0, 0.0, wrong], [0.0; 3], [1.0; 3]);
            assert!(thresholds.of(MISALIGNMENT[2]).unwrap().is_nan());
            let settings = crate::machines::self_calibration::Settings {
                thresholds,
                ..Default::default()
            };
            let told = settings.check().unwrap_err().to_string();
            assert!(told.contains(MISALIGNMENT[2]), "{told}");
        }
    }

    /// Any state of any model may be asked for, by its name; what the filter does not have is not reached.
    #[test]
    fn any_state_may_be_asked_for() {
        let mut thresholds = Thresholds::new([0.0; 3], [0.0; 3], [1.0; 3]);
        assert_eq!(thresholds.reached(&covariance(4.0, 0.5)), 1.0);
        let scale = "gyroscope_scale_factor_x";
        thresholds.ask(scale, 1e-6).unwrap();
        assert_eq!(thresholds.of(scale), Some(1e-6));
        assert_eq!(thresholds.reached(&covariance(4.0, 0.5)), 0.0);
        for wrong in [f64::NAN, -1e-6] {
            let told = thresholds.ask(scale, wrong).unwrap_err().to_string();
            assert!(told.contains(scale), "{told}");
        }
        thresholds.ask(scale, 0.0).unwrap();
        assert_eq!((thresholds.of(scale), thresholds.iter().count()), (None, 3));
        let told = thresholds.ask("gyroscope_colour", 1.0).unwrap_err();
        assert!(told.to_string().contains("gyroscope_colour"), "{told}");
    }
}
