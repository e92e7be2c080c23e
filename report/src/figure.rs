//! What a figure shows: data, axes and marks, nothing of how it is drawn.

use std::borrow::Cow;

use serde::Serialize;

use crate::ticks::scaled;
use crate::{Error, csv, svg};

/// Name and unit of an axis; the unit may be empty.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Axis {
    /// The quantity, e.g. `time`.
    pub label: String,
    /// Its unit, e.g. `h`.
    pub unit: String,
}

impl Axis {
    /// An axis of `label` in `unit`.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            unit: unit.into(),
        }
    }

    /// `label (unit)`, or the label alone.
    pub fn title(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} ({})", self.label, self.unit)
        }
    }
}

/// How a series is drawn.
///
/// Where a panel has several series of one kind, the second and later ones also carry a few markers, so that a black-and-white
/// print tells them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Line {
    /// A full line.
    Solid,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A thin translucent line, for many runs over each other.
    Thin,
    /// Markers without a line.
    Points,
    /// Markers joined by a line.
    LinePoints,
    /// A value that holds until the next point.
    Steps,
}

/// One curve. A value that is not finite (on a logarithmic axis: not positive) leaves a gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Its name in the legend. Series of one name share one entry.
    pub name: String,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub line: Line,
    /// Index into [`crate::palette`], and with it the shape of its markers.
    pub colour: usize,
    /// Whether the legend names it.
    pub in_legend: bool,
}

impl Series {
    /// A full line in the first colour.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points,
            line: Line::Solid,
            colour: 0,
            in_legend: true,
        }
    }

    /// Drawn as `line`.
    #[must_use]
    pub fn line(mut self, line: Line) -> Self {
        self.line = line;
        self
    }

    /// In a colour of the palette.
    #[must_use]
    pub fn colour(mut self, colour: usize) -> Self {
        self.colour = colour;
        self
    }

    /// Not named in the legend.
    #[must_use]
    pub fn unlisted(mut self) -> Self {
        self.in_legend = false;
        self
    }
}

/// A shaded area between two curves, such as ±3σ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    /// Its name in the legend; empty for none.
    pub name: String,
    /// Points (x, lower, upper), by ascending x.
    pub points: Vec<(f64, f64, f64)>,
    /// Index into [`crate::palette`].
    pub colour: usize,
}

impl Band {
    /// A band in the first colour.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points,
            colour: 0,
        }
    }

    /// In a colour of the palette.
    #[must_use]
    pub fn colour(mut self, colour: usize) -> Self {
        self.colour = colour;
        self
    }
}

/// A line at one value of an axis, with a short label.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mark {
    /// Where.
    pub at: f64,
    /// What is there, e.g. `below threshold at 1.16 h`.
    pub label: String,
}

impl Mark {
    /// A mark at `at`.
    pub fn new(at: f64, label: impl Into<String>) -> Self {
        Self {
            at,
            label: label.into(),
        }
    }
}

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Equal differences, equal distances.
    #[default]
    Linear,
    /// Equal ratios, equal distances.
    Log,
}

/// One pair of axes of a figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Stands above the panel; may be empty.
    pub title: String,
    /// The y axis.
    pub y: Axis,
    /// Its scale.
    pub scale: Scale,
    /// Its ends; without them, what the data need.
    pub range: Option<(f64, f64)>,
    /// Curves.
    pub series: Vec<Series>,
    /// Shaded areas, behind the curves.
    pub bands: Vec<Band>,
    /// Marks on the x axis.
    pub vertical: Vec<Mark>,
    /// Marks on the y axis.
    pub horizontal: Vec<Mark>,
}

impl Panel {
    /// An empty panel with a linear y axis that fits its data.
    pub fn new(title: impl Into<String>, y: Axis) -> Self {
        Self {
            title: title.into(),
            y,
            scale: Scale::Linear,
            range: None,
            series: Vec::new(),
            bands: Vec::new(),
            vertical: Vec::new(),
            horizontal: Vec::new(),
        }
    }

    /// With a logarithmic y axis.
    #[must_use]
    pub fn log(mut self) -> Self {
        self.scale = Scale::Log;
        self
    }

    /// With fixed ends of the y axis. What lies beyond is cut off.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// With one more curve.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// With one more shaded area.
    #[must_use]
    pub fn band(mut self, band: Band) -> Self {
        self.bands.push(band);
        self
    }

    /// With a mark on the x axis.
    #[must_use]
    pub fn vertical(mut self, at: f64, label: impl Into<String>) -> Self {
        self.vertical.push(Mark::new(at, label));
        self
    }

    /// With a mark on the y axis.
    #[must_use]
    pub fn horizontal(mut self, at: f64, label: impl Into<String>) -> Self {
        self.horizontal.push(Mark::new(at, label));
        self
    }
}

/// A column of panels over one x axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Its anchor in a page and the stem of its files.
    pub id: String,
    /// What it shows, in a few words.
    pub title: String,
    /// What the reader should see in it.
    pub caption: String,
    /// The x axis of all panels.
    pub x: Axis,
    /// Its scale.
    pub x_scale: Scale,
    /// Its ends; without them, what the data need.
    pub x_range: Option<(f64, f64)>,
    /// Panels, from the top.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// A figure without panels.
    pub fn new(id: impl Into<String>, title: impl Into<String>, x: Axis) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            caption: String::new(),
            x,
            x_scale: Scale::Linear,
            x_range: None,
            panels: Vec::new(),
        }
    }

    /// With a caption.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// With a logarithmic x axis.
    #[must_use]
    pub fn log_x(mut self) -> Self {
        self.x_scale = Scale::Log;
        self
    }

    /// With fixed ends of the x axis. What lies beyond is cut off.
    #[must_use]
    pub fn x_range(mut self, low: f64, high: f64) -> Self {
        self.x_range = Some((low, high));
        self
    }

    /// With one more panel, below the others.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// The picture, as an SVG document that stands alone.
    ///
    /// It needs neither scripts nor fonts, and turns dark where the reader's screen is.
    ///
    /// # Errors
    /// [`Error::NoPanels`] if the figure has no panels.
    pub fn to_svg(&self) -> Result<String, Error> {
        svg::svg(self, Some(svg::STYLE)).map(maud::PreEscaped::into_string)
    }

    /// What is drawn, with everything of the x axis on the drawn scale.
    pub(crate) fn on_drawn_x(&self) -> Cow<'_, Self> {
        if self.x_scale == Scale::Linear {
            return Cow::Borrowed(self);
        }
        let mut figure = self.clone();
        let place = |x: &mut f64| *x = scaled(*x, true);
        if let Some((low, high)) = &mut figure.x_range {
            place(low);
            place(high);
        }
        for panel in &mut figure.panels {
            let points = panel.series.iter_mut().flat_map(|s| &mut s.points);
            points.for_each(|point| place(&mut point.0));
            let spans = panel.bands.iter_mut().flat_map(|b| &mut b.points);
            spans.for_each(|span| place(&mut span.0));
            panel
                .vertical
                .iter_mut()
                .for_each(|mark| place(&mut mark.at));
        }
        Cow::Owned(figure)
    }

    /// What is drawn, as CSV: one row a point, with all digits of a value.
    ///
    /// Columns: panel, kind (`series`, `band`, `vertical`, `horizontal`), series, x with its unit, value, lower, upper, and the
    /// unit of the last three. A band has no value, a curve no lower and upper.
    ///
    /// # Errors
    /// [`Error::Csv`] if a row cannot be written.
    pub fn to_csv(&self) -> Result<String, Error> {
        csv::long_form(self)
    }
}
