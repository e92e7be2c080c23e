//! What a node leaves behind when it ends: a table at rest, a whole bag.
#![allow(clippy::unwrap_used)]

use std::process::Command;

use ros_node::Qos;
use ros2_interfaces::sensor_msgs::JointState;
use suite_tests::{
    Listener, Program, Running, Scene, isolated, repository, rotary_sins, scratch, skip,
};

/// A sequencer in a turn is ended like this, and the table stands still where it is then.
fn ended_in_a_turn(name: &str, interface: &str, end: impl FnOnce(&Listener, &mut Running)) {
    let scene = Scene::new(&format!("{name}_{interface}"));
    let mut table =
        scene.start_apart(&Program::new("imu_simulator").parameter("imu_rate_hz", "50.0"));
    let mut sequencer = scene.start_apart(
        &Program::sequencer()
            .parameter("table_interface", interface)
            .parameter("dwell_s", "0.5")
            .parameter("command_lead_s", "0.0"),
    );
    sequencer.wait_for_line("to 180.000 deg");
    let listener = Listener::new();
    let states = listener.hear::<JointState>("turntable/joint_states", Qos::sensor());
    states.wait_for("the table is on its way", |state| {
        state.position.iter().any(|angle| angle.abs() > 0.1)
    });
    end(&listener, &mut sequencer);
    assert!(
        sequencer.log().contains("the table rests at"),
        "{}",
        sequencer.log()
    );
    // What the table said on its way may still be coming.
    let rest = states.wait_for("the table rests", |state| {
        state.velocity == [0.0, 0.0] && state.position.iter().any(|angle| angle.abs() > 0.1)
    });
    let later = rest.header.stamp.nanos() + 2_000_000_000;
    let last = states.wait_for("two seconds later", |state| {
        state.header.stamp.nanos() > later
    });
    table.interrupt();
    let outer_deg = last.position[0]
        .to_degrees()
        .abs()
        .max(last.position[1].to_degrees().abs());
    assert_eq!(last.velocity, [0.0, 0.0]);
    assert_eq!(last.position, rest.position);
    assert!(outer_deg > 1.0 && outer_deg < 170.0, "{outer_deg} deg");
}

/// Ctrl-C at a sequencer in a turn stops the table and holds it, whichever way it is moved.
#[test]
fn an_interrupted_sequencer_stops_the_table() {
    isolated(|| {
        for interface in ["topic", "action"] {
            ended_in_a_turn("interrupted", interface, |_, sequencer| {
                sequencer.interrupt();
            });
        }
    });
}

/// So do a manager's `deactivate` and `shutdown` in the middle of a turn: the table rests before they are answered.
#[test]
fn a_manager_stops_the_table() {
    const DEACTIVATE: u8 = 4;
    const ACTIVE_SHUTDOWN: u8 = 7;
    isolated(|| {
        for interface in ["topic", "action"] {
            for (name, transition) in [("deactivated", DEACTIVATE), ("shut_down", ACTIVE_SHUTDOWN)]
            {
                ended_in_a_turn(name, interface, |manager, _| {
                    assert!(
                        manager.change_state("/scheme_sequencer", transition),
                        "{name}"
                    );
                });
            }
        }
    });
}

/// Ctrl-C at a recorder on a slow disk, several seconds for every write: the bag is whole, with its `metadata.yaml`, and the
/// status is 0.
#[test]
fn a_recorder_ends_its_bag_on_a_slow_disk() {
    let library = scratch("library").join("slow_write.so");
    let built = Command::new("cc")
        .args(["-shared", "-fPIC", "-o"])
        .arg(&library)
        .arg(repository().join("tests/slow_disk/slow_write.c"))
        .arg("-ldl")
        .status();
    if !built.is_ok_and(|status| status.success()) {
        return skip("there is no C compiler to make a slow disk with");
    }
    isolated(|| {
        let scene = Scene::new("slow_disk");
        let bag = scene.folder().join("bag");
        let mut table =
            scene.start_apart(&Program::new("imu_simulator").parameter("imu_rate_hz", "50.0"));
        let mut recorder = scene.start_apart(
            &Program::new("rotary-sins")
                .label("recorder")
                .args("record /imu/data_raw --output")
                .arg(&bag)
                .environment("LD_PRELOAD", library.to_str().unwrap()),
        );
        recorder.wait_for_line("recording /imu/data_raw");
        recorder.interrupt();
        table.interrupt();
        assert!(
            recorder.log().contains("the disk is slow"),
            "{}",
            recorder.log()
        );
        assert!(bag.join("metadata.yaml").exists());
        let told = rotary_sins(&["info", bag.to_str().unwrap()]).expect_status(0);
        drop(told);
    });
}
