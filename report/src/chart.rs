//! From a figure to its picture.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::layout::{self, Entry, FONT, ROW, SAMPLE, Sample, text_width};
use crate::marks::{draw_horizontals, draw_verticals};
use crate::pen::{self, GREY, Sheet, words};
use crate::plan::{PanelPlan, Plan, WIDTH, clean};
use crate::ticks::Ruler;
use crate::traces::{draw_bands, draw_series};
use crate::{Figure, Line, Panel, Scale, Series};

/// An axis as the chart library wants it, with our ticks.
pub(crate) struct Coordinate {
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

/// A pair of axes.
pub(crate) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<Coordinate, Coordinate>>;

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
    if !panel.title.is_empty() {
        let at = (plan.left, place.head + ROW / 2);
        sheet
            .draw_text(&clean(&panel.title), &pen::bold(), at)
            .map_err(words)?;
    }
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
        .axis_style(pen::stroke(GREY, 2))
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
                    let style = pen::colour(colour).mix(0.2).filled();
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
                        let style = match line {
                            Line::Thin => pen::stroke(pen::colour(colour), 3),
                            _ => pen::curve(line, colour),
                        };
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
