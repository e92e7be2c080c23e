//! A panel with one curve, and what an SVG says.
#![allow(dead_code, reason = "each test uses a part of it")]

use report::{Axis, Figure, Panel};
use roxmltree::{Document, Node};

pub fn figure(panel: Panel) -> Figure {
    Figure::new("id", "title", Axis::new("time", "h")).panel(panel)
}

pub fn panel() -> Panel {
    Panel::new("", Axis::new("value", "m"))
}

pub fn svg(figure: &Figure) -> String {
    figure.to_svg().expect("it can be drawn")
}

pub fn texts(document: &Document) -> Vec<String> {
    let texts = document
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "text")));
    texts
        .map(|node| node.text().unwrap_or_default().trim().to_owned())
        .collect()
}

/// Numbers of an attribute such as `points`.
pub fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', ',', 'M', 'H', 'V'])
        .filter(|number| !number.is_empty())
        .map(|number| number.parse().expect("a number"))
        .collect()
}

pub fn points(node: &Node) -> Vec<(f64, f64)> {
    let numbers = numbers(node.attribute("points").unwrap_or_default());
    numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect()
}

/// Everything of a class, in the order of drawing.
pub fn of_class<'a, 'b>(document: &'a Document<'b>, class: &str) -> Vec<Node<'a, 'b>> {
    let has = |node: &Node| {
        let classes = node.attribute("class").unwrap_or_default();
        classes.split(' ').any(|each| each == class)
    };
    document.descendants().filter(has).collect()
}

/// Curves of the first colour, as points.
pub fn curves(document: &Document) -> Vec<Vec<(f64, f64)>> {
    let groups = of_class(document, "c0");
    let children = groups.iter().flat_map(Node::children);
    children
        .filter(|node| node.tag_name().name() == "polyline")
        .map(|node| points(&node))
        .collect()
}
