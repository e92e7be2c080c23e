//! Parameters: files, manual and running nodes say what the declarations say.
//!
//! After a change of a declaration `ROTARY_SINS_UPDATE_PARAMETERS=1 cargo test --release -p suite_tests parameters` writes
//! `launch-scripts/config/*.yaml` and `docs/parameters.md` anew.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use ros_node::NodeBuilder;
use ros2_client::parameters::raw::{ParameterType, ParameterValue};
use ros2_client::rcl_interfaces::{
    GetParametersRequest, GetParametersResponse, ListParametersRequest, ListParametersResponse,
};
use serde_json::{Value, json};
use suite_tests::{GUARD, Program, Running, Scene, executable, hold_file, isolated, scratch};

use crate::install::install;

const NODES: [&str; 4] = [
    "imu_simulator",
    "scheme_sequencer",
    "self_calibrator",
    "navigation_compensator",
];

const MANUAL: &str = "# Parameters of the nodes

Every parameter is declared once in the code, with key, default, unit, range and words; from that come this page,
`NODE --help`, the files in `launch-scripts/config` (`NODE --print-parameters`), what `ros2 param describe` answers,
and the options of `rotary-sins simulate`, `align`, `calibrate`, `navigate` and `report` that have the same names.

A value is given by `--ros-args -p KEY:=VALUE` or `--params-file FILE`. An unknown key, a wrong type or a value out
of range is one line that names the key and what was expected, and exit status 2. Parameters are read when a node is
configured; only those that say so may be set later. Beside these, every stream has `qos_overrides`, see [in a ROS
2 stack](in-a-ros2-stack.md).
";

fn printed(node: &str, options: &[&str]) -> String {
    let output = Command::new(executable(node))
        .args(options)
        .output()
        .unwrap();
    assert!(output.status.success(), "{node} {options:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn hold(path: &str, text: &str) {
    hold_file(path, text, "ROTARY_SINS_UPDATE_PARAMETERS");
}

/// The parameter files in the are what the nodes print, with every parameter and its default.
#[test]
fn parameter_files_are_what_nodes_print() {
    for node in NODES {
        hold(
            &format!("launch-scripts/config/{node}.yaml"),
            &printed(node, &["--print-parameters"]),
        );
    }
}

/// The manual's tables of parameters are those of the declarations.
#[test]
fn the_manual_has_every_parameter() {
    let mut text = MANUAL.to_owned();
    for node in NODES {
        let table = printed(node, &["--print-parameters", "--markdown"]);
        write!(text, "\n## {node}\n\n{}\n", table.trim_end()).unwrap();
    }
    hold("docs/parameters.md", &text);
}

/// Values by key.
type Values = BTreeMap<String, Value>;

/// What a parameter file holds for a node, read without any code of the nodes.
fn of_file(file: &Path, node: &str) -> Values {
    let text = fs::read_to_string(file).unwrap();
    let all: BTreeMap<String, BTreeMap<String, Values>> = serde_saphyr::from_str(&text).unwrap();
    all[node]["ros__parameters"].clone()
}

fn plain(value: &ParameterValue) -> Value {
    match value.ptype {
        ParameterType::BOOL => json!(value.boolean_value),
        ParameterType::INTEGER => json!(value.int_value),
        ParameterType::DOUBLE => json!(value.double_value),
        ParameterType::STRING => json!(value.string_value),
        ParameterType::DOUBLE_ARRAY => json!(value.double_array),
        ParameterType::STRING_ARRAY => json!(value.string_array),
        other => panic!("a parameter of type {other}"),
    }
}

/// What a running node says that its parameters are, without the qualities of service of its topics.
fn of_node(node: &str) -> Values {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let no_arguments: [&str; 0] = [];
        let asker = NodeBuilder::new("asker").start(no_arguments).unwrap();
        let list = asker
            .client(
                &format!("{node}/list_parameters"),
                "rcl_interfaces/srv/ListParameters",
            )
            .unwrap();
        let everything = ListParametersRequest {
            prefixes: Vec::new(),
            depth: 0,
        };
        let answer: ListParametersResponse = list.call(everything, GUARD).await.unwrap();
        let mut names = answer.result.names;
        names.retain(|name| !name.starts_with("qos_overrides."));
        let get = asker
            .client(
                &format!("{node}/get_parameters"),
                "rcl_interfaces/srv/GetParameters",
            )
            .unwrap();
        let request = GetParametersRequest {
            names: names.clone(),
        };
        let answer: GetParametersResponse = get.call(request, GUARD).await.unwrap();
        names
            .into_iter()
            .zip(answer.values.iter().map(plain))
            .collect()
    })
}

/// A node of an installation with this parameter file.
fn start(scene: &Scene, prefix: &Path, node: &str, file: &Path) -> Running {
    let program = Program::at(node, prefix.join("lib/rotary_sins").join(node));
    scene.start_apart(&program.parameters_of(file))
}

/// A copy of the file with one line changed.
fn copy_with(scene: &Scene, file: &Path, line: &str, instead: &str) -> PathBuf {
    let text = fs::read_to_string(file).unwrap();
    assert_eq!(text.matches(line).count(), 1, "{}: {line}", file.display());
    let copy = scene.folder().join(file.file_name().unwrap());
    fs::write(&copy, text.replace(line, instead)).unwrap();
    copy
}

/// Every node starts with its installed parameter file and then has, by its own services, exactly what stands in it,
/// which is what it has without the file; a changed value is taken, and a wrong key or value is refused by file and key.
#[test]
fn nodes_take_their_installed_parameter_files() {
    isolated(|| {
        let prefix = scratch("install-config");
        install(&prefix);
        let scene = Scene::new("parameter_files");
        // A line of each file, another value, what it then is; the same line with a value that is refused.
        let changes = [
            ("    turn_deg: 10.0", "self_calibrator", json!(12.5)),
            ("    imu_rate_hz: 100.0", "imu_simulator", json!(50.5)),
            ("    settling_s: 1.0", "scheme_sequencer", json!(1.5)),
            ("    history_s: 60.0", "navigation_compensator", json!(61.5)),
        ];
        for (line, node, changed) in changes {
            let file = prefix.join(format!("share/rotary_sins/config/{node}.yaml"));
            let name = format!("/{node}");
            let installed = of_file(&file, node);
            assert!(installed.len() > 10, "{node}: {installed:?}");
            let mut running = start(&scene, &prefix, node, &file);
            assert_eq!(of_node(&name), installed, "{node} with its file");
            running.interrupt();
            let program = Program::at(node, prefix.join("lib/rotary_sins").join(node));
            let mut running = scene.start_apart(&program);
            assert_eq!(of_node(&name), installed, "{node} without its file");
            running.interrupt();

            let key = line.trim().split(':').next().unwrap();
            let copy = copy_with(&scene, &file, line, &format!("    {key}: {changed}"));
            let mut expected = installed;
            expected.insert(key.to_owned(), changed);
            let mut running = start(&scene, &prefix, node, &copy);
            assert_eq!(of_node(&name), expected, "{node} with another value");
            running.interrupt();

            for (wrong, told) in [
                (
                    format!("    {key}: 'ten'"),
                    format!("parameter '{key}' is 'ten', expected double"),
                ),
                (
                    format!("    {key}: -1e9"),
                    format!("parameter '{key}' is -1000000000.0, expected double"),
                ),
                (
                    format!("    {key}x: 1.0"),
                    format!("unknown parameter '{key}x'; did you mean '{key}'?"),
                ),
            ] {
                let copy = copy_with(&scene, &file, line, &wrong);
                let mut refused = start(&scene, &prefix, node, &copy);
                assert_eq!(refused.wait().code(), Some(2), "{wrong}");
                let log = refused.log();
                assert!(
                    log.contains(&told) && log.contains(copy.to_str().unwrap()),
                    "{log}"
                );
            }
        }
    });
}
