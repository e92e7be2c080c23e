//! Everything at once, from a seed: four nodes at work, and whatever happens to processes, streams and networks. In the end the
//! calibration must be as far from the truth as its sigmas say.
//!
//! `ROTARY_SINS_SOAK_MINUTES` (wall time with faults, 1 unless given) and `ROTARY_SINS_SOAK_SEED` make a long one.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use ros_node::{Publisher, Qos};
use ros2_interfaces::sensor_msgs::Imu;
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate};
use suite_tests::{
    Chance, Heard, Intruder, Listener, Program, Running, Scene, isolated, namespaces_are_permitted,
    skip, wait_until,
};

/// Sigmas that an error may have, here where some hundred estimates are looked at.
const SIGMAS: f64 = 5.0;
/// Participants that datagrams spare: the world itself, and the test.
const SPARED: u16 = 2;

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name)
        .ok()
        .map_or(default, |value| value.parse().unwrap())
}

/// A node that somebody starts again whenever it has ended.
struct Supervised {
    program: Program,
    running: Running,
    starts: u32,
}

impl Supervised {
    fn new(scene: &Scene, program: Program) -> Self {
        let running = scene.start_apart(&program);
        Self {
            program,
            running,
            starts: 1,
        }
    }

    fn start(&mut self, scene: &Scene) {
        self.running = scene.start_apart(&self.program);
        self.starts += 1;
    }

    /// Starts it again where it has ended by itself: never by a signal, and never without a word.
    fn look_after(&mut self, scene: &Scene, diary: &mut String) {
        if self.running.is_running() {
            return;
        }
        let status = self.running.wait();
        let log = self.running.log();
        let told = log.lines().find(|line| line.contains("FATAL"));
        writeln!(diary, "  {status}: {told:?}").unwrap();
        assert!(status.code().is_some() && told.is_some(), "{diary}{log}");
        self.start(scene);
    }
}

/// Samples as no sensor gives them, from somebody else on the same topic.
struct Liar {
    voice: Publisher<Imu>,
    samples: Heard<Imu>,
}

impl Liar {
    fn say(&self, chance: &mut Chance) -> &'static str {
        let Some(honest) = self.samples.latest() else {
            return "nothing to lie about";
        };
        let what = chance.below(4);
        for k in 0..50 {
            let mut lie = honest.clone();
            match what {
                0 => lie.angular_velocity.x = f64::NAN,
                1 => lie.linear_acceleration.z = 1e9,
                // Clocks that jump, each to another time.
                2 => lie.header.stamp.sec += 3600 * (k + 1),
                // The same sample once more, from a second publisher.
                _ => {}
            }
            self.voice.publish(lie).left_to_diagnostics();
        }
        ["NaN", "beyond range", "clock steps", "repeated samples"][what]
    }
}

/// How far an estimate is from the truth, in its sigmas: the worst of drifts and biases.
fn worst(estimate: &SelfCalibrationEstimate, truth: &Calibration) -> f64 {
    let mut worst = 0.0_f64;
    for axis in 0..3 {
        let drift = estimate.gyroscope_drift[axis] - truth.gyroscope_drift[axis];
        let bias = estimate.accelerometer_bias[axis] - truth.accelerometer_bias[axis];
        worst = worst
            .max(drift.abs() / estimate.gyroscope_drift_std[axis])
            .max(bias.abs() / estimate.accelerometer_bias_std[axis]);
    }
    worst
}

/// One fault; says which.
fn happen(
    scene: &Scene,
    nodes: &mut [Supervised; 3],
    liar: &Liar,
    intruder: &mut Intruder,
    chance: &mut Chance,
) -> String {
    let node = &mut nodes[chance.below(3)];
    let name = node.program.name().to_owned();
    match chance.below(6) {
        0 => {
            node.running.kill();
            node.start(scene);
            format!("{name} is killed")
        }
        1 => {
            let time = Duration::from_millis(200 + 100 * chance.below(10) as u64);
            node.running.stop_for(time);
            format!("{name} is stopped for {time:?}")
        }
        2 => {
            let time = Duration::from_millis(1000 + 500 * chance.below(5) as u64);
            node.running.kill();
            std::thread::sleep(time);
            node.start(scene);
            format!("{name} is away for {time:?}")
        }
        3 => {
            let prefixes = intruder.hear(4);
            for _ in 0..200 {
                intruder.send_from(SPARED, &intruder.mutated(&prefixes, chance));
            }
            "200 damaged datagrams".to_owned()
        }
        _ => liar.say(chance).to_owned(),
    }
}

/// Kills, stops, gaps, bursts of nonsense, clock steps, second publishers and damaged datagrams, one after the other as the seed has it. No
/// node ends without a word; none stays away; whatever is said to be converged is as near to the truth as it says; and in the end it
/// converges.
#[test]
fn whatever_happens_the_calibration_is_true() {
    if !namespaces_are_permitted() {
        return skip("only in a network that is nobody else's");
    }
    isolated(|| {
        let (minutes, seed) = (
            setting("ROTARY_SINS_SOAK_MINUTES", 1),
            setting("ROTARY_SINS_SOAK_SEED", 11),
        );
        let scene = Scene::new("soak");
        let kept = |name: &str| scene.folder().join(name).to_str().unwrap().to_owned();
        for name in ["calibrator.kept", "sequencer.kept"] {
            // Of an earlier run of this test.
            let _none = std::fs::remove_file(kept(name));
        }
        // The world, which nothing happens to: first, so that datagrams can spare it.
        let mut world = scene.start_apart(
            &Program::new("imu_simulator")
                .parameter("imu_rate_hz", "20.0")
                .parameter("speed", "20.0"),
        );
        let mut intruder = Intruder::new();
        intruder.hear(1);
        let listener = Listener::new();
        let topic = "/self_calibration/estimate";
        let estimates = listener.hear::<SelfCalibrationEstimate>(topic, Qos::reliable(1000));
        let truth = listener.hear::<Calibration>("/ground_truth/calibration", Qos::latched(1));
        let liar = Liar {
            voice: listener.speak("/imu/data_raw", Qos::reliable(1000)),
            samples: listener.hear("/imu/data_raw", Qos::reliable(1000)),
        };
        intruder.hear(2);
        let mut nodes = [
            Program::new("self_calibrator")
                .parameter("checkpoint_file", &kept("calibrator.kept"))
                .parameter("checkpoint_period_s", "1.0")
                .parameter(
                    "gyroscope_drift_threshold_deg_per_hour",
                    "[0.01, 0.01, 0.01]",
                )
                .parameter("accelerometer_bias_threshold_ug", "[30.0, 30.0, 30.0]")
                .parameter("azimuth_threshold_arcmin", "10.0"),
            Program::sequencer()
                .parameter("dwell_s", "400.0")
                .parameter("checkpoint_file", &kept("sequencer.kept")),
            Program::new("navigation_compensator"),
        ]
        .map(|program| Supervised::new(&scene, program));
        estimates.wait_for("the first dwell", |estimate| estimate.duration > 320.0);

        let mut chance = Chance::new(seed);
        let mut diary = String::new();
        let begun = Instant::now();
        let mut faults = 0;
        while begun.elapsed() < Duration::from_secs(60 * minutes) {
            let what = happen(&scene, &mut nodes, &liar, &mut intruder, &mut chance);
            faults += 1;
            writeln!(diary, "{:.0} s: {what}", begun.elapsed().as_secs_f64()).unwrap();
            std::thread::sleep(Duration::from_millis(500 + 100 * chance.below(30) as u64));
            for node in &mut nodes {
                node.look_after(&scene, &mut diary);
            }
        }
        let since = estimates
            .latest()
            .map_or(0, |last| last.header.stamp.nanos());
        wait_until("convergence after the last fault", || {
            for node in &mut nodes {
                node.look_after(&scene, &mut diary);
            }
            estimates.latest().is_some_and(|last| {
                last.header.stamp.nanos() > since
                    && last.phase == SelfCalibrationEstimate::CONVERGED
            })
        });
        let truth = truth.latest().unwrap();
        let all = estimates.all();
        let last = all.last().unwrap();
        let converged = |estimate: &&SelfCalibrationEstimate| {
            estimate.phase == SelfCalibrationEstimate::CONVERGED
        };
        let worst_ever = all
            .iter()
            .filter(converged)
            .map(|estimate| worst(estimate, &truth))
            .fold(0.0, f64::max);
        let starts: Vec<u32> = nodes.iter().map(|node| node.starts).collect();
        println!(
            "seed {seed}: {faults} faults in {minutes} min, starts {starts:?}, {} estimates over {:.0} s, {} gaps, worst {worst_ever:.1} \
             sigma, at the end {:.1}\n{diary}",
            all.len(),
            last.duration,
            last.gaps,
            worst(last, &truth)
        );
        assert!(worst_ever < SIGMAS, "{worst_ever} sigma");
        for node in &mut nodes {
            node.running.interrupt();
        }
        world.interrupt();
    });
}
