//! The rooms of the crate: arrows point down only.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

/// From the ground up. What a room may use stands before it.
const ROOMS: [&str; 9] = [
    "earth",
    "sensor",
    "table",
    "stream",
    "mechanization",
    "estimation",
    "simulation",
    "machines",
    "studies",
];
/// Beside all rooms, and using none of them but the earth's constants.
const BESIDE: [&str; 4] = ["time", "units", "range", "error"];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The rooms that a file's code names; what its tests and its comments name does not count.
fn named_rooms(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    code.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| line.split("crate::").skip(1))
        .map(|rest| {
            assert!(
                !rest.starts_with('{'),
                "name one room a line: crate::{rest}"
            );
            rest.chars()
                .take_while(|c| c.is_ascii_lowercase() || *c == '_')
                .collect()
        })
        .collect()
}

/// No file uses a room that stands above its own, so a subject can be read from the ground up and taken out alone.
#[test]
fn arrows_point_down_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 40, "{} sources", files.len());
    let height = |room: &str| ROOMS.iter().position(|name| *name == room);
    let mut wrong = Vec::new();
    for file in files {
        let inside = file.strip_prefix(&root).unwrap();
        let room = inside.iter().next().unwrap().to_str().unwrap();
        if room == "lib.rs" || inside.to_str().unwrap().ends_with("tests.rs") {
            continue;
        }
        let own = height(room);
        let name = room.trim_end_matches(".rs");
        assert!(
            own.is_some() || BESIDE.contains(&name),
            "{room} is no room of the house: name it in this test and in ARCHITECTURE.md"
        );
        for used in named_rooms(&fs::read_to_string(&file).unwrap()) {
            // A file beside the rooms may use the ground floor alone.
            if height(&used).is_some_and(|above| above > own.unwrap_or(0)) {
                wrong.push(format!("{} uses {used}", inside.display()));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "arrows that point up:\n{}",
        wrong.join("\n")
    );
}

/// The test above sees an arrow that points up, in a use and in a path, and not in a comment or in tests.
#[test]
fn an_arrow_is_seen() {
    let text = "//! [`crate::studies`]\nuse crate::machines::navigator;\nfn f() { crate::stream::g(); }\n\
                #[cfg(test)]\nmod tests { use crate::studies; }\n";
    assert_eq!(named_rooms(text), ["machines", "stream"]);
}

/// What studies share: the paper's setting is a file, this is a folder.
const SHARED: &str = "stretch";

/// No study uses another; what several share uses none of them.
#[test]
fn studies_stand_side_by_side() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/studies");
    let studies: Vec<String> = fs::read_dir(&root)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .map(|path| path.file_name().unwrap().to_str().unwrap().to_owned())
        .collect();
    assert!(studies.len() >= 5, "{studies:?}");
    let mut wrong = Vec::new();
    for study in &studies {
        let mut files = Vec::new();
        sources(&root.join(study), &mut files);
        files.retain(|file| !file.to_str().unwrap().ends_with("tests.rs"));
        assert!(files.len() > 1, "{study}");
        for file in files {
            let text = fs::read_to_string(&file).unwrap();
            let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
            for other in studies
                .iter()
                .filter(|other| *other != study && *other != SHARED)
            {
                let path = format!("studies::{other}");
                let uses = code
                    .lines()
                    .filter(|line| !line.trim_start().starts_with("//"))
                    .any(|line| line.contains(&path));
                if uses {
                    wrong.push(format!("{} uses {path}", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
