//! Where the executables are.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Folder with the executables; handed on to the inner run of an isolated test.
pub(crate) const BIN_DIR: &str = "ROTARY_SINS_BIN_DIR";

/// All executables of the suite.
pub const EXECUTABLES: [&str; 5] = [
    "imu_simulator",
    "scheme_sequencer",
    "self_calibrator",
    "navigation_compensator",
    "rotary-sins",
];

/// Root of the repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_owned()
}

/// Cargo's target folder: this test stands in its `PROFILE/deps`.
pub fn target_directory() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.ancestors().nth(3).unwrap().to_owned()
}

/// Folder of the release executables, built first unless `ROTARY_SINS_BIN_DIR` names another.
pub(crate) fn executables() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| match std::env::var_os(BIN_DIR) {
        Some(folder) => PathBuf::from(folder),
        None => build(),
    })
}

fn build() -> PathBuf {
    let target = target_directory();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["build", "--release", "--quiet", "--workspace", "--bins"])
        .current_dir(repository())
        .arg("--target-dir")
        .arg(&target)
        .status()
        .unwrap();
    assert!(status.success(), "building the executables: {status}");
    target.join("release")
}

/// Path of one of the suite's executables, e.g. `self_calibrator`.
pub fn executable(name: &str) -> PathBuf {
    let path = executables().join(name);
    assert!(
        path.is_file(),
        "{}: not there; build it with `cargo build --release --workspace --bins`",
        path.display()
    );
    path
}
