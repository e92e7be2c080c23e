//! From a figure to its picture.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::curve::{self, Point};
use crate::layout::{self, Entry, FONT, ROW, SAMPLE, Sample, text_width};
use crate::pen::{self, GREY, Sheet, words};
use crate::plan::{PanelPlan, Plan, WIDTH, clean};
use crate::ticks::{Ruler, is_drawable};
use crate::{Figure, Line, Panel, Scale, Series};

/// An axis as the chart library wants it, with our ticks.
struct Coordinate {
    line: RangedCoordf64,
    ticks: Vec<f64>,
    minor: Vec<f64>,
}

impl Coordinate {
    fn new(ruler: &Ruler) -> Self {
        let ticks = ruler.ticks.iter().map(|tick| tick.at).collect();
        Self {
            line: (ruler.low..ruler.high).into(),
            ticks,
            minor: ruler.minor.clone(),
        }
    }
}

impl Ranged for Coordinate {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.line.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            self.minor.clone()
        } else {
            self.ticks.clone()
        }
    }

    fn range(&self) -> Range<f64> {
        self.line.range()
    }
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Coordinate, Coordinate>>;

/// Columns of the window a curve is thinned to, and a curve that is one of many.
const COLUMNS: usize = 1000;
const COLUMNS_THIN: usize = 400;
/// A curve with markers has one in so many pixels.
const MARKERS_EVERY: i32 = 220;

/// The picture of a figure, or why there is none.
pub(crate) fn svg(figure: &Figure) -> Result<String, String> {
    if figure.panels.is_empty() {
        return Err("it has no panels".to_owned());
    }
    let plan = Plan::new(figure);
    let mut drawn = String::new();
    {
        let sheet = SVGBackend::with_string(&mut drawn, (WIDTH as u32, plan.height as u32))
            .into_drawing_area();
        sheet.fill(&WHITE).map_err(words)?;
        draw_legend(&sheet, &plan.legend, (plan.left, 14))?;
        for (i, (panel, place)) in figure.panels.iter().zip(&plan.panels).enumerate() {
            draw_panel(&sheet, panel, place, &plan, i + 1 == figure.panels.len())?;
        }
        sheet.present().map_err(words)?;
    }
    titled(&pen::with_dashes(&drawn), figure, plan.height)
}

/// With a size that scales, and a name for those who do not see it.
fn titled(drawn: &str, figure: &Figure, height: i32) -> Result<String, String> {
    let (_, body) = drawn.split_once('>').ok_or("the drawing is not SVG")?;
    let name = if figure.title.is_empty() {
        &figure.id
    } else {
        &figure.title
    };
    let [name, caption] = [name, &figure.caption].map(|text| clean(text));
    let markup = maud::html! {
        title { (name) }
        @if !caption.is_empty() { desc { (caption) } }
    };
    let label = maud::html! { (name) }.into_string();
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{label}\" \
         stroke-linejoin=\"round\">\n{}\n{}",
        markup.into_string(),
        body.trim_start()
    ))
}

fn draw_panel(
    sheet: &Sheet,
    panel: &Panel,
    place: &PanelPlan,
    plan: &Plan,
    last: bool,
) -> Result<(), String> {
    sheet
        .draw_text(
            &clean(&panel.title),
            &pen::bold(),
            (plan.left, place.head + ROW / 2),
        )
        .map_err(words)?;
    draw_legend(sheet, &place.legend, place.legend_at)?;
    draw_y_title(sheet, place)?;
    let mut chart = axes(sheet, place, plan, last)?;
    let frame = [
        (plan.left, place.top),
        (plan.right, place.top),
        (plan.right, place.bottom),
        (plan.left, place.bottom),
    ];
    if let Some(reason) = place.empty {
        let middle = (
            i32::midpoint(plan.left, plan.right),
            i32::midpoint(place.top, place.bottom),
        );
        let style = pen::text(HPos::Center, VPos::Center).color(&GREY);
        sheet.draw_text(reason, &style, middle).map_err(words)?;
    }
    let log = panel.scale == Scale::Log;
    draw_bands(&mut chart, panel, place, log)?;
    draw_verticals(sheet, &chart, panel, place)?;
    let mut drawn = Vec::new();
    let marked = layout::marked(panel);
    let behind = |series: &Series| series.line == Line::Thin;
    for pass in [true, false] {
        for (series, marked) in panel
            .series
            .iter()
            .zip(&marked)
            .filter(|(series, _)| behind(series) == pass)
        {
            draw_series(sheet, &mut chart, series, *marked, place, log, &mut drawn)?;
        }
    }
    draw_horizontals(sheet, &chart, panel, place, plan, drawn)?;
    let frame: Vec<_> = frame.into_iter().cycle().take(5).collect();
    sheet
        .draw(&PathElement::new(frame, pen::stroke(GREY, 2)))
        .map_err(words)
}

fn axes<'a, 'b>(
    sheet: &'a Sheet<'b>,
    place: &PanelPlan,
    plan: &Plan,
    last: bool,
) -> Result<Chart<'a, 'b>, String> {
    let below = if last { 64 } else { 0 };
    let area = sheet.clone().shrink(
        (0, place.top),
        (plan.right as u32, (place.bottom - place.top + below) as u32),
    );
    let mut chart = ChartBuilder::on(&area)
        .set_label_area_size(LabelAreaPosition::Left, plan.left)
        .set_label_area_size(LabelAreaPosition::Bottom, below)
        .build_cartesian_2d(Coordinate::new(&plan.x), Coordinate::new(&place.ruler))
        .map_err(words)?;
    let text = |ruler: &Ruler, at: f64| {
        ruler
            .ticks
            .iter()
            .find(|tick| tick.at == at)
            .map_or(String::new(), |t| t.text.clone())
    };
    chart
        .configure_mesh()
        .disable_axes()
        .set_all_tick_mark_size(8)
        .bold_line_style(pen::stroke(RGBColor(0xD8, 0xD8, 0xD8), 2))
        .light_line_style(pen::stroke(RGBColor(0xEC, 0xEC, 0xEC), 2))
        .label_style(pen::text(HPos::Center, VPos::Center))
        .x_label_formatter(&|at| text(&plan.x, *at))
        .y_label_formatter(&|at| text(&place.ruler, *at))
        .draw()
        .map_err(words)?;
    if last {
        let middle = i32::midpoint(plan.left, plan.right);
        let at = (middle, place.bottom + 64 + ROW / 2 - 4);
        sheet
            .draw_text(&plan.x.title, &pen::text(HPos::Center, VPos::Center), at)
            .map_err(words)?;
    }
    Ok(chart)
}

fn draw_y_title(sheet: &Sheet, place: &PanelPlan) -> Result<(), String> {
    let room = place.bottom - place.top + ROW;
    for (i, line) in place.title.iter().enumerate() {
        let size = (FONT * room / text_width(line, FONT).max(1)).clamp(24, FONT);
        let at = (
            12 + FONT / 2 + i as i32 * (FONT + 6),
            i32::midpoint(place.top, place.bottom),
        );
        sheet
            .draw_text(line, &pen::upright(size), at)
            .map_err(words)?;
    }
    Ok(())
}

fn draw_legend(
    sheet: &Sheet,
    rows: &[Vec<(i32, Entry)>],
    (left, top): (i32, i32),
) -> Result<(), String> {
    for (i, row) in rows.iter().enumerate() {
        let y = top + i as i32 * ROW + ROW / 2;
        for (x, entry) in row {
            let (from, to) = (left + x, left + x + SAMPLE);
            match entry.sample {
                Sample::Band { colour } => {
                    let style = pen::colour(colour).mix(0.25).filled();
                    sheet
                        .draw(&Rectangle::new([(from, y - 15), (to, y + 15)], style))
                        .map_err(words)?;
                }
                Sample::Line {
                    line,
                    colour,
                    marked,
                } => {
                    if line != Line::Points {
                        let style = pen::curve(line, colour);
                        sheet
                            .draw(&PathElement::new(vec![(from, y), (to, y)], style))
                            .map_err(words)?;
                    }
                    if marked || matches!(line, Line::Points | Line::LinePoints) {
                        pen::marker(sheet, (i32::midpoint(from, to), y), colour)?;
                    }
                }
            }
            let style = pen::text(HPos::Left, VPos::Center);
            sheet
                .draw_text(&clean(&entry.name), &style, (to + 16, y))
                .map_err(words)?;
        }
    }
    Ok(())
}

/// A value on the drawn scale.
fn scaled(y: f64, log: bool) -> f64 {
    if !log {
        y
    } else if y > 0.0 {
        y.log10()
    } else {
        f64::NAN
    }
}

fn draw_bands(
    chart: &mut Chart,
    panel: &Panel,
    place: &PanelPlan,
    log: bool,
) -> Result<(), String> {
    let bottom = place.window.y.0;
    for band in &panel.bands {
        // On a logarithmic axis a lower edge at or below zero is below every window.
        let lower = |y: f64| {
            if log && y <= 0.0 {
                bottom
            } else {
                scaled(y, log)
            }
        };
        let spans: Vec<_> = band
            .points
            .iter()
            .map(|&(x, l, u)| (x, lower(l), scaled(u, log)))
            .collect();
        let drawable = |&(x, l, u): &curve::Span| [x, l, u].into_iter().all(is_drawable);
        for run in curve::runs(&spans, drawable) {
            if let Some(outline) = curve::outline(&run, &place.window, COLUMNS) {
                let style = pen::colour(band.colour).mix(0.2).filled();
                chart
                    .draw_series([Polygon::new(outline, style)])
                    .map_err(words)?;
            }
        }
    }
    Ok(())
}

/// Pieces of a series that are seen.
fn pieces(series: &Series, place: &PanelPlan, log: bool) -> Vec<Vec<Point>> {
    let points: Vec<_> = series
        .points
        .iter()
        .map(|&(x, y)| (x, scaled(y, log)))
        .collect();
    let columns = if series.line == Line::Thin {
        COLUMNS_THIN
    } else {
        COLUMNS
    };
    curve::runs(&points, |&(x, y)| is_drawable(x) && is_drawable(y))
        .into_iter()
        .map(|run| {
            if series.line == Line::Steps {
                curve::stairs(&run)
            } else {
                run
            }
        })
        .flat_map(|run| match series.line {
            Line::Points => run
                .into_iter()
                .flat_map(|point| curve::cut(&[point], &place.window))
                .collect(),
            _ => curve::cut(&run, &place.window),
        })
        .map(|piece| curve::thinned(&piece, &place.window, columns))
        .collect()
}

fn draw_series(
    sheet: &Sheet,
    chart: &mut Chart,
    series: &Series,
    marked: bool,
    place: &PanelPlan,
    log: bool,
    drawn: &mut Vec<(i32, i32)>,
) -> Result<(), String> {
    for piece in pieces(series, place, log) {
        let pixels: Vec<_> = piece
            .iter()
            .map(|point| chart.backend_coord(point))
            .collect();
        match (series.line, pixels.as_slice()) {
            (Line::Points, _) | (Line::LinePoints, [_]) => {}
            (line, [only]) => {
                let style = pen::curve(line, series.colour).filled();
                sheet.draw(&Circle::new(*only, 6, style)).map_err(words)?;
            }
            (line, _) => {
                let path = PathElement::new(piece.clone(), pen::curve(line, series.colour));
                chart.draw_series([path]).map_err(words)?;
            }
        }
        drawn.extend(
            pixels
                .windows(2)
                .flat_map(|pair| between(pair[0], pair[1], 24)),
        );
        drawn.extend(&pixels);
        if marked {
            for at in spread(&pixels, series.colour) {
                pen::marker(sheet, at, series.colour)?;
            }
        }
    }
    if matches!(series.line, Line::Points | Line::LinePoints) {
        for &(x, y) in &series.points {
            let point = (x, scaled(y, log));
            if is_drawable(x)
                && is_drawable(point.1)
                && !curve::cut(&[point], &place.window).is_empty()
            {
                pen::marker(sheet, chart.backend_coord(&point), series.colour)?;
            }
        }
    }
    Ok(())
}

/// Points of a segment, one in so many pixels.
fn between(a: (i32, i32), b: (i32, i32), every: i32) -> impl Iterator<Item = (i32, i32)> {
    let n = (b.0 - a.0).abs().max((b.1 - a.1).abs()) / every;
    (1..=n).map(move |k| {
        (
            a.0 + (b.0 - a.0) * k / (n + 1),
            a.1 + (b.1 - a.1) * k / (n + 1),
        )
    })
}

/// Places for a few markers on a curve; curves of different colours have theirs at different x.
fn spread(pixels: &[(i32, i32)], colour: usize) -> Vec<(i32, i32)> {
    let phase = (colour as i32 * 3 % 8) * MARKERS_EVERY / 8 + MARKERS_EVERY / 16;
    let slot = |x: i32| (x - phase).div_euclid(MARKERS_EVERY);
    let ends = |pair: &[(i32, i32)]| (pair[0], pair[1]);
    let mut places = Vec::new();
    for (a, b) in pixels.windows(2).map(ends) {
        let (from, to) = (slot(a.0.min(b.0)), slot(a.0.max(b.0)));
        places.extend((from + 1..=to).map(|k| {
            let x = k * MARKERS_EVERY + phase;
            let share = f64::from(x - a.0) / f64::from(b.0 - a.0);
            (
                x,
                (f64::from(a.1) + share * f64::from(b.1 - a.1)).round() as i32,
            )
        }));
    }
    match (places.is_empty(), pixels) {
        (true, [_, ..]) => vec![pixels[pixels.len() / 2]],
        _ => places,
    }
}

fn draw_verticals(
    sheet: &Sheet,
    chart: &Chart,
    panel: &Panel,
    place: &PanelPlan,
) -> Result<(), String> {
    let (low, high) = place.window.x;
    for mark in panel
        .vertical
        .iter()
        .filter(|mark| (low..=high).contains(&mark.at))
    {
        let x = chart.backend_coord(&(mark.at, place.window.y.0)).0;
        sheet
            .draw(&PathElement::new(
                vec![(x, place.top), (x, place.bottom)],
                pen::mark(),
            ))
            .map_err(words)?;
    }
    for flag in &place.flags {
        let top = place.top - (flag.row as i32 + 1) * ROW + 6;
        sheet
            .draw(&PathElement::new(
                vec![(flag.x, top), (flag.x, place.top)],
                pen::stroke(GREY, 3),
            ))
            .map_err(words)?;
    }
    for flag in &place.flags {
        let middle = place.top - flag.row as i32 * ROW - ROW / 2;
        let (from, to) = flag.reach();
        let cover = [
            (from + 4, middle - ROW / 2 + 4),
            (to - 4, middle + ROW / 2 - 4),
        ];
        sheet
            .draw(&Rectangle::new(cover, WHITE.filled()))
            .map_err(words)?;
        let (anchor, x) = if flag.left {
            (HPos::Right, flag.x - 12)
        } else {
            (HPos::Left, flag.x + 12)
        };
        sheet
            .draw_text(&flag.text, &pen::text(anchor, VPos::Center), (x, middle))
            .map_err(words)?;
    }
    Ok(())
}

/// Lines of horizontal marks; each label goes where it hides the least of what is drawn.
fn draw_horizontals(
    sheet: &Sheet,
    chart: &Chart,
    panel: &Panel,
    place: &PanelPlan,
    plan: &Plan,
    mut drawn: Vec<(i32, i32)>,
) -> Result<(), String> {
    let (low, high) = place.window.y;
    let log = panel.scale == Scale::Log;
    let marks = panel
        .horizontal
        .iter()
        .map(|mark| (scaled(mark.at, log), clean(&mark.label)));
    let marks: Vec<_> = marks
        .filter(|(at, _)| (low..=high).contains(at))
        .map(|(at, label)| (chart.backend_coord(&(place.window.x.0, at)).1, label))
        .collect();
    for (y, _) in &marks {
        sheet
            .draw(&PathElement::new(
                vec![(plan.left, *y), (plan.right, *y)],
                pen::mark(),
            ))
            .map_err(words)?;
        drawn.extend((plan.left..plan.right).step_by(24).map(|x| (x, *y)));
    }
    for (y, label) in marks.into_iter().filter(|(_, label)| !label.is_empty()) {
        let width = text_width(&label, FONT);
        let places = [1.0, 0.0, 0.5, 0.75, 0.25].into_iter().flat_map(|share| {
            let x =
                plan.left + 16 + (share * f64::from(plan.right - plan.left - 32 - width)) as i32;
            [(x, y - ROW + 2), (x, y + 6)]
        });
        let hidden = |&(x, top): &(i32, i32)| {
            let covers = |&&(px, py): &&(i32, i32)| {
                (x..=x + width).contains(&px) && (top..=top + ROW - 6).contains(&py)
            };
            let outside = top < place.top || top + ROW > place.bottom;
            drawn.iter().filter(covers).count() + if outside { 1_000_000 } else { 0 }
        };
        let Some((x, top)) = places.min_by_key(hidden) else {
            continue;
        };
        let cover = Rectangle::new(
            [(x - 6, top + 2), (x + width + 6, top + ROW - 8)],
            WHITE.mix(0.75).filled(),
        );
        sheet.draw(&cover).map_err(words)?;
        let style = pen::text(HPos::Left, VPos::Center);
        sheet
            .draw_text(&label, &style, (x, top + ROW / 2 - 3))
            .map_err(words)?;
        drawn.extend(between((x, top + ROW / 2), (x + width, top + ROW / 2), 8));
    }
    Ok(())
}
