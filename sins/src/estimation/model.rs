//! A model is a list of groups. From the list come the number of states, their order, names and labels, and the filter.
//!
//! A further group is a line in a list; a further model is a list.

use nalgebra::{SMatrix, SVector};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::filter::ErrorFilter;
use super::group::{Coupling, Group, Interval, Span};
use super::groups::antenna::Antenna;
use super::groups::arms::AccelerometerArms;
use super::groups::bias::{ACCELEROMETER_BIAS, Bias, GYROSCOPE_DRIFT};
use super::groups::delay::AccelerometerDelay;
use super::groups::g_sensitivity::GyroscopeGSensitivity;
use super::groups::navigation::{MISALIGNMENT, Navigation};
use super::groups::quadratic::AccelerometerQuadratic;
use super::groups::scale::{AccelerometerMatrix, GyroscopeMatrix};
use super::groups::table::{BaseAttitude, Table};
use super::groups::vertical::Vertical;
use super::installation::Installation;
use super::kalman::Dynamics;
use super::state::{NamedCovariance, StateLabel, StateList, StateValues};
use crate::error::Error;
use crate::mechanization::strapdown::{NavigationState, Strapdown};
use crate::sensor::errors::SensorErrors;

/// Names of the nine states that calibration is about, which every model has: misalignment (E, N, U), biases, drifts (x, y, z).
pub const CALIBRATED_NAMES: [&str; 9] = [
    MISALIGNMENT[0],
    MISALIGNMENT[1],
    MISALIGNMENT[2],
    ACCELEROMETER_BIAS[0],
    ACCELEROMETER_BIAS[1],
    ACCELEROMETER_BIAS[2],
    GYROSCOPE_DRIFT[0],
    GYROSCOPE_DRIFT[1],
    GYROSCOPE_DRIFT[2],
];

/// What a filter needs of its list of groups: `M` states that move, `N` in all. The macro `model!` writes it.
pub trait Model<const M: usize, const N: usize>:
    Copy + std::fmt::Debug + PartialEq + Serialize + DeserializeOwned
{
    /// Labels of the states, in their order.
    const STATES: [StateLabel; N];
    /// The same, to be shared.
    const LIST: &'static [StateLabel; N] = &Self::STATES;
    /// Row of the vertical velocity, where a vertical channel is among the groups.
    const VELOCITY_UP: Option<usize>;
    /// Whether a group gathers changes of rate and specific force.
    const FOLLOWS_CHANGES: bool;
    /// Where the table's errors begin, where they are among the groups.
    const TABLE: Option<usize>;
    /// Where the attitude of the table's base begins, where it is among the groups.
    const BASE: Option<usize>;
    /// Where the antenna's arm begins, where it is among the groups.
    const ANTENNA: Option<usize>;
    /// What the groups gather.
    type Gathered: Copy + Default + std::fmt::Debug + Serialize + DeserializeOwned;

    /// One-sigma of all states before anything is measured.
    fn prior(&self, place: &NavigationState) -> SVector<f64, N>;
    /// Variance that the states gain a second by walking.
    fn walk(&self) -> SVector<f64, N>;
    /// Gathers one sampling interval.
    fn gather(gathered: &mut Self::Gathered, span: &Span);
    /// A = ∫F dt over the time since the last step.
    fn dynamics(&self, gathered: &Self::Gathered, interval: &Interval) -> Dynamics<M, N>;
    /// Takes errors out of the mechanization.
    fn correct_navigation(x: &SVector<f64, N>, strapdown: &mut Strapdown);
    /// Takes errors into the sensor model.
    fn correct_sensors(x: &SVector<f64, N>, errors: &mut SensorErrors);
    /// What the sensor model and the installation hold of the states; zero in the navigation and in the base's attitude.
    fn found(errors: &SensorErrors, installation: &Installation) -> SVector<f64, N>;
    /// Takes errors into what has been found of table, base and antenna.
    fn correct_installation(x: &SVector<f64, N>, installation: &mut Installation);

    /// Where a state stands.
    fn position(name: &str) -> Option<usize> {
        Self::STATES.iter().position(|state| state.name == name)
    }

    /// Whether a state of this name moves; the others are parameters of the sensors, which stand still or walk.
    fn is_moving(name: &str) -> bool {
        Self::STATES[..M].iter().any(|state| state.name == name)
    }

    /// The diagonal P0 at a place.
    fn initial_covariance(&self, place: &NavigationState) -> SMatrix<f64, N, N> {
        let sigma = self.prior(place);
        SMatrix::from_diagonal(&sigma.component_mul(&sigma))
    }

    /// One-sigma of all states before anything is measured, with their names.
    fn named_prior(&self, place: &NavigationState) -> StateValues {
        StateValues::of(Self::LIST, &self.prior(place))
    }

    /// A covariance over this model's states with their names.
    ///
    /// # Errors
    /// As [`NamedCovariance::new`].
    fn named(covariance: &SMatrix<f64, N, N>) -> Result<NamedCovariance, Error> {
        NamedCovariance::new(
            StateList::labels(Self::LIST),
            nalgebra::DMatrix::from_column_slice(N, N, covariance.as_slice()),
        )
    }

    /// What is known by name, in this model's order: a state that is not named keeps its prior, and a name that is none of
    /// this model's states is left aside.
    fn covariance_of(
        &self,
        known: &NamedCovariance,
        place: &NavigationState,
    ) -> SMatrix<f64, N, N> {
        Self::arranged(known, &self.initial_covariance(place))
    }

    /// What is known by name, in this model's order, and where a name is missing what `otherwise` says.
    fn arranged(known: &NamedCovariance, otherwise: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
        let positions = Self::STATES.map(|state| known.position(state.name));
        SMatrix::from_fn(|row, column| match (positions[row], positions[column]) {
            (Some(i), Some(j)) => known.matrix()[(i, j)],
            _ => otherwise[(row, column)],
        })
    }
}

/// Labels of groups, one after the other.
const fn join<const N: usize>(groups: &[&'static [StateLabel]]) -> [StateLabel; N] {
    let mut all = [StateLabel::new("", "", "", "", 1.0); N];
    let (mut group, mut next) = (0, 0);
    while group < groups.len() {
        let mut state = 0;
        while state < groups[group].len() {
            all[next] = groups[group][state];
            next += 1;
            state += 1;
        }
        group += 1;
    }
    all
}

/// Where the group begins that is the one, of groups with their sizes.
const fn first_of(groups: &[(bool, usize)]) -> Option<usize> {
    let (mut group, mut first) = (0, 0);
    while group < groups.len() {
        let (is_it, size) = groups[group];
        if is_it {
            return Some(first);
        }
        first += size;
        group += 1;
    }
    None
}

/// Writes a model: its struct with a field for every group's settings, the numbers `M` and `N`, the type of its filter, and
/// its [`Model`].
macro_rules! model {
    (
        $(#[$about:meta])*
        $model:ident, gathers $gathered:ident, filter $filter:ident:
        moving { $($moving:ident: $moving_group:ty),+ $(,)? }
        parameters { $($group:ident: $group_type:ty),* $(,)? }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        pub struct $model {
            $(#[doc = concat!("Settings of the group `", stringify!($moving_group), "`.")] pub $moving: $moving_group,)+
            $(#[doc = concat!("Settings of the group `", stringify!($group_type), "`.")] pub $group: $group_type,)*
        }

        #[doc = concat!("What the groups of [`", stringify!($model), "`] gather between two covariance steps.")]
        #[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
        pub struct $gathered {
            $($moving: <$moving_group as Group>::Gathered,)+
            $($group: <$group_type as Group>::Gathered,)*
        }

        #[doc = concat!("The filter of [`", stringify!($model), "`].")]
        pub type $filter = ErrorFilter<$model, { $model::M }, { $model::N }>;

        impl $model {
            /// Number of states that move.
            pub const M: usize = 0 $(+ <$moving_group as Group>::SIZE)+;
            /// Number of states.
            pub const N: usize = Self::M $(+ <$group_type as Group>::SIZE)*;
        }

        impl Model<{ $model::M }, { $model::N }> for $model {
            const STATES: [StateLabel; { $model::N }] = join(&[
                $(<$moving_group as Group>::LABELS,)+
                $(<$group_type as Group>::LABELS,)*
            ]);
            const VELOCITY_UP: Option<usize> = {
                let (mut first, mut up) = (0, None);
                $(
                    if let Some(local) = <$moving_group as Group>::VELOCITY_UP {
                        up = Some(first + local);
                    }
                    first += <$moving_group as Group>::SIZE;
                )+
                assert!(first == $model::M, "rows of the moving groups");
                up
            };
            const FOLLOWS_CHANGES: bool =
                false $(|| <$moving_group as Group>::FOLLOWS_CHANGES)+ $(|| <$group_type as Group>::FOLLOWS_CHANGES)*;
            const TABLE: Option<usize> = first_of(&[
                $((<$moving_group as Group>::OF_TABLE, <$moving_group as Group>::SIZE),)+
                $((<$group_type as Group>::OF_TABLE, <$group_type as Group>::SIZE),)*
            ]);
            const BASE: Option<usize> = first_of(&[
                $((<$moving_group as Group>::OF_BASE, <$moving_group as Group>::SIZE),)+
                $((<$group_type as Group>::OF_BASE, <$group_type as Group>::SIZE),)*
            ]);
            const ANTENNA: Option<usize> = first_of(&[
                $((<$moving_group as Group>::OF_ANTENNA, <$moving_group as Group>::SIZE),)+
                $((<$group_type as Group>::OF_ANTENNA, <$group_type as Group>::SIZE),)*
            ]);
            type Gathered = $gathered;

            fn prior(&self, place: &NavigationState) -> SVector<f64, { $model::N }> {
                let mut sigma = SVector::<f64, { $model::N }>::zeros();
                let (rest, _) = sigma.as_mut_slice().split_at_mut($model::N);
                $(let (own, rest) = rest.split_at_mut(<$moving_group as Group>::SIZE); self.$moving.prior(place, own);)+
                $(let (own, rest) = rest.split_at_mut(<$group_type as Group>::SIZE); self.$group.prior(place, own);)*
                let _ = rest;
                sigma
            }

            fn walk(&self) -> SVector<f64, { $model::N }> {
                let mut rate = SVector::<f64, { $model::N }>::zeros();
                let (rest, _) = rate.as_mut_slice().split_at_mut($model::N);
                $(let (own, rest) = rest.split_at_mut(<$moving_group as Group>::SIZE); self.$moving.walk(own);)+
                $(let (own, rest) = rest.split_at_mut(<$group_type as Group>::SIZE); self.$group.walk(own);)*
                let _ = rest;
                rate
            }

            #[inline]
            fn gather(gathered: &mut $gathered, span: &Span) {
                $(<$moving_group as Group>::gather(&mut gathered.$moving, span);)+
                $(<$group_type as Group>::gather(&mut gathered.$group, span);)*
            }

            fn dynamics(
                &self,
                gathered: &$gathered,
                interval: &Interval,
            ) -> Dynamics<{ $model::M }, { $model::N }> {
                let mut dynamics = Dynamics::<{ $model::M }, { $model::N }>::zeros();
                let (rows, decay) = (dynamics.rows.as_mut_slice(), dynamics.decay.as_mut_slice());
                let first = 0;
                let up = <Self as Model<{ $model::M }, { $model::N }>>::VELOCITY_UP;
                $(
                    self.$moving.couple(&gathered.$moving, interval, &mut Coupling::new(rows, decay, first, up));
                    let first = first + <$moving_group as Group>::SIZE;
                )+
                $(
                    self.$group.couple(&gathered.$group, interval, &mut Coupling::new(rows, decay, first, up));
                    let first = first + <$group_type as Group>::SIZE;
                )*
                let _ = first;
                dynamics
            }

            fn correct_navigation(x: &SVector<f64, { $model::N }>, strapdown: &mut Strapdown) {
                let rest = x.as_slice();
                $(let (own, rest) = rest.split_at(<$moving_group as Group>::SIZE); <$moving_group as Group>::correct_navigation(own, strapdown);)+
                $(let (own, rest) = rest.split_at(<$group_type as Group>::SIZE); <$group_type as Group>::correct_navigation(own, strapdown);)*
                let _ = rest;
            }

            fn correct_sensors(x: &SVector<f64, { $model::N }>, errors: &mut SensorErrors) {
                let rest = x.as_slice();
                $(let (own, rest) = rest.split_at(<$moving_group as Group>::SIZE); <$moving_group as Group>::correct_sensors(own, errors);)+
                $(let (own, rest) = rest.split_at(<$group_type as Group>::SIZE); <$group_type as Group>::correct_sensors(own, errors);)*
                let _ = rest;
            }

            fn correct_installation(x: &SVector<f64, { $model::N }>, installation: &mut Installation) {
                let rest = x.as_slice();
                $(let (own, rest) = rest.split_at(<$moving_group as Group>::SIZE); <$moving_group as Group>::correct_installation(own, installation);)+
                $(let (own, rest) = rest.split_at(<$group_type as Group>::SIZE); <$group_type as Group>::correct_installation(own, installation);)*
                let _ = rest;
            }

            fn found(errors: &SensorErrors, installation: &Installation) -> SVector<f64, { $model::N }> {
                let mut x = SVector::<f64, { $model::N }>::zeros();
                let (rest, _) = x.as_mut_slice().split_at_mut($model::N);
                $(let (own, rest) = rest.split_at_mut(<$moving_group as Group>::SIZE); <$moving_group as Group>::found(errors, own); <$moving_group as Group>::found_of_installation(installation, own);)+
                $(let (own, rest) = rest.split_at_mut(<$group_type as Group>::SIZE); <$group_type as Group>::found(errors, own); <$group_type as Group>::found_of_installation(installation, own);)*
                let _ = rest;
                x
            }
        }
    };
}

model! {
    /// The paper's thirteen states: navigation, accelerometer biases, gyroscope drifts.
    Paper, gathers PaperGathered, filter PaperFilter:
    moving { navigation: Navigation }
    parameters { bias: Bias }
}

model! {
    /// The thirteen with scale factors and installation angles of both kinds of sensor: 28.
    Matrices, gathers MatricesGathered, filter MatricesFilter:
    moving { navigation: Navigation }
    parameters { bias: Bias, gyroscope_matrix: GyroscopeMatrix, accelerometer_matrix: AccelerometerMatrix }
}

model! {
    /// The whole sensor on the whole table, and the antenna: 60 states.
    Whole, gathers WholeGathered, filter WholeFilter:
    moving { navigation: Navigation, vertical: Vertical }
    parameters {
        bias: Bias,
        gyroscope_matrix: GyroscopeMatrix,
        accelerometer_matrix: AccelerometerMatrix,
        quadratic: AccelerometerQuadratic,
        arms: AccelerometerArms,
        g_sensitivity: GyroscopeGSensitivity,
        delay: AccelerometerDelay,
        table: Table,
        antenna: Antenna,
        base: BaseAttitude,
    }
}

model! {
    /// The whole sensor for free-inertial navigation: no vertical channel, which diverges by itself, and no table: 44.
    Inertial, gathers InertialGathered, filter InertialFilter:
    moving { navigation: Navigation }
    parameters {
        bias: Bias,
        gyroscope_matrix: GyroscopeMatrix,
        accelerometer_matrix: AccelerometerMatrix,
        quadratic: AccelerometerQuadratic,
        arms: AccelerometerArms,
        g_sensitivity: GyroscopeGSensitivity,
        delay: AccelerometerDelay,
    }
}

impl From<Whole> for Inertial {
    fn from(whole: Whole) -> Self {
        Self {
            navigation: whole.navigation,
            bias: whole.bias,
            gyroscope_matrix: whole.gyroscope_matrix,
            accelerometer_matrix: whole.accelerometer_matrix,
            quadratic: whole.quadratic,
            arms: whole.arms,
            g_sensitivity: whole.g_sensitivity,
            delay: whole.delay,
        }
    }
}

/// The label of a state that any group here has, by its name.
pub fn label(name: &str) -> Option<&'static StateLabel> {
    labels().iter().find(|state| state.name == name)
}

/// The labels of all states that any group here has.
pub fn labels() -> &'static [StateLabel] {
    const ALL: [StateLabel; Whole::N] = Whole::STATES;
    static KNOWN: [StateLabel; Whole::N] = ALL;
    &KNOWN
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::estimation::column_test::{Example, place};

    /// The paper's states are the thirteen of files and messages, in their order; the bigger model goes on where they end.
    #[test]
    fn states_come_from_the_list() {
        assert_eq!(
            (Paper::M, Paper::N, Matrices::M, Matrices::N),
            (7, 13, 7, 28)
        );
        let names = Paper::STATES.map(|state| state.name);
        assert_eq!(names[0], "latitude_error_rad");
        assert_eq!(names[6], "misalignment_up_rad");
        assert_eq!(names[7], "accelerometer_bias_x_m_s2");
        assert_eq!(names[12], "gyroscope_drift_z_rad_s");
        assert_eq!(Matrices::STATES[..13], Paper::STATES);
        assert_eq!(
            Matrices::position("accelerometer_installation_zy_rad"),
            Some(27)
        );
        assert_eq!(label("gyroscope_scale_factor_y").unwrap().unit, "ppm");
        assert!(label("gyroscope_colour").is_none());
    }

    /// A covariance goes from one model to the other by names: what both have stays, what the other does not have is its
    /// prior or left aside.
    #[test]
    fn covariances_go_by_name() {
        let (paper, matrices) = (Paper::example(), Matrices::example());
        let whole = matrices.initial_covariance(&place()) * 0.25;
        let named = Matrices::named(&whole).unwrap();
        let less = paper.covariance_of(&named, &place());
        assert_eq!(less, whole.fixed_view::<13, 13>(0, 0).into_owned());
        let back = matrices.covariance_of(&Paper::named(&less).unwrap(), &place());
        assert_eq!(back[(12, 12)], whole[(12, 12)]);
        assert_eq!(
            back[(20, 20)],
            matrices.initial_covariance(&place())[(20, 20)]
        );
    }
}
