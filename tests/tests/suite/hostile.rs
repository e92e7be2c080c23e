//! Datagrams that nobody should send. RustDDS believes them; what they cost a node is bounded, and it goes on from where it stood.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::time::Duration;

use ros_node::Qos;
use ros2_client::parameters::{ParameterValue, raw};
use ros2_client::rcl_interfaces as rcl;
use rotary_sins_msgs::{Calibration, SelfCalibrationEstimate};
use suite_tests::{
    Chance, Intruder, Listener, Prefix, Program, Running, Scene, fragment_of, gap, heartbeat,
    isolated, namespaces_are_permitted, skip, wait_until,
};

/// Datagrams of the flood; within 7500 two of four nodes ended in an abort, before.
const FLOOD: usize = 10_000;
/// So many at a time.
const PACE: usize = 20;

fn table() -> Program {
    Program::new("imu_simulator")
        .parameter("imu_rate_hz", "20.0")
        .parameter("speed", "20.0")
}

fn calibrator(scene: &Scene) -> Program {
    let kept = scene.folder().join("calibrator.kept");
    Program::new("self_calibrator")
        .parameter("coarse_alignment_s", "60.0")
        .parameter("checkpoint_period_s", "1.0")
        .parameter("checkpoint_file", kept.to_str().unwrap())
}

/// What the kernel says of the most memory that a process has had \[MiB\].
fn peak_mib(running: &Running) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", running.id())).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kibibytes >> 10)
}

/// A calibrator that works, the prefix of its participant, and that of the table.
struct Victim {
    scene: Scene,
    intruder: Intruder,
    calibrator: Running,
    table: Running,
    own: Prefix,
    peer: Prefix,
    listener: Listener,
}

impl Victim {
    fn new(test: &str) -> Self {
        let scene = Scene::new(test);
        // Of an earlier run of this test.
        let _none = std::fs::remove_file(scene.folder().join("calibrator.kept"));
        let mut intruder = Intruder::new();
        let calibrator = scene.start_apart(&calibrator(&scene));
        let own = *intruder.hear(1).first().unwrap();
        let table = scene.start_apart(&table());
        let all = intruder.hear(2);
        let peer = *all.iter().find(|prefix| **prefix != own).unwrap();
        let listener = Listener::new();
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        estimates.wait_for("an estimate with numbers", |estimate| {
            estimate.phase >= SelfCalibrationEstimate::FINE_ALIGNMENT && estimate.duration > 100.0
        });
        Self {
            scene,
            intruder,
            calibrator,
            table,
            own,
            peer,
            listener,
        }
    }

    /// The calibrator has said why, ended with status 1, and goes on from its checkpoint when it is started again.
    fn has_ended_in_order(mut self, reason: &str) {
        let status = self.calibrator.wait();
        let log = self.calibrator.log();
        assert_eq!(status.code(), Some(1), "{log}");
        let told = log.lines().find(|line| line.contains("FATAL"));
        assert!(told.is_some_and(|line| line.contains(reason)), "{log}");
        let mut again = self
            .scene
            .start_apart(&calibrator(&self.scene).label("again"));
        again.wait_for_line("goes on from");
        again.interrupt();
        self.table.interrupt();
        drop(self.listener);
    }
}

/// One fragment that claims a message of 1 GiB ends the node in order, before the memory is taken.
#[test]
fn a_fragment_of_a_gibibyte_costs_a_restart() {
    if !namespaces_are_permitted() {
        return skip("only in a network that is nobody else's");
    }
    isolated(|| {
        let victim = Victim::new("hostile_fragment");
        victim
            .intruder
            .send(&fragment_of(&victim.peer, &victim.own, 1 << 30));
        victim.has_ended_in_order("asks the middleware for 1024 MiB");
    });
}

/// Heartbeats of 2^31 samples end the node in order as well.
#[test]
fn heartbeats_of_everything_cost_a_restart() {
    if !namespaces_are_permitted() {
        return skip("only in a network that is nobody else's");
    }
    isolated(|| {
        let victim = Victim::new("hostile_heartbeats");
        for count in 0..3 {
            let datagram = heartbeat(&victim.peer, &victim.own, 1, 1 << 31, 0x7000_0000 + count);
            victim.intruder.send(&datagram);
        }
        victim.has_ended_in_order("asks the middleware for");
    });
}

/// A gap of 2^31 samples makes RustDDS write down every one of them; the node ends in order where its memory is at its bound.
#[test]
fn a_gap_of_everything_costs_a_restart() {
    if !namespaces_are_permitted() {
        return skip("only in a network that is nobody else's");
    }
    isolated(|| {
        let victim = Victim::new("hostile_gap");
        let datagram = gap(&victim.peer, &victim.own, 1_000_000, 1 << 31);
        victim.intruder.send(&datagram);
        victim.has_ended_in_order("of memory are used");
    });
}

/// A flood of damaged datagrams from a seed: no node ends by a signal; one that ends says FATAL first, and is started again. Afterwards
/// all of them work.
#[test]
fn a_flood_of_damaged_datagrams_is_lived_through() {
    if !namespaces_are_permitted() {
        return skip("only in a network that is nobody else's");
    }
    isolated(|| {
        let scene = Scene::new("hostile_flood");
        // Of an earlier run of this test.
        let _none = std::fs::remove_file(scene.folder().join("calibrator.kept"));
        let programs = [
            calibrator(&scene),
            Program::new("scheme_sequencer"),
            Program::new("navigation_compensator"),
            table(),
        ];
        let mut nodes = programs
            .each_ref()
            .map(|program| scene.start_apart(program));
        let mut intruder = Intruder::new();
        let prefixes: BTreeSet<Prefix> = intruder.hear(nodes.len());
        let mut chance = Chance::new(11);
        let mut ends = String::new();
        let mut peak = [0; 4];
        let mut look_after = |nodes: &mut [Running; 4], sent: usize| {
            for (k, node) in nodes.iter_mut().enumerate() {
                peak[k] = peak[k].max(peak_mib(node).unwrap_or(0));
                if node.is_running() {
                    continue;
                }
                let status = node.wait();
                let log = node.log();
                let told = log.lines().find(|line| line.contains("FATAL"));
                writeln!(ends, "after {sent}: {status}, {told:?}").unwrap();
                assert!(status.code().is_some() && told.is_some(), "{ends}{log}");
                *node = scene.start_apart(&programs[k]);
            }
            peak
        };
        for sent in 0..FLOOD {
            intruder.send(&intruder.mutated(&prefixes, &mut chance));
            if sent % PACE == 0 {
                look_after(&mut nodes, sent);
                // Else the kernel drops what the nodes have not read yet.
                std::thread::sleep(Duration::from_millis(10));
            }
        }
        let listener = Listener::new();
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        let mut first = None;
        wait_until("estimates that go on", || {
            look_after(&mut nodes, FLOOD);
            let now = estimates
                .latest()
                .map(|estimate| estimate.header.stamp.nanos());
            first = first.or(now);
            now > first.map(|first| first + 60_000_000_000)
        });
        let peak = look_after(&mut nodes, FLOOD);
        println!("{FLOOD} datagrams, at most {peak:?} MiB\n{ends}");
        // One that was started a moment ago may not have listened to signals yet: they are ended as they stand.
        assert!(nodes.iter_mut().all(Running::is_running));
    });
}

/// Processor time that a process has used \[s\].
fn processor_s(running: &Running) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", running.id())).unwrap();
    let behind_name = stat.rsplit_once(')').unwrap().1;
    let ticks = |field: usize| -> f64 {
        let value = behind_name.split_whitespace().nth(field).unwrap();
        value.parse().unwrap()
    };
    (ticks(11) + ticks(12)) / 100.0
}

/// A parameter of two megabytes of name, a calibration of two megabytes of source, and 2000 calls one behind the other: answers and lines stay
/// short, and the node has its time for its work. (A name of two megabytes took minutes to be compared with those that there are.)
#[test]
fn long_names_and_many_calls_cost_nothing() {
    isolated(|| {
        let scene = Scene::new("long_names");
        let mut node = scene.start_apart(&Program::new("navigation_compensator"));
        let listener = Listener::new();
        let long = "x".repeat(2_000_000);
        let parameter = |name: &str| {
            let value = raw::ParameterValue::from(ParameterValue::Double(1.0));
            let name = name.to_owned();
            rcl::SetParametersRequest {
                parameter: vec![raw::Parameter { name, value }],
            }
        };
        let set = |name: &str| -> rcl::SetParametersResponse {
            let service = "/navigation_compensator/set_parameters";
            listener.call(service, "rcl_interfaces/srv/SetParameters", parameter(name))
        };
        let before = processor_s(&node);
        let result = set(&long).results.remove(0);
        assert!(!result.successful);
        let reason = &result.reason;
        assert!(
            reason.len() < 20_000 && reason.contains("(2000000 bytes)"),
            "{reason:.200}"
        );
        let calibrations =
            listener.speak::<Calibration>("/self_calibration/calibration", Qos::latched(1));
        let mut calibration = Calibration::default();
        calibration.source.clone_from(&long);
        calibrations.publish(calibration).left_to_diagnostics();
        let request = rcl::GetParametersRequest {
            names: vec!["use_sim_time".to_owned()],
        };
        listener.call_often::<_, rcl::GetParametersResponse>(
            "/navigation_compensator/get_parameters",
            "rcl_interfaces/srv/GetParameters",
            &request,
            2000,
        );
        let used = processor_s(&node) - before;
        node.interrupt();
        let longest = node.log().lines().map(str::len).max().unwrap();
        println!("{used} s of processor time, lines of at most {longest} bytes");
        assert!(longest < 1000, "a line of {longest} bytes");
        assert!(used < 10.0, "{used} s of processor time");
    });
}
