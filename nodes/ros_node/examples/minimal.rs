//! The least a node needs: a parameter, a topic, a service, a clean end. It is a managed node, which takes one line:
//! `ros2 lifecycle set /minimal deactivate` makes it silent.
//!
//! `cargo run -p ros_node --example minimal -- --ros-args -p rate:=5.0 -r status:=/ship/status`

use std::process::ExitCode;
use std::time::Duration;

use ros_node::{Node, NodeBuilder, Parameter, Qos, Report};
use ros2_interfaces::diagnostic_msgs::KeyValue;
use ros2_interfaces::std_srvs::{TriggerRequest, TriggerResponse};

fn main() -> ExitCode {
    let builder = NodeBuilder::new("minimal")
        .about("publishes a counter")
        .parameter(
            Parameter::new("rate", 10.0)
                .describe("messages published")
                .unit("1/s")
                .range(0.1, 1000.0),
        )
        .parameter(
            Parameter::new("panic", false).describe("panics at once, to show what becomes of it"),
        )
        .parameter(
            Parameter::new("fail", false)
                .describe("ends with an error as soon as it is set, to show what becomes of it")
                .changeable(),
        )
        .managed();
    ros_node::run(builder, counter)
}

async fn counter(node: Node) -> Result<(), ros_node::Error> {
    let period = Duration::from_secs_f64(1.0 / node.parameter::<f64>("rate")?);
    let publisher = node.publisher::<KeyValue>("status", Qos::reliable(10))?;
    node.serve("~/hello", "std_srvs/srv/Trigger", |_: TriggerRequest| {
        TriggerResponse {
            success: true,
            message: "hello".to_owned(),
        }
    })?;
    let statistics = publisher.statistics();
    node.diagnostics().add("counter", move || {
        Report::ok("counting").with("published", statistics.published())
    });
    node.set_ready();
    tracing::info!("publishing on {}", publisher.topic());
    assert!(!node.parameter::<bool>("panic")?, "asked to");
    for count in 0_u64.. {
        tokio::select! {
            () = node.shutdown() => break,
            () = node.clock().sleep(period) => {}
        }
        if node.parameter::<bool>("fail")? {
            return Err(ros_node::Error::Argument("asked to fail".to_owned()));
        }
        publisher.publish(KeyValue {
            key: "count".to_owned(),
            value: count.to_string(),
        });
    }
    Ok(())
}
