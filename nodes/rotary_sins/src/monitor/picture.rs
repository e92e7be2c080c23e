//! The page as a picture for documents: the cells of its terminal as SVG.

use maud::{Markup, html};
use ratatui::{
    buffer::{Buffer, Cell},
    style::{Color, Modifier},
};

/// Size of a cell, and where in it letters stand \[px\].
const CELL: [usize; 2] = [9, 18];
const BASELINE: usize = 14;
/// Around the page \[px\].
const MARGIN: usize = 10;
const GROUND: &str = "#1b1f24";
const INK: &str = "#d5dae0";

/// What stands in the terminal, cells of one look together.
pub fn svg(buffer: &Buffer) -> String {
    let area = buffer.area();
    let (columns, lines) = (usize::from(area.width), usize::from(area.height));
    let width = columns * CELL[0] + 2 * MARGIN;
    let height = lines * CELL[1] + 2 * MARGIN;
    let page = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width} {height}")) width=(width) height=(height)
            font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="15" {
            rect width=(width) height=(height) rx="6" fill=(GROUND) {}
            @for line in 0..lines {
                (line_of(buffer, line))
            }
        }
    };
    let mut text = page.into_string();
    text.push('\n');
    text
}

fn line_of(buffer: &Buffer, line: usize) -> Markup {
    let columns = usize::from(buffer.area().width);
    let cells = &buffer.content()[line * columns..(line + 1) * columns];
    let y = MARGIN + line * CELL[1] + BASELINE;
    let runs = cells
        .chunk_by(|a, b| look(a) == look(b))
        .scan(0, |end, run| {
            let start = *end;
            *end += run.len();
            Some((start, run))
        });
    html! {
        @for (start, run) in runs {
            @let text: String = run.iter().map(Cell::symbol).collect();
            @if !text.trim().is_empty() {
                @let (colour, is_bold) = look(&run[0]);
                text x=(MARGIN + start * CELL[0]) y=(y) fill=(colour) xml:space="preserve"
                    textLength=(text.chars().count() * CELL[0]) font-weight=[is_bold.then_some("bold")] { (text) }
                "\n"
            }
        }
    }
}

/// Colour and weight of a cell.
fn look(cell: &Cell) -> (&'static str, bool) {
    let colour = match cell.fg {
        Color::Red | Color::LightRed => "#f47067",
        Color::Green | Color::LightGreen => "#57ab5a",
        Color::Yellow | Color::LightYellow => "#daaa3f",
        Color::Blue | Color::LightBlue => "#539bf5",
        Color::Magenta | Color::LightMagenta => "#b083f0",
        Color::Cyan | Color::LightCyan => "#39c5cf",
        Color::Gray | Color::DarkGray => "#8b949e",
        _ => INK,
    };
    (colour, cell.modifier.contains(Modifier::BOLD))
}

#[cfg(test)]
mod tests {
    use ratatui::style::Style;

    use super::*;

    /// Every text of the terminal stands in the picture, in its place and colour, and nothing of it is taken for markup.
    #[test]
    fn the_terminal_stands_in_the_picture() {
        let mut buffer = Buffer::with_lines(["a <b & c", "  red "]);
        buffer.set_style(
            ratatui::layout::Rect::new(2, 1, 3, 1),
            Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
        );
        let picture = svg(&buffer);
        assert!(picture.contains(">a &lt;b &amp; c</text>"), "{picture}");
        let red = format!(
            "<text x=\"{}\" y=\"{}\" fill=\"#f47067\"",
            10 + 2 * 9,
            10 + 18 + 14
        );
        assert!(
            picture.contains(&red) && picture.contains(">red</text>"),
            "{picture}"
        );
        assert_eq!(picture.matches("<text").count(), 2);
    }
}
