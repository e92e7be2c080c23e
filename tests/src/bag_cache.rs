//! Bags made by our own simulator, kept between runs of the tests.

use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};

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

    /// The bag, made where it is not there yet. It is made anew where the arguments or the executable have changed.
    pub fn bag(&self) -> PathBuf {
        let modified = fs::metadata(executable("rotary-sins"))
            .and_then(|file| file.modified())
            .unwrap();
        let [hours, rate, seed] =
            [self.hours, self.rate_hz, self.seed as f64].map(|number| number.to_string());
        let mut hasher = DefaultHasher::new();
        (&self.scheme, &hours, &rate, &seed, modified).hash(&mut hasher);
        let folder = target_directory().join("test-bags");
        let bag = folder.join(format!("{:016x}", hasher.finish()));
        if !bag.exists() {
            fs::create_dir_all(&folder).unwrap();
            // Written aside first, so that a run that was cut off leaves nothing that looks whole.
            let part = folder.join(format!("{:016x}.{}", hasher.finish(), std::process::id()));
            let _ = rotary_sins(&[
                "simulate",
                "--scheme",
                &self.scheme,
                "--hours",
                &hours,
                "--rate",
                &rate,
                "--seed",
                &seed,
                "--output",
                part.to_str().unwrap(),
            ])
            .expect_status(0);
            if fs::rename(&part, &bag).is_err() {
                // Another test was first.
                fs::remove_dir_all(&part).ok();
            }
        }
        bag
    }
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
