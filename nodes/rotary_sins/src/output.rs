//! What all commands write alike: JSON on standard output, notes on standard error.

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use analysis::Listener;
use anyhow::{Context, ensure};
use report::Figure;
use serde::Serialize;

/// Writes one JSON object and ends the line. A reader that has gone away is no error.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    let text =
        serde_json::to_string_pretty(value).context("the result cannot be written as JSON")?;
    text_line(&text)
}

/// Writes a text and ends the line.
pub fn text_line(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{}", harmless(text)) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result.context("standard output"),
    }
}

/// Says something on standard error that is not the result.
pub fn note(text: impl std::fmt::Display) {
    eprintln!("rotary-sins: {}", harmless(&text.to_string()));
}

/// A text that moves no terminal: names come from bags and files, and whatever a terminal would obey is shown as unknown.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if text.contains(obeyed) {
        text.replace(obeyed, "\u{fffd}").into()
    } else {
        text.into()
    }
}

/// Writes a file, whole or not at all. What a command reads, and every record, is never written over.
pub fn file(path: &Path, text: &str, input: Option<&Path>) -> anyhow::Result<()> {
    refuse_records(path, input)?;
    files::write(path, text.as_bytes()).with_context(|| path.display().to_string())
}

/// Looks before hours of work whether their result can be written: what [`file()`] would refuse is told now, and so is a file that is
/// there already, unless it is to be replaced.
pub fn check(path: &Path, input: Option<&Path>, replaces: bool) -> anyhow::Result<()> {
    refuse_records(path, input)?;
    let is_there = std::fs::metadata(path).is_ok_and(|there| there.is_file());
    ensure!(
        replaces || !is_there,
        "{}: it is there already; --force replaces it",
        path.display()
    );
    files::check(path).with_context(|| path.display().to_string())
}

fn refuse_records(path: &Path, input: Option<&Path>) -> anyhow::Result<()> {
    if let Some(input) = input {
        ensure!(
            !files::is_same(path, input),
            "{}: it is what is read, and would be written over",
            path.display()
        );
    }
    ensure!(
        !is_record(path),
        "{}: it is a bag, and would be written over",
        path.display()
    );
    Ok(())
}

/// Every figure with its data, as SVG and CSV in a folder.
pub fn figures(figures: &[Figure], folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)?;
    for figure in figures {
        let path = folder.join(&figure.id);
        file(&path.with_extension("svg"), &figure.to_svg()?, None)?;
        file(&path.with_extension("csv"), &figure.to_csv()?, None)?;
    }
    Ok(())
}

/// The command line, so that a shell takes it again.
pub fn command() -> String {
    let quoted = |argument: String| {
        let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
        if !argument.is_empty() && argument.chars().all(plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', r"'\''"))
        }
    };
    std::iter::once("rotary-sins".to_owned())
        .chain(std::env::args().skip(1).map(quoted))
        .collect::<Vec<_>>()
        .join(" ")
}

/// Whether a file is the MCAP file of a bag.
fn is_record(path: &Path) -> bool {
    use std::io::Read;

    let mut magic = [0; 8];
    std::fs::metadata(path).is_ok_and(|there| there.is_file())
        && std::fs::File::open(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok())
        && magic == *b"\x89MCAP0\r\n"
}

/// Nanoseconds as seconds with all digits.
pub fn seconds(nanos: u64) -> String {
    format!("{}.{:09}", nanos / 1_000_000_000, nanos % 1_000_000_000)
}

/// Says what it is told to say, and shows no progress.
pub struct Screen;

impl Listener for Screen {
    fn note(&self, line: &str) {
        note(line);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// What a terminal would obey does not reach it.
    #[test]
    fn texts_move_no_terminal() {
        assert_eq!(harmless("Ω 1\n\t2"), "Ω 1\n\t2");
        assert_eq!(
            harmless("\u{1b}[2J\u{9b}1m\r"),
            "\u{fffd}[2J\u{fffd}1m\u{fffd}"
        );
    }

    /// Neither what is read nor a record is written over, under whatever name; anything else is.
    #[test]
    fn records_are_not_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let [bag, link, page] = ["b.mcap", "link", "page.html"].map(|n| folder.path().join(n));
        std::fs::write(&bag, b"\x89MCAP0\r\nrest").unwrap();
        std::os::unix::fs::symlink("b.mcap", &link).unwrap();
        for path in [&bag, &link] {
            let told = file(path, "x", None).unwrap_err().to_string();
            assert!(told.contains("would be written over"), "{told}");
        }
        file(&page, "one", Some(&bag)).unwrap();
        file(&page, "two", Some(&bag)).unwrap();
        file(&page, "three", Some(&page)).unwrap_err();
        assert_eq!(std::fs::read_to_string(&page).unwrap(), "two");
        let told = |path| check(path, Some(&bag), false).unwrap_err().to_string();
        assert!(told(&bag).contains("would be written over"));
        assert!(told(&page).contains("--force replaces it"));
        check(&page, Some(&bag), true).unwrap();
        let nowhere = folder.path().join("none").join("page.html");
        assert!(check(&nowhere, None, true).is_err());
    }
}
