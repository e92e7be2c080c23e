//! A network and a process namespace for one test.

use std::process::{Command, Output, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::executables::{BIN_DIR, executables};

/// In the inner run of an isolated test: its name.
const INSIDE: &str = "ROTARY_SINS_TEST_INSIDE";
/// cargo-nextest runs each test in a process of its own and says which one it is.
const NEXTEST_NAME: &str = "NEXTEST_TEST_NAME";

/// Gives the namespace a loopback that also carries multicast, which DDS discovery needs; then becomes the test.
const ENTER: &str = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\"";

/// Namespaces of the network and of processes: when the inner test ends, the kernel ends everything it started.
const UNSHARE: [&str; 5] = ["--net", "--pid", "--fork", "--kill-child", "--mount-proc"];

/// Runs `body` with only a loopback of its own, so that any number of such tests run side by side.
///
/// The test program starts itself again, for this one test, inside of new namespaces. As root that is always
/// permitted; for others it needs unprivileged user namespaces. Where neither is permitted, the test runs in a random
/// DDS domain on the loopback, and a line says so.
///
/// What the test needs from outside (peers, data) is decided before: see [`crate::skip`].
pub fn isolated(body: impl FnOnce()) {
    if is_inside() {
        return body();
    }
    let name = current_test();
    let mut command = if let Some(mut unshare) = permitted_unshare() {
        unshare
            .args(["bash", "-c", ENTER, "bash"])
            .arg(std::env::current_exe().unwrap());
        unshare
    } else {
        let nanos = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        let domain = 1 + nanos.subsec_nanos() % 200;
        println!(
            "{name}: namespaces are not permitted here; runs in DDS domain {domain} on the loopback"
        );
        let mut command = Command::new(std::env::current_exe().unwrap());
        command
            .env("ROS_DOMAIN_ID", domain.to_string())
            .env("ROS_LOCALHOST_ONLY", "1");
        command
    };
    let output = command
        .args(["--exact", &name, "--nocapture", "--include-ignored"])
        .env(INSIDE, &name)
        .env(BIN_DIR, executables())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    judge(&name, &output);
}

/// Whether this is the inner run of an isolated test.
pub(crate) fn is_inside() -> bool {
    std::env::var_os(INSIDE).is_some()
}

/// `module::test` of the test that runs here, whoever runs it.
pub(crate) fn current_test() -> String {
    let by_environment = [INSIDE, NEXTEST_NAME]
        .into_iter()
        .find_map(|variable| std::env::var(variable).ok());
    let by_thread = || std::thread::current().name().map(str::to_owned);
    let name = by_environment.or_else(by_thread);
    // A single thread runs the tests in its own, which has another name.
    name.filter(|name| name != "main")
        .expect("the name of this test: run with cargo nextest, or with more than one test thread")
}

/// Whether a test may have a network of its own here.
pub fn namespaces_are_permitted() -> bool {
    is_inside() || permitted_unshare().is_some()
}

fn permitted_unshare() -> Option<Command> {
    [&[][..], &["--map-root-user"][..]]
        .into_iter()
        .map(|extra| [&UNSHARE[..], extra].concat())
        .find(|options| {
            let tried = Command::new("unshare")
                .args(options)
                .args(["bash", "-c", ENTER, "bash", "true"])
                .output();
            tried.is_ok_and(|output| output.status.success())
        })
        .map(|options| {
            let mut command = Command::new("unshare");
            command.args(options);
            command
        })
}

fn judge(name: &str, output: &Output) {
    let text = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    println!("{text}{errors}");
    assert!(
        output.status.success(),
        "{name}, in its own network: {}",
        output.status
    );
    assert!(
        text.contains("1 passed"),
        "{name}: the inner run did not find this test"
    );
}
