//! A topic, service or action of the table is named in the table and nowhere else: no other source has its name as text.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use rotary_sins_msgs::interfaces::all;

/// Folders whose programs work by the table.
const FOLDERS: [&str; 3] = ["nodes", "analysis/src", "bags/src"];

/// A sentence of `--help`, which must be a constant.
const HELP: &str = "description of a parameter";

/// File, name, and why it may stand there.
const ALLOWED: [(&str, &str, &str); 9] = [
    (
        "nodes/node_parameters/src/filter.rs",
        "aiding/velocity",
        HELP,
    ),
    (
        "nodes/imu_simulator/src/parameters.rs",
        "aiding/velocity",
        HELP,
    ),
    (
        "nodes/navigation_compensator/src/parameters.rs",
        "imu/data",
        HELP,
    ),
    (
        "nodes/scheme_sequencer/src/parameters.rs",
        "turntable/joint_trajectory",
        HELP,
    ),
    (
        "nodes/scheme_sequencer/src/parameters.rs",
        "turntable/follow_joint_trajectory",
        HELP,
    ),
    ("nodes/scheme_sequencer/src/parameters.rs", "~/start", HELP),
    ("nodes/self_calibrator/src/parameters.rs", "~/save", HELP),
    ("nodes/self_calibrator/src/parameters.rs", "~/load", HELP),
    (
        "nodes/self_calibrator/src/node.rs",
        "velocity",
        "name of a status of the diagnostics",
    ),
];

/// Rust sources of `src` folders, without those that are tests.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            if !["tests", "examples", "benches", "target"].contains(&name.as_str()) {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !name.ends_with("_tests.rs")
        {
            found.push(path);
        }
    }
}

/// The string literals of a source up to its tests; comments are left out.
fn literals(source: &str) -> Vec<String> {
    let mut rest = source.split("#[cfg(test)]\nmod tests {").next().unwrap();
    let mut found = Vec::new();
    while let Some(at) = rest.find(['"', '/', '\'']) {
        let here = &rest[at..];
        if here.starts_with("//") {
            rest = here.split_once('\n').map_or("", |(_, next)| next);
        } else if let Some(next) = here.strip_prefix("'\"'") {
            rest = next;
        } else if let Some(mut text) = here.strip_prefix('"') {
            let mut literal = String::new();
            while let Some(at) = text.find(['"', '\\']) {
                literal.push_str(&text[..at]);
                let is_end = text[at..].starts_with('"');
                text = &text[at + 1..];
                if is_end {
                    break;
                }
                // What is escaped is no part of a name.
                let mut escaped = text.chars();
                escaped.next();
                text = escaped.as_str();
                literal.push(' ');
            }
            found.push(literal);
            rest = text;
        } else {
            rest = &here[1..];
        }
    }
    found
}

/// Whether a literal names an interface: it is the name, with or without the slash of the root; a name of several parts
/// may also stand inside a sentence or a pattern.
fn names(literal: &str, name: &str) -> bool {
    let is_several = name.trim_start_matches('/').contains('/');
    literal == name
        || literal.strip_prefix('/') == Some(name)
        || (is_several && has_word(literal, name))
}

/// Whether a text holds a name that is no part of a longer one.
fn has_word(text: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '/';
    text.match_indices(name).any(|(at, _)| {
        let (before, after) = (&text[..at], &text[at + name.len()..]);
        !after.starts_with(is_part) && !before.trim_end_matches('/').ends_with(is_part)
    })
}

/// Nodes, tools, report and bags take the names from the table.
#[test]
fn names_stand_in_the_table_alone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = Vec::new();
    for folder in FOLDERS {
        sources(&root.join(folder), &mut files);
    }
    assert!(files.len() > 100, "{} files", files.len());
    let mut used = vec![false; ALLOWED.len()];
    let mut wrong = Vec::new();
    for path in files {
        let file = path.strip_prefix(&root).unwrap().display().to_string();
        for literal in literals(&fs::read_to_string(&path).unwrap()) {
            for row in all().filter(|row| names(&literal, row.name)) {
                match ALLOWED
                    .iter()
                    .position(|(there, name, _)| *there == file && *name == row.name)
                {
                    Some(at) => used[at] = true,
                    None => wrong.push(format!("{file}: \"{literal}\" names {}", row.name)),
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "take these from rotary_sins_msgs::interfaces:\n{}",
        wrong.join("\n")
    );
    let idle = ALLOWED.iter().zip(used).filter(|(_, used)| !used);
    let idle: Vec<_> = idle.map(|(allowed, _)| allowed).collect();
    assert!(idle.is_empty(), "these are not needed any more: {idle:?}");
}

/// The search finds a name that stands alone, with a slash, and inside a sentence; and no word that only looks like one.
#[test]
fn search_finds_names() {
    let source = "f(\"imu/data_raw\", '\"', \"a \\\" b\"); // \"no\"\n    /// \"/fix\"\n#[cfg(test)]\nmod tests {\n\"fix\"";
    assert_eq!(literals(source), ["imu/data_raw", "a   b"]);
    assert!(names("/imu/data_raw", "imu/data_raw"));
    assert!(names("no imu/data_raw came", "imu/data_raw"));
    assert!(names("/fix", "fix"));
    assert!(!names("a fix came", "fix"));
    assert!(!names("no imu/data_raw came", "imu/data"));
    assert!(!names("diagnostics", "/diagnostics"));
}
