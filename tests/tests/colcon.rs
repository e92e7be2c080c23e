//! `colcon build` of a workspace that this repository is linked into: what it finds, and the prefix it leaves.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
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

fn colcon(environment: &Path, workspace: &Path, arguments: &str) -> Answer {
    let mut path = OsString::from(environment.join("bin"));
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap());
    let output = Command::new(environment.join("bin/colcon"))
        .args(arguments.split(' '))
        .current_dir(workspace)
        .env("PATH", path)
        .env("COLCON_LOG_PATH", workspace.join("log"))
        .env_remove("AMENT_PREFIX_PATH")
        .output()
        .unwrap();
    Answer::from(output).expect_status(0)
}

fn files(folder: &Path) -> BTreeSet<String> {
    let entries =
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.starts_with("__"))
        .collect()
}

/// The two packages are found and no crate beside them; the nodes' package is built, and its prefix has executables, launch files,
/// parameters, layouts, model and the entry in the index, as `install.sh` lays them out.
#[test]
fn colcon_builds_the_package() {
    let Some(environment) = environment() else {
        return;
    };
    let workspace = scratch("colcon");
    fs::create_dir(workspace.join("src")).unwrap();
    std::os::unix::fs::symlink(repository(), workspace.join("src/rotary_sins")).unwrap();
    // A working tree has what a clone has not: environments and prefixes of other tests.
    fs::write(target_directory().join("COLCON_IGNORE"), "").unwrap();
    // What cargo has built for these tests is not built once more.
    fs::create_dir(workspace.join("build")).unwrap();
    std::os::unix::fs::symlink(target_directory(), workspace.join("build/rotary_sins")).unwrap();

    let found = colcon(&environment, &workspace, "list --names-only");
    let names: Vec<&str> = found.stdout.lines().collect();
    assert_eq!(
        names,
        ["rotary_sins", "rotary_sins_msgs"],
        "{}",
        found.stderr
    );
    let _ = colcon(
        &environment,
        &workspace,
        "build --packages-select rotary_sins --cargo-args --release --workspace --bins",
    );

    let prefix = workspace.join("install/rotary_sins");
    let executables = [
        "imu_simulator",
        "navigation_compensator",
        "rotary-sins",
        "scheme_sequencer",
        "self_calibrator",
    ];
    let lib = prefix.join("lib/rotary_sins");
    assert_eq!(files(&lib), executables.map(str::to_owned).into());
    let share = prefix.join("share/rotary_sins");
    for folder in ["launch", "config", "layouts", "urdf"] {
        let ours = repository().join("launch-scripts").join(folder);
        assert_eq!(files(&share.join(folder)), files(&ours), "{folder}");
    }
    let package = fs::read(repository().join("nodes/rotary_sins/package.xml")).unwrap();
    assert_eq!(fs::read(share.join("package.xml")).unwrap(), package);
    let index = prefix.join("share/ament_index/resource_index");
    assert!(index.join("packages/rotary_sins").is_file());
    // What stands there is offered as a patch to every crate that colcon builds afterwards.
    assert!(!index.join("rust_packages").exists());

    let line = format!(
        ". '{0}/install/setup.sh' && '{1}/self_calibrator' --help && echo $AMENT_PREFIX_PATH",
        workspace.display(),
        lib.display(),
    );
    let output = Command::new("sh")
        .args(["-c", &line])
        .env_remove("AMENT_PREFIX_PATH")
        .output();
    let answer = Answer::from(output.unwrap()).expect_status(0);
    assert_eq!(
        answer.stdout.lines().last().unwrap(),
        prefix.to_str().unwrap()
    );
    let Some(python) = peer_python("kilted") else {
        return;
    };
    let ask = "from ament_index_python import get_package_prefix as p; print(p('rotary_sins'))";
    let output = Command::new(python)
        .args(["-c", ask])
        .env("AMENT_PREFIX_PATH", &prefix)
        .output();
    let answer = Answer::from(output.unwrap()).expect_status(0);
    assert_eq!(answer.stdout.trim(), prefix.to_str().unwrap());
}
