//! Where things stand in a picture: ranges, ticks, curves and the frame.

mod common;

use common::*;
use report::{Band, Line, Series};
use roxmltree::Document;

/// On a logarithmic x axis equal ratios have equal distances, its numbers are decades, and what is not positive is not drawn.
#[test]
fn x_axis_can_be_logarithmic() {
    let points = vec![(0.0, 1.0), (0.01, 1.0), (1.0, 2.0), (100.0, 3.0)];
    let svg = svg(&figure(panel().series(Series::new("s", points))).log_x());
    let document = Document::parse(&svg).expect("well-formed");
    let texts = texts(&document);
    for decade in ["0.01", "0.1", "1", "10", "100"] {
        assert!(texts.iter().any(|text| text == decade), "{texts:?}");
    }
    let curves = curves(&document);
    // Three points on a line: the middle one is left out.
    let [(from, _), (to, _)] = curves[0][..] else {
        panic!("{curves:?}");
    };
    assert!(to > from && curves.len() == 1);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

/// No range, however small, large or empty, gives numbers that cannot be read.
#[test]
fn degenerate_ranges_have_sensible_axes() {
    let values = [
        0.0,
        1e-9,
        -1e-9,
        1e9,
        5e-324,
        1e299,
        -1e299,
        f64::MAX,
        0.1 + 0.2,
    ];
    for a in values {
        for b in values {
            for log in [false, true] {
                let lines = [Line::Solid, Line::Steps, Line::LinePoints, Line::Points];
                let points = [
                    vec![(a, b)],
                    vec![(0.0, a), (1.0, a)],
                    vec![(0.0, a), (1.0, b)],
                    vec![(a, 1.0), (b, 1.0)],
                ];
                for (line, points) in lines.into_iter().zip(points) {
                    let mut panel = panel()
                        .series(Series::new("s", points.clone()).line(line))
                        .range(a, b);
                    panel = panel
                        .band(Band::new(
                            "b",
                            points.iter().map(|&(x, y)| (x, y, y)).collect(),
                        ))
                        .horizontal(b, "h")
                        .vertical(a, "v");
                    let panel = if log { panel.log() } else { panel };
                    let svg = svg(&figure(panel).x_range(b, a));
                    let document = Document::parse(&svg).expect("well-formed");
                    assert!(!svg.contains("NaN") && !svg.contains("inf"));
                    assert!(
                        texts(&document)
                            .iter()
                            .all(|text| text.chars().count() < 40),
                        "{:?}",
                        texts(&document)
                    );
                }
            }
        }
    }
}

/// A curve that leaves its panel ends there, and is not pressed flat against the frame.
#[test]
fn what_is_beyond_a_fixed_range_is_not_drawn_outside_the_panel() {
    let series = Series::new("a", vec![(0.0, -100.0), (1.0, 100.0), (2.0, -100.0)]);
    let svg = svg(&figure(panel().series(series).range(-1.0, 1.0)));
    let document = Document::parse(&svg).expect("well-formed");
    let curves = curves(&document);
    assert_eq!(curves.len(), 2);
    // Steep to the end: no clamped flat pieces along the frame.
    assert!(
        curves
            .iter()
            .flat_map(|curve| curve.windows(2))
            .all(|pair| pair[0].1 != pair[1].1),
        "{curves:?}"
    );
}

/// Ticks stand where their numbers say: the number, its small line and its grid line at one place, on both axes.
#[test]
fn ticks_stand_at_their_values() {
    let points = vec![(0.0, 0.0), (4.0, 2.0)];
    let figure = figure(panel().range(0.0, 2.0).series(Series::new("a", points))).x_range(0.0, 4.0);
    let svg = svg(&figure);
    let document = Document::parse(&svg).expect("well-formed");
    let curve = &curves(&document)[0];
    let ((left, bottom), (right, top)) = (curve[0], curve[1]);
    let frame = of_class(&document, "frame")[0];
    let edge = |name| numbers(frame.attribute(name).expect("a frame"))[0];
    assert_eq!((edge("x"), edge("y")), (left, top));
    assert_eq!(
        (edge("width"), edge("height")),
        (right - left, bottom - top)
    );

    let ticks = |class: &str, value: &dyn Fn(f64) -> f64, wanted: &str, at: &str| {
        let groups = of_class(&document, class);
        let group = groups.iter().find(|node| node.tag_name().name() == "g");
        let texts = group
            .expect("a group of numbers")
            .children()
            .filter(|node| node.attribute(at).is_some())
            .filter_map(|node| {
                let number: f64 = node.text()?.parse().ok()?;
                Some((number, numbers(node.attribute(at)?)[0]))
            });
        let texts: Vec<_> = texts.collect();
        assert!(texts.len() >= 4, "{texts:?}");
        for &(number, place) in &texts {
            assert!(
                (place - value(number)).abs() < 0.06,
                "{wanted}: {number} at {place}"
            );
        }
        texts
            .into_iter()
            .map(|(_, place)| place)
            .collect::<Vec<_>>()
    };
    let x = ticks("middle", &|v| left + v / 4.0 * (right - left), "x", "x");
    let below = 6.5; // From the middle of a text down to its baseline.
    let y = ticks(
        "end",
        &|v| bottom - v / 2.0 * (bottom - top) + below,
        "y",
        "y",
    );
    for (class, lengths) in [
        ("grid", (bottom - top, right - left)),
        ("ticks", (5.0, 5.0)),
    ] {
        let path = of_class(&document, class)[0]
            .attribute("d")
            .expect("a path");
        let lines: Vec<_> = path
            .split('M')
            .skip(1)
            .map(|line| (line.contains('V'), numbers(line)))
            .collect();
        let of = |vertical: bool| {
            lines
                .iter()
                .filter(move |line| line.0 == vertical)
                .map(|line| &line.1)
        };
        assert_eq!(of(true).map(|line| line[0]).collect::<Vec<_>>(), x);
        let places: Vec<_> = of(false).map(|line| line[1] + below).collect();
        assert!(
            places.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-9),
            "{places:?} {y:?}"
        );
        assert!(of(true).all(|line| (line[2] - line[1]).abs() == lengths.0));
        assert!(of(false).all(|line| (line[2] - line[0]).abs() == lengths.1));
    }
}

/// A curve goes through its data, to the two tenths of a unit that rounding and simplifying may cost.
#[test]
fn curves_go_through_their_data() {
    let xs = (0..=200).map(|i| f64::from(i) * 0.05);
    let data: Vec<_> = xs
        .map(|x| (x, (x * 1.3).sin() * (-0.2 * x).exp()))
        .collect();
    let figure = figure(
        panel()
            .range(-1.0, 1.0)
            .series(Series::new("a", data.clone())),
    );
    let svg = svg(&figure.x_range(0.0, 10.0));
    let document = Document::parse(&svg).expect("well-formed");
    let frame = of_class(&document, "frame")[0];
    let edge = |name| numbers(frame.attribute(name).expect("a frame"))[0];
    let [x, y, width, height] = ["x", "y", "width", "height"].map(edge);
    let curve = &curves(&document)[0];
    let place = |(a, b): (f64, f64)| (x + a / 10.0 * width, y + (1.0 - b) / 2.0 * height);
    for point in &data {
        let (px, py) = place(*point);
        let pair = curve
            .windows(2)
            .find(|pair| pair[0].0 - 0.1 <= px && px <= pair[1].0 + 0.1);
        let pair = pair.expect("a piece of the curve");
        let share = (px - pair[0].0) / (pair[1].0 - pair[0].0);
        let drawn = pair[0].1 + share * (pair[1].1 - pair[0].1);
        let steep = ((pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)).hypot(1.0);
        assert!(
            (drawn - py).abs() <= 0.2 * steep,
            "{drawn} instead of {py} at {px}"
        );
    }
    // And every point drawn is one of the data.
    for drawn in curve {
        let is_it = |point: &(f64, f64)| {
            let (px, py) = place(*point);
            (px - drawn.0).abs() <= 0.0501 && (py - drawn.1).abs() <= 0.0501
        };
        assert!(data.iter().any(is_it), "{drawn:?}");
    }
}

/// Every kind of line has its own dashes, by the style sheet that the picture carries.
#[test]
fn kinds_of_lines_have_their_dashes() {
    let points = vec![(0.0, 0.0), (1.0, 1.0)];
    for (line, class, dashes) in [
        (Line::Solid, "curve", None),
        (Line::Steps, "curve", None),
        (Line::Dashed, "curve dashed", Some("11 6.5")),
        (Line::Dotted, "curve dotted", Some("0.1 7")),
        (Line::Thin, "curve thin", None),
    ] {
        let svg = svg(&figure(
            panel()
                .series(Series::new("a", points.clone()).line(line))
                .horizontal(0.5, ""),
        ));
        let document = Document::parse(&svg).expect("well-formed");
        let style = document
            .descendants()
            .find(|node| node.tag_name().name() == "style")
            .and_then(|node| node.text())
            .expect("a style");
        let rule = |class: &str| {
            let (_, rest) = style
                .split_once(&format!("\n.chart .{class} {{"))
                .expect("a rule");
            rest.split_once('}').expect("closed").0
        };
        let dash = |class: &str| {
            let (_, rest) = rule(class).split_once("stroke-dasharray: ")?;
            rest.split_once(';').map(|(dashes, _)| dashes)
        };
        let lines: Vec<_> = document
            .descendants()
            .filter(|node| node.tag_name().name() == "polyline")
            .collect();
        assert_eq!(
            lines
                .iter()
                .map(|line| line.attribute("class"))
                .collect::<Vec<_>>(),
            [Some(class)]
        );
        assert_eq!(class.split(' ').find_map(dash), dashes);
        let samples = of_class(&document, "sample");
        assert_eq!(samples.len(), 1);
        assert!(
            samples[0]
                .attribute("class")
                .is_some_and(|sample| sample.starts_with(class))
        );
        assert_eq!(
            (of_class(&document, "mark").len(), dash("mark")),
            (1, Some("5 4"))
        );
    }
}

/// Nothing is drawn outside of its panel: curves, bands, markers and marks end at the frame, exactly.
#[test]
fn everything_is_cut_at_the_frame() {
    let wave: Vec<_> = (0..2000)
        .map(|i| f64::from(i) * 0.01 - 5.0)
        .map(|x| (x, 3.0 * (7.0 * x).sin()))
        .collect();
    let band = wave.iter().map(|&(x, y)| (x, y - 1.0, y + 1.0)).collect();
    let figure = figure(
        panel()
            .range(-1.0, 1.0)
            .band(Band::new("band", band))
            .series(Series::new("a", wave.clone()))
            .series(Series::new("b", wave.clone()).line(Line::Steps))
            .series(Series::new("c", wave).line(Line::Points).colour(1))
            .vertical(-4.0, "before")
            .horizontal(2.0, "above")
            .horizontal(0.5, "within"),
    )
    .x_range(0.0, 10.0);
    let svg = svg(&figure);
    let document = Document::parse(&svg).expect("well-formed");
    let frame = of_class(&document, "frame")[0];
    let [x, y, width, height] = ["x", "y", "width", "height"]
        .map(|name| numbers(frame.attribute(name).expect("a frame"))[0]);
    let within =
        |(px, py): (f64, f64)| (x..=x + width).contains(&px) && (y..=y + height).contains(&py);
    let shapes = document
        .descendants()
        .filter(|node| node.attribute("points").is_some());
    let places: Vec<_> = shapes.flat_map(|node| points(&node)).collect();
    assert!(places.len() > 500 && places.iter().all(|place| within(*place)));
    for edge in [y, y + height] {
        assert!(
            places.iter().any(|place| place.1 == edge),
            "nothing reaches {edge}"
        );
    }
    let markers = of_class(&document, "c1")
        .into_iter()
        .flat_map(|group| group.children());
    let mut markers = markers.filter(|node| node.attribute("class") == Some("point"));
    let path = markers
        .next_back()
        .and_then(|node| node.attribute("d"))
        .expect("markers");
    let at = path
        .split('M')
        .skip(1)
        .filter_map(|marker| marker.split_once('m'));
    let at: Vec<_> = at.map(|(place, _)| numbers(place)).collect();
    assert!(at.len() > 50 && at.iter().all(|place| within((place[0], place[1]))));
    assert_eq!(
        of_class(&document, "mark").len(),
        1,
        "only one mark lies within"
    );
}
