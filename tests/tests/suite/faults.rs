//! Faulty input: one clear line that names file, topic or key, the right exit status, and no panic.

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::PathBuf;
use std::process::Command;

use ros2_interfaces::sensor_msgs::{Imu, NavSatFix, NavSatStatus};
use serde_json::Value;
use suite_tests::{
    Answer, Program, Simulation, alter, alter_imu, calibrate, executable, isolated, mcap_of,
    rotary_sins, sample, scratch, text, without_topic,
};

const IMU: &str = "/imu/data_raw";
/// Standard gravity [m/s²], for a driver that reports specific force in g.
const STANDARD_GRAVITY: f64 = 9.806_65;
const RATE_HZ: usize = 10;

fn at_rest() -> PathBuf {
    Simulation::at_rest().bag()
}

/// A faulty copy of the bag at rest.
fn altered(test: &str, change: impl FnMut(usize, &mut Imu)) -> PathBuf {
    let bag = scratch(test).join("altered.mcap");
    alter_imu(&at_rest(), &bag, change);
    bag
}

fn shift(imu: &mut Imu, seconds: i32) {
    imu.header.stamp.sec += seconds;
}

/// A file that is no bag is refused by name.
#[test]
fn text_file_is_no_bag() {
    let bag = scratch("no_bag").join("notes.mcap");
    std::fs::write(&bag, "not a bag").unwrap();
    calibrate(&bag).expect_refusal(&["notes.mcap"]);
}

/// A bag that is not there is refused by name, by every command that reads one.
#[test]
fn absent_bag_is_refused() {
    for command in ["calibrate", "align", "info", "play"] {
        rotary_sins(&[command, "/nowhere/at/all"]).expect_refusal(&["/nowhere/at/all"]);
    }
}

/// A bag without IMU samples is refused with the topic that is missing and those that are there.
#[test]
fn missing_topic_is_named() {
    let bag = scratch("missing_topic").join("no_imu.mcap");
    without_topic(&at_rest(), &bag, IMU);
    calibrate(&bag).expect_refusal(&["no_imu.mcap", IMU, "/fix"]);
}

/// Without a position nothing can be aligned, and the line says what would help.
#[test]
fn missing_position_is_named() {
    let bag = scratch("missing_position").join("no_fix.mcap");
    without_topic(&at_rest(), &bag, "/fix");
    for command in ["calibrate", "align"] {
        let answer = rotary_sins(&[command, text(&bag), "--json"]);
        answer.expect_refusal(&["no_fix.mcap", "no topic /fix", IMU, "--latitude-deg"]);
    }
}

/// Fixes without a position are none, and the line names their topic.
#[test]
fn fixes_without_position_are_named() {
    let bag = scratch("no_position").join("no_position.mcap");
    alter(&at_rest(), &bag, "/fix", |_, fix: &mut NavSatFix| {
        fix.status.status = NavSatStatus::STATUS_NO_FIX;
    });
    calibrate(&bag).expect_refusal(&["no_position.mcap", "messages of /fix", "--latitude-deg"]);
}

/// A sample that is not finite is left out; the line names the topic, the result counts it as a gap.
#[test]
fn sample_that_is_not_finite_is_left_out() {
    let bag = altered("not_finite", |index, imu| {
        if index == 5000 {
            imu.angular_velocity.y = f64::NAN;
        }
    });
    let answer = calibrate(&bag).expect_status(1);
    answer.expect_words(&[IMU, "not finite"]);
    let json = answer.json();
    assert_eq!(json["gaps"], 1);
    assert!(json["state"].as_array().unwrap().iter().all(Value::is_f64));
}

/// Samples that are missing are counted in the result.
#[test]
fn stamps_that_jump_forward_are_a_gap() {
    let bag = altered("jump_forward", |index, imu| {
        if index >= 5000 {
            shift(imu, 2);
        }
    });
    let json = calibrate(&bag).expect_status(1).json();
    assert_eq!(json["gaps"], 1);
    assert_eq!(json["lost_samples"], 2 * RATE_HZ);
}

/// Stamps that go back by long start the alignment anew: only what comes after counts.
#[test]
fn stamps_that_jump_back_start_anew() {
    let jump = 3000;
    let bag = altered("jump_back", |index, imu| {
        if index >= jump {
            shift(imu, -200);
        }
    });
    let answer = calibrate(&bag).expect_status(1);
    let duration = answer.json()["duration_s"].as_f64().unwrap();
    let after = 720.0 - (jump / RATE_HZ) as f64;
    assert!(
        (duration - after).abs() < 2.0,
        "{duration} s, {after} s after the jump"
    );
}

/// Specific force in g instead of m/s² is no gravity, and the line says so.
#[test]
fn specific_force_in_g_is_refused() {
    let bag = altered("in_g", |_, imu| {
        imu.linear_acceleration.x /= STANDARD_GRAVITY;
        imu.linear_acceleration.y /= STANDARD_GRAVITY;
        imu.linear_acceleration.z /= STANDARD_GRAVITY;
    });
    calibrate(&bag).expect_refusal(&["altered.mcap", "is linear_acceleration in m/s²?"]);
}

/// An option of the command line that does not exist is refused with its name.
#[test]
fn unknown_option_is_named() {
    let answer = rotary_sins(&["calibrate", text(&at_rest()), "--sped", "3"]);
    assert_eq!(answer.status, 2);
    answer.expect_words(&["--sped"]);
}

/// An unknown scheme is refused with the known ones.
#[test]
fn unknown_scheme_is_named() {
    let output = scratch("unknown_scheme").join("bag");
    rotary_sins(&[
        "simulate",
        "--scheme",
        "nine-position",
        "--hours",
        "0.1",
        "--output",
        text(&output),
    ])
    .expect_refusal(&["nine-position", "eight-position"]);
    assert!(!output.exists());
}

fn run_node(name: &str, arguments: &[&str]) -> Answer {
    let mut command = Command::new(executable(name));
    Answer::from(command.arg("--ros-args").args(arguments).output().unwrap())
}

/// Every node refuses a parameter that it does not have, with its name, before it touches the network.
#[test]
fn unknown_parameter_is_named() {
    for node in [
        "imu_simulator",
        "scheme_sequencer",
        "self_calibrator",
        "navigation_compensator",
    ] {
        run_node(node, &["-p", "no_such_key:=1"]).expect_refusal(&[node, "no_such_key"]);
    }
}

/// A value out of its range is refused with key, value and range.
#[test]
fn parameter_out_of_range_is_named() {
    run_node("imu_simulator", &["-p", "imu_rate_hz:=-5.0"]).expect_refusal(&[
        "imu_rate_hz",
        "-5",
        "1.0 to 1000.0",
    ]);
}

/// A parameter file with a key that is not known is refused with file and key.
#[test]
fn unknown_key_of_a_parameter_file_is_named() {
    let file = scratch("parameter_file").join("parameters.yaml");
    std::fs::write(
        &file,
        "self_calibrator:\n  ros__parameters:\n    turn_degrees: 3.0\n",
    )
    .unwrap();
    run_node("self_calibrator", &["--params-file", text(&file)])
        .expect_refusal(&["parameters.yaml", "turn_degrees"]);
}

/// What is read is not written over, under whatever name, and a record that is there is not replaced unless that is asked for; what goes to
/// a device is written to it.
#[test]
fn records_are_not_written_over() {
    let folder = scratch("written_over");
    let bag = folder.join("bag.mcap");
    fs::copy(mcap_of(&sample("eight_position")), &bag).unwrap();
    let before = fs::read(&bag).unwrap();
    let link = folder.join("link.yaml");
    std::os::unix::fs::symlink("bag.mcap", &link).unwrap();
    for output in [&bag, &link] {
        let answer = rotary_sins(&["calibrate", text(&bag), "--output", text(output)]);
        answer.expect_refusal(&["would be written over"]);
    }
    let simulate = ["simulate", "--hours", "0.01", "--output", text(&bag)];
    rotary_sins(&simulate).expect_refusal(&["bag.mcap", "it is there already"]);
    assert_eq!(fs::read(&bag).unwrap(), before);
    let _told = rotary_sins(&[&simulate[..], &["--force"]].concat()).expect_status(0);
    assert_ne!(fs::read(&bag).unwrap(), before);

    let bag = sample("eight_position");
    let there = folder.join("there.yaml");
    fs::write(&there, "of yesterday").unwrap();
    let nowhere = folder.join("none").join("c.yaml");
    for (output, told) in [(&there, "--force replaces it"), (&nowhere, "c.yaml")] {
        let answer = rotary_sins(&["calibrate", text(&bag), "--output", text(output)]);
        answer.expect_refusal(&[told]);
        // Nothing was worked on before.
        assert!(answer.stdout.is_empty(), "{}", answer.stdout);
    }
    assert_eq!(fs::read_to_string(&there).unwrap(), "of yesterday");
    let answer = rotary_sins(&["calibrate", text(&bag), "--output", text(&there), "--force"]);
    assert!(answer.status < 2 && fs::metadata(&there).unwrap().len() > 100);
    let answer = rotary_sins(&["calibrate", text(&bag), "--output", "/dev/null"]);
    assert!(answer.status < 2, "{}", answer.stderr);
    let kind = fs::metadata("/dev/null").unwrap().file_type();
    assert!(kind.is_char_device());
}

/// `record` over a record ends with a line and leaves it as it was.
#[test]
fn record_does_not_empty_a_record() {
    isolated(|| {
        let bag = scratch("record_over").join("bag.mcap");
        fs::copy(mcap_of(&sample("eight_position")), &bag).unwrap();
        let before = fs::read(&bag).unwrap();
        let answer = rotary_sins(&["record", "--duration", "1", "--output", text(&bag)]);
        assert_ne!(answer.status, 0, "{}", answer.stderr);
        answer.expect_words(&["bag.mcap", "it is there already"]);
        assert_eq!(fs::read(&bag).unwrap(), before);
    });
}

/// A bag of which something cannot be read has a status of its own; a whole one has 0.
#[test]
fn a_damaged_bag_has_its_own_status() {
    for (name, status) in [("eight_position", 0), ("cut_off", 3), ("damaged_chunk", 3)] {
        let answer = rotary_sins(&["info", text(&sample(name))]).expect_status(status);
        assert_eq!(answer.stderr.is_empty(), status == 0, "{}", answer.stderr);
    }
}

/// What never ends or never begins is refused at once, as a bag, a calibration or a scheme.
#[test]
fn devices_and_pipes_are_refused() {
    let folder = scratch("pipes");
    let fifo = folder.join("fifo");
    let made = Command::new("mkfifo").arg(&fifo).status();
    assert!(made.unwrap().success());
    let bag = sample("eight_position");
    for path in ["/dev/zero", text(&fifo)] {
        let refused = |arguments: &[&str]| {
            rotary_sins(arguments).expect_refusal(&[path, "expected a regular file"]);
        };
        refused(&["info", path]);
        refused(&["navigate", text(&bag), "--calibration", path]);
        refused(&[
            "simulate",
            "--scheme",
            path,
            "--output",
            text(&folder.join("b")),
        ]);
    }
}

/// An argument that is no text is a line, for the command line as for a node.
#[test]
fn an_argument_that_is_no_text_is_a_line() {
    use std::os::unix::ffi::OsStrExt;
    let argument = std::ffi::OsStr::from_bytes(b"b\xffg.mcap");
    for (name, first) in [("rotary-sins", "info"), ("self_calibrator", "--help")] {
        let output = Command::new(Program::new(name).path())
            .arg(first)
            .arg(argument)
            .output();
        Answer::from(output.unwrap()).expect_refusal(&["no UTF-8"]);
    }
}

/// Thresholds that mean nothing, and steps that are none, are refused by the name of the option.
#[test]
fn numbers_that_mean_nothing_are_refused() {
    let bag = sample("eight_position");
    for (option, value) in [
        ("--azimuth-threshold-arcmin", "nan"),
        ("--azimuth-threshold-arcmin", "-1"),
        ("--gyroscope-drift-threshold-deg-per-hour", "nan,nan,nan"),
        ("--update-interval-s", "nan"),
        ("--update-interval-s", "0"),
        ("--update-interval-s", "1e9"),
    ] {
        let given = format!("{option}={value}");
        let answer = rotary_sins(&["calibrate", text(&bag), &given]);
        answer.expect_refusal(&[option.trim_start_matches("--")]);
    }
}

/// 57 600 positions off the globe cost one line, and time in proportion to their number.
#[test]
fn many_bad_positions_are_one_line() {
    let from = bags::Bag::open(at_rest()).unwrap();
    let path = scratch("bad_positions").join("bad.mcap");
    let mut to = bags::BagWriter::create(&path, bags::WriteOptions::default()).unwrap();
    let ids: Vec<bags::TopicId> = from
        .topics()
        .iter()
        .map(|topic| {
            let topic = bags::NewTopic {
                name: topic.name.clone(),
                type_name: topic.type_name.clone(),
                schema: Some(topic.schema.clone()),
                type_hash: topic.type_hash.clone(),
                qos: topic.qos.clone(),
            };
            to.add_topic(topic).unwrap()
        })
        .collect();
    let mut messages = from.messages(&bags::Selection::default());
    let mut bad = 0;
    while let Some(message) = messages.next() {
        let time = message.log_time;
        let id = ids[message.topic];
        to.write_payload(id, time, time, message.data).unwrap();
        if from.topics()[message.topic].name == "/fix" {
            let mut fix: NavSatFix = bags::cdr::decode(message.data).unwrap();
            fix.latitude = 95.0;
            for _ in 0..80 {
                to.write(id, time, &fix).unwrap();
                bad += 1;
            }
        }
    }
    to.finish().unwrap();
    assert!(bad >= 57_600, "{bad}");
    let answer = calibrate(&path).expect_status(1);
    let lines: Vec<&str> = answer
        .stderr
        .lines()
        .filter(|line| line.contains("/fix"))
        .collect();
    assert!((1..=2).contains(&lines.len()), "{lines:#?}");
    assert!(lines[0].contains("latitude"), "{lines:#?}");
}

/// Nothing is navigated with a calibration that was inconsistent, or with a drift that no gyroscope has; the line names the key.
#[test]
fn calibrations_that_cannot_be_are_not_navigated_with() {
    let bag = sample("eight_position");
    let folder = scratch("calibrations");
    let good = folder.join("good.yaml");
    let _made = rotary_sins(&["calibrate", text(&bag), "--output", text(&good)]).expect_status(0);
    let written = fs::read_to_string(&good).unwrap();
    // Without the section for the machine the numbers for people count.
    let (people, _si) = written.split_once("\nsi:").unwrap();
    let navigate = |name: &str, said: &str, instead: &str| {
        let file = folder.join(name);
        fs::write(&file, people.replacen(said, instead, 1) + "\n").unwrap();
        rotary_sins(&["navigate", text(&bag), "--calibration", text(&file)])
    };
    let _taken = navigate("same.yaml", "", "").expect_status(0);
    navigate("one.yaml", "phase: converged", "phase: inconsistent")
        .expect_refusal(&["one.yaml", "phase is inconsistent"]);
    let key = "gyroscope_drift_deg_per_hour:\n- ";
    navigate("other.yaml", key, &format!("{key}1e6 # not "))
        .expect_refusal(&["other.yaml", "gyroscope_drift in rad/s"]);
}

/// A push of the ship that the filter was not told of: the record is inconsistent by the exit status, JSON, YAML and the page.
#[test]
fn an_inconsistent_record_is_told_everywhere() {
    let folder = scratch("inconsistent");
    let [bag, yaml, page] = ["pushed.mcap", "pushed.yaml", "pushed.html"].map(|n| folder.join(n));
    alter_imu(
        &Simulation::new("static", 0.3, 10.0, 8).bag(),
        &bag,
        |index, imu| {
            if index > 6000 {
                imu.linear_acceleration.x += 0.01 * (index as f64 * 0.002).sin();
            }
        },
    );
    let arguments = ["calibrate", text(&bag), "--json", "--output", text(&yaml)];
    let json = rotary_sins(&arguments).expect_status(1).json();
    assert_eq!(json["phase"], "inconsistent", "{json}");
    assert_eq!(json["verdict"]["consistent"], false, "{}", json["verdict"]);
    let written = fs::read_to_string(&yaml).unwrap();
    assert!(written.contains("\nphase: inconsistent\n"), "{written}");
    let told = rotary_sins(&["calibrate", text(&bag)]).expect_status(1);
    assert!(told.stdout.contains("inconsistent"), "{}", told.stdout);
    let arguments = ["report", text(&bag), "--json", "--output", text(&page)];
    let json = rotary_sins(&arguments).expect_status(1).json();
    assert_eq!(json["phase"], "inconsistent", "{json}");
    assert_eq!(json["verdict"], "inconsistent", "{json}");
    let page = fs::read_to_string(&page).unwrap();
    assert!(page.contains("inconsistent"));
}

/// Every second stamp is that of the sample before: half of the record is not used, which text, JSON, page and exit status tell.
#[test]
fn repeated_stamps_are_told_everywhere() {
    let folder = scratch("repeated");
    let [bag, page] = ["repeated.mcap", "repeated.html"].map(|name| folder.join(name));
    let mut before = None;
    alter_imu(&Simulation::converging().bag(), &bag, |index, imu| {
        if index % 2 == 0 {
            before = Some(imu.header.stamp);
        } else {
            imu.header.stamp = before.unwrap();
        }
    });
    let repeated = 27_000;
    let json = calibrate(&bag).expect_status(1).json();
    assert_eq!(json["repeated_samples"], repeated, "{json}");
    assert_eq!(json["verdict"]["converged"], false, "{}", json["verdict"]);
    let told = rotary_sins(&["calibrate", text(&bag)]).expect_status(1);
    assert!(told.stdout.contains("27000"), "{}", told.stdout);
    let arguments = ["report", text(&bag), "--json", "--output", text(&page)];
    let json = rotary_sins(&arguments).expect_status(1).json();
    let faults = json["faults"].to_string();
    assert!(faults.contains("27000 stamps repeated"), "{faults}");
    let page = fs::read_to_string(&page).unwrap();
    assert!(page.contains("27000 stamps repeated"));
}

/// `NODE --help | head`: a reader that has gone is no fault of who writes, and nobody panics.
#[test]
fn a_reader_that_has_gone_is_no_fault() {
    let nodes = [
        "imu_simulator",
        "scheme_sequencer",
        "self_calibrator",
        "navigation_compensator",
    ];
    let asked = nodes
        .iter()
        .flat_map(|node| [(*node, "--help"), (*node, "--print-parameters")])
        .chain([("rotary-sins", "--help")]);
    for (name, option) in asked {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = Command::new(executable(name))
            .arg(option)
            .stdout(writer)
            .output()
            .unwrap();
        let answer = Answer::from(output).expect_status(0);
        assert!(
            answer.stderr.is_empty(),
            "{name} {option}: {}",
            answer.stderr
        );
    }
}

/// A page or a parameter file that is there is replaced by `--force` alone, and that is said before anything is worked on.
#[test]
fn pages_are_not_written_over() {
    let bag = sample("eight_position");
    let folder = scratch("pages");
    let there = folder.join("there.html");
    let own = folder.join("run.mcap");
    fs::copy(mcap_of(&bag), &own).unwrap();
    fs::write(folder.join("run.html"), "of yesterday").unwrap();
    fs::write(&there, "of yesterday").unwrap();
    let commands = [
        vec!["report", text(&bag), "--output", text(&there)],
        vec!["report", text(&own)],
        vec!["allan", text(&bag), "--output", text(&there)],
        vec!["allan", text(&bag), "--parameters", text(&there)],
        vec!["experiment", "--output", text(&there)],
        vec!["assurance", "--output", text(&there)],
    ];
    for command in commands {
        let answer = rotary_sins(&command);
        answer.expect_refusal(&[".html", "it is there already; --force replaces it"]);
        assert!(answer.stdout.is_empty(), "{command:?}: {}", answer.stdout);
    }
    for name in ["there.html", "run.html"] {
        assert_eq!(
            fs::read_to_string(folder.join(name)).unwrap(),
            "of yesterday"
        );
    }
    let forced = ["report", text(&bag), "--output", text(&there), "--force"];
    let _made = rotary_sins(&forced).expect_status(0);
    assert!(fs::metadata(&there).unwrap().len() > 10_000);
}
