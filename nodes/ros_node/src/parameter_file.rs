//! Parameter files with the layout of rcl: node names, wildcards and namespaces, `ros__parameters`, nested keys.
//!
//! ```yaml
//! /**:                       # every node
//!   ros__parameters:
//!     use_sim_time: true
//! /ship:                     # a namespace
//!   self_calibrator:
//!     ros__parameters:
//!       thresholds:          # becomes thresholds.azimuth_arcmin
//!         azimuth_arcmin: 1.0
//! ```
//!
//! A node name without a leading slash stands in the root namespace. `*` is one part of a name, `**` any number.

use std::path::Path;

use crate::error::{Error, Result};
use crate::yaml::Yaml;

const PARAMETERS: &str = "ros__parameters";
/// No parameter file is longer \[bytes\].
const LONGEST: u64 = 1 << 20;

/// The parameters that the file has for the node, in order of the file, keys joined by dots.
///
/// # Errors
/// [`Error::ParameterFile`] where it cannot be read or a part is neither node, namespace nor `ros__parameters`.
pub(crate) fn read(path: &Path, node: &str) -> Result<Vec<(String, Yaml)>> {
    // Keys and values that a reason quotes may go over several lines.
    let bad = |reason: String| Error::ParameterFile {
        path: path.to_owned(),
        reason: reason.chars().fold(String::new(), |mut line, c| {
            if c.is_control() {
                line.extend(c.escape_default());
            } else {
                line.push(c);
            }
            line
        }),
    };
    let text = files::read_text(path, LONGEST).map_err(|error| bad(error.to_string()))?;
    let mut found = Vec::new();
    match Yaml::parse(&text).map_err(bad)? {
        Yaml::Null => {}
        Yaml::Mapping(entries) => walk("", &entries, node, &mut found).map_err(bad)?,
        _ => return Err(bad("expected a mapping of node names".to_owned())),
    }
    Ok(found)
}

/// Goes down through namespaces and nodes until `ros__parameters`.
fn walk(
    name: &str,
    entries: &[(String, Yaml)],
    node: &str,
    found: &mut Vec<(String, Yaml)>,
) -> Result<(), String> {
    for (key, value) in entries {
        if key == PARAMETERS {
            if name.is_empty() {
                return Err(format!("{PARAMETERS} stands outside a node name"));
            }
            match value {
                Yaml::Mapping(parameters) if matches(name, node) => flatten("", parameters, found),
                Yaml::Mapping(_) | Yaml::Null => {}
                _ => {
                    return Err(format!(
                        "{name}: {PARAMETERS} is {value}, expected a mapping"
                    ));
                }
            }
        } else {
            let below = format!("{name}/{}", key.trim_matches('/'));
            match value {
                Yaml::Mapping(inner) => walk(&below, inner, node, found)?,
                Yaml::Null => {}
                _ => {
                    return Err(format!(
                        "{below} is {value}, expected {PARAMETERS} below a node name"
                    ));
                }
            }
        }
    }
    Ok(())
}

fn flatten(prefix: &str, parameters: &[(String, Yaml)], found: &mut Vec<(String, Yaml)>) {
    for (key, value) in parameters {
        let name = if prefix.is_empty() {
            key.clone()
        } else {
            format!("{prefix}.{key}")
        };
        match value {
            Yaml::Mapping(inner) => flatten(&name, inner, found),
            value => found.push((name, value.clone())),
        }
    }
}

/// Whether a pattern of a file is for the node of this full name.
fn matches(pattern: &str, node: &str) -> bool {
    fn rest(pattern: &[&str], node: &[&str]) -> bool {
        match (pattern, node) {
            ([], []) => true,
            (["**", more @ ..], _) => {
                rest(more, node) || (!node.is_empty() && rest(pattern, &node[1..]))
            }
            (["*", more @ ..], [_, others @ ..]) => rest(more, others),
            ([token, more @ ..], [name, others @ ..]) => token == name && rest(more, others),
            _ => false,
        }
    }
    let tokens = |name: &str| -> Vec<String> {
        name.split('/')
            .filter(|t| !t.is_empty())
            .map(str::to_owned)
            .collect()
    };
    let (pattern, node) = (tokens(pattern), tokens(node));
    rest(
        &pattern.iter().map(String::as_str).collect::<Vec<_>>(),
        &node.iter().map(String::as_str).collect::<Vec<_>>(),
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fmt::Write as _;

    use proptest::prelude::*;

    use super::*;

    const GOOD: &str = "/**:\n  ros__parameters:\n    use_sim_time: true\n    names: [a, 'b', \"c\"]\n/ship:\n  node:\n    \
                        ros__parameters:\n      thresholds: {azimuth: 1.0, drift: [0.1, 2e-3, .inf]}\n      label: |\n        two\n        \
                        lines\n      base: &base 7\n      same: *base\n";

    proptest! {
        #![proptest_config(damage::drawn(2000))]

        /// A damaged file gives parameters, or one line that names it.
        #[test]
        fn damaged_files_are_told(bytes in damage::damaged(GOOD.as_bytes().to_vec())) {
            let file = TextFile::new("");
            std::fs::write(&file.0, bytes).unwrap();
            if let Err(error) = read(&file.0, "/ship/node") {
                let told = error.to_string();
                prop_assert!(told.contains(file.0.to_str().unwrap()), "{told}");
                prop_assert!(!told.contains('\n') && told.len() < 1000, "{told}");
            }
        }
    }

    /// A value of two lines is told in one.
    #[test]
    fn a_reason_is_one_line() {
        let file = TextFile::new("/ship:\n  node:\n    label: |\n      two\n      lines\n");
        let told = read(&file.0, "/ship/node").unwrap_err().to_string();
        assert!(told.contains("'two\\nlines\\n'"), "{told}");
    }

    /// Names that stand for names that stand for names: ten levels of ten would be 10^10 nodes. They are refused before.
    #[test]
    fn names_that_multiply_are_refused() {
        let mut text =
            String::from("/**:\n  ros__parameters:\n    a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n");
        for level in 1..10 {
            let last = format!("*a{}", level - 1);
            let names = vec![last; 10].join(", ");
            writeln!(text, "    a{level}: &a{level} [{names}]").unwrap();
        }
        let file = TextFile::new(&text);
        let told = read(&file.0, "/ship/node").unwrap_err().to_string();
        assert!(told.len() < 500, "{told}");
    }

    /// A file in the temporary directory that goes away with the test.
    struct TextFile(std::path::PathBuf);

    impl TextFile {
        fn new(text: &str) -> Self {
            use std::sync::atomic::{AtomicU32, Ordering};
            static NEXT: AtomicU32 = AtomicU32::new(0);
            let name = format!(
                "ros_node_{}_{}.yaml",
                std::process::id(),
                NEXT.fetch_add(1, Ordering::Relaxed)
            );
            let path = std::env::temp_dir().join(name);
            std::fs::write(&path, text).unwrap();
            Self(path)
        }
    }

    impl Drop for TextFile {
        fn drop(&mut self) {
            std::fs::remove_file(&self.0).ok();
        }
    }

    fn names(text: &str, node: &str) -> Result<Vec<String>> {
        let file = TextFile::new(text);
        Ok(read(&file.0, node)?
            .into_iter()
            .map(|(name, _)| name)
            .collect())
    }

    /// Wildcards are those of rcl: one part, or any number of parts.
    #[test]
    fn patterns_match_as_in_rcl() {
        for (pattern, node, expected) in [
            ("/**", "/n", true),
            ("/**", "/a/b/n", true),
            ("/*", "/n", true),
            ("/*", "/a/n", false),
            ("/a/*", "/a/n", true),
            ("/**/n", "/a/b/n", true),
            ("/**/n", "/n", true),
            ("n", "/n", true),
            ("n", "/a/n", false),
            ("/a/n", "/a/n", true),
        ] {
            assert_eq!(matches(pattern, node), expected, "{pattern} {node}");
        }
    }

    /// Namespaces nest, keys are joined by dots, other nodes' parameters are left alone.
    #[test]
    fn nested_namespaces_and_keys() {
        let text = "/**:\n  ros__parameters:\n    use_sim_time: true\n/ship:\n  n:\n    ros__parameters:\n      a:\n        b: 1\n        c: [1.0]\nother:\n  ros__parameters:\n    z: 1\n";
        assert_eq!(
            names(text, "/ship/n").unwrap(),
            ["use_sim_time", "a.b", "a.c"]
        );
        assert_eq!(names(text, "/n").unwrap(), ["use_sim_time"]);
    }

    /// Broken files are refused with a reason, not skipped.
    #[test]
    fn broken_files_are_errors() {
        for text in [
            "n: 3\n",
            "- a\n",
            "ros__parameters:\n  a: 1\n",
            "n:\n  ros__parameters: 4\n",
            "a: [1\n",
        ] {
            let error = names(text, "/n").unwrap_err().to_string();
            assert!(
                error.starts_with("parameter file ") && !error.contains('\n'),
                "{error}"
            );
        }
        assert!(read(Path::new("/nowhere.yaml"), "/n").is_err());
        let told = names(&"# long\n".repeat(200_000), "/n").unwrap_err();
        assert!(told.to_string().contains("expected at most"), "{told}");
        let told = read(Path::new("/dev/zero"), "/n").unwrap_err();
        assert!(told.to_string().contains("regular file"), "{told}");
    }
}
