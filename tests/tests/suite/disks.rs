//! Disks that are full, slow or silent, and processes that are killed while they write.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use bags::{Bag, Selection, cdr};
use ros_node::Qos;
use ros2_interfaces::sensor_msgs::Imu;
use rotary_sins_msgs::SelfCalibrationEstimate;
use suite_tests::{
    Listener, Program, Scene, isolated, namespaces_are_permitted, rotary_sins, skip, text,
    wait_until,
};

const NO_DISK: &str = "the kernel does not let this test mount a small disk";

/// A disk of 40 MiB that only its own mount namespace knows, and goes with it.
struct SmallDisk {
    holder: Child,
}

impl SmallDisk {
    const PLACE: &str = "/mnt";

    /// Whether the kernel lets a test mount one: looked at before the namespace of the test, in one that goes with its process.
    fn are_permitted() -> bool {
        let mount = format!("mount -t tmpfs -o size=40m none {}", Self::PLACE);
        let mounts = |as_root: &[&str]| {
            Command::new("unshare")
                .args(as_root)
                .args(["--mount", "bash", "-c", &mount])
                .stderr(Stdio::null())
                .status()
                .is_ok_and(|status| status.success())
        };
        namespaces_are_permitted() && (mounts(&[]) || mounts(&["--map-root-user"]))
    }

    /// `None` where the kernel refuses.
    fn new() -> Option<Self> {
        let script = format!(
            "mount -t tmpfs -o size=40m none {} && echo mounted && exec sleep infinity",
            Self::PLACE
        );
        let mut holder = Command::new("unshare")
            .args(["--mount", "bash", "-c", &script])
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        let mut line = [0; 8];
        let mut told = holder.stdout.take()?;
        let mounted = std::io::Read::read_exact(&mut told, &mut line);
        if mounted.is_err() {
            holder.wait().ok()?;
            return None;
        }
        Some(Self { holder })
    }

    /// A program that sees it.
    fn program(&self, label: &str, name: &str) -> Program {
        Program::at(label, PathBuf::from("/usr/bin/nsenter"))
            .arg(format!("--mount=/proc/{}/ns/mnt", self.holder.id()))
            .arg(Program::new(name).path())
    }

    /// What stands on it, from outside.
    fn outside(&self, name: &str) -> PathBuf {
        let root = format!("/proc/{}/root{}", self.holder.id(), Self::PLACE);
        Path::new(&root).join(name)
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        self.holder.kill().unwrap();
        self.holder.wait().unwrap();
    }
}

/// How many messages a bag has that can be read, and whether that is all of it.
fn readable(bag: &Path) -> (usize, bool) {
    let bag = Bag::open(bag).unwrap();
    let mut messages = bag.messages(&Selection::default());
    let mut count = 0;
    while messages.next().is_some() {
        count += 1;
    }
    let whole = bag.warnings().is_empty() && messages.warnings().is_empty();
    (count, whole)
}

fn table() -> Program {
    Program::new("imu_simulator")
        .parameter("imu_rate_hz", "50.0")
        .parameter("speed", "20.0")
}

/// A disk that refuses a write ends the recording by itself, with a line and status 1. What is in whole chunks can be read.
#[test]
fn a_full_disk_ends_the_recording() {
    if !SmallDisk::are_permitted() {
        return skip(NO_DISK);
    }
    isolated(|| {
        let disk = SmallDisk::new().expect(NO_DISK);
        let scene = Scene::new("full_disk");
        let mut table = scene.start_apart(&table());
        let bag = format!("{}/bag", SmallDisk::PLACE);
        let record = format!("record /imu/data_raw --output {bag}");
        let mut recorder =
            scene.start_apart(&disk.program("recorder", "rotary-sins").args(&record));
        recorder.wait_for_line("recording /imu/data_raw");
        wait_until("two chunks are recorded", || {
            let file = disk.outside("bag").join("bag_0.mcap");
            fs::metadata(file).is_ok_and(|file| file.len() > 600_000)
        });
        // Somebody else fills the disk, to the last byte.
        let mut other = fs::File::create(disk.outside("other")).unwrap();
        while other.write(&[0; 4096]).is_ok_and(|written| written > 0) {}
        let status = recorder.wait();
        table.interrupt();
        let log = recorder.log();
        assert_eq!(status.code(), Some(1), "{log}");
        // Whichever is noticed first: that it is full, or that it refuses a write.
        let told = ["the disk is full", "the disk takes no more"];
        assert!(told.iter().any(|words| log.contains(words)), "{log}");
        assert!(!log.contains("whole up to then"), "{log}");
        // On this disk nothing has room any more, not even what is left for the end of the bag.
        let (count, _) = readable(&disk.outside("bag").join("bag_0.mcap"));
        assert!(count > 1000, "{count}");
    });
}

/// A disk that comes near its end ends the recording while there is room for the end of the bag: the bag is whole, and `info` says so.
#[test]
fn a_disk_that_fills_up_leaves_a_whole_bag() {
    if !SmallDisk::are_permitted() {
        return skip(NO_DISK);
    }
    isolated(|| {
        let disk = SmallDisk::new().expect(NO_DISK);
        let scene = Scene::new("filling_disk");
        let mut table = scene.start_apart(&table());
        let bag = format!("{}/bag", SmallDisk::PLACE);
        let record = format!("record /imu/data_raw --output {bag}");
        let mut recorder =
            scene.start_apart(&disk.program("recorder", "rotary-sins").args(&record));
        recorder.wait_for_line("recording /imu/data_raw");
        wait_until("something is recorded", || {
            let file = disk.outside("bag").join("bag_0.mcap");
            fs::metadata(file).is_ok_and(|file| file.len() > 100_000)
        });
        fs::write(disk.outside("other"), vec![0; 30 << 20]).unwrap();
        let status = recorder.wait();
        table.interrupt();
        let log = recorder.log();
        assert_eq!(status.code(), Some(1), "{log}");
        assert!(log.contains("the bag is whole up to then"), "{log}");
        let bag = disk.outside("bag");
        let (count, whole) = readable(&bag);
        assert!(whole && count > 1000, "{count}");
        let told = rotary_sins(&["info", text(&bag)]).expect_status(0);
        assert!(told.stderr.is_empty(), "{}", told.stderr);
    });
}

/// A recorder that is killed costs at most the chunk that was being filled.
#[test]
fn a_killed_recorder_loses_its_last_chunk_at_most() {
    isolated(|| {
        let scene = Scene::new("killed_recorder");
        let listener = Listener::new();
        let samples = listener.hear::<Imu>("/imu/data_raw", Qos::reliable(10_000));
        let bag = scene.folder().join("bag");
        // Of an earlier run of this test.
        let _none = fs::remove_dir_all(&bag);
        let mut recorder = scene.start_apart(
            &Program::new("rotary-sins")
                .label("recorder")
                .args("record /imu/data_raw --output")
                .arg(&bag),
        );
        let mut table = scene.start_apart(&table());
        recorder.wait_for_line("recording /imu/data_raw");
        let first = samples.wait_for("a sample", |_| true).header.stamp.nanos();
        // 20 000 samples of some 340 bytes: six chunks of a mebibyte.
        let enough = first + 400_000_000_000;
        samples.wait_for("six chunks", |imu| imu.header.stamp.nanos() > enough);
        recorder.kill();
        let heard = samples.latest().unwrap().header.stamp.nanos();
        table.interrupt();
        let file = bag.join("bag_0.mcap");
        let (_, whole) = readable(&file);
        let bag = Bag::open(&file).unwrap();
        let mut messages = bag.messages(&Selection::default());
        let mut kept = 0;
        while let Some(message) = messages.next() {
            kept = cdr::decode::<Imu>(message.data)
                .unwrap()
                .header
                .stamp
                .nanos();
        }
        let lost = (heard - kept) / 20_000_000;
        // A chunk, and the queues on the way to it.
        assert!(!whole && lost < 2 * 3300, "{lost} samples are lost");
    });
}

/// A calibration file on a disk that takes nothing (a pipe that nobody empties) costs its service an answer in time, and nothing else:
/// estimates go on, and Ctrl-C ends the node.
#[test]
fn a_silent_disk_stops_no_estimate() {
    isolated(|| {
        let scene = Scene::new("silent_disk");
        let pipe = scene.folder().join("calibration.yaml");
        // Of an earlier run of this test.
        let _none = fs::remove_file(&pipe);
        let made = Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let _open = OpenOptions::new()
            .read(true)
            .write(true)
            .open(&pipe)
            .unwrap();
        let listener = Listener::new();
        let estimates = listener
            .hear::<SelfCalibrationEstimate>("/self_calibration/estimate", Qos::latched(100));
        let mut calibrator = scene.start_apart(
            &Program::new("self_calibrator")
                .parameter("coarse_alignment_s", "60.0")
                .parameter("calibration_file", text(&pipe)),
        );
        let mut table = scene.start_apart(&table());
        estimates.wait_for("an estimate", |estimate| {
            estimate.phase >= SelfCalibrationEstimate::FINE_ALIGNMENT
        });
        // Filled up, so that the next byte waits.
        let fill = OpenOptions::new().write(true).open(&pipe).unwrap();
        rustix::io::ioctl_fionbio(&fill, true).unwrap();
        while (&fill).write(&[0; 4096]).is_ok() {}
        drop(fill);
        let before = estimates.all().len();
        let saved = listener.trigger("/self_calibrator/save");
        assert!(
            !saved.success && saved.message.contains("calibration.yaml"),
            "{}",
            saved.message
        );
        let again = listener.trigger("/self_calibrator/save");
        assert!(!again.success, "{}", again.message);
        let loaded = listener.trigger("/self_calibrator/load");
        assert!(
            !loaded.success && loaded.message.contains("regular file"),
            "{}",
            loaded.message
        );
        assert!(estimates.all().len() > before + 20, "estimates stood still");
        calibrator.interrupt();
        table.interrupt();
    });
}
