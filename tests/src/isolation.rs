//! A network and a process namespace for one test.

use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::executables::{BIN_DIR, executables};

/// Set in the inner run of an isolated test.
const INSIDE: &str = "ROTARY_SINS_TEST_INSIDE";

/// Gives the namespace a loopback that also carries multicast, which DDS discovery needs; then becomes the test.
const ENTER: &str = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\"";

/// Namespaces of the network and of processes: when the inner test ends, the kernel ends everything it started.
const UNSHARE: [&str; 5] = ["--net", "--pid", "--fork", "--kill-child", "--mount-proc"];

/// Runs `body` with only a loopback of its own, one such test of a program at a time: the machine's cores are part of
/// what these tests measure.
///
/// The test program starts itself again, for this one test, inside of new namespaces. As root that is always
/// permitted; for others it needs unprivileged user namespaces. Where neither is permitted, the test runs in a random
/// DDS domain on the loopback, and a line says so.
pub fn isolated<F: FnOnce()>(body: F) {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    if std::env::var_os(INSIDE).is_some() {
        return body();
    }
    let name = test_name::<F>();
    let bin_dir = executables();
    let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
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
        .args(["--exact", name, "--nocapture", "--include-ignored"])
        .env(INSIDE, "1")
        .env(BIN_DIR, bin_dir)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    judge(name, &output);
}

/// `module::test` from the type of the closure, `crate::module::test::{{closure}}`.
fn test_name<F>() -> &'static str {
    let path = std::any::type_name::<F>();
    let path = path.strip_suffix("::{{closure}}").unwrap_or(path);
    path.split_once("::").map_or(path, |(_, name)| name)
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
