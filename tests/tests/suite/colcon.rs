//! `colcon build` of a workspace that this repository is linked into: what it finds, and the prefix it leaves.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use suite_tests::{Answer, peer_python, repository, scratch, skip, target_directory};

/// Folder of the environment that `tests/colcon/setup.sh` made; `None`, with a line, where it was not made.
fn environment() -> Option<PathBuf> {
    let prefix = std::env::var_os("ROTARY_SINS_COLCON")
        .map_or_else(|| repository().join("target/colcon"), PathBuf::from);
    if prefix.join(".packages").exists() {
        return Some(prefix);
    }
    skip("there is no colcon: run tests/colcon/setup.sh");
    None
}

/// A line of a shell that has sourced ROS 2, here the wheels of the peer.
fn sourced(ros: &Path, folder: &Path, line: &str) -> Answer {
    let script = format!(
        ". '{}/tests/ros2_peers/environment.sh' '{ros}' && export CMAKE_PREFIX_PATH='{ros}' PATH='{ros}/bin':\"$PATH\" && {line}",
        repository().display(),
        ros = ros.display(),
    );
    let output = Command::new("bash")
        .args(["-c", &script])
        .current_dir(folder)
        .output();
    Answer::from(output.unwrap()).expect_status(0)
}

fn names(folder: &Path) -> BTreeSet<String> {
    fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.starts_with("__"))
        .collect()
}

/// The two packages are found and no crate beside them; both are built, and the prefix of the nodes' package has executables,
/// launch files, parameters, layouts, model and the entry in the index, as `install.sh` lays them out.
#[test]
fn colcon_builds_both_packages() {
    let (Some(environment), Some(python)) = (environment(), peer_python("kilted")) else {
        return;
    };
    let ros = python.ancestors().nth(2).unwrap();
    let workspace = scratch("colcon");
    fs::create_dir(workspace.join("src")).unwrap();
    symlink(repository(), workspace.join("src/rotary_sins")).unwrap();
    // A working tree has what a clone has not: environments and prefixes of other tests.
    fs::write(target_directory().join("COLCON_IGNORE"), "").unwrap();
    let colcon = |arguments: &str| {
        // What cargo has built for these tests is not built once more.
        let line = format!(
            "CARGO_TARGET_DIR='{}' PATH='{bin}':\"$PATH\" COLCON_LOG_PATH=log '{bin}/colcon' {arguments}",
            target_directory().display(),
            bin = environment.join("bin").display(),
        );
        sourced(ros, &workspace, &line).stdout
    };

    let found = colcon("list --names-only");
    assert_eq!(
        found.lines().collect::<Vec<_>>(),
        ["rotary_sins", "rotary_sins_msgs"]
    );
    colcon(&format!(
        "build --cmake-args -GNinja -DBUILD_TESTING=OFF -Wno-dev -DPython3_EXECUTABLE='{}'",
        python.display()
    ));

    let prefix = workspace.join("install/rotary_sins");
    let executables = [
        "imu_simulator",
        "navigation_compensator",
        "rotary-sins",
        "scheme_sequencer",
        "self_calibrator",
    ];
    let lib = prefix.join("lib/rotary_sins");
    assert_eq!(names(&lib), executables.map(str::to_owned).into());
    let share = prefix.join("share/rotary_sins");
    for folder in ["launch", "config", "layouts", "urdf"] {
        let ours = repository().join("launch-scripts").join(folder);
        assert_eq!(names(&share.join(folder)), names(&ours), "{folder}");
    }
    let package = fs::read(repository().join("nodes/rotary_sins/package.xml")).unwrap();
    assert_eq!(fs::read(share.join("package.xml")).unwrap(), package);
    let index = prefix.join("share/ament_index/resource_index");
    assert!(index.join("packages/rotary_sins").is_file());
    // What stands there is offered as a patch to every crate that colcon builds afterwards, where it knows crates.
    assert!(!index.join("rust_packages").exists());

    // What a user does next.
    let ask = "from ament_index_python import get_package_prefix as p\n\
               from rotary_sins_msgs.msg import SchemeStatus\n\
               print(p('rotary_sins'), p('rotary_sins_msgs'), SchemeStatus.FAULT)\n";
    fs::write(workspace.join("ask.py"), ask).unwrap();
    let line = format!(
        ". install/setup.sh && '{}/self_calibrator' --help && python ask.py",
        lib.display()
    );
    let answer = sourced(ros, &workspace, &line);
    let installed = workspace.join("install");
    let expected = format!(
        "{0}/rotary_sins {0}/rotary_sins_msgs 7",
        installed.display()
    );
    assert_eq!(answer.stdout.lines().last().unwrap(), expected);
}

/// A colcon that knows crates, which the one of these tests does not, finds none of ours: those that are no package are marked.
#[test]
fn crates_that_are_no_package_are_ignored() {
    let root = repository();
    let manifest = fs::read_to_string(root.join("Cargo.toml")).unwrap();
    let members = manifest.split("members = [").nth(1).unwrap();
    let members = members.split(']').next().unwrap();
    let members: Vec<_> = members.split('"').skip(1).step_by(2).collect();
    let is_seen = |member: &&str| {
        let mut folders = Path::new(member).ancestors();
        !folders.any(|folder| root.join(folder).join("COLCON_IGNORE").exists())
    };
    let seen: BTreeSet<_> = members.into_iter().filter(is_seen).collect();
    assert_eq!(seen, BTreeSet::from(["msgs", "nodes/rotary_sins"]));
}

/// Where there is no cargo, the package says so, and how to get it.
#[test]
fn without_cargo_the_build_says_so() {
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let ros = python.ancestors().nth(2).unwrap();
    let folder = scratch("without_cargo");
    let line = format!(
        "! cmake -GNinja -S '{}' -B . -DCMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF -DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF \
         -DCMAKE_MAKE_PROGRAM='{}/bin/ninja' -DPython3_EXECUTABLE='{}'",
        repository().join("nodes/rotary_sins").display(),
        ros.display(),
        python.display(),
    );
    let answer = sourced(ros, &folder, &line);
    assert!(
        answer.stderr.contains("cargo is missing"),
        "{}",
        answer.stderr
    );
}
