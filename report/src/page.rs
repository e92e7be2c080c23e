//! A page: text, tables and figures in one HTML file.

use std::collections::HashSet;
use std::io::{self, Write};

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::{Error, Figure, Table, svg};

/// The whole look of a page.
const STYLE: &str = include_str!("style.css");

/// What is thought of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// As it should be.
    Good,
    /// Needs a look.
    Warn,
    /// Not as it should be.
    Bad,
}

impl Verdict {
    pub(crate) fn class(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Warn => "warn",
            Self::Bad => "bad",
        }
    }

    /// The sign that tells it without colour.
    pub(crate) fn sign(self) -> Markup {
        let (word, sign) = match self {
            Self::Good => ("good", "✓"),
            Self::Warn => ("warning", "▲"),
            Self::Bad => ("bad", "✗"),
        };
        html! { span role="img" aria-label=(word) { (sign) } }
    }
}

enum Block {
    Section {
        level: u8,
        id: String,
        title: String,
    },
    Markup(Markup),
    Badge(Markup),
}

/// A page that is filled from top to bottom. What stands before its first section also stands before the table of contents.
pub struct Page {
    title: String,
    subtitle: String,
    meta: Vec<(String, String)>,
    blocks: Vec<Block>,
    ids: HashSet<String>,
    figures: usize,
    tables: usize,
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            subtitle: String::new(),
            meta: Vec::new(),
            blocks: Vec::new(),
            ids: HashSet::from(["contents".to_owned()]),
            figures: 0,
            tables: 0,
        }
    }

    /// A line under the title.
    pub fn subtitle(&mut self, text: impl Into<String>) -> &mut Self {
        self.subtitle = text.into();
        self
    }

    /// A line of the head: how the page came to be (command, version, date, seeds).
    pub fn meta(&mut self, key: impl Into<String>, value: impl Into<String>) -> &mut Self {
        self.meta.push((key.into(), value.into()));
        self
    }

    /// A heading, and its entry in the table of contents. Levels go from 2 (the title is 1) to 6.
    pub fn section(&mut self, level: u8, title: impl Into<String>) -> &mut Self {
        let title = title.into();
        let id = self.unique_id(&slug("section", &title));
        self.blocks.push(Block::Section {
            level: level.clamp(2, 6),
            id,
            title,
        });
        self
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: impl AsRef<str>) -> &mut Self {
        self.push(html! { p { (text.as_ref()) } })
    }

    /// A remark, set apart.
    pub fn note(&mut self, text: impl AsRef<str>) -> &mut Self {
        self.push(html! { p.note role="note" { (text.as_ref()) } })
    }

    /// Text with its own line breaks.
    pub fn preformatted(&mut self, text: impl AsRef<str>) -> &mut Self {
        self.push(html! { pre.scroll tabindex="0" { (text.as_ref()) } })
    }

    /// A list of names and values.
    pub fn key_values<K: AsRef<str>, V: AsRef<str>>(
        &mut self,
        pairs: impl IntoIterator<Item = (K, V)>,
    ) -> &mut Self {
        self.push(html! {
            dl { @for (key, value) in pairs { dt { (key.as_ref()) } dd { (value.as_ref()) } } }
        })
    }

    /// A list of lines.
    pub fn list<S: AsRef<str>>(&mut self, items: impl IntoIterator<Item = S>) -> &mut Self {
        self.push(html! { ul { @for item in items { li { (item.as_ref()) } } } })
    }

    /// A verdict in a few words. Several in a row stand beside each other.
    pub fn badge(&mut self, verdict: Verdict, text: impl AsRef<str>) -> &mut Self {
        let class = verdict.class();
        self.blocks.push(Block::Badge(
            html! { span.badge .(class) { (verdict.sign()) " " (text.as_ref()) } },
        ));
        self
    }

    /// A table. It is numbered.
    #[allow(clippy::needless_pass_by_value)] // A page takes what it is given, as with text.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.tables += 1;
        let id = self.unique_id(&format!("table-{}", self.tables));
        self.push(table.markup(self.tables, &id))
    }

    /// A figure with its caption. It is numbered, and its id is its anchor.
    ///
    /// # Errors
    /// As [`Figure::to_svg`].
    pub fn figure(&mut self, figure: &Figure) -> Result<(), Error> {
        let svg = svg::svg(figure, None)?;
        self.figures += 1;
        let number = self.figures;
        let id = match figure.id.split_whitespace().collect::<Vec<_>>().join("-") {
            id if id.is_empty() => format!("figure-{number}"),
            id => id,
        };
        let id = self.unique_id(&id);
        self.push(html! {
            figure id=(id) {
                div.scroll tabindex="0" role="region" aria-label={ "Figure " (number) } { (svg) }
                figcaption {
                    b { "Figure " (number) ". " (figure.title) @if !ends_sentence(&figure.title) { "." } }
                    " " (figure.caption)
                }
            }
        });
        Ok(())
    }

    /// The page as one HTML document.
    pub fn to_html(&self) -> String {
        self.markup().into_string()
    }

    /// Writes the page.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(self.to_html().as_bytes())
    }

    fn push(&mut self, markup: Markup) -> &mut Self {
        self.blocks.push(Block::Markup(markup));
        self
    }

    /// The wanted id, or one like it that the page does not have yet.
    fn unique_id(&mut self, wanted: &str) -> String {
        let mut id = wanted.to_owned();
        let mut n = 2;
        while !self.ids.insert(id.clone()) {
            id = format!("{wanted}-{n}");
            n += 1;
        }
        id
    }

    fn markup(&self) -> Markup {
        let section = |block: &Block| matches!(block, Block::Section { .. });
        let first = self.blocks.iter().position(section);
        let (opening, rest) = self.blocks.split_at(first.unwrap_or(self.blocks.len()));
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) (PreEscaped(svg::STYLE)) }
                }
                body {
                    header {
                        h1 { (self.title) }
                        @if !self.subtitle.is_empty() { p.subtitle { (self.subtitle) } }
                        @if !self.meta.is_empty() {
                            dl.meta { @for (key, value) in &self.meta { dt { (key) } dd { (value) } } }
                        }
                    }
                    main {
                        (body(opening))
                        (self.contents())
                        (body(rest))
                    }
                }
            }
        }
    }

    fn contents(&self) -> Markup {
        html! {
            @if self.blocks.iter().any(|block| matches!(block, Block::Section { .. })) {
                nav id="contents" aria-label="Contents" {
                    h2 { "Contents" }
                    ul {
                        @for block in &self.blocks {
                            @if let Block::Section { level, id, title } = block {
                                li class={ "level" (level) } { a href={ "#" (id) } { (title) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn body(blocks: &[Block]) -> Markup {
    let badge = |block: &Block| matches!(block, Block::Badge(_));
    html! {
        @for group in blocks.chunk_by(|a, b| badge(a) && badge(b)) {
            @if badge(&group[0]) {
                p.badges { @for block in group { @if let Block::Badge(markup) = block { (markup) " " } } }
            } @else {
                @for block in group { (block_markup(block)) }
            }
        }
    }
}

fn block_markup(block: &Block) -> Markup {
    match block {
        Block::Section { level, id, title } => html! {
            @match level {
                2 => h2 id=(id) { (title) },
                3 => h3 id=(id) { (title) },
                4 => h4 id=(id) { (title) },
                5 => h5 id=(id) { (title) },
                _ => h6 id=(id) { (title) },
            }
        },
        Block::Markup(markup) | Block::Badge(markup) => markup.clone(),
    }
}

/// An id that can stand in a link as it is.
fn slug(kind: &str, title: &str) -> String {
    let words = title
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty());
    [kind.to_owned()]
        .into_iter()
        .chain(words.map(str::to_ascii_lowercase))
        .collect::<Vec<_>>()
        .join("-")
}

fn ends_sentence(text: &str) -> bool {
    text.ends_with(['.', '!', '?'])
}
