//! `rotary-sins allan`: the noise of the sensors, against an independent program, known truth and a real record.

use std::io::Write as _;
use std::path::Path;

use ros2_interfaces::sensor_msgs::Imu;
use serde_json::Value;
use suite_tests::{
    Answer, Program, Simulation, data_file, messages, numbers, repository, rotary_sins, scratch,
    skip, text,
};

/// The simulator's white noise: 0.001 deg/√h and 10 ug/√Hz.
const WHITE: [f64; 2] = [2.908_882e-7, 9.806_65e-5];

/// Overlapping deviations of `allantools`, with its bands for white noise, as JSON: file of numbers, axes, rate, factors.
const ALLANTOOLS: &str = r"
import json, sys
import allantools, numpy
data = numpy.fromfile(sys.argv[1]).reshape(-1, 6)
rate, factors = float(sys.argv[2]), json.loads(sys.argv[3])
found = {'deviation': [], 'degrees': [], 'band': []}
for axis in data.T:
    taus = [factor / rate for factor in factors]
    _, deviation, _, _ = allantools.oadev(axis - axis.mean(), rate=rate, data_type='freq', taus=taus)
    found['deviation'].append(list(deviation))
for factor in factors:
    degrees = allantools.edf_greenhall(0, 2, factor, len(data) + 1, overlapping=True, modified=False)
    found['degrees'].append(degrees)
    found['band'].append(allantools.confidence_interval(1.0, degrees, ci=0.95))
print(json.dumps(found))
";

fn allan(bag: &Path, more: &[&str]) -> Value {
    rotary_sins(&[&["allan", text(bag), "--json"], more].concat())
        .expect_status(0)
        .json()
}

/// What `allantools` makes of the samples of a bag; `None`, with a line, where it is not installed.
fn allantools(bag: &Path, skipped: usize, report: &Value) -> Option<Value> {
    let prefix = std::env::var_os("ROTARY_SINS_PYTHON")
        .map_or_else(|| repository().join("target/python"), Into::into);
    if !prefix.join(".packages").exists() {
        skip("there is no allantools: run python/environment.sh");
        return None;
    }
    let file = scratch("allantools").join("samples.f64");
    let mut out = std::io::BufWriter::new(std::fs::File::create(&file).unwrap());
    for imu in messages::<Imu>(bag, "/imu/data_raw").iter().skip(skipped) {
        let (rate, force) = (imu.angular_velocity, imu.linear_acceleration);
        for value in [rate.x, rate.y, rate.z, force.x, force.y, force.z] {
            out.write_all(&value.to_le_bytes()).unwrap();
        }
    }
    out.into_inner().unwrap();
    let program = Program::at("python", prefix.join("bin/python"))
        .arg("-c")
        .arg(ALLANTOOLS)
        .arg(&file)
        .arg((1.0 / report["interval_s"].as_f64().unwrap()).to_string())
        .arg(report["averaging_factor"].to_string());
    let output = program.command().output().unwrap();
    Some(Answer::from(output).expect_status(0).json())
}

/// Deviations of all axes are those of `allantools` where every start counts, and within a tenth of their own uncertainty
/// beyond; degrees of freedom and bands of white noise are its own.
#[test]
fn deviations_are_those_of_allantools() {
    let bag = Simulation::new("static", 1.0, 50.0, 11).bag();
    let report = allan(&bag, &[]);
    // The first sample ends an interval of unknown length.
    let Some(other) = allantools(&bag, 1, &report) else {
        return;
    };
    let factors = numbers(&report["averaging_factor"]);
    assert!(
        factors.len() >= 16 && factors.last() >= Some(&32768.0),
        "{factors:?}"
    );
    for (k, axis) in report["axes"].as_array().unwrap().iter().enumerate() {
        let ours =
            ["deviation", "degrees_of_freedom", "lower", "upper"].map(|key| numbers(&axis[key]));
        let [deviation, degrees, lower, upper] = ours;
        let theirs = numbers(&other["deviation"][k]);
        assert_eq!(theirs.len(), deviation.len());
        for (i, factor) in factors.iter().enumerate() {
            let ratio = deviation[i] / theirs[i];
            let allowed = if *factor <= 1024.0 {
                1e-7
            } else {
                0.1 / degrees[i].sqrt()
            };
            assert!(
                (ratio - 1.0).abs() < allowed,
                "{}, {factor}: {ratio}",
                axis["name"]
            );
            if axis["noise_type"][i] == "white" && *factor <= 1024.0 {
                let wanted = other["degrees"][i].as_f64().unwrap();
                assert!(
                    (degrees[i] / wanted - 1.0).abs() < 0.03,
                    "{factor}: {}",
                    degrees[i]
                );
                let band = numbers(&other["band"][i]);
                for (ours, theirs) in [(lower[i], band[0]), (upper[i], band[1])] {
                    let ratio = ours / deviation[i] / theirs;
                    assert!((ratio - 1.0).abs() < 0.02, "{factor}: {ratio}");
                }
            }
        }
    }
}

/// The simulator's white noise is found within its sigmas on every axis, nothing else is, and the parameter file is taken by both
/// nodes; the page stands alone and has both pictures.
#[test]
fn what_was_simulated_is_found_and_handed_on() {
    let bag = Simulation::new("static", 1.0, 50.0, 11).bag();
    let folder = scratch("allan");
    let [page, file] = ["allan.html", "noise.yaml"].map(|name| folder.join(name));
    let report = allan(
        &bag,
        &["--output", text(&page), "--parameters", text(&file)],
    );
    for (k, axis) in report["axes"].as_array().unwrap().iter().enumerate() {
        let white = &axis["white_noise"];
        let [value, std] = ["value", "std"].map(|key| white[key].as_f64().unwrap());
        assert!((value - WHITE[k / 3]).abs() < 3.5 * std, "{axis}");
        assert!(
            axis["quantization"]["value"].is_null() && axis["count"].is_null(),
            "{axis}"
        );
        assert!(axis["reduced_chi_square"].as_f64().unwrap() < 4.0, "{axis}");
    }
    let html = std::fs::read_to_string(&page).unwrap();
    assert_eq!(html.matches("<svg").count(), 2);
    assert!(
        html.contains("angle_random_walk_deg_per_sqrt_hour: 0.00"),
        "{html}"
    );
    // A node takes its parameters before it looks for its domain, so that only what is wrong with the domain is left to say.
    for node in ["self_calibrator", "navigation_compensator"] {
        let program = Program::new(node)
            .parameters_of(&file)
            .environment("ROS_DOMAIN_ID", "none");
        let answer = Answer::from(program.command().output().unwrap());
        answer.expect_refusal(&[node, "ROS_DOMAIN_ID"]);
    }
    let noise = std::fs::read_to_string(&file).unwrap();
    assert_eq!(
        noise
            .matches("angle_random_walk_deg_per_sqrt_hour: 0.00")
            .count(),
        2,
        "{noise}"
    );
}

/// The real ring-laser record: the deviations of `allantools`, its whole counts of 0.1 arcsec and 125 ug s, a slope of −1
/// where they rule, and the people on board as what no noise explains.
#[test]
fn the_ring_laser_record_shows_its_counts() {
    let Some(bag) = data_file("rlg_static.mcap") else {
        return;
    };
    let report = allan(&bag, &["--start-offset", "1200", "--duration", "300"]);
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("do not explain the curve"), "{warnings}");
    for (k, axis) in report["axes"].as_array().unwrap().iter().enumerate() {
        let count = axis["count"].as_f64().unwrap();
        let expected = if k < 3 {
            0.1 / 206_264.806
        } else {
            125e-6 * 9.806_65
        };
        assert!((count / expected - 1.0).abs() < 0.01, "{axis}");
        let deviation = numbers(&axis["deviation"]);
        if k >= 3 {
            let slope = (deviation[3] / deviation[0]).log2() / 3.0;
            assert!((-1.2..-0.6).contains(&slope), "{}: {slope}", axis["name"]);
        }
    }
    let whole = allan(&bag, &[]);
    assert!(whole["samples"].as_u64().unwrap() > 184_000, "{whole}");
}

/// What cannot be used is refused by name: no probability, no rest.
#[test]
fn what_cannot_be_used_is_refused() {
    let bag = Simulation::at_rest().bag();
    rotary_sins(&["allan", text(&bag), "--confidence", "1"])
        .expect_refusal(&["confidence is 1", "less than 1"]);
    rotary_sins(&["allan", text(&bag), "--duration", "3"])
        .expect_refusal(&["samples at rest", "at least 64"]);
}
