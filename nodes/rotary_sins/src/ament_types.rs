//! Message types of others, as they stand in the prefixes of `AMENT_PREFIX_PATH`: `share/PACKAGE/msg/Name.msg`.

use std::{
    collections::BTreeSet,
    env,
    path::{Path, PathBuf},
};

/// Line between the parts of a `ros2msg` schema.
const SEPARATOR: &str =
    "================================================================================";

/// No definition of a message is longer \[bytes\].
const LONGEST: u64 = 1 << 20;

/// Types that a field has without being a message.
const PLAIN: [&str; 16] = [
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "string", "wstring", "wchar",
];

/// What a bag wants to know of a type.
#[derive(Debug, PartialEq, Eq)]
pub struct Definition {
    /// `ros2msg` text: the definition and those of all it is made of.
    pub schema: String,
    /// REP-2011 hash, where the package has one (Iron and later).
    pub hash: Option<String>,
}

/// Why a type has no definition.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Missing {
    /// No prefix is named.
    #[error("AMENT_PREFIX_PATH is not set: source a ROS 2 workspace that has its package")]
    NoPrefix,
    /// The file stands nowhere.
    #[error("no folder of AMENT_PREFIX_PATH has share/{0}")]
    NotFound(String),
    /// It is no type of a message.
    #[error("'{0}' is no type of the form package/msg/Name")]
    NoMessage(String),
}

/// The definition of `package/msg/Name` in the prefixes of the environment.
pub fn find(type_name: &str) -> Result<Definition, Missing> {
    let path = env::var_os("AMENT_PREFIX_PATH").unwrap_or_default();
    let prefixes: Vec<PathBuf> = env::split_paths(&path)
        .filter(|prefix| !prefix.as_os_str().is_empty())
        .collect();
    find_in(&prefixes, type_name)
}

fn find_in(prefixes: &[PathBuf], type_name: &str) -> Result<Definition, Missing> {
    if prefixes.is_empty() {
        return Err(Missing::NoPrefix);
    }
    let text = definition(prefixes, type_name)?;
    let mut schema = text.clone();
    let mut gathered = BTreeSet::from([type_name.to_owned()]);
    // Each is written once, in the order of first use.
    let mut waiting = parts(&text, type_name);
    while !waiting.is_empty() {
        let part = waiting.remove(0);
        if !gathered.insert(part.clone()) {
            continue;
        }
        let text = definition(prefixes, &part)?;
        if !schema.ends_with('\n') {
            schema.push('\n');
        }
        let name = part.replace("/msg/", "/");
        schema.extend([SEPARATOR, "\nMSG: ", name.as_str(), "\n", text.as_str()]);
        waiting.extend(parts(&text, &part));
    }
    Ok(Definition {
        schema,
        hash: hash(prefixes, type_name),
    })
}

fn definition(prefixes: &[PathBuf], type_name: &str) -> Result<String, Missing> {
    read(prefixes, type_name, "msg")?.ok_or_else(|| Missing::NotFound(format!("{type_name}.msg")))
}

/// The hash that `rosidl` wrote beside the definition.
fn hash(prefixes: &[PathBuf], type_name: &str) -> Option<String> {
    let text = read(prefixes, type_name, "json").ok()??;
    let all: serde_json::Value = serde_json::from_str(&text).ok()?;
    let mut hashes = all["type_hashes"].as_array()?.iter();
    let own = hashes.find(|entry| entry["type_name"] == type_name)?;
    Some(own["hash_string"].as_str()?.to_owned())
}

/// The first file of this type that can be read.
fn read(prefixes: &[PathBuf], type_name: &str, ending: &str) -> Result<Option<String>, Missing> {
    let is_name = |part: &str| {
        !part.is_empty() && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let place = match type_name.split('/').collect::<Vec<_>>()[..] {
        [package, "msg", name] if is_name(package) && is_name(name) => Path::new("share")
            .join(package)
            .join("msg")
            .join(format!("{name}.{ending}")),
        _ => return Err(Missing::NoMessage(type_name.to_owned())),
    };
    let mut places = prefixes.iter().map(|prefix| prefix.join(&place));
    Ok(places.find_map(|file| files::read_text(&file, LONGEST).ok()))
}

/// The messages that the fields of a definition are made of, by full names.
fn parts(definition: &str, of: &str) -> Vec<String> {
    let package = of.split('/').next().unwrap_or_default();
    let message = |line: &str| {
        let line = line.split('#').next()?;
        let kind = line.split_whitespace().next()?;
        // Arrays and bounds: `Name[3]`, `Name[<=3]`, `string<=10`.
        let kind = kind.split(['[', '<']).next()?;
        if kind.is_empty() || PLAIN.contains(&kind) {
            return None;
        }
        Some(match kind.split('/').collect::<Vec<_>>()[..] {
            [other, name] | [other, "msg", name] => format!("{other}/msg/{name}"),
            _ => format!("{package}/msg/{kind}"),
        })
    };
    definition.lines().filter_map(message).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;

    use super::*;

    fn prefix(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in files {
            let path = folder.path().join("share").join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        folder
    }

    /// Definitions are gathered over packages and prefixes, each once, whatever fields look like; the hash comes along.
    #[test]
    fn a_schema_is_gathered_from_prefixes() {
        let echo = "# An echo.\nuint8 LEFT=1 # of Nothing\nstd_msgs/Header header\nBeam[<=4] beams # Beam\n\
                    string<=10 name \"sonar\"\nfloat64[] range_m\nBeam main";
        let ours = prefix(&[
            ("acme_msgs/msg/Echo.msg", echo),
            ("acme_msgs/msg/Beam.msg", "float32 angle_rad\n"),
            (
                "acme_msgs/msg/Echo.json",
                r#"{"type_hashes": [{"type_name": "acme_msgs/msg/Echo", "hash_string": "RIHS01_12"}]}"#,
            ),
        ]);
        let theirs = prefix(&[
            (
                "std_msgs/msg/Header.msg",
                "builtin_interfaces/Time stamp\nstring frame_id\n",
            ),
            (
                "builtin_interfaces/msg/Time.msg",
                "int32 sec\nuint32 nanosec\n",
            ),
        ]);
        let prefixes = [ours.path().to_owned(), theirs.path().to_owned()];
        let found = find_in(&prefixes, "acme_msgs/msg/Echo").unwrap();
        let expected = format!(
            "{echo}\n{SEPARATOR}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
             {SEPARATOR}\nMSG: acme_msgs/Beam\nfloat32 angle_rad\n\
             {SEPARATOR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
        );
        assert_eq!(found.schema, expected);
        assert_eq!(found.hash.as_deref(), Some("RIHS01_12"));
    }

    /// What is not there is told by the file that was looked for.
    #[test]
    fn what_is_missing_is_named() {
        let ours = prefix(&[("acme_msgs/msg/Echo.msg", "std_msgs/Header header\n")]);
        let prefixes = [ours.path().to_owned()];
        let told = |prefixes: &[PathBuf], name| find_in(prefixes, name).unwrap_err().to_string();
        assert_eq!(
            told(&prefixes, "acme_msgs/msg/Echo"),
            "no folder of AMENT_PREFIX_PATH has share/std_msgs/msg/Header.msg"
        );
        assert!(told(&[], "acme_msgs/msg/Echo").starts_with("AMENT_PREFIX_PATH is not set"));
        assert!(told(&prefixes, "acme_msgs/../Echo").contains("package/msg/Name"));
    }
}
