//! Bags made by our own simulator, kept between runs of the tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use crate::cli::rotary_sins;
use crate::executables::{executable, target_directory};

/// A run of `rotary-sins simulate`.
#[derive(Clone, Debug)]
pub struct Simulation {
    scheme: String,
    hours: f64,
    rate_hz: f64,
    seed: u64,
}

impl Simulation {
    /// A scheme by name or file.
    pub fn new(scheme: &str, hours: f64, rate_hz: f64, seed: u64) -> Self {
        Self {
            scheme: scheme.to_owned(),
            hours,
            rate_hz,
            seed,
        }
    }

    /// The bag, made where it is not there yet. A new executable makes all bags anew.
    pub fn bag(&self) -> PathBuf {
        static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
        let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let [hours, rate, seed] =
            [self.hours, self.rate_hz, self.seed as f64].map(|number| number.to_string());
        let name = Path::new(&self.scheme)
            .file_stem()
            .unwrap()
            .to_str()
            .unwrap();
        let bag = cache().join(format!("{name}_{hours}h_{rate}Hz_seed{seed}"));
        if !bag.exists() {
            // Written aside first, so that a run that was cut off leaves nothing that looks whole.
            let part = scratch("simulating").join("bag");
            let arguments = [
                ["simulate", "--scheme", &self.scheme],
                ["--hours", &hours, "--rate"],
                [&rate, "--seed", &seed],
            ];
            let output = ["--output", part.to_str().unwrap()];
            let _ = rotary_sins(&[&arguments.concat()[..], &output[..]].concat()).expect_status(0);
            fs::rename(&part, &bag).unwrap();
        }
        bag
    }
}

/// Folder of the bags of this executable; those of an older one are removed.
fn cache() -> PathBuf {
    let modified = fs::metadata(executable("rotary-sins"))
        .and_then(|file| file.modified())
        .unwrap();
    let all = target_directory().join("test-bags");
    let folder = all.join(
        modified
            .duration_since(UNIX_EPOCH)
            .unwrap()
            .as_nanos()
            .to_string(),
    );
    if !folder.exists() {
        fs::remove_dir_all(&all).ok();
        fs::create_dir_all(&folder).unwrap();
    }
    folder
}

/// An empty folder for the files of one test, in the target folder; what an earlier run left in it is gone.
pub fn scratch(test: &str) -> PathBuf {
    let folder = target_directory().join("test-scratch").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The one MCAP file of a bag folder.
pub fn mcap_of(bag: &Path) -> PathBuf {
    if bag.is_file() {
        return bag.to_owned();
    }
    fs::read_dir(bag)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .find(|path| {
            path.extension()
                .is_some_and(|extension| extension == "mcap")
        })
        .unwrap_or_else(|| panic!("{}: no .mcap file in it", bag.display()))
}

/// Copies the MCAP file of a bag to `to`, changed by `change`.
pub fn copy_bag(bag: &Path, to: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(mcap_of(bag)).unwrap();
    change(&mut bytes);
    fs::write(to, bytes).unwrap();
}
