//! The page as a whole.

use std::collections::HashSet;

use report::{Axis, Cell, Figure, Page, Panel, Series, Table, Verdict};
use roxmltree::{Document, ParsingOptions};

fn figure(id: &str) -> Figure {
    let series = Series::new("a", vec![(0.0, 1.0), (1.0, 2.0)]);
    Figure::new(id, "A title", Axis::new("time", "h"))
        .panel(Panel::new("", Axis::new("v", "m")).series(series))
}

fn page() -> Page {
    let mut page = Page::new("Title <& \"x\">");
    page.subtitle("sub <b>").meta("key <b>", "value & <i>");
    page.badge(Verdict::Good, "fine <")
        .badge(Verdict::Bad, "not");
    page.section(2, "Results")
        .paragraph("1 < 2 & 3")
        .note("<script>")
        .preformatted("a\n  <b>");
    page.figure(&figure("Results")).expect("drawn");
    page.section(3, "Results")
        .key_values([("<k>", "v")])
        .list(["<li>"]);
    page.figure(&figure("azimuth error")).expect("drawn");
    page.section(2, "???");
    page.table(
        Table::new("c <", ["name", "x (m)"])
            .row([Cell::text("<a>"), Cell::number("1.5")])
            .row([Cell::Good("ok".into())]),
    );
    page
}

/// The style of figures stands once in a page, and not in every figure.
#[test]
fn figures_share_their_style() {
    let html = page().to_html();
    let style = html.matches("<style>").count();
    assert_eq!((style, html.matches(".chart .curve {").count()), (1, 1));
    assert_eq!(html.matches("class=\"chart\"").count(), 2);
}

/// The page read as XML: void elements closed, the document type allowed.
fn parsed(html: &str) -> String {
    let open = html.replace("charset=\"utf-8\">", "charset=\"utf-8\"/>");
    open.replace("initial-scale=1\">", "initial-scale=1\"/>")
}

/// The page can be read as XML, and no text of a caller becomes markup.
#[test]
fn elements_nest_and_text_is_escaped() {
    let xml = parsed(&page().to_html());
    let document = Document::parse_with_options(
        &xml,
        ParsingOptions {
            allow_dtd: true,
            ..Default::default()
        },
    )
    .expect("nested");
    let texts: Vec<_> = document
        .descendants()
        .filter_map(|node| node.text())
        .collect();
    for text in [
        "1 < 2 & 3",
        "<script>",
        "a\n  <b>",
        "value & <i>",
        "<a>",
        "<k>",
        "<li>",
        "sub <b>",
    ] {
        assert!(texts.contains(&text), "{text}");
    }
    assert!(
        !document
            .descendants()
            .any(|node| node.has_tag_name("script") || node.has_tag_name("link"))
    );
}

/// Every link of the contents has its one target.
#[test]
fn ids_are_unique_and_contents_lead_to_them() {
    let xml = parsed(&page().to_html());
    let document = Document::parse_with_options(
        &xml,
        ParsingOptions {
            allow_dtd: true,
            ..Default::default()
        },
    )
    .expect("nested");
    let ids: Vec<_> = document
        .descendants()
        .filter_map(|node| node.attribute("id"))
        .collect();
    assert_eq!(
        ids.iter().collect::<HashSet<_>>().len(),
        ids.len(),
        "{ids:?}"
    );
    assert!(
        [
            "section-results",
            "Results",
            "section-results-2",
            "azimuth-error",
            "section"
        ]
        .iter()
        .all(|id| ids.contains(id)),
        "{ids:?}"
    );
    let links: Vec<_> = document
        .descendants()
        .filter_map(|node| node.attribute("href"))
        .collect();
    assert_eq!(links.len(), 3);
    assert!(
        links
            .iter()
            .all(|link| ids.contains(&link.trim_start_matches('#'))),
        "{links:?}"
    );
}

/// Nothing in a page leads to a network or a script.
#[test]
fn nothing_is_fetched() {
    let html = page()
        .to_html()
        .replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for word in [
        "http://", "https://", "@import", "url(", "<script", "<link", "src=",
    ] {
        assert!(!html.contains(word), "{word}");
    }
}

/// Figures and tables are counted, each with its caption.
#[test]
fn figures_and_tables_are_numbered_and_captioned() {
    let html = page().to_html();
    assert_eq!(html.matches("<figcaption>").count(), 2);
    assert_eq!(
        html.matches("role=\"img\" aria-label=\"A title\"").count(),
        2
    );
    assert!(html.contains("<b>Figure 2. A title.</b>") && html.contains("<b>Table 1.</b> c &lt;"));
}

/// A verdict can be read without colour.
#[test]
fn numbers_are_aligned_and_verdicts_told_by_signs() {
    let html = page().to_html();
    assert!(html.contains("<td class=\"number\">1.5</td>"));
    assert!(html.contains(
        "<span class=\"good\"><span role=\"img\" aria-label=\"good\">✓</span> ok</span>"
    ));
    assert!(html.contains("aria-label=\"bad\">✗</span> not"));
}

/// Long names break behind a slash, an underscore or before a capital; short ones stay whole.
#[test]
fn long_names_of_topics_may_be_broken() {
    let mut page = Page::new("t");
    let names = [
        "/imu/data_raw",
        "/self_calibration/estimate",
        "TwistWithCovariance",
    ];
    page.table(Table::new("", ["topics"]).row(names.map(Cell::text)));
    let html = page.to_html();
    assert!(html.contains("<td>/imu/data_raw</td>"));
    assert!(html.contains("<td>Twist<wbr>With<wbr>Covariance</td>"));
    assert!(html.contains("<td>/<wbr>self_<wbr>calibration/<wbr>estimate</td>"));
}

/// What stands before the first section stands before the contents.
#[test]
fn a_verdict_stands_before_the_contents() {
    let html = page().to_html();
    let at = |text: &str| html.find(text).expect("it is there");
    assert!(at("fine &lt;") < at("id=\"contents\"") && at("id=\"contents\"") < at("<h2 id="));
}

/// Writer and string give the same bytes.
#[test]
fn a_page_is_written_as_it_reads() {
    let mut out = Vec::new();
    page().write_to(&mut out).expect("memory");
    assert_eq!(out, page().to_html().into_bytes());
    assert!(out.starts_with(b"<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\">"));
}
