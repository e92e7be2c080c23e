//! What stands in a picture: its text, its legend, its holes; and the data beside it.

mod common;

use common::*;
use report::{Axis, Band, Figure, Line, Panel, Series};
use roxmltree::Document;

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
