//! A page with one of everything, to be looked at: `cargo run --release -p report --example sample > sample.html`.

use std::f64::consts::TAU;
use std::io;

use report::{Axis, Band, Cell, Figure, Line, Page, Panel, Series, Table, Verdict, palette};

/// Noise that is the same every time.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn gauss(&mut self) -> f64 {
        (-2.0 * self.uniform().max(1e-300).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut page = Page::new("Self-calibration at the mooring <& report>");
    page.subtitle("Sixteen-position scheme, 6 h, latitude 59.9°")
        .meta("command", "rotary-sins compare --bag mooring_2024-05-02.mcap --seeds 1..200 --scheme sixteen.yaml --out report.html")
        .meta("version", "0.1.0 (39cfa77)")
        .meta("date", "2025-01-01 12:00 UTC")
        .meta("seeds", "1 … 200");
    page.badge(Verdict::Good, "converged after 1.16 h")
        .badge(Verdict::Warn, "gap of 3 s")
        .badge(Verdict::Bad, "bias ∇z above 3σ");

    page.section(2, "Alignment").paragraph(
        "The estimate of the misalignment and its three-sigma bounds. The shaded area is what the filter believes of itself; the \
         dashed curve is the error against truth.",
    );
    page.figure(&alignment())?;
    page.section(3, "Azimuth over many runs");
    page.figure(&monte_carlo())?;
    page.note("One run left its bounds for 4 min: seed 117.");

    page.section(2, "Calibration");
    page.figure(&sigmas())?;
    page.table(table());
    page.section(3, "Sweep over heading");
    page.figure(&sweep())?;

    page.section(2, "Limits of the drawing");
    page.figure(&odd())?;
    page.figure(&labels())?;
    page.section(3, "Parameters").preformatted(
        "velocity_reference: moored\ncoarse_alignment_s: 120   # a rather long comment that does not fit on a phone, nor should it be broken\n",
    );
    page.key_values([
        ("samples", "2 160 000"),
        ("gaps", "1"),
        ("latitude", "59.9°"),
    ]);
    page.list(["one thing", "another thing"]);
    page.write_to(&mut io::stdout().lock())?;
    Ok(())
}

fn hours(n: usize, to: f64) -> impl Iterator<Item = f64> {
    (0..=n).map(move |i| to * i as f64 / n as f64)
}

fn alignment() -> Figure {
    let mut noise = Noise(1);
    let mut figure = Figure::new("misalignment", "Misalignment", Axis::new("time", "h"))
        .caption("Estimate, error against truth and 3σ of the filter. Azimuth is below its threshold of 1′ after 1.16 h.");
    for (name, start, floor, mark) in [
        ("E", 3.0, 0.2, None),
        ("N", 3.0, 0.25, None),
        ("U", 40.0, 0.6, Some(1.16)),
    ] {
        let sigma = |t: f64| floor + start * (-t * 3.0).exp();
        let mut wander = 0.3;
        let error: Vec<_> = hours(3600, 6.0)
            .map(|t| {
                wander += 0.02 * noise.gauss() - 0.002 * wander;
                (
                    t,
                    if (2.0..2.3).contains(&t) {
                        f64::NAN
                    } else {
                        wander * sigma(t)
                    },
                )
            })
            .collect();
        let mut panel = Panel::new(
            format!("Misalignment {name}"),
            Axis::new(format!("φ {name}"), "arcmin"),
        )
        .band(
            Band::new(
                "±3σ",
                hours(600, 6.0)
                    .map(|t| (t, -3.0 * sigma(t), 3.0 * sigma(t)))
                    .collect(),
            )
            .colour(palette::SKY),
        )
        .series(Series::new(
            "estimate",
            error
                .iter()
                .map(|&(t, e)| (t, e + 0.3 * sigma(t)))
                .collect(),
        ))
        .series(
            Series::new("error", error)
                .line(Line::Dashed)
                .colour(palette::VERMILION),
        )
        .vertical(0.03, "alignment ends");
        if let Some(at) = mark {
            panel = panel
                .vertical(at, "below threshold at 1.16 h")
                .vertical(5.9, "end of scheme")
                .range(-20.0, 20.0);
        }
        figure = figure.panel(panel);
    }
    figure
}

fn monte_carlo() -> Figure {
    let mut panel = Panel::new("", Axis::new("azimuth error", "arcmin"))
        .horizontal(1.0, "threshold")
        .horizontal(-1.0, "");
    for seed in 0..100 {
        let mut noise = Noise(seed * 977 + 3);
        let mut value = noise.gauss() * 2.0;
        let run = hours(3600, 6.0).map(|t| {
            value += 0.02 * noise.gauss() - 0.004 * value;
            (t, value)
        });
        panel = panel.series(Series::new("single run", run.collect()).line(Line::Thin));
    }
    let spread = |t: f64| 0.8 + 3.0 * (-t * 2.4).exp();
    panel = panel
        .series(
            Series::new(
                "3σ of the filter",
                hours(200, 6.0).map(|t| (t, spread(t))).collect(),
            )
            .colour(palette::BLACK),
        )
        .series(
            Series::new("-3σ", hours(200, 6.0).map(|t| (t, -spread(t))).collect())
                .colour(palette::BLACK)
                .unlisted(),
        );
    Figure::new(
        "monte-carlo",
        "Azimuth error of 100 runs",
        Axis::new("time", "h"),
    )
    .panel(panel)
}

fn sigmas() -> Figure {
    let curve = |scale: f64, rate: f64| {
        hours(300, 6.0)
            .map(|t| (t, scale * (1e-3 + (-t * rate).exp())))
            .collect::<Vec<_>>()
    };
    let gyro = Panel::new("Gyroscopes", Axis::new("σ of drift", "deg/h"))
        .log()
        .series(Series::new("εx", curve(0.1, 1.0)))
        .series(Series::new("εy", curve(0.1, 1.6)).colour(palette::VERMILION))
        .series(Series::new("εz", curve(0.1, 2.5)).colour(palette::GREEN))
        .horizontal(0.003, "threshold 0.003 deg/h");
    let accelerometer = Panel::new("Accelerometers", Axis::new("σ of bias", "m/s²"))
        .log()
        .series(Series::new("∇x", curve(1e-3, 3.0)))
        .series(Series::new("∇y", curve(1e-3, 2.0)).colour(palette::VERMILION))
        .series(Series::new("∇z", curve(1e-3, 0.9)).colour(palette::GREEN));
    Figure::new(
        "sigmas",
        "Uncertainty of the calibration",
        Axis::new("time", "h"),
    )
    .caption("Logarithmic.")
    .panel(gyro)
    .panel(accelerometer)
}

fn sweep() -> Figure {
    let points = |phase: f64, size: f64| {
        (0..=12)
            .map(|i| f64::from(i) * 30.0)
            .map(|h| (h, 1e-9 * (size + (h.to_radians() * 2.0 + phase).sin())))
            .collect()
    };
    let panel = Panel::new("", Axis::new("residual drift", "rad/s"))
        .series(Series::new("sixteen positions", points(0.0, 2.0)).line(Line::LinePoints))
        .series(
            Series::new("eight positions", points(1.0, 3.0))
                .line(Line::LinePoints)
                .colour(palette::VERMILION),
        )
        .series(
            Series::new("measured", points(0.4, 2.4))
                .line(Line::Points)
                .colour(palette::GREEN),
        );
    Figure::new(
        "heading",
        "Residual drift against heading",
        Axis::new("heading", "deg"),
    )
    .x_range(-5.0, 365.0)
    .panel(panel)
}

fn odd() -> Figure {
    let constant = |value: f64| vec![(0.0, value), (2.0, value), (4.0, value)];
    Figure::new("odd", "Degenerate data", Axis::new("time", "s"))
        .panel(
            Panel::new("constant", Axis::new("value", "m")).series(Series::new("a", constant(1e9))),
        )
        .panel(Panel::new("empty", Axis::new("value", "m")).series(Series::new("b", Vec::new())))
        .panel(
            Panel::new("one point", Axis::new("value", "m"))
                .series(Series::new("c", vec![(3.0, 1e-9)])),
        )
        .panel(
            Panel::new("late digits", Axis::new("value", "m"))
                .series(Series::new("d", vec![(0.0, 1e6), (4.0, 1e6 + 0.01)])),
        )
        .panel(
            Panel::new(
                "steps and dots",
                Axis::new("a rather long label of a position", "1"),
            )
            .series(
                Series::new(
                    "position",
                    vec![(0.0, 1.0), (1.0, 2.0), (2.5, 3.0), (4.0, 1.0)],
                )
                .line(Line::Steps),
            )
            .series(
                Series::new("dots", vec![(0.0, 2.5), (4.0, 1.2)])
                    .line(Line::Dotted)
                    .colour(palette::PURPLE),
            ),
        )
}

fn labels() -> Figure {
    let wave = |k: usize| {
        hours(200, 1e5)
            .map(|t| (t, (t * 1e-4 + k as f64).sin() * 1e4))
            .collect::<Vec<_>>()
    };
    let names = [
        "with odometer",
        "without odometer",
        "only gyroscopes",
        "scheme of eight",
        "scheme of sixteen",
        "no rotation",
        "truth",
        "last",
    ];
    let panel = names.iter().enumerate().fold(
        Panel::new("Many", Axis::new("error", "m")),
        |panel, (k, name)| panel.series(Series::new(*name, wave(k)).colour(k)),
    );
    let panel = [
        (1e4, "first leg"),
        (1.3e4, "turn to port"),
        (2e4, "second leg"),
        (9.6e4, "a mark near the end"),
        (9.9e4, "end"),
    ]
    .into_iter()
    .fold(panel, |panel, (at, label)| panel.vertical(at, label));
    Figure::new("labels", "Many names and marks", Axis::new("time", "s")).panel(panel)
}

fn table() -> Table {
    let text = Cell::text;
    let number = Cell::number;
    Table::new(
        "Calibration after 6 h.",
        [
            "Parameter",
            "Estimate (deg/h)",
            "Truth (deg/h)",
            "Error / σ",
            "Verdict",
        ],
    )
    .row([
        text("gyroscope drift x"),
        number("0.0102"),
        number("0.0100"),
        number("0.7"),
        Cell::Good("within 3σ".into()),
    ])
    .row([
        text("gyroscope drift y"),
        number("−0.0211"),
        number("−0.0200"),
        number("−2.9"),
        Cell::Warn("near 3σ".into()),
    ])
    .row([
        text("gyroscope drift z"),
        number("0.0350"),
        number("0.0300"),
        number("5.1"),
        Cell::Bad("outside".into()),
    ])
}
