//! Declarations as people read them: the usage text, a parameter file, tables of a manual.

use std::fmt::Write;

use super::declaration::Parameter;
use super::value::Value;

/// Longest line of a parameter file.
const WIDTH: usize = 120;

/// The part of `--help`, headings above their groups.
pub(crate) fn usage(parameters: &[Parameter]) -> String {
    let mut text = String::new();
    for (group, members) in groups(parameters) {
        if !group.is_empty() {
            writeln!(text, "\n {group}").ok();
        }
        for parameter in members {
            writeln!(text, "{}", parameter.usage()).ok();
        }
    }
    text
}

/// A parameter file that rcl and this crate read, with every default and what is known of it as comments.
pub(crate) fn file(node: &str, about: &str, parameters: &[Parameter]) -> String {
    let mut text = String::new();
    comment(
        &mut text,
        "",
        &format!("Parameters of {node}, each with its default. The node {about}."),
    );
    comment(
        &mut text,
        "",
        &format!("Made by: {node} --print-parameters. Use: {node} --ros-args --params-file FILE"),
    );
    writeln!(text, "{node}:\n  ros__parameters:").ok();
    for (index, (group, members)) in groups(parameters).into_iter().enumerate() {
        if !group.is_empty() {
            let blank = if index == 0 { "" } else { "\n" };
            writeln!(text, "{blank}    # --- {group} ---").ok();
        }
        for parameter in members {
            let words = format!("{}; {}", parameter.description, parameter.limits());
            comment(&mut text, "    ", words.trim_start_matches("; "));
            writeln!(text, "    {}: {}", parameter.name, yaml(&parameter.default)).ok();
        }
    }
    text
}

/// Tables in Markdown, one a group.
pub(crate) fn table(parameters: &[Parameter]) -> String {
    let cell = |text: &str| text.replace('|', "\\|");
    let mut text = String::new();
    for (group, members) in groups(parameters) {
        writeln!(
            text,
            "| {group} | default | expected | |\n| --- | --- | --- | --- |"
        )
        .ok();
        for parameter in members {
            writeln!(
                text,
                "| `{}` | `{}` | {} | {} |",
                parameter.name,
                yaml(&parameter.default),
                cell(&parameter.limits()),
                cell(&parameter.description)
            )
            .ok();
        }
        text.push('\n');
    }
    text
}

/// Parameters by their headings, both in the order in which they come first.
fn groups(parameters: &[Parameter]) -> Vec<(&str, Vec<&Parameter>)> {
    let mut groups: Vec<(&str, Vec<&Parameter>)> = Vec::new();
    for parameter in parameters {
        match groups.iter_mut().find(|(name, _)| *name == parameter.group) {
            Some((_, members)) => members.push(parameter),
            None => groups.push((&parameter.group, vec![parameter])),
        }
    }
    groups
}

/// Lines of a comment, broken between words.
fn comment(text: &mut String, indent: &str, words: &str) {
    let mut line = format!("{indent}#");
    for word in words.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            writeln!(text, "{line}").ok();
            line = format!("{indent}#");
        }
        write!(line, " {word}").ok();
    }
    writeln!(text, "{line}").ok();
}

/// A value that YAML 1.1 and 1.2 read alike.
fn yaml(value: &Value) -> String {
    match value {
        Value::Double(value) => double(*value),
        Value::String(value) => quoted(value),
        Value::DoubleArray(values) => list(values.iter().map(|value| double(*value))),
        Value::StringArray(values) => list(values.iter().map(|value| quoted(value))),
        other => other.to_string(),
    }
}

fn list(values: impl Iterator<Item = String>) -> String {
    format!("[{}]", values.collect::<Vec<_>>().join(", "))
}

fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "''"))
}

/// With a point and a signed exponent: YAML 1.1 takes `1e-6` for a text.
fn double(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else {
        return text;
    };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::yaml::Yaml;

    fn declared() -> Vec<Parameter> {
        vec![
            Parameter::new("small", 1e-6)
                .group("Numbers")
                .describe("A small number")
                .unit("m"),
            Parameter::new("name", "it's")
                .group("Words")
                .describe("A name"),
            Parameter::new("large", vec![1e20, 0.5])
                .group("Numbers")
                .describe(&"Long ".repeat(40)),
            Parameter::new("names", vec!["a", "b"])
                .group("Words")
                .changeable(),
        ]
    }

    /// The file holds every default, in groups, and its lines are not too long; it reads back as it was.
    #[test]
    fn a_file_holds_the_defaults() {
        let text = file("n", "counts", &declared());
        assert!(
            text.lines().all(|line| line.chars().count() <= WIDTH),
            "{text}"
        );
        for line in [
            "    # --- Numbers ---",
            "    # A small number; double [m]",
            "    small: 1.0e-6",
            "    large: [1.0e+20, 0.5]",
            "    name: 'it''s'",
            "    # array of string, may be set while running",
        ] {
            assert!(text.lines().any(|l| l == line), "{line}\n{text}");
        }
        let Yaml::Mapping(nodes) = Yaml::parse(&text).unwrap() else {
            panic!("{text}")
        };
        let Yaml::Mapping(parameters) = &nodes[0].1 else {
            panic!("{text}")
        };
        let Yaml::Mapping(values) = &parameters[0].1 else {
            panic!("{text}")
        };
        assert_eq!(values.len(), declared().len());
        for parameter in declared() {
            let (_, yaml) = values
                .iter()
                .find(|(name, _)| *name == parameter.name)
                .unwrap();
            let value = Value::from_yaml(yaml, parameter.kind()).unwrap();
            assert_eq!(value, parameter.default);
        }
    }

    /// A table has a row a parameter.
    #[test]
    fn a_table_has_every_parameter() {
        let text = table(&declared());
        assert!(
            text.contains("| `small` | `1.0e-6` | double [m] | A small number |"),
            "{text}"
        );
        assert_eq!(
            text.lines().filter(|line| line.starts_with("| `")).count(),
            4
        );
    }
}
