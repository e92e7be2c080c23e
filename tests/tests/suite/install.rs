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

# What ros2 launch looks for. Every file is run with every argument given, by what stands in for ROS 2's launch: what it starts
# are executables that exist, with parameters that the files of these nodes have.
import runpy
from types import SimpleNamespace
from unittest.mock import MagicMock

share = prefix / "share" / "rotary_sins"
launch, actions, substitutions = MagicMock(), MagicMock(), MagicMock()
for module in ("launch", "launch_ros"):
    sys.modules |= {module: launch, module + ".actions": actions, module + ".substitutions": substitutions}
sys.modules["launch.conditions"] = launch
given = {"params_file": str(share / "package.xml")}
substitutions.LaunchConfiguration = lambda name: SimpleNamespace(perform=lambda _: given.get(name, "1"))
substitutions.FindPackageShare = get_package_share_directory
substitutions.FindPackagePrefix = get_package_prefix
substitutions.PathJoinSubstitution = "/".join


def started(file):
    """Nodes that the file starts, with their parameters; twice where it starts those anew that have failed."""
    description = runpy.run_path(str(file))
    description["generate_launch_description"]()
    actions.Node.reset_mock()
    for action in description.get("start", lambda _: [])(None):
        assert action is not None, file
    for node in actions.Node.call_args_list.copy():
        if not isinstance(node.kwargs["on_exit"], MagicMock):
            node.kwargs["on_exit"](SimpleNamespace(returncode=1), None)
    return [node.kwargs for node in actions.Node.call_args_list]


follow = ["self_calibrator", "navigation_compensator"]
expected = {
    "demo.launch.py": ["imu_simulator", "scheme_sequencer", *follow],
    "live.launch.py": ["scheme_sequencer", *follow] * 2,
    "replay.launch.py": follow,
    # No node of ours.
    "view.launch.py": [],
}
files = sorted((share / "launch").glob("*.launch.py"))
assert [file.name for file in files] == list(expected), files
for file in files:
    nodes = started(file)
    assert [node["name"] for node in nodes] == expected[file.name], (file, nodes)
    for node in nodes:
        assert node["package"] == "rotary_sins" and node["executable"] == node["name"], node
        assert (prefix / "lib" / "rotary_sins" / node["executable"]).is_file(), (file, node)
        assert node["parameters"][0] == str(share / "config" / (node["name"] + ".yaml")), (file, node)
        config = pathlib.Path(node["parameters"][0]).read_text()
        for part in node["parameters"]:
            for parameter in part if isinstance(part, dict) else ():
                assert f"    {parameter}:" in config, (file, node["name"], parameter)
# The files that view.launch.py hands on are there.
for path in ("urdf/turntable.urdf", "layouts/turntable.rviz"):
    assert (share / path).is_file(), path
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

/// ROS 2's own libraries find packages, interfaces and executables; launch files start what is there. A second installation
/// replaces the first, and nobody else may write into it.
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
