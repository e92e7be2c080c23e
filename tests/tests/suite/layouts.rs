//! The layouts for Foxglove, PlotJuggler and RViz, and the model of the table: every topic, field and frame that they name is
//! there in a run of the nodes.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;

use nalgebra::{Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use serde_json::Value;
use suite_tests::{RecordedRun, isolated, repository};

/// What `view.launch.py` publishes beside the nodes.
const MODEL: &str = "/robot_description";
const ODOMETRY: &str = "nav_msgs/msg/Odometry";
const JOINT_STATE: &str = "sensor_msgs/msg/JointState";

fn text(path: &str) -> String {
    fs::read_to_string(repository().join("launch-scripts").join(path)).unwrap()
}

/// What is wrong with a layout, a line each.
#[derive(Default)]
struct Problems(Vec<String>);

impl Problems {
    fn note<T>(&mut self, result: Result<T, String>) -> Option<T> {
        result.map_err(|problem| self.0.push(problem)).ok()
    }
}

fn topic_of_type<'r>(
    run: &'r RecordedRun,
    name: &str,
    types: &[&str],
) -> Result<&'r Value, String> {
    let (type_name, newest) = run
        .topics
        .get(name)
        .ok_or_else(|| format!("{name}: nobody publishes it"))?;
    if !types.is_empty() && !types.contains(&type_name.as_str()) {
        return Err(format!("{name} is a {type_name}, expected {types:?}"));
    }
    Ok(newest)
}

fn frame(run: &RecordedRun, name: &str) -> Result<(), String> {
    let is_parent = |transform: &&_| parent(transform) == name;
    if run.transforms.contains_key(name) || run.transforms.values().any(|t| is_parent(&t)) {
        Ok(())
    } else {
        Err(format!("{name}: no frame of this name"))
    }
}

fn parent(transform: &ros2_interfaces::geometry_msgs::TransformStamped) -> &str {
    &transform.header.frame_id
}

/// `name` or `name[3]` within a message.
fn step<'v>(value: &'v Value, step: &str) -> Option<&'v Value> {
    let (name, index) = match step.split_once('[') {
        Some((name, rest)) => (name, Some(rest.strip_suffix(']')?.parse::<usize>().ok()?)),
        None => (step, None),
    };
    let value = value.get(name)?;
    index.map_or(Some(value), |index| value.get(index))
}

fn is_plain(value: &Value) -> bool {
    !value.is_object() && !value.is_array()
}

/// A message path of Foxglove, with the functions that stand behind it: `/topic.field[0].part.@mul(2)`.
fn message_path(run: &RecordedRun, path: &str) -> Result<(), String> {
    let (topic, mut rest) = path.split_once('.').unwrap_or((path, ""));
    let mut value = topic_of_type(run, topic, &[])?.clone();
    while !rest.is_empty() {
        let (part, behind) = next_part(rest);
        rest = behind;
        let is_vector = ["x", "y", "z"].iter().all(|axis| value.get(axis).is_some());
        value = match part.strip_prefix('@') {
            Some("degrees") if value.is_number() => value,
            Some("norm") if is_vector => Value::from(0.0),
            Some(call) => {
                let factor = call.strip_prefix("mul(").and_then(|f| f.strip_suffix(')'));
                let is_number = factor.is_some_and(|factor| factor.parse::<f64>().is_ok());
                if !(is_number && value.is_number()) {
                    return Err(format!("{path}: @{call} cannot stand there"));
                }
                value
            }
            None => step(&value, part)
                .ok_or_else(|| format!("{path}: there is no {part}"))?
                .clone(),
        };
    }
    if is_plain(&value) {
        Ok(())
    } else {
        Err(format!("{path}: not one value"))
    }
}

/// The part up to the next dot that is not within brackets, and what is behind it.
fn next_part(text: &str) -> (&str, &str) {
    let mut depth = 0;
    for (at, character) in text.char_indices() {
        match character {
            '(' => depth += 1,
            ')' => depth -= 1,
            '.' if depth == 0 => return (&text[..at], &text[at + 1..]),
            _ => {}
        }
    }
    (text, "")
}

fn keys(value: &Value) -> impl Iterator<Item = &str> {
    value
        .as_object()
        .into_iter()
        .flatten()
        .map(|(key, _)| key.as_str())
}

fn elements(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn foxglove(layout: &str, run: &RecordedRun) -> Vec<String> {
    let layout: Value = serde_json::from_str(layout).unwrap();
    let mut problems = Problems::default();
    let mut placed = BTreeSet::new();
    place(&layout["layout"], &mut placed);
    let panels = layout["configById"].as_object().unwrap();
    for (id, panel) in panels {
        for tab in elements(&panel["tabs"]) {
            place(&tab["layout"], &mut placed);
        }
        let mut topic = |key: &str, types: &[&str]| {
            let name = panel[key].as_str().unwrap_or_default();
            problems.note(topic_of_type(run, name, types));
        };
        match id.split_once('!').unwrap().0 {
            "Plot" | "StateTransitions" => {
                for path in elements(&panel["paths"]) {
                    let path = path["value"].as_str().unwrap();
                    // A number is a line across the plot.
                    if path.parse::<f64>().is_err() {
                        problems.note(message_path(run, path));
                    }
                }
            }
            "RawMessages" => topic("topicPath", &[]),
            "DiagnosticSummary" | "DiagnosticStatusPanel" => {
                topic("topicToRender", &["diagnostic_msgs/msg/DiagnosticArray"]);
            }
            "RosOut" => topic("topicToRender", &["rcl_interfaces/msg/Log"]),
            "map" => {
                let names = keys(&panel["topicColors"]).chain(panel["followTopic"].as_str());
                for name in names {
                    problems.note(topic_of_type(run, name, &["sensor_msgs/msg/NavSatFix"]));
                }
            }
            "3D" => {
                for name in keys(&panel["topics"]).filter(|name| *name != MODEL) {
                    problems.note(topic_of_type(run, name, &[ODOMETRY]));
                }
                let layers = panel["layers"].as_object().unwrap().values();
                let frames = layers
                    .filter_map(|layer| layer["frameId"].as_str())
                    .chain(panel["followTf"].as_str())
                    .chain(keys(&panel["transforms"]).map(|key| &key["frame:".len()..]));
                for name in frames {
                    problems.note(frame(run, name));
                }
            }
            "Tab" => {}
            other => problems
                .0
                .push(format!("{id}: no panel {other} is known here")),
        }
    }
    let configured: BTreeSet<String> = panels.keys().cloned().collect();
    if placed != configured {
        let odd: Vec<_> = placed.symmetric_difference(&configured).collect();
        problems
            .0
            .push(format!("{odd:?}: configured or placed, not both"));
    }
    problems.0
}

/// Panels by their place in the tree of splits.
fn place(tree: &Value, placed: &mut BTreeSet<String>) {
    match tree {
        Value::String(id) => assert!(placed.insert(id.clone()), "{id} stands in two places"),
        tree => {
            for half in ["first", "second"] {
                place(&tree[half], placed);
            }
        }
    }
}

/// A series of PlotJuggler, `/topic/field/part[0]`, and its topic. Joint states are by joint: `/topic/JOINT/position`.
fn series<'r>(run: &'r RecordedRun, name: &str) -> Result<&'r str, String> {
    let (topic, (type_name, newest)) = run
        .topics
        .iter()
        .filter(|(topic, _)| name.starts_with(&format!("{topic}/")))
        .max_by_key(|(topic, _)| topic.len())
        .ok_or_else(|| format!("{name}: nobody publishes its topic"))?;
    let fields = name[topic.len() + 1..].split('/');
    let missing = || format!("{name}: there is no such field");
    let found = if type_name == JOINT_STATE {
        let [joint, what] = fields.collect::<Vec<_>>()[..] else {
            return Err(missing());
        };
        let joint = elements(&newest["name"]).position(|name| name == joint);
        newest
            .get(what)
            .zip(joint)
            .and_then(|(all, joint)| all.get(joint))
    } else {
        fields
            .into_iter()
            .try_fold(newest, |value, field| step(value, field))
    };
    found.filter(|value| is_plain(value)).ok_or_else(missing)?;
    Ok(topic)
}

fn named<'a, 'i>(
    document: &'a Document<'i>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    document
        .descendants()
        .filter(move |node| node.has_tag_name(tag))
}

fn child_text<'a>(node: &Node<'a, '_>, tag: &str) -> &'a str {
    let child = node.children().find(|child| child.has_tag_name(tag));
    child.and_then(|child| child.text()).unwrap_or_default()
}

fn plotjuggler(layout: &str, run: &RecordedRun) -> Vec<String> {
    let document = Document::parse(layout).unwrap();
    let mut problems = Problems::default();
    let mut used = BTreeSet::new();
    let mut made = BTreeSet::new();
    for snippet in named(&document, "snippet") {
        made.insert(snippet.attribute("name").unwrap());
        let function = child_text(&snippet, "function");
        let factor = function.strip_prefix("return value * ");
        if factor.is_none_or(|factor| factor.parse::<f64>().is_err()) {
            problems.0.push(format!("{function}: expected a factor"));
        }
        used.extend(problems.note(series(run, child_text(&snippet, "linked_source"))));
    }
    for curve in named(&document, "curve") {
        let name = curve.attribute("name").unwrap();
        if !made.contains(name) {
            used.extend(problems.note(series(run, name)));
        }
    }
    // What is drawn is what PlotJuggler is told to subscribe to and to take from a bag.
    for selected in named(&document, "selected_topics") {
        let selected: BTreeSet<&str> = selected.attribute("value").unwrap().split(';').collect();
        if selected != used {
            problems
                .0
                .push(format!("{selected:?} are selected, {used:?} drawn"));
        }
    }
    problems.0
}

fn rviz(config: &str, run: &RecordedRun) -> Vec<String> {
    let config: Value = serde_saphyr::from_str(config).unwrap();
    let manager = &config["Visualization Manager"];
    let mut problems = Problems::default();
    for display in elements(&manager["Displays"]) {
        let topic = display["Topic"]["Value"].as_str().unwrap_or_default();
        match display["Class"].as_str().unwrap() {
            "rviz_default_plugins/Grid" => {
                let name = display["Reference Frame"].as_str().unwrap();
                problems.note(frame(run, name));
            }
            "rviz_default_plugins/Odometry" => {
                problems.note(topic_of_type(run, topic, &[ODOMETRY]));
            }
            "rviz_default_plugins/TF" => {
                for name in keys(&display["Frames"]).filter(|name| *name != "All Enabled") {
                    problems.note(frame(run, name));
                }
                tree(&display["Tree"], None, run, &mut problems);
            }
            "rviz_default_plugins/RobotModel" => {
                assert_eq!(display["Description Topic"]["Value"], MODEL);
                for link in keys(&display["Links"]).filter(|name| *name != "All Links Enabled") {
                    problems.note(frame(run, link));
                }
            }
            other => problems.0.push(format!(
                "{other}: not of rviz_default_plugins, or not known here"
            )),
        }
    }
    let view = &manager["Views"]["Current"]["Target Frame"];
    for name in [&manager["Global Options"]["Fixed Frame"], view] {
        problems.note(frame(run, name.as_str().unwrap()));
    }
    problems.0
}

/// The tree of frames, parent by parent.
fn tree(children: &Value, above: Option<&str>, run: &RecordedRun, problems: &mut Problems) {
    for name in keys(children) {
        let is_there = run.transforms.get(name).map(parent);
        if is_there != above {
            problems
                .0
                .push(format!("{name} stands in {is_there:?}, not in {above:?}"));
        }
        tree(&children[name], Some(name), run, problems);
    }
}

fn numbers<const N: usize>(text: &str) -> [f64; N] {
    let numbers: Vec<f64> = text
        .split(' ')
        .map(|number| number.parse().unwrap())
        .collect();
    numbers.try_into().unwrap()
}

/// Link by link the model stands as /tf has it at the joint angles of the run; nothing but boxes and cylinders, in materials that
/// are there.
fn model(urdf: &str, run: &RecordedRun) -> Vec<String> {
    let document = Document::parse(urdf).unwrap();
    let mut problems = Problems::default();
    let top_level = |tag: &'static str| {
        let robot = document.root_element();
        robot.children().filter(move |node| node.has_tag_name(tag))
    };
    let links: BTreeSet<&str> = top_level("link")
        .filter_map(|link| link.attribute("name"))
        .collect();
    let materials: BTreeSet<&str> = top_level("material")
        .filter_map(|m| m.attribute("name"))
        .collect();
    for visual in named(&document, "material") {
        let name = visual.attribute("name").unwrap();
        if !materials.contains(name) {
            problems.0.push(format!("{name}: no such material"));
        }
    }
    for link in &links {
        problems.note(frame(run, link));
    }
    let mut children = BTreeSet::new();
    let states = &run.topics["/turntable/joint_states"].1;
    for joint in top_level("joint") {
        let end = |tag: &str| {
            let child = joint.children().find(|child| child.has_tag_name(tag));
            child
                .and_then(|child| child.attribute("link"))
                .unwrap_or_default()
        };
        let attribute = |tag: &str, name: &str| {
            let child = joint.children().find(|child| child.has_tag_name(tag));
            child
                .and_then(|child| child.attribute(name))
                .map(numbers::<3>)
        };
        let (name, above, below) = (
            joint.attribute("name").unwrap(),
            end("parent"),
            end("child"),
        );
        if !(links.contains(above) && links.contains(below) && children.insert(below)) {
            problems
                .0
                .push(format!("{name}: {above} and {below} make no tree of links"));
        }
        let Some(transform) = run.transforms.get(below) else {
            continue;
        };
        if parent(transform) != above {
            problems.0.push(format!(
                "{below} stands in {}, not in {above}",
                parent(transform)
            ));
        }
        let [roll, pitch, yaw] = attribute("origin", "rpy").unwrap();
        let angle = if joint.attribute("type") == Some("fixed") {
            0.0
        } else {
            let at = elements(&states["name"]).position(|joint| joint == name);
            let angle = states["position"][at.unwrap()].as_f64().unwrap();
            assert!(angle.abs() > 1.0, "{name} did not turn: {angle} rad");
            angle
        };
        let axis = Vector3::from(attribute("axis", "xyz").unwrap_or([1.0, 0.0, 0.0]));
        let expected = UnitQuaternion::from_euler_angles(roll, pitch, yaw)
            * UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), angle);
        let [x, y, z] = attribute("origin", "xyz").unwrap();
        let is = transform.transform.rotation.rotation().unwrap();
        let place = Vector3::from(transform.transform.translation);
        if expected.angle_to(&is) > 1e-6 || (place - Vector3::new(x, y, z)).norm() > 1e-9 {
            problems
                .0
                .push(format!("{name}: {below} stands otherwise in /tf"));
        }
    }
    let roots: Vec<_> = links.difference(&children).collect();
    if roots.len() != 1 {
        problems.0.push(format!("{roots:?}: expected one root"));
    }
    problems.0
}

type Check = fn(&str, &RecordedRun) -> Vec<String>;
/// File, check, and words of it with what they are misspelt as.
type Case<'a> = (&'a str, Check, &'a [(&'a str, &'a str)]);

/// The layouts have no problem; with any of these words misspelt they have one.
#[test]
fn what_layouts_name_is_there() {
    isolated(|| {
        let run = RecordedRun::make("layouts");
        let files: [Case<'_>; 4] = [
            (
                "layouts/foxglove.json",
                foxglove,
                &[
                    ("gyroscope_drift_std[2]", "gyroscope_drift_sdt[2]"),
                    ("misalignment_std[2]", "misalignment_std[3]"),
                    (
                        "\"topicPath\": \"/scheme/status\"",
                        "\"topicPath\": \"/sheme/status\"",
                    ),
                    ("\"followTf\": \"base_link\"", "\"followTf\": \"base_lnik\""),
                    (
                        "\"topicToRender\": \"/rosout\"",
                        "\"topicToRender\": \"/diagnostics\"",
                    ),
                    (
                        "/odometry.pose.pose.position.@norm",
                        "/odometry.pose.pose.orientation.w.@norm",
                    ),
                    (
                        "\"first\": \"Plot!position\"",
                        "\"first\": \"Plot!nowhere\"",
                    ),
                ],
            ),
            (
                "layouts/plotjuggler.xml",
                plotjuggler,
                &[
                    ("/estimate/heading_std<", "/estimate/heading_sdt<"),
                    ("\"/scheme/status/step\"", "\"/scheme/status/stp\""),
                    ("/outer_joint/position", "/outer_jiont/position"),
                    ("gyroscope_drift[2]", "gyroscope_drift[3]"),
                ],
            ),
            (
                "layouts/turntable.rviz",
                rviz,
                &[
                    ("Fixed Frame: base_link", "Fixed Frame: base_lnik"),
                    (
                        "Value: /uncompensated/odometry",
                        "Value: /uncompensated/fix_ins",
                    ),
                    ("imu_link: {}", "imu_lnik: {}"),
                ],
            ),
            (
                "urdf/turntable.urdf",
                model,
                &[
                    (
                        "rpy=\"0 0 -1.5707963267948966\"",
                        "rpy=\"0 0 1.5707963267948966\"",
                    ),
                    ("axis xyz=\"0 1 0\"", "axis xyz=\"0 0 1\""),
                    ("<material name=\"blue\"/>", "<material name=\"bleu\"/>"),
                ],
            ),
        ];
        for (file, check, misspellings) in files {
            let good = text(file);
            let problems = check(&good, &run);
            assert!(problems.is_empty(), "{file}:\n{}", problems.join("\n"));
            for (word, misspelt) in misspellings {
                assert!(good.contains(word), "{file} has no {word}");
                let problems = check(&good.replacen(word, misspelt, 1), &run);
                assert!(!problems.is_empty(), "{file}: {misspelt} went through");
            }
        }
    });
}

/// Where the launch file for pictures looks for the configuration and the model, there they are.
#[test]
fn launch_file_finds_them() {
    let launch = text("launch/view.launch.py");
    for (folder, file) in [("urdf", "turntable.urdf"), ("layouts", "turntable.rviz")] {
        let place = format!("share / \"{folder}\" / \"{file}\"");
        assert!(launch.contains(&place), "{place}");
        assert!(!text(&format!("{folder}/{file}")).is_empty());
    }
    assert!(launch.contains("\"robot_description\""));
}
