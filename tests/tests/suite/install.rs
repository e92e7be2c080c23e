//! The ament prefix that `launch-scripts/install.sh` lays out, asked through ROS 2's own libraries, and run from there.

use std::fs;
use std::path::Path;
use std::process::Command;

use suite_tests::{peer_python, repository, scratch, target_directory};

const ASK: &str = r#"
import pathlib, sys
from ament_index_python import get_package_prefix, get_package_share_directory, get_resource, get_resources, has_resource
from catkin_pkg.package import parse_package

prefix = pathlib.Path(sys.argv[1])
for name in ("rotary_sins", "rotary_sins_msgs"):
    assert get_package_prefix(name) == str(prefix), get_package_prefix(name)
    assert name in get_resources("packages")
    package = parse_package(get_package_share_directory(name) + "/package.xml")
    package.validate()
    assert package.name == name
    depends, _ = get_resource("package_run_dependencies", name)
    assert {d.name for d in package.exec_depends} <= set(depends.split(";")), depends

# What ros2 run looks for.
for executable in ("imu_simulator", "scheme_sequencer", "self_calibrator", "navigation_compensator", "rotary-sins"):
    path = prefix / "lib" / "rotary_sins" / executable
    assert path.is_file() and path.stat().st_mode & 0o111, path

# What ros2 interface show reads.
assert has_resource("rosidl_interfaces", "rotary_sins_msgs")
interfaces, _ = get_resource("rosidl_interfaces", "rotary_sins_msgs")
assert interfaces.split(), interfaces
for interface in interfaces.split():
    assert (prefix / "share" / "rotary_sins_msgs" / interface).is_file(), interface

# What ros2 launch looks for: every file compiles, names executables that exist, and parameter files that are there.
import ast
launch = prefix / "share" / "rotary_sins" / "launch"
files = sorted(launch.glob("*.launch.py"))
assert [f.name for f in files] == ["demo.launch.py", "live.launch.py", "replay.launch.py", "view.launch.py"], files
for file in files:
    tree = ast.parse(file.read_text(), str(file))
    if file.name == "view.launch.py":
        # No node of ours; the files that it hands on are there.
        for path in ("urdf/turntable.urdf", "layouts/turntable.rviz"):
            assert (prefix / "share" / "rotary_sins" / path).is_file(), path
        continue
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") == "node"]
    assert calls, file
    for call in calls:
        name = call.args[0].value
        assert (prefix / "lib" / "rotary_sins" / name).is_file(), (file, name)
        config = (prefix / "share" / "rotary_sins" / "config" / (name + ".yaml")).read_text()
        for keyword in call.keywords:
            # Whether it keeps its state is no parameter.
            if keyword.arg and keyword.arg != "keeps":
                assert f"    {keyword.arg}:" in config, (file, name, keyword.arg)
print("good")
"#;

/// Lays the suite out below this folder.
pub(crate) fn install(prefix: &Path) {
    let output = Command::new(repository().join("launch-scripts/install.sh"))
        .arg(prefix)
        .env("CARGO_TARGET_DIR", target_directory())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn ros_2_finds_the_packages() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let prefix = scratch("install");
    install(&prefix);
    // Twice: what is there already is replaced, whatever the mask of whoever installs; and it says what is not in it.
    let output = Command::new("sh")
        .args(["-c", "umask 000 && exec \"$0\" \"$1\""])
        .arg(repository().join("launch-scripts/install.sh"))
        .arg(&prefix)
        .env("CARGO_TARGET_DIR", target_directory())
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && told.contains("rotary_sins_msgs"),
        "{told}"
    );
    let writable = Command::new("find")
        .arg(&prefix)
        .args(["-type", "f", "-perm", "/022"])
        .output()
        .unwrap();
    assert_eq!(String::from_utf8_lossy(&writable.stdout), "");
    let prefix = fs::canonicalize(&prefix).unwrap();
    let script = scratch("install-script").join("ask.py");
    fs::write(&script, ASK).unwrap();
    let line = format!(
        ". '{0}/setup.sh' && . '{0}/setup.sh' && '{1}' '{2}' '{0}' && self_calibrator --help && echo $AMENT_PREFIX_PATH",
        prefix.display(),
        python.display(),
        script.display()
    );
    let output = Command::new("sh")
        .args(["-c", &line])
        .env_remove("AMENT_PREFIX_PATH")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && text.starts_with("good"),
        "{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    // Sourced twice, it stands there once.
    let path = text.lines().last().unwrap();
    assert_eq!(path.matches(prefix.to_str().unwrap()).count(), 1, "{path}");
}
