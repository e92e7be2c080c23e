//! Curves made ready to be drawn: gaps, steps, cut to the window, no more points than the picture can show.

use crate::frame::{Point, Window};

/// A point of a band: x, lower, upper.
pub(crate) type Span = (f64, f64, f64);
/// Distance of the places that stand for a line where a label looks for room.
const EVERY: f64 = 12.0;

/// The unbroken pieces between points that cannot be drawn.
pub(crate) fn runs<T: Copy>(points: &[T], drawable: impl Fn(&T) -> bool) -> Vec<Vec<T>> {
    points
        .split(|point| !drawable(point))
        .filter(|run| !run.is_empty())
        .map(<[T]>::to_vec)
        .collect()
}

/// Each value holds until the next point.
pub(crate) fn stairs(run: &[Point]) -> Vec<Point> {
    let mut out = Vec::with_capacity(run.len() * 2);
    for (i, &point) in run.iter().enumerate() {
        if i > 0 {
            out.push((point.0, run[i - 1].1));
        }
        out.push(point);
    }
    out
}

/// The pieces of a run within the window.
pub(crate) fn cut(run: &[Point], window: &Window) -> Vec<Vec<Point>> {
    if let [only] = *run {
        return if window.holds(only) {
            vec![vec![only]]
        } else {
            Vec::new()
        };
    }
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    let mut open = false;
    for pair in run.windows(2) {
        let Some((from, to, whole)) = inside(pair[0], pair[1], window) else {
            open = false;
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if open => piece.push(to),
            _ => pieces.push(vec![from, to]),
        }
        open = whole;
    }
    pieces
}

/// The part of a segment within the window (Liang and Barsky, 1984), and whether it reaches the segment's end.
fn inside(a: Point, b: Point, window: &Window) -> Option<(Point, Point, bool)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    let edges = [
        (-dx, a.0 - window.x.0),
        (dx, window.x.1 - a.0),
        (-dy, a.1 - window.y.0),
        (dy, window.y.1 - a.1),
    ];
    for (direction, distance) in edges {
        if direction == 0.0 {
            if distance < 0.0 {
                return None;
            }
        } else if direction < 0.0 {
            start = start.max(distance / direction);
        } else {
            end = end.min(distance / direction);
        }
    }
    let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
    (start <= end).then(|| {
        let from = if start > 0.0 { at(start) } else { a };
        let to = if end < 1.0 { at(end) } else { b };
        (from, to, end >= 1.0)
    })
}

/// At most four points in each of so many columns of the window: the first, the least, the greatest and the last.
pub(crate) fn thinned(run: &[Point], window: &Window, columns: usize) -> Vec<Point> {
    let column = |point: &Point| window.column(point.0, columns as f64);
    let mut out = Vec::new();
    for group in run.chunk_by(|a, b| column(a) == column(b)) {
        if group.len() <= 4 {
            out.extend_from_slice(group);
            continue;
        }
        let by_y = |&i: &usize, &j: &usize| group[i].1.total_cmp(&group[j].1);
        let least = (0..group.len()).min_by(by_y).unwrap_or(0);
        let greatest = (0..group.len()).max_by(by_y).unwrap_or(0);
        let mut keep = [0, least, greatest, group.len() - 1];
        keep.sort_unstable();
        let mut last = None;
        for index in keep {
            if last != Some(index) {
                out.push(group[index]);
            }
            last = Some(index);
        }
    }
    out
}

/// The same line in fewer points (Ramer, 1972; Douglas and Peucker, 1973): none that is left out is further than `tolerance` from it.
pub(crate) fn simplified(line: &[Point], tolerance: f64) -> Vec<Point> {
    let mut keep = vec![false; line.len()];
    let mut open = vec![(0, line.len().saturating_sub(1))];
    while let Some((from, to)) = open.pop() {
        for end in [from, to] {
            if let Some(keep) = keep.get_mut(end) {
                *keep = true;
            }
        }
        let far = (from + 1..to).map(|i| (i, distance(line[i], line[from], line[to])));
        let farthest = far.max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((middle, _)) = farthest.filter(|(_, far)| *far > tolerance) {
            open.extend([(from, middle), (middle, to)]);
        }
    }
    let kept = line.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(point, _)| *point).collect()
}

/// From a point to a segment.
fn distance(point: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (px, py) = (point.0 - a.0, point.1 - a.1);
    let square = dx * dx + dy * dy;
    let share = if square > 0.0 {
        ((px * dx + py * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (px - share * dx).hypot(py - share * dy)
}

/// A band within the window: its outline along the lower edge and back along the upper.
pub(crate) fn outline(run: &[Span], window: &Window, columns: usize) -> Option<Vec<Point>> {
    let mut spans: Vec<Span> = Vec::new();
    for pair in run.windows(2) {
        let mut at: Vec<f64> = vec![0.0, 1.0];
        at.extend(crossings(pair[0], pair[1], window));
        at.sort_by(f64::total_cmp);
        spans.extend(at.into_iter().map(|t| mixed(pair[0], pair[1], t)));
    }
    let slack = (window.x.1 - window.x.0) * 1e-9;
    spans.retain(|span| (window.x.0 - slack..=window.x.1 + slack).contains(&span.0));
    let hold = |y: f64| y.clamp(window.y.0, window.y.1);
    let column = |span: &Span| window.column(span.0, columns as f64);
    let mut lower = Vec::new();
    let mut upper = Vec::new();
    for group in spans.chunk_by(|a, b| column(a) == column(b)) {
        let ends = [group[0], group[group.len() - 1]];
        let (least, greatest) = group.iter().fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(least, greatest), span| (least.min(span.1), greatest.max(span.2)),
        );
        if group.len() > 4 {
            lower.push((ends[0].0, hold(least)));
            upper.push((ends[0].0, hold(greatest)));
        } else {
            lower.extend(group.iter().map(|span| (span.0, hold(span.1))));
            upper.extend(group.iter().map(|span| (span.0, hold(span.2))));
        }
        if group.len() > 4 {
            lower.push((ends[1].0, hold(least)));
            upper.push((ends[1].0, hold(greatest)));
        }
    }
    lower.extend(upper.into_iter().rev());
    (lower.len() >= 4).then_some(lower)
}

/// Places on a segment, its ends not among them.
pub(crate) fn between(a: Point, b: Point) -> impl Iterator<Item = Point> {
    let n = ((b.0 - a.0).abs().max((b.1 - a.1).abs()) / EVERY) as usize;
    (1..=n).map(move |k| {
        let share = k as f64 / (n + 1) as f64;
        (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
    })
}

/// Where, between two spans, an edge of the band meets an edge of the window.
fn crossings(a: Span, b: Span, window: &Window) -> Vec<f64> {
    let lines = [
        (a.0, b.0, window.x.0),
        (a.0, b.0, window.x.1),
        (a.1, b.1, window.y.0),
        (a.1, b.1, window.y.1),
        (a.2, b.2, window.y.0),
        (a.2, b.2, window.y.1),
    ];
    lines
        .into_iter()
        .filter(|&(from, to, edge)| (from < edge) != (to < edge) && from != to)
        .map(|(from, to, edge)| (edge - from) / (to - from))
        .filter(|t| *t > 0.0 && *t < 1.0)
        .collect()
}

fn mixed(a: Span, b: Span, t: f64) -> Span {
    if t <= 0.0 {
        return a;
    }
    if t >= 1.0 {
        return b;
    }
    let mix = |from: f64, to: f64| from + t * (to - from);
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window {
        x: (0.0, 10.0),
        y: (0.0, 1.0),
    };

    /// What cannot be drawn parts what can.
    #[test]
    fn a_hole_parts_a_run() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, 2.0)];
        let runs = runs(&points, |point| point.1.is_finite());
        assert_eq!(runs, [vec![(0.0, 1.0)], vec![(2.0, 1.0), (3.0, 2.0)]]);
    }

    /// A step goes across first, then up.
    #[test]
    fn stairs_hold_their_value() {
        assert_eq!(
            stairs(&[(0.0, 1.0), (2.0, 5.0)]),
            [(0.0, 1.0), (2.0, 1.0), (2.0, 5.0)]
        );
    }

    /// Ends of pieces lie on the edge of the window, where the segment crosses it.
    #[test]
    fn a_curve_is_cut_where_it_leaves_and_comes_back() {
        let pieces = cut(&[(0.0, 0.5), (2.0, 1.5), (4.0, 0.5), (5.0, 0.5)], &WINDOW);
        assert_eq!(
            pieces,
            [
                vec![(0.0, 0.5), (1.0, 1.0)],
                vec![(3.0, 1.0), (4.0, 0.5), (5.0, 0.5)]
            ]
        );
        assert!(cut(&[(0.0, 2.0), (9.0, 2.0)], &WINDOW).is_empty());
        assert_eq!(
            cut(&[(-1.0, 0.5), (11.0, 0.5)], &WINDOW),
            [vec![(0.0, 0.5), (10.0, 0.5)]]
        );
    }

    /// A single extreme point of a hundred thousand stays, as do both ends.
    #[test]
    fn thinning_keeps_a_spike() {
        let mut run: Vec<_> = (0..100_000).map(|i| (f64::from(i) * 1e-4, 0.1)).collect();
        run[54_321].1 = 0.9;
        let thin = thinned(&run, &WINDOW, 100);
        assert!(thin.len() <= 404, "{}", thin.len());
        assert!(thin.contains(&run[54_321]));
        assert_eq!(
            (thin[0], thin[thin.len() - 1]),
            (run[0], run[run.len() - 1])
        );
    }

    /// Corners stay, what lies between them on a line goes, and nothing that went is further away than allowed.
    #[test]
    fn a_simplified_line_stays_close() {
        let corner: Vec<_> = (0..=20)
            .map(|i| (f64::from(i), (f64::from(i) - 10.0).abs()))
            .collect();
        let corners = [(0.0, 10.0), (10.0, 0.0), (20.0, 10.0)];
        assert_eq!(simplified(&corner, 0.1), corners);
        let wave: Vec<_> = (0..4000)
            .map(|i| f64::from(i) * 0.2)
            .map(|x| (x, 50.0 * (x * 0.1).sin()))
            .collect();
        let few = simplified(&wave, 0.1);
        // At the crests a chord with a rise of 0.1 is 1.26 long, that is 6 points; halving may leave half of that.
        assert!(few.len() <= wave.len() / 3, "{}", few.len());
        let near = |point: &Point| {
            few.windows(2)
                .any(|pair| distance(*point, pair[0], pair[1]) <= 0.1)
        };
        assert!(wave.iter().all(near));
        for short in [&wave[..0], &wave[..1], &wave[..2]] {
            assert_eq!(simplified(short, 0.1), short);
        }
    }

    /// A band is held to its window without losing corners within.
    #[test]
    fn a_band_stays_in_the_window() {
        let outline = outline(
            &[(-5.0, -1.0, 3.0), (5.0, 0.4, 0.6), (20.0, 0.4, 0.6)],
            &WINDOW,
            100,
        )
        .expect("it is seen");
        assert!(
            outline
                .iter()
                .all(|&(x, y)| (0.0..=10.0).contains(&x) && (0.0..=1.0).contains(&y)),
            "{outline:?}"
        );
        assert!(outline.contains(&(5.0, 0.4)) && outline.contains(&(10.0, 0.6)));
    }
}
