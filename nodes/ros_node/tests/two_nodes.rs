//! Two nodes over real DDS, in a network namespace that has loopback only.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use common::{LONG, isolated, minimal, run_inner, start};
use ros_node::{Published, Qos};
use ros2_client::rcl_interfaces as rcl;
use ros2_interfaces::builtin_interfaces::Time;
use ros2_interfaces::diagnostic_msgs::{DiagnosticArray, KeyValue};
use ros2_interfaces::lifecycle_msgs::{
    ChangeStateRequest, ChangeStateResponse, Transition, TransitionEvent,
};
use ros2_interfaces::rosgraph_msgs::Clock;
use ros2_interfaces::std_srvs::{TriggerRequest, TriggerResponse};

fn key_value(key: &str, value: usize) -> KeyValue {
    KeyValue {
        key: key.to_owned(),
        value: value.to_string(),
    }
}

#[test]
fn messages_go_over_whatever_the_reliability() {
    run_inner("inner_messages");
}

/// A reliable subscription takes everything from a reliable and from a best-effort publisher, nothing twice, and
/// remapped names meet.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_messages() {
    let sender = start("sender", &["--ros-args", "-r", "out:=/ship/in"]);
    let receiver = start("receiver", &["--ros-args", "-r", "__ns:=/ship"]);
    let mut subscription = receiver
        .subscription::<KeyValue>("in", Qos::sensor())
        .unwrap();
    let reliable = sender.publisher::<KeyValue>("out", Qos::sensor()).unwrap();
    assert!(reliable.wait_for_subscribers(1, LONG).await);
    let best_effort = sender
        .publisher::<KeyValue>("out", Qos::best_effort(100))
        .unwrap();
    // Polling lets the subscription open its second reader once it has heard of the best-effort publisher.
    let waiting = Instant::now();
    while best_effort.subscriber_count() < 1 {
        assert!(
            waiting.elapsed() < LONG,
            "the best-effort publisher is not heard"
        );
        assert!(
            tokio::time::timeout(Duration::from_millis(50), subscription.recv())
                .await
                .is_err()
        );
    }
    for k in 0..500 {
        assert_eq!(reliable.publish(key_value("reliable", k)), Published::Sent);
        if k < 50 {
            let published = best_effort.publish(key_value("best effort", k));
            assert_eq!(published, Published::Sent);
        }
    }
    let mut received = Vec::new();
    while received.len() < 550 {
        let batch = tokio::time::timeout(LONG, subscription.recv_batch(100)).await;
        received.extend(batch.unwrap());
    }
    // What came twice would come now, behind a last message of either publisher.
    for publisher in [&reliable, &best_effort] {
        assert_eq!(publisher.publish(key_value("end", 0)), Published::Sent);
    }
    while received.len() < 552 {
        received.push(
            tokio::time::timeout(LONG, subscription.recv())
                .await
                .unwrap(),
        );
    }
    assert_eq!(received.iter().filter(|m| m.key == "end").count(), 2);
    let of = |key: &str| -> Vec<usize> {
        received
            .iter()
            .filter(|m| m.key == key)
            .map(|m| m.value.parse().unwrap())
            .collect()
    };
    assert_eq!(of("reliable"), (0..500).collect::<Vec<_>>());
    assert_eq!(of("best effort"), (0..50).collect::<Vec<_>>());
    assert_eq!(
        (
            subscription.statistics().lost(),
            reliable.statistics().dropped()
        ),
        (0, 0)
    );
}

#[test]
fn latched_messages_reach_late_subscribers() {
    run_inner("inner_latched");
}

/// Transient local: who subscribes later still gets the last message; the clock of a node follows `/clock`.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_latched() {
    let sender = start("sender", &[]);
    let latched = sender
        .publisher::<KeyValue>("calibration", Qos::latched(1))
        .unwrap();
    // What was before is the past, which nobody is told of.
    for value in 0..=7 {
        assert_eq!(latched.publish(key_value("k", value)), Published::Kept);
    }
    let volatile = sender
        .publisher::<KeyValue>("nobody/listens", Qos::reliable(1))
        .unwrap();
    assert_eq!(volatile.publish(key_value("k", 7)), Published::Unheard);
    assert_eq!(
        volatile.publish_if_heard(|| unreachable!("nobody listens")),
        Published::Unheard
    );
    let clock = sender
        .publisher::<Clock>("/clock", Qos::reliable(10))
        .unwrap();
    let receiver = start("receiver", &["--ros-args", "-p", "use_sim_time:=true"]);
    let mut subscription = receiver
        .subscription::<KeyValue>("calibration", Qos::latched(1))
        .unwrap();
    let message = tokio::time::timeout(LONG, subscription.recv())
        .await
        .unwrap();
    assert_eq!(message.value, "7");
    assert_eq!(latched.publish(key_value("k", 8)), Published::Sent);
    let message = tokio::time::timeout(LONG, subscription.recv())
        .await
        .unwrap();
    assert_eq!(message.value, "8");
    assert!(clock.wait_for_subscribers(1, LONG).await);
    assert_eq!(receiver.now_nanos(), 0);
    let published = clock.publish(Clock {
        clock: Time {
            sec: 12,
            nanosec: 5,
        },
    });
    assert_eq!(published, Published::Sent);
    tokio::time::timeout(LONG, receiver.clock().wait_until_known())
        .await
        .unwrap();
    assert_eq!(receiver.now_nanos(), 12_000_000_005);
}

#[test]
fn services_and_parameters_answer() {
    run_inner("inner_services");
}

/// A service answers; parameters are described, set, and refused with a reason; diagnostics name the node.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_services() {
    let server = start("server", &["--ros-args", "-p", "rate:=25"]);
    let asking = start("asking", &[]);
    server
        .serve("~/start", "std_srvs/srv/Trigger", |_: TriggerRequest| {
            TriggerResponse {
                success: true,
                message: "begun".into(),
            }
        })
        .unwrap();
    let client = asking
        .client::<TriggerRequest, TriggerResponse>("/server/start", "std_srvs/srv/Trigger")
        .unwrap();
    assert_eq!(
        client
            .call(TriggerRequest::default(), LONG)
            .await
            .unwrap()
            .message,
        "begun"
    );

    let get = asking
        .client("/server/get_parameters", "rcl_interfaces/srv/GetParameters")
        .unwrap();
    let request = rcl::GetParametersRequest {
        names: vec!["rate".into()],
    };
    let answer: rcl::GetParametersResponse = get.call(request, LONG).await.unwrap();
    assert_eq!(answer.values[0].double_value, 25.0);

    let set = asking
        .client("/server/set_parameters", "rcl_interfaces/srv/SetParameters")
        .unwrap();
    let change = |name: &str, value: f64| ros2_client::parameters::Parameter {
        name: name.into(),
        value: ros2_client::ParameterValue::Double(value),
    };
    let wanted = [
        change("gain", 1.5),
        change("gain", 9.0),
        change("rate", 1.0),
    ];
    let request = rcl::SetParametersRequest {
        parameter: wanted.into_iter().map(Into::into).collect(),
    };
    let answer: rcl::SetParametersResponse = set.call(request, LONG).await.unwrap();
    assert_eq!(
        answer
            .results
            .iter()
            .map(|r| r.successful)
            .collect::<Vec<_>>(),
        [true, false, false]
    );
    assert!(
        answer.results[1].reason.contains("from 0.0 to 2.0"),
        "{}",
        answer.results[1].reason
    );
    assert!(
        answer.results[2].reason.contains("read-only"),
        "{}",
        answer.results[2].reason
    );
    assert_eq!(server.parameter::<f64>("gain").unwrap(), 1.5);

    let mut diagnostics = asking
        .subscription::<DiagnosticArray>("/diagnostics", Qos::reliable(10))
        .unwrap();
    let array = tokio::time::timeout(LONG, diagnostics.recv())
        .await
        .unwrap();
    assert!(
        array.status[0].name.ends_with(": topics"),
        "{}",
        array.status[0].name
    );
}

#[test]
fn an_error_at_work_leaves_a_managed_node_unconfigured() {
    run_inner("inner_error");
}

/// A managed node whose main function fails at work goes through error processing, lives on, and can be configured anew.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test of its namespace"]
async fn inner_error() {
    let mut child = Command::new(minimal())
        .args(["--ros-args", "-p", "lifecycle_autostart:=false"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let manager = start("manager", &[]);
    let mut events = manager
        .subscription::<TransitionEvent>("/minimal/transition_event", Qos::reliable(10))
        .unwrap();
    assert!(events.wait_for_publishers(1, LONG).await);
    let change = manager
        .client("/minimal/change_state", "lifecycle_msgs/srv/ChangeState")
        .unwrap();
    let step = async |id| {
        let transition = Transition {
            id,
            label: String::new(),
        };
        let answer: ChangeStateResponse = change
            .call(ChangeStateRequest { transition }, LONG)
            .await
            .unwrap();
        answer.success
    };
    let set = manager
        .client(
            "/minimal/set_parameters",
            "rcl_interfaces/srv/SetParameters",
        )
        .unwrap();
    let fail = async |value| {
        let parameter = ros2_client::parameters::Parameter {
            name: "fail".into(),
            value: ros2_client::ParameterValue::Boolean(value),
        };
        let request = rcl::SetParametersRequest {
            parameter: vec![parameter.into()],
        };
        let answer: rcl::SetParametersResponse = set.call(request, LONG).await.unwrap();
        assert!(answer.results[0].successful);
    };
    assert!(step(Transition::CONFIGURE).await && step(Transition::ACTIVATE).await);
    fail(true).await;
    let mut passed = Vec::new();
    while passed.last().map(String::as_str) != Some("unconfigured") {
        let event = tokio::time::timeout(LONG, events.recv()).await.unwrap();
        passed.push(event.goal_state.label);
    }
    assert_eq!(
        passed,
        [
            "configuring",
            "inactive",
            "activating",
            "active",
            "deactivating",
            "errorprocessing",
            "unconfigured"
        ]
    );
    assert!(child.try_wait().unwrap().is_none());
    fail(false).await;
    assert!(step(Transition::CONFIGURE).await && step(Transition::ACTIVATE).await);
    child.kill().unwrap();
    child.wait().unwrap();
}

fn output(arguments: &[&str]) -> Output {
    isolated(&minimal(), arguments).output().unwrap()
}

/// Unusable arguments: one line that names them, status 2.
#[test]
fn unusable_arguments_end_with_status_2() {
    for (arguments, named) in [
        (vec!["--ros-args", "-p", "rat:=3"], "'rate'"),
        (vec!["--ros-args", "-p", "rate:=fast"], "'fast'"),
        (vec!["--ros-args", "--frob"], "'--frob'"),
        (vec!["stray"], "'stray'"),
        (
            vec!["--ros-args", "--params-file", "/nowhere.yaml"],
            "/nowhere.yaml",
        ),
        (vec!["--ros-args", "-r", "status:=a//b"], "a//b"),
    ] {
        let output = output(&arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(named) && text.lines().count() == 1, "{text}");
    }
}

/// A panic becomes a FATAL line and a status that is not zero.
#[test]
fn a_panic_is_fatal() {
    let output = output(&["--ros-args", "-p", "panic:=true"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(101), "{text}");
    assert!(
        text.lines()
            .any(|line| line.starts_with("[FATAL] [") && line.contains("asked to")),
        "{text}"
    );
}

/// SIGINT and SIGTERM end the node by itself, status 0, and what is not done in time is a FATAL line, of which there is none.
#[test]
fn signals_end_the_node_cleanly() {
    for signal in ["-INT", "-TERM"] {
        let mut child = isolated(&minimal(), &[])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut log = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("publishing on") {
            line.clear();
            assert!(
                log.read_line(&mut line).unwrap() > 0,
                "ended before it was ready"
            );
        }
        assert!(
            Command::new("kill")
                .args([signal, &child.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        let mut rest = String::new();
        log.read_to_string(&mut rest).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(0), "{signal}: {rest}");
        assert!(!rest.contains("[FATAL]"), "{signal}: {rest}");
    }
}
