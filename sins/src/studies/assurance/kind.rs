//! Kinds of worlds: every one a name, what is in it, which model holds it, and how it is drawn.

use nalgebra::{Matrix3, Vector3};

use super::draw::Draw;
use super::world::{World, swapped};
use crate::estimation::grade::Grade;
use crate::machines::self_calibration::{ModelChoice, Reference, Settings, Thresholds};
use crate::simulation::{
    AidingSettings, EncoderSettings, ImuErrorSettings, NoiseReading, PlantSettings, SensorGrade,
    Ship, SimulatorSettings, WaveSystem,
};
use crate::table::Turntable;
use crate::table::scheme::Scheme;
use crate::units::{ARC_SECOND, DEG_PER_HOUR, DEG_PER_HOUR_PER_G, MICRO_G, MICRO_G_PER_G2, PPM};

/// Which models hold a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inside {
    /// The paper's thirteen states and the whole model.
    Both,
    /// The whole model alone.
    Whole,
    /// Neither.
    Neither,
}

impl Inside {
    /// Whether the model holds it.
    pub fn holds(self, model: ModelChoice) -> bool {
        self == Self::Both || (self == Self::Whole && model == ModelChoice::Whole)
    }
}

/// A kind of worlds.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// Which models hold it.
    pub inside: Inside,
    /// Makes a world of the kind from a plain one.
    change: fn(&mut World, &mut Draw),
}

/// Samples a second: a fault of the model shows at 10 Hz as at 100.
const RATE_HZ: f64 = 10.0;

impl Kind {
    /// World number `world` of a seed.
    pub fn draw(&self, seed: u64, world: u64, model: ModelChoice) -> World {
        let mut draw = Draw::new(seed, world);
        let mut drawn = plain(&mut draw);
        (self.change)(&mut drawn, &mut draw);
        drawn.calibration.model = model;
        drawn
    }
}

/// A world inside every model: drifts and biases as large as the priors say, any heading, any latitude up to 65 deg, either order of
/// the joints.
fn plain(draw: &mut Draw) -> World {
    let scheme = Scheme::eight_position();
    let turntable = if draw.within(0.0, 1.0) < 0.7 {
        Turntable::default()
    } else {
        swapped(Turntable::default())
    };
    let mut imu = ImuErrorSettings::default();
    imu.errors.gyroscope_drift = draw.vector(0.01 * DEG_PER_HOUR);
    imu.errors.accelerometer_bias = draw.vector(100.0 * MICRO_G);
    let latitude_deg = draw.within(5.0, 65.0);
    let ship = Ship {
        latitude_rad: draw.signed(latitude_deg.to_radians()),
        heading_rad: draw.within(0.0, 360.0).to_radians(),
        roll_rad: draw.normal(0.01),
        pitch_rad: draw.normal(0.01),
        ..Ship::default()
    };
    World {
        simulator: SimulatorSettings {
            plant: PlantSettings {
                ship,
                turntable,
                imu_rate_hz: RATE_HZ,
                ..PlantSettings::default()
            },
            imu,
            encoder: EncoderSettings {
                position_std_rad: 3.0 * ARC_SECOND,
                ..EncoderSettings::default()
            },
            joint_state_rate_hz: RATE_HZ,
            aiding: AidingSettings::default(),
            seed: draw.seed(),
        },
        scheme,
        duration_s: 4.0 * 3600.0,
        calibration: Settings {
            turntable,
            ..Settings::default()
        },
        fix_error_rad: [0.0; 2],
        encoder_scale: [1.0; 2],
    }
}

fn grade(world: &mut World, draw: &mut Draw, grade: SensorGrade) {
    world.calibration.coarse_residual_limit_m_s = 30.0;
    let drawn = grade.draw(draw.seed());
    world.simulator.imu = drawn.imu;
    world.simulator.encoder = drawn.encoder;
    world.simulator.plant.table_errors = drawn.table;
}

fn gyroscope_scale(world: &mut World, draw: &mut Draw, ppm: f64) {
    world.simulator.imu.errors.gyroscope_matrix = Matrix3::from_diagonal(&draw.signs(ppm * PPM));
}

fn stated(world: &mut World, ratio: f64) {
    world.simulator.imu.output.stated_variance_ratio = ratio;
}

fn priors(world: &mut World, drift_deg_h: f64, bias_ug: f64) {
    let prior = &mut world.calibration.prior;
    prior.gyroscope_drift_rad_s = Vector3::repeat(drift_deg_h * DEG_PER_HOUR);
    prior.accelerometer_bias_m_s2 = Vector3::repeat(bias_ug * MICRO_G);
}

/// Thresholds that any sensor reaches.
fn loose(world: &mut World, azimuth_deg: f64, bias_ug: f64, drift_deg_h: f64) {
    world.calibration.thresholds = Thresholds::new(
        [0.0, 0.0, azimuth_deg.to_radians()],
        [bias_ug * MICRO_G; 3],
        [drift_deg_h * DEG_PER_HOUR; 3],
    );
}

const PER_ROOT_HOUR: f64 = 1.0 / 60.0;

/// All kinds.
pub const KINDS: &[Kind] = &[
    Kind {
        name: "drift and bias alone",
        inside: Inside::Both,
        change: |_, _| {},
    },
    Kind {
        name: "latitude 65 to 80 deg",
        inside: Inside::Both,
        change: |w, d| {
            let latitude = d.within(65.0, 80.0).to_radians();
            w.simulator.plant.ship.latitude_rad = d.signed(latitude);
        },
    },
    Kind {
        name: "quiet gyroscopes (H)",
        inside: Inside::Both,
        change: |w, _| w.simulator.imu.noise = NoiseReading::H.density(),
    },
    Kind {
        name: "velocity measured, 1 cm/s",
        inside: Inside::Both,
        change: |w, _| w.calibration.reference = Reference::Measured { patience_s: 1.0 },
    },
    Kind {
        name: "two hours",
        inside: Inside::Both,
        change: |w, d| w.duration_s = d.within(1.5, 2.5) * 3600.0,
    },
    Kind {
        name: "samples in counts",
        inside: Inside::Both,
        change: |w, d| {
            w.simulator.imu.output.angle_count_rad = d.log_within(0.05, 1.0) * ARC_SECOND;
            w.simulator.imu.output.velocity_count_m_s = d.log_within(1e-5, 3e-4);
        },
    },
    Kind {
        name: "gyroscope scale 1 to 3 ppm",
        inside: Inside::Whole,
        change: |w, d| {
            let ppm = d.within(1.0, 3.0);
            gyroscope_scale(w, d, ppm);
        },
    },
    Kind {
        name: "gyroscope scale 3 ppm",
        inside: Inside::Whole,
        change: |w, d| gyroscope_scale(w, d, 3.0),
    },
    Kind {
        name: "gyroscope scale 10 ppm",
        inside: Inside::Whole,
        change: |w, d| gyroscope_scale(w, d, 10.0),
    },
    Kind {
        name: "gyroscope scale 50 ppm",
        inside: Inside::Whole,
        change: |w, d| gyroscope_scale(w, d, 50.0),
    },
    Kind {
        name: "gyroscope scale 200 ppm",
        inside: Inside::Neither,
        change: |w, d| gyroscope_scale(w, d, 200.0),
    },
    Kind {
        name: "ring laser",
        inside: Inside::Whole,
        change: |w, d| grade(w, d, SensorGrade::RingLaser),
    },
    Kind {
        name: "fibre optic",
        inside: Inside::Whole,
        change: |w, d| grade(w, d, SensorGrade::FibreOptic),
    },
    Kind {
        name: "fibre optic, thresholds of its grade",
        inside: Inside::Whole,
        change: |w, d| {
            grade(w, d, SensorGrade::FibreOptic);
            loose(w, 0.5, 30.0, 0.1);
        },
    },
    Kind {
        name: "MEMS, thresholds of its grade",
        // Its azimuth is uncertain by 8 deg and more when the loop closes: no linear filter holds that.
        inside: Inside::Neither,
        change: |w, d| {
            grade(w, d, SensorGrade::Mems);
            w.calibration.grade = Some(Grade::Mems);
            loose(w, 10.0, 300.0, 1.0);
        },
    },
    Kind {
        name: "MEMS, thresholds looser than its priors",
        inside: Inside::Neither,
        change: |w, d| {
            grade(w, d, SensorGrade::Mems);
            w.calibration.grade = Some(Grade::Mems);
            loose(w, 90.0, 1e5, 1e3);
        },
    },
    Kind {
        name: "thresholds looser than the priors, one turn",
        inside: Inside::Neither,
        change: |w, d| {
            loose(w, 20.0, 200.0, 0.02);
            w.duration_s = d.within(600.0, 1500.0);
            priors(w, 0.01, 100.0);
            w.simulator.imu.errors.gyroscope_drift = d.signs(0.1 * DEG_PER_HOUR);
        },
    },
    Kind {
        name: "gyroscope installation 2 arcsec",
        inside: Inside::Whole,
        change: |w, d| w.simulator.imu.errors.gyroscope_matrix = d.off_diagonal(2.0 * ARC_SECOND),
    },
    Kind {
        name: "installation 10 arcsec",
        inside: Inside::Whole,
        change: |w, d| {
            let errors = &mut w.simulator.imu.errors;
            errors.gyroscope_matrix = d.off_diagonal(10.0 * ARC_SECOND);
            errors.accelerometer_matrix = d.off_diagonal(10.0 * ARC_SECOND).lower_triangle();
        },
    },
    Kind {
        name: "accelerometer scale 30 ppm",
        inside: Inside::Whole,
        change: |w, d| {
            w.simulator.imu.errors.accelerometer_matrix =
                Matrix3::from_diagonal(&d.signs(30.0 * PPM));
        },
    },
    Kind {
        name: "accelerometer squares 5 ug/g2",
        inside: Inside::Whole,
        change: |w, d| {
            w.simulator.imu.errors.accelerometer_quadratic = d.signs(5.0 * MICRO_G_PER_G2);
        },
    },
    Kind {
        name: "accelerometers 25 mm apart",
        inside: Inside::Whole,
        change: |w, d| {
            w.simulator.imu.errors.accelerometer_arms = Matrix3::from_diagonal(&d.signs(0.025));
        },
    },
    Kind {
        name: "accelerometers 0.3 ms late",
        inside: Inside::Whole,
        change: |w, _| w.simulator.imu.errors.accelerometer_delay_s = 0.3e-3,
    },
    Kind {
        name: "accelerometers 2 ms late",
        inside: Inside::Neither,
        change: |w, _| w.simulator.imu.errors.accelerometer_delay_s = 2e-3,
    },
    Kind {
        name: "g-sensitivity 0.003 deg/h/g",
        inside: Inside::Whole,
        change: |w, d| {
            w.simulator.imu.errors.gyroscope_g_sensitivity =
                Matrix3::from_diagonal(&d.signs(0.003 * DEG_PER_HOUR_PER_G));
        },
    },
    Kind {
        name: "g-sensitivity 0.01 deg/h/g",
        inside: Inside::Neither,
        change: |w, d| {
            w.simulator.imu.errors.gyroscope_g_sensitivity =
                Matrix3::from_diagonal(&d.signs(0.01 * DEG_PER_HOUR_PER_G));
        },
    },
    Kind {
        name: "biases grow 5 ug/h",
        inside: Inside::Neither,
        change: |w, d| {
            w.simulator.imu.wandering.accelerometer_trend = d.signs(5.0 * MICRO_G / 3600.0);
        },
    },
    Kind {
        name: "drifts grow 1e-3 deg/h/h",
        inside: Inside::Neither,
        change: |w, d| {
            w.simulator.imu.wandering.gyroscope_trend = d.signs(1e-3 * DEG_PER_HOUR / 3600.0);
        },
    },
    Kind {
        name: "walks 1e-3 deg/h/rt-h, 3 ug/rt-h",
        inside: Inside::Neither,
        change: |w, _| {
            let wandering = &mut w.simulator.imu.wandering;
            wandering.gyroscope_walk = Vector3::repeat(1e-3 * DEG_PER_HOUR * PER_ROOT_HOUR);
            wandering.accelerometer_walk = Vector3::repeat(3.0 * MICRO_G * PER_ROOT_HOUR);
        },
    },
    Kind {
        name: "warming up",
        inside: Inside::Neither,
        change: |w, d| {
            let wandering = &mut w.simulator.imu.wandering;
            wandering.warm_up_s = d.within(1000.0, 6000.0);
            wandering.gyroscope_warm_up = d.signs(0.02 * DEG_PER_HOUR);
            wandering.accelerometer_warm_up = d.signs(50.0 * MICRO_G);
            wandering.gyroscope_scale_warm_up = d.signs(5.0 * PPM);
            wandering.accelerometer_scale_warm_up = d.signs(30.0 * PPM);
        },
    },
    Kind {
        name: "gyroscope asymmetry 5 ppm",
        inside: Inside::Neither,
        change: |w, d| w.simulator.imu.gyroscope_asymmetry = d.signs(5.0 * PPM),
    },
    Kind {
        name: "table bends 3 arcsec/g",
        inside: Inside::Neither,
        change: |w, d| w.simulator.plant.flexing_rad_per_g = d.signs(3.0 * ARC_SECOND),
    },
    Kind {
        name: "stamps jittered by 2 ms",
        inside: Inside::Neither,
        change: |w, _| w.simulator.imu.output.stamp_jitter_s = 2e-3,
    },
    Kind {
        name: "covariances 3 times too small",
        inside: Inside::Neither,
        change: |w, _| stated(w, 1.0 / 9.0),
    },
    Kind {
        name: "covariances 10 times too small",
        inside: Inside::Neither,
        change: |w, _| stated(w, 0.01),
    },
    Kind {
        name: "no covariances, 3 times the noise",
        inside: Inside::Neither,
        change: |w, _| {
            let noise = &mut w.simulator.imu.noise;
            noise.gyroscope *= 3.0;
            noise.accelerometer *= 3.0;
            stated(w, 0.0);
        },
    },
    Kind {
        name: "fix wrong by 0.1 deg",
        inside: Inside::Neither,
        change: |w, d| w.fix_error_rad = [d.signed(0.1f64.to_radians()), 0.0],
    },
    Kind {
        name: "0.5 deg/h and 300 ug, priors say so",
        inside: Inside::Both,
        change: |w, d| {
            priors(w, 0.5, 300.0);
            w.simulator.imu.errors.gyroscope_drift = d.vector(0.5 * DEG_PER_HOUR);
            w.simulator.imu.errors.accelerometer_bias = d.vector(300.0 * MICRO_G);
        },
    },
    Kind {
        name: "1 deg/h, priors of a ring laser",
        inside: Inside::Neither,
        change: |w, d| {
            w.simulator.imu.errors.gyroscope_drift = d.signs(1.0 * DEG_PER_HOUR);
            w.simulator.imu.errors.accelerometer_bias = d.signs(500.0 * MICRO_G);
        },
    },
    Kind {
        name: "0.06 deg/h, priors of 0.01",
        inside: Inside::Neither,
        change: |w, d| w.simulator.imu.errors.gyroscope_drift = d.signs(0.06 * DEG_PER_HOUR),
    },
    Kind {
        name: "sea of 3 cm, zero velocity",
        inside: Inside::Neither,
        change: |w, d| sea(w, d, 0.03),
    },
    Kind {
        name: "sea of 0.3 m, zero velocity",
        inside: Inside::Neither,
        change: |w, d| sea(w, d, 0.3),
    },
    Kind {
        name: "order of the joints told wrong",
        inside: Inside::Neither,
        change: |w, _| w.calibration.turntable = swapped(w.calibration.turntable),
    },
    Kind {
        name: "a joint told with the wrong sign",
        inside: Inside::Neither,
        change: |w, d| w.encoder_scale[usize::from(d.coin())] = -1.0,
    },
    Kind {
        name: "a joint told 0.1 % too large",
        inside: Inside::Neither,
        change: |w, d| w.encoder_scale[usize::from(d.coin())] = 1.001,
    },
];

fn sea(world: &mut World, draw: &mut Draw, height_m: f64) {
    world.simulator.plant.motion.sea = WaveSystem {
        significant_height_m: height_m,
        peak_period_s: draw.within(4.0, 9.0),
        from_direction_rad: draw.within(0.0, std::f64::consts::TAU),
        ..WaveSystem::WIND_SEA
    };
}
