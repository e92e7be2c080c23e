//! What several tests need and takes long to make: kept below the target folder, as long as the executables stay the same.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use crate::cli::rotary_sins;
use crate::executables::{executable, target_directory};
use crate::isolation::current_test;

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

    /// 12 minutes at rest, 10 Hz: enough to align, too little to calibrate.
    pub fn at_rest() -> Self {
        Self::new("static", 0.2, 10.0, 3)
    }

    /// An hour and a half of the eight positions, 10 Hz, which converges after about an hour.
    pub fn converging() -> Self {
        Self::new("eight-position", 1.5, 10.0, 3)
    }

    /// The bag, made where it is not there yet. A new executable makes all bags anew.
    pub fn bag(&self) -> PathBuf {
        let [hours, rate, seed] =
            [self.hours, self.rate_hz, self.seed as f64].map(|number| number.to_string());
        let scheme = Path::new(&self.scheme)
            .file_stem()
            .unwrap()
            .to_str()
            .unwrap();
        let name = format!("{scheme}_{hours}h_{rate}Hz_seed{seed}");
        made_once(&name, &["rotary-sins"], |bag| {
            let arguments = [
                ["simulate", "--scheme", &self.scheme],
                ["--hours", &hours, "--rate"],
                [&rate, "--seed", &seed],
            ];
            let output = ["--output", bag.to_str().unwrap()];
            let _ = rotary_sins(&[&arguments.concat()[..], &output[..]].concat()).expect_status(0);
        })
    }
}

/// A file or folder that `make` writes where it is not there yet, made by these executables; tests in other processes wait for it.
pub(crate) fn made_once(name: &str, by: &[&str], make: impl FnOnce(&Path)) -> PathBuf {
    let folder = cache(by);
    let made = folder.join(name);
    let lock = File::create(folder.join(format!("{name}.lock"))).unwrap();
    lock.lock().unwrap();
    if !made.exists() {
        // Written aside first, so that a run that was cut off leaves nothing that looks whole.
        let part = part_of(name, by);
        remove(&part);
        make(&part);
        fs::rename(&part, &made).unwrap();
    }
    made
}

/// Where [`made_once`] has it written.
pub(crate) fn part_of(name: &str, by: &[&str]) -> PathBuf {
    cache(by).join(format!("{name}.part"))
}

/// Folder of what these executables made. It stays as long as this process lives; that of older ones is removed where no
/// other process uses it any more.
fn cache(by: &[&str]) -> PathBuf {
    let modified = by.iter().map(|name| {
        let file = fs::metadata(executable(name)).unwrap();
        let since = file.modified().unwrap().duration_since(UNIX_EPOCH);
        since.unwrap().as_nanos()
    });
    let key = modified.max().unwrap().to_string();
    let all = target_directory().join("test-made").join(by.join("+"));
    fs::create_dir_all(&all).unwrap();
    let lock = File::create(all.join("lock")).unwrap();
    lock.lock().unwrap();
    let folder = all.join(&key);
    fs::create_dir_all(&folder).unwrap();
    // Locks of this kind are taken and given up only by who holds the one above, or by the end of a process.
    let in_use = |folder: &Path| File::create(folder.with_extension("in-use")).unwrap();
    {
        let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
        held.entry(folder.clone()).or_insert_with(|| {
            let file = in_use(&folder);
            file.lock_shared().unwrap();
            file
        });
    }
    for entry in fs::read_dir(&all).unwrap() {
        let path = entry.unwrap().path();
        if path != folder && path.is_dir() && in_use(&path).try_lock().is_ok() {
            remove(&path);
            remove(&path.with_extension("in-use"));
        }
    }
    folder
}

/// Folders that this process uses, each with the lock that keeps others from removing it.
static HELD: Mutex<BTreeMap<PathBuf, File>> = Mutex::new(BTreeMap::new());

fn remove(path: &Path) {
    if path.is_dir() {
        fs::remove_dir_all(path).unwrap();
    } else if path.exists() {
        fs::remove_file(path).unwrap();
    }
}

/// An empty folder for files of this test, in the target folder; what an earlier run left in it is gone.
pub fn scratch(name: &str) -> PathBuf {
    let test = current_test().replace("::", ".");
    let folder = target_directory()
        .join("test-scratch")
        .join(test)
        .join(name);
    remove(&folder);
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
