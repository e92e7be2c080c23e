//! A ship in the sea: what the simulator gives of her is held against the inertial frame, and the mechanization against the simulator.
#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use sins::earth::frames::map_in_earth;
use sins::earth::{EARTH_RATE_RAD_S, LocalEarth, Position};
use sins::mechanization::strapdown::{NavigationState, Strapdown};
use sins::sensor::Increment;
use sins::simulation::{
    Course, MotionSettings, Plant, PlantSettings, Ship, ShipMotion, ShipState, Swing, WaveSystem,
};
use sins::table::{Joint, Trajectory};

fn waves(significant_height_m: f64) -> MotionSettings {
    MotionSettings {
        sea: WaveSystem {
            significant_height_m,
            ..WaveSystem::WIND_SEA
        },
        swell: WaveSystem {
            significant_height_m: 0.5 * significant_height_m,
            ..WaveSystem::SWELL
        },
        table_arm_m: Vector3::new(3.0, -15.0, 5.0),
        ..MotionSettings::default()
    }
}

fn moored() -> MotionSettings {
    MotionSettings {
        swing: Swing {
            amplitude_rad: 0.1,
            ..Swing::default()
        },
        ..waves(0.5)
    }
}

fn under_way() -> MotionSettings {
    MotionSettings {
        course: Course {
            speed_m_s: 9.0,
            start_s: 60.0,
            leg_s: 300.0,
            ..Course::default()
        },
        ..waves(2.0)
    }
}

fn position(state: &ShipState) -> Position {
    Position {
        latitude_rad: state.latitude_rad,
        longitude_rad: state.longitude_rad,
        height_m: state.height_m,
    }
}

/// Position and attitude against inertial space, from place and attitude alone.
fn inertial(motion: &ShipMotion, t: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let state = motion.at(t);
    let map = map_in_earth(&position(&state));
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), EARTH_RATE_RAD_S * t);
    (turn * map.translation, turn * map.rotation * state.attitude)
}

/// Rate and specific force are those of the place and the attitude differentiated in the inertial frame, where no radius, no transport
/// rate and no Coriolis term stands; moored and under way, with gravitation as gravity without its centrifugal part.
#[test]
fn a_ship_feels_what_the_inertial_frame_says() {
    for (settings, latitude_deg) in [
        (moored(), 45.78f64),
        (under_way(), 45.78),
        (under_way(), -69.0),
    ] {
        let ship = Ship {
            latitude_rad: latitude_deg.to_radians(),
            longitude_rad: 0.3,
            heading_rad: 0.7,
            ..Ship::default()
        };
        let motion = ShipMotion::new(ship, settings, 11).unwrap();
        for t in [3.0, 80.0, 1300.5] {
            let state = motion.at(t);
            let (here, attitude) = inertial(&motion, t);
            // Eighth order: a metre of 6.4e6 has lost a nanometre to rounding, and waves change within half a second.
            let h = 0.03;
            let at = |k: f64| inertial(&motion, t + k * h).0 - here;
            let acceleration = (1.6 * (at(1.0) + at(-1.0)) - 0.2 * (at(2.0) + at(-2.0))
                + 8.0 / 315.0 * (at(3.0) + at(-3.0))
                - 1.0 / 560.0 * (at(4.0) + at(-4.0)))
                / (h * h);
            let earth = LocalEarth::at(state.latitude_rad, state.height_m);
            let up = attitude * (state.attitude.inverse() * Vector3::z());
            let axis = Vector3::z() * EARTH_RATE_RAD_S;
            let gravitation = -up * earth.gravity_m_s2 + axis.cross(&axis.cross(&here));
            let force = attitude.inverse() * (acceleration - gravitation);
            let off = (force - state.specific_force).norm();
            assert!(off < 2e-5, "{latitude_deg}, {t} s: {off} m/s²");
            let h = 0.003;
            let turn = |k: f64| {
                let [before, after] = [-k, k].map(|k| inertial(&motion, t + k * h).1);
                ((attitude.inverse() * after).scaled_axis()
                    - (attitude.inverse() * before).scaled_axis())
                    / (2.0 * k * h)
            };
            let rate = 1.5 * turn(1.0) - 0.6 * turn(2.0) + 0.1 * turn(3.0);
            let off = (rate - state.angular_rate).norm();
            assert!(off < 1e-8, "{latitude_deg}, {t} s: {off} rad/s");
        }
    }
}

/// Horizontal position \[m\] and attitude error \[rad\] of the mechanization after an hour of samples, while the table turns.
fn mechanized(settings: MotionSettings, rate_hz: f64) -> (f64, f64) {
    let ship = Ship {
        heading_rad: 0.7,
        ..Ship::default()
    };
    let mut plant = Plant::new(PlantSettings {
        ship,
        motion: settings,
        imu_rate_hz: rate_hz,
        ..PlantSettings::default()
    })
    .unwrap();
    let start = plant.ship();
    let mut strapdown = Strapdown::new(NavigationState {
        attitude: plant.attitude(),
        velocity: start.velocity,
        position: position(start),
    });
    let (mut position_m, mut attitude_rad) = (0.0f64, 0.0f64);
    for step in 0..(3600.0 * rate_hz) as u32 {
        if step % (600.0 * rate_hz) as u32 == 0 {
            let turn = Trajectory::trapezoid(
                [Joint::Outer, Joint::Inner][(step % 2) as usize],
                plant.joints().position,
                3.0,
                5f64.to_radians(),
                2.5f64.to_radians(),
            );
            plant.command(None, &turn.unwrap()).unwrap();
        }
        let truth = plant.step();
        strapdown.propagate(&Increment::from_averages(
            truth.interval_nanos as f64 * 1e-9,
            &truth.angular_rate,
            &truth.specific_force,
        ));
        let (now, ship) = (strapdown.state(), plant.ship());
        position_m = position_m.max(position(ship).offset_m(&now.position).xy().norm());
        attitude_rad = attitude_rad.max(now.attitude.angle_to(&plant.attitude()));
    }
    (position_m, attitude_rad)
}

/// The samples of a ship in the sea, moored and under way, mechanize back to her truth. What is left falls with the square of the interval
/// and more, as coning and sculling do.
#[test]
fn samples_in_the_sea_mechanize_back() {
    for (name, settings) in [("moored", moored()), ("under way", under_way())] {
        let (position_m, attitude_rad) = mechanized(settings, 50.0);
        let (coarse_m, coarse_rad) = mechanized(settings, 10.0);
        println!(
            "{name}: {position_m} m, {attitude_rad} rad; at 10 Hz {coarse_m} m, {coarse_rad} rad"
        );
        assert!(position_m < 0.05, "{name}: {position_m} m");
        assert!(attitude_rad < 2e-8, "{name}: {attitude_rad} rad");
    }
}

/// The level frame that heads and rolls with the ship: in a calm the table's centre lies where the ship is said to be, however long its arm.
#[test]
fn the_table_lies_where_the_ship_is_said_to_be() {
    let motion = ShipMotion::new(Ship::default(), waves(0.4), 2).unwrap();
    let ship = Ship::default().at(0.0);
    let n = 4000;
    let mean: Vector3<f64> = (0..n)
        .map(|k| position(&ship).offset_m(&position(&motion.at(1.7 * f64::from(k)))))
        .sum::<Vector3<f64>>()
        / f64::from(n);
    assert!(mean.norm() < 0.02, "{mean}");
    let turned: Matrix3<f64> = motion.at(5.0).attitude.to_rotation_matrix().into_inner();
    assert!((turned.determinant() - 1.0).abs() < 1e-12);
}
