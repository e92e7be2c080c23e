//! The manual is true: its links lead somewhere, its commands and options exist, and the blocks that it marks run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use suite_tests::{Program, repository, rotary_sins, scratch};

/// Longest line of prose.
const LONGEST_LINE: usize = 120;

/// The pages that people read, from the repository's root.
fn pages() -> Vec<PathBuf> {
    let root = repository();
    let mut pages = vec![
        root.join("README.md"),
        root.join("ARCHITECTURE.md"),
        root.join("CHANGELOG.md"),
    ];
    for folder in ["docs", "docs/decisions"] {
        let entries = std::fs::read_dir(root.join(folder)).unwrap();
        pages.extend(
            entries
                .map(|entry| entry.unwrap().path())
                .filter(|path| path.extension().is_some_and(|extension| extension == "md")),
        );
    }
    pages.sort();
    assert!(pages.len() > 20, "{} pages", pages.len());
    pages
}

/// A line of a page, and whether it is code.
fn lines(text: &str) -> impl Iterator<Item = (&str, bool)> {
    let mut fenced = false;
    text.lines().map(move |line| {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
            return (line, true);
        }
        (line, fenced || line.starts_with("    "))
    })
}

/// Blocks that begin with a fence of these words.
fn blocks<'a>(text: &'a str, fence: &str) -> Vec<Vec<&'a str>> {
    let mut found = Vec::new();
    let mut open: Option<Vec<&str>> = None;
    for line in text.lines() {
        match &mut open {
            None if line == fence => open = Some(Vec::new()),
            Some(block) if line == "```" => {
                found.push(std::mem::take(block));
                open = None;
            }
            Some(block) => block.push(line),
            None => {}
        }
    }
    found
}

fn name(page: &Path) -> String {
    page.strip_prefix(repository())
        .unwrap()
        .display()
        .to_string()
}

/// Every link of every page leads to a file that is there.
#[test]
fn links_lead_somewhere() {
    let mut broken = Vec::new();
    let mut links = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for (line, code) in lines(&text) {
            if code {
                continue;
            }
            for target in line
                .split("](")
                .skip(1)
                .filter_map(|rest| rest.split(')').next())
            {
                if target.contains("://") || target.starts_with('#') {
                    continue;
                }
                links += 1;
                let file = target.split('#').next().unwrap();
                if !page.parent().unwrap().join(file).exists() {
                    broken.push(format!("{}: {target}", name(&page)));
                }
            }
        }
    }
    assert!(links > 60, "{links} links");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Every page of the repository, wherever it stands.
fn all_pages(folder: &Path, pages: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            all_pages(&path, pages);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        }
    }
}

/// No line of prose is longer than a reader's eye; tables and code may be.
#[test]
fn prose_is_narrow() {
    let mut every = Vec::new();
    all_pages(&repository(), &mut every);
    assert!(every.len() > pages().len(), "{} pages", every.len());
    let mut long = Vec::new();
    for page in every {
        let text = std::fs::read_to_string(&page).unwrap();
        for (line, code) in lines(&text) {
            if !code && !line.starts_with('|') && line.chars().count() > LONGEST_LINE {
                long.push(format!("{}: {line}", name(&page)));
            }
        }
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
}

/// Every command of the manual exists, and every option that it is given.
#[test]
fn commands_and_options_exist() {
    let help = rotary_sins(&["--help"]).expect_status(0).stdout;
    let commands: BTreeSet<String> = help
        .split("Commands:")
        .nth(1)
        .unwrap()
        .lines()
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .collect();
    let mut wrong = Vec::new();
    let mut seen = BTreeSet::new();
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for (line, code) in lines(&text) {
            // In prose a command stands between backticks.
            let spans: Vec<&str> = if code {
                vec![line.split(" #").next().unwrap()]
            } else {
                line.split('`').skip(1).step_by(2).collect()
            };
            for span in spans {
                let words: Vec<&str> = span.split_whitespace().collect();
                let Some(at) = words
                    .iter()
                    .position(|word| *word == "rotary-sins" || word.ends_with("/rotary-sins"))
                else {
                    continue;
                };
                let Some(command) = words.get(at + 1).filter(|word| !word.starts_with('-')) else {
                    continue;
                };
                if !commands.contains(*command) {
                    wrong.push(format!("{}: no command {command}: {span}", name(&page)));
                    continue;
                }
                seen.insert((*command).to_owned());
                let help = rotary_sins(&[*command, "--help"]).expect_status(0).stdout;
                for option in words[at + 2..]
                    .iter()
                    .map(|word| word.trim_start_matches('['))
                    .filter(|word| word.starts_with("--"))
                {
                    let option: String = option
                        .chars()
                        .take_while(|c| c.is_ascii_alphanumeric() || *c == '-')
                        .collect();
                    if !help
                        .split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'))
                        .any(|word| word == option)
                    {
                        wrong.push(format!(
                            "{}: {command} has no {option}: {span}",
                            name(&page)
                        ));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let page = std::fs::read_to_string(repository().join("docs/commands.md")).unwrap();
    for command in commands.iter().filter(|command| *command != "help") {
        assert!(
            page.contains(&format!("`rotary-sins {command}")),
            "docs/commands.md says nothing of {command}"
        );
    }
    assert!(seen.len() > 8, "{seen:?}");
}

/// The blocks that the manual marks with `sh run` are run line by line in one folder, and every line ends with status 0.
#[test]
fn marked_commands_run() {
    let mut lines = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let folder = scratch(page.file_stem().unwrap().to_str().unwrap());
        for line in blocks(&text, "```sh run").concat() {
            let words: Vec<&str> = line.split_whitespace().collect();
            assert_eq!(words[0], "rotary-sins", "{}: {line}", name(&page));
            let program = words[1..]
                .iter()
                .fold(Program::new("rotary-sins"), |program, word| {
                    program.arg(word)
                });
            let output = program.command().current_dir(&folder).output().unwrap();
            assert!(
                output.status.success(),
                "{}: {line}\n{}",
                name(&page),
                String::from_utf8_lossy(&output.stderr)
            );
            lines += 1;
        }
    }
    assert!(lines >= 5, "{lines} lines were run");
}

/// Schemes that the manual shows can be run as they stand, and see every state that a record at one place can show.
#[test]
fn schemes_of_the_manual_are_good_ones() {
    let page = std::fs::read_to_string(repository().join("docs/schemes.md")).unwrap();
    let schemes = blocks(&page, "```yaml");
    assert!(!schemes.is_empty());
    for scheme in schemes {
        let file = scratch("schemes").join("scheme.yaml");
        std::fs::write(&file, scheme.join("\n")).unwrap();
        let answer = rotary_sins(&["observability", "--scheme", file.to_str().unwrap()]);
        let text = answer.expect_status(0).stdout;
        assert!(text.contains("12 of 13"), "{text}");
        let hidden = text.split("Hidden to the end").nth(1).unwrap();
        assert!(
            hidden.trim_start().starts_with("longitude error alone"),
            "{text}"
        );
    }
}
