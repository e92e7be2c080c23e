//! Pictures and their data.

use report::{Axis, Band, Figure, Line, Panel, Series};
use roxmltree::{Document, Node};

fn figure(panel: Panel) -> Figure {
    Figure::new("id", "title", Axis::new("time", "h")).panel(panel)
}

fn panel() -> Panel {
    Panel::new("", Axis::new("value", "m"))
}

fn svg(figure: &Figure) -> String {
    figure.to_svg().expect("it can be drawn")
}

fn texts(document: &Document) -> Vec<String> {
    let texts = document
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "text")));
    texts
        .map(|node| node.text().unwrap_or_default().trim().to_owned())
        .collect()
}

/// Numbers of an attribute such as `points`.
fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', ',', 'M', 'H', 'V'])
        .filter(|number| !number.is_empty())
        .map(|number| number.parse().expect("a number"))
        .collect()
}

fn points(node: &Node) -> Vec<(f64, f64)> {
    let numbers = numbers(node.attribute("points").unwrap_or_default());
    numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect()
}

/// Everything of a class, in the order of drawing.
fn of_class<'a, 'b>(document: &'a Document<'b>, class: &str) -> Vec<Node<'a, 'b>> {
    let has = |node: &Node| {
        let classes = node.attribute("class").unwrap_or_default();
        classes.split(' ').any(|each| each == class)
    };
    document.descendants().filter(has).collect()
}

/// Curves of the first colour, as points.
fn curves(document: &Document) -> Vec<Vec<(f64, f64)>> {
    let groups = of_class(document, "c0");
    let children = groups.iter().flat_map(Node::children);
    children
        .filter(|node| node.tag_name().name() == "polyline")
        .map(|node| points(&node))
        .collect()
}

/// Any text, even of control characters and markup, gives valid XML with a name for those who do not see it.
#[test]
fn a_picture_is_well_formed_whatever_the_text() {
    let nasty = "a <b> & \"c\" 'd' \u{1} ]]> stroke-width=\"101\"";
    let figure = Figure::new(nasty, nasty, Axis::new(nasty, nasty))
        .caption(nasty)
        .panel(
            Panel::new(nasty, Axis::new(nasty, nasty))
                .series(Series::new(nasty, vec![(0.0, 0.0), (1.0, 1.0)]))
                .band(Band::new(
                    format!("{nasty} band"),
                    vec![(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)],
                ))
                .vertical(0.5, nasty)
                .horizontal(0.5, nasty),
        );
    let svg = svg(&figure);
    let document = Document::parse(&svg).expect("well-formed");
    let root = document.root_element();
    assert_eq!(root.attribute("role"), Some("img"));
    assert!(
        root.attribute("aria-label")
            .is_some_and(|label| label.starts_with("a <b> & \"c\""))
    );
    assert!(
        root.first_element_child()
            .is_some_and(|child| child.has_tag_name(("http://www.w3.org/2000/svg", "title")))
    );
    assert!(
        texts(&document)
            .iter()
            .any(|text| text.contains("<b> & \"c\" 'd'") && text.contains("stroke-width=\"101\""))
    );
}

/// Series of one name share an entry, and panels that agree share a legend.
#[test]
fn every_name_stands_once_in_the_legend() {
    let with = |figure: Figure, title: &str| {
        figure.panel(
            Panel::new(title, Axis::new("value", "m"))
                .series(Series::new("estimate", vec![(0.0, 1.0), (1.0, 2.0)]))
                .series(Series::new("run", vec![(0.0, 1.0), (1.0, 2.0)]).line(Line::Thin))
                .series(Series::new("run", vec![(0.0, 2.0), (1.0, 1.0)]).line(Line::Thin))
                .series(Series::new("unlisted", vec![(0.0, 2.0), (1.0, 1.0)]).unlisted())
                .band(Band::new("±3σ", vec![(0.0, 0.0, 2.0), (1.0, 1.0, 3.0)]).colour(5)),
        )
    };
    let figure = with(
        with(Figure::new("id", "title", Axis::new("time", "h")), "first"),
        "second",
    );
    let svg = svg(&figure);
    let texts = texts(&Document::parse(&svg).expect("well-formed"));
    let count = |name: &str| texts.iter().filter(|text| *text == name).count();
    assert_eq!(
        ["estimate", "run", "±3σ", "first", "second", "unlisted"].map(count),
        [1, 1, 1, 1, 1, 0]
    );
}

/// A curve has a hole where a value is not finite.
#[test]
fn what_is_not_finite_leaves_a_gap() {
    for hole in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let points = vec![
            (0.0, 1.0),
            (1.0, 2.0),
            (2.0, hole),
            (3.0, 1.0),
            (4.0, 2.0),
            (hole, 1.0),
        ];
        let svg = svg(&figure(panel().series(Series::new("a", points))));
        let document = Document::parse(&svg).expect("well-formed");
        let curves = curves(&document);
        assert_eq!(curves.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        assert!(curves[0][1].0 < curves[1][0].0);
    }
}

/// Equal ratios are equal distances, and what has no logarithm is a hole.
#[test]
fn the_zero_of_a_logarithmic_axis_is_a_gap() {
    let svg = svg(&figure(panel().log().series(Series::new(
        "a",
        vec![
            (0.0, 1.0),
            (1.0, 10.0),
            (2.0, 0.0),
            (3.0, 100.0),
            (4.0, 1e3),
        ],
    ))));
    let document = Document::parse(&svg).expect("well-formed");
    let curves = curves(&document);
    assert_eq!(curves.len(), 2);
    let rise = |curve: &[(f64, f64)]| curve[0].1 - curve[1].1;
    assert!(
        (rise(&curves[0]) - rise(&curves[1])).abs() <= 0.2,
        "equal ratios, equal distances: {curves:?}"
    );
    assert!(
        ["1", "10", "100", "1000"]
            .iter()
            .all(|tick| texts(&document).contains(&(*tick).to_owned()))
    );
}

/// An empty panel says why it is empty.
#[test]
fn panels_without_data_say_so() {
    for series in [Vec::new(), vec![(0.0, f64::NAN)], vec![(f64::NAN, 0.0)]] {
        let svg = svg(&figure(panel().series(Series::new("a", series))));
        assert!(
            texts(&Document::parse(&svg).expect("well-formed")).contains(&"no data".to_owned())
        );
    }
    let svg = svg(&figure(
        panel()
            .log()
            .series(Series::new("a", vec![(0.0, -1.0), (1.0, 0.0)])),
    ));
    assert!(
        texts(&Document::parse(&svg).expect("well-formed"))
            .contains(&"no positive values".to_owned())
    );
}

/// A figure without panels is refused by name.
#[test]
fn a_figure_without_panels_is_an_error_with_its_name() {
    let error = Figure::new("azimuth", "", Axis::new("", ""))
        .to_svg()
        .expect_err("nothing to draw");
    assert_eq!(error.to_string(), "figure azimuth: it has no panels");
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

/// The size of a picture is bound by its width, not by its data.
#[test]
fn a_million_points_make_a_small_picture() {
    let points: Vec<_> = (0..1_000_000)
        .map(|i| (f64::from(i), (f64::from(i) * 0.7).sin()))
        .collect();
    assert!(svg(&figure(panel().series(Series::new("a", points)))).len() < 100_000);
}

/// Every value comes back to the last bit, whatever the text beside it.
#[test]
fn csv_gives_every_value_back() {
    let points = vec![
        (0.1 + 0.2, 1e-300),
        (f64::MIN_POSITIVE, f64::MAX),
        (1.0, f64::NAN),
        (-0.0, f64::NEG_INFINITY),
    ];
    let figure = Figure::new("id", "t", Axis::new("time", "h"))
        .panel(
            Panel::new("one, \"two\"\nthree", Axis::new("v", "m/s"))
                .series(Series::new("a", points.clone()))
                .horizontal(0.3, "limit"),
        )
        .panel(
            Panel::new("", Axis::new("w", ""))
                .band(Band::new("±3σ", vec![(1.5, -0.1, 0.1)]))
                .vertical(2.0, "here"),
        );
    let csv = figure.to_csv().expect("rows");
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let header: Vec<_> = reader
        .headers()
        .expect("a header")
        .iter()
        .map(str::to_owned)
        .collect();
    assert_eq!(
        header,
        [
            "panel", "kind", "series", "time (h)", "value", "lower", "upper", "unit"
        ]
    );
    let rows: Vec<Vec<String>> = reader
        .records()
        .map(|row| row.expect("a row").iter().map(str::to_owned).collect())
        .collect();
    let number = |text: &str| text.parse::<f64>().expect("a number");
    for (row, (x, y)) in rows.iter().zip(points) {
        assert_eq!(
            (row[0].as_str(), row[1].as_str(), row[7].as_str()),
            ("one, \"two\"\nthree", "series", "m/s")
        );
        assert_eq!(number(&row[3]).to_bits(), x.to_bits());
        assert!(number(&row[4]).to_bits() == y.to_bits() || y.is_nan() && number(&row[4]).is_nan());
    }
    assert_eq!(
        rows[4],
        [
            "one, \"two\"\nthree",
            "horizontal",
            "limit",
            "",
            "0.3",
            "",
            "",
            "m/s"
        ]
    );
    assert_eq!(rows[5], ["w", "band", "±3σ", "1.5", "", "-0.1", "0.1", ""]);
    assert_eq!(rows[6], ["w", "vertical", "here", "2.0", "", "", "", ""]);
}

/// The names of JSON are those of the documentation.
#[test]
fn a_figure_is_json_too() {
    let json = serde_json::to_value(figure(
        panel()
            .log()
            .series(Series::new("a", vec![(0.0, 1.0)]).line(Line::LinePoints)),
    ))
    .expect("json");
    assert_eq!(json["panels"][0]["scale"], "log");
    assert_eq!(json["panels"][0]["series"][0]["line"], "line_points");
    assert_eq!(json["panels"][0]["series"][0]["points"][0][1], 1.0);
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

/// Every colour has its value for light and for dark paper; the faint one keeps it.
#[test]
fn every_colour_has_its_values() {
    let svg = svg(&figure(panel()));
    let (light, dark) = svg
        .split_once("@media screen and (prefers-color-scheme: dark)")
        .expect("both");
    for colour in 0..report::palette::COUNT {
        let rule = format!(".chart .c{colour} {{ color: #");
        assert_eq!(light.matches(&rule).count(), 1, "{rule}");
        assert_eq!(
            dark.matches(&rule).count(),
            usize::from(colour != report::palette::YELLOW),
            "{rule}"
        );
    }
}

/// The same figure gives the same bytes.
#[test]
fn pictures_are_repeatable() {
    let figure = || {
        let names = ["a", "b", "c", "d"].into_iter().enumerate();
        let panel = names.fold(panel(), |panel, (i, name)| {
            panel.series(Series::new(name, vec![(0.0, i as f64), (1.0, 1.0)]).colour(i))
        });
        figure(panel)
    };
    assert_eq!(svg(&figure()), svg(&figure()));
}
