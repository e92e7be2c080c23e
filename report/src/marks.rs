//! Lines that mark a value of an axis, and their labels.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::chart::Chart;
use crate::layout::{FONT, ROW, text_width};
use crate::pen::{self, GREY, Sheet, words};
use crate::plan::{PanelPlan, Plan, clean};
use crate::ticks::scaled;
use crate::traces::between;
use crate::{Panel, Scale};

/// Lines of vertical marks, and their labels above the panel.
pub(crate) fn draw_verticals(
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
pub(crate) fn draw_horizontals(
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
