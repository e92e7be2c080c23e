//! Where an axis has its ticks, and how their numbers read.

use crate::{Axis, Scale};

/// Beyond this a value is treated as infinite, so that differences stay finite.
const LARGEST: f64 = 1e300;
/// Below this a value is treated as zero.
const SMALLEST: f64 = 1e-290;

/// A tick and its text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    /// Its place on the drawn scale.
    pub at: f64,
    pub text: String,
}

/// A ready axis. On a logarithmic one everything is the decimal logarithm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ruler {
    pub low: f64,
    pub high: f64,
    pub ticks: Vec<Tick>,
    /// Grid lines without text.
    pub minor: Vec<f64>,
    /// Label and unit, with the power of ten and the offset the ticks are given in.
    pub title: String,
}

impl Ruler {
    /// An axis over `range`, which is on the drawn scale.
    pub fn new(axis: &Axis, scale: Scale, range: (f64, f64), target: usize) -> Self {
        let (low, high) = range;
        match scale {
            Scale::Linear => linear(axis, low, high, target),
            Scale::Log => logarithmic(axis, low, high, target),
        }
    }

    /// An axis that has nothing to say: no data, no range.
    pub fn blank(axis: &Axis) -> Self {
        Self {
            low: 0.0,
            high: 1.0,
            ticks: Vec::new(),
            minor: Vec::new(),
            title: axis.title(),
        }
    }
}

/// Whether a value can be drawn.
pub(crate) fn is_drawable(value: f64) -> bool {
    value.abs() < LARGEST
}

/// A value on the drawn scale; what a logarithmic one does not have is not a number.
pub(crate) fn scaled(value: f64, log: bool) -> f64 {
    if !log {
        value
    } else if value > SMALLEST && is_drawable(value) {
        value.log10()
    } else {
        f64::NAN
    }
}

/// Least and greatest of what can be drawn.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .filter(|value| is_drawable(*value))
        .fold(None, |range, v| {
            Some(range.map_or((v, v), |(low, high): (f64, f64)| (low.min(v), high.max(v))))
        })
}

/// The same range, with something between its ends and `margin` of its length beyond them.
pub(crate) fn widened((low, high): (f64, f64), margin: f64) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if size < SMALLEST {
        return (-1.0, 1.0);
    }
    if high - low <= size * 1e-12 {
        return (low - size * 0.1, high + size * 0.1);
    }
    let margin = margin * (high - low);
    (low - margin, high + margin)
}

/// A range that a caller has fixed, if it is one.
pub(crate) fn fixed(range: Option<(f64, f64)>) -> Option<(f64, f64)> {
    let (a, b) = range?;
    let (low, high) = (a.min(b), a.max(b));
    let usable = is_drawable(a)
        && is_drawable(b)
        && high - low > high.abs().max(low.abs()).max(SMALLEST) * 1e-12;
    usable.then_some((low, high))
}

fn linear(axis: &Axis, low: f64, high: f64, target: usize) -> Ruler {
    let span = high - low;
    let step = step(span / target as f64, &axis.unit);
    // Ticks that differ in late digits only are given as differences from a round number.
    let offset = if low.abs().max(high.abs()) > 2e4 * step {
        let coarse = 10f64.powf(span.log10().ceil());
        (f64::midpoint(low, high) / coarse).round() * coarse
    } else {
        0.0
    };
    let first = ((low - offset) / step - 1e-6).ceil();
    let last = ((high - offset) / step + 1e-6).floor();
    let largest = first.abs().max(last.abs()) * step;
    let exponent = if (1e-3..1e5).contains(&largest) {
        0
    } else {
        (largest.log10() / 3.0).floor() as i32 * 3
    };
    let unit = 10f64.powi(exponent);
    let digits = (-(step / unit * (1.0 + 1e-9)).log10().floor()).max(0.0) as usize;
    let ticks = (0..=(last - first).max(0.0) as usize)
        .map(|k| {
            let steps = first + k as f64;
            Tick {
                at: offset + steps * step,
                text: signed(&format!("{:.digits$}", steps * step / unit)),
            }
        })
        .collect();
    Ruler {
        low,
        high,
        ticks,
        minor: Vec::new(),
        title: title(axis, exponent, offset, step),
    }
}

/// The smallest round step that is not below `least`: 1, 2 or 5 times a power of ten; on a circle a part of it.
fn step(least: f64, unit: &str) -> f64 {
    if matches!(unit, "deg" | "°") && (7.0..90.0).contains(&least) {
        return [10.0, 15.0, 30.0, 45.0, 90.0]
            .into_iter()
            .find(|step| *step >= least)
            .unwrap_or(90.0);
    }
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

fn title(axis: &Axis, exponent: i32, offset: f64, step: f64) -> String {
    let mut label = axis.label.clone();
    if offset != 0.0 {
        let sign = if offset > 0.0 { '−' } else { '+' };
        let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        let text = format!("{:.digits$}", offset.abs());
        let text = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        label = format!("{label} {sign} {text}");
    }
    let unit = match (exponent, axis.unit.as_str()) {
        (0, unit) => unit.to_owned(),
        (e, "") => format!("×10{}", superscript(e)),
        (e, unit) => format!("10{} {unit}", superscript(e)),
    };
    Axis::new(label, unit).title()
}

/// With a true minus sign, and none before a zero.
fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text.to_owned(),
    }
}

fn superscript(number: i32) -> String {
    let digit = |c| match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    };
    number.to_string().chars().map(digit).collect()
}

fn logarithmic(axis: &Axis, low: f64, high: f64, target: usize) -> Ruler {
    let decades = |stride: i32| -> Vec<i32> {
        let first = (low - 1e-9).ceil() as i32;
        let last = (high + 1e-9).floor() as i32;
        (first..=last)
            .filter(|e| e.rem_euclid(stride) == 0)
            .collect()
    };
    let within = |at: &f64| (low - 1e-9..=high + 1e-9).contains(at);
    let every = decades(1);
    let (ticks, minor) = match every.len() {
        0 | 1 => {
            let span = (low.floor() as i32)..=(high.floor() as i32);
            let fine: Vec<_> = span
                .clone()
                .flat_map(|e| [(1, e), (2, e), (5, e)])
                .filter(|&(m, e)| within(&(f64::from(m).log10() + f64::from(e))))
                .collect();
            if fine.len() < 2 {
                return narrow(axis, low, high, target);
            }
            let ticks = fine
                .iter()
                .map(|&(m, e)| (f64::from(m).log10() + f64::from(e), m, e))
                .collect();
            (
                ticks,
                span.flat_map(|e| (3..10).map(move |m| f64::from(m).log10() + f64::from(e)))
                    .collect::<Vec<_>>(),
            )
        }
        n => {
            let stride = i32::try_from(n.div_ceil(target + 1)).unwrap_or(i32::MAX);
            let ticks: Vec<(f64, i32, i32)> = decades(stride)
                .into_iter()
                .map(|e| (f64::from(e), 1, e))
                .collect();
            let minor = if stride > 1 {
                every.into_iter().map(f64::from).collect()
            } else if n <= 5 {
                let span = (low.floor() as i32)..=(high.floor() as i32);
                span.flat_map(|e| (2..10).map(move |m| f64::from(m).log10() + f64::from(e)))
                    .collect()
            } else {
                Vec::new()
            };
            (ticks, minor)
        }
    };
    let plain = ticks.iter().all(|&(_, _, e)| (-3..=4).contains(&e));
    let ticks = ticks
        .into_iter()
        .map(|(at, m, e)| Tick {
            at,
            text: power(m, e, plain),
        })
        .collect();
    let minor = minor.into_iter().filter(within).collect();
    Ruler {
        low,
        high,
        ticks,
        minor,
        title: axis.title(),
    }
}

/// Less than a factor of a few: ticks as on a linear axis, at their logarithmic places.
fn narrow(axis: &Axis, low: f64, high: f64, target: usize) -> Ruler {
    let mut ruler = linear(axis, 10f64.powf(low), 10f64.powf(high), target);
    ruler.ticks.retain(|tick| tick.at > 0.0);
    for tick in &mut ruler.ticks {
        tick.at = tick.at.log10();
    }
    Ruler { low, high, ..ruler }
}

fn power(mantissa: i32, exponent: i32, plain: bool) -> String {
    if plain {
        let digits = (-exponent).max(0) as usize;
        format!("{:.digits$}", f64::from(mantissa) * 10f64.powi(exponent))
    } else if mantissa == 1 {
        format!("10{}", superscript(exponent))
    } else {
        format!("{mantissa}×10{}", superscript(exponent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The title, and the ticks between blanks.
    fn texts(low: f64, high: f64) -> (String, String) {
        let ruler = Ruler::new(&Axis::new("v", "m"), Scale::Linear, (low, high), 5);
        let texts: Vec<_> = ruler.ticks.into_iter().map(|tick| tick.text).collect();
        (ruler.title, texts.join(" "))
    }

    /// No more digits than the step has.
    #[test]
    fn ordinary_numbers_have_the_digits_of_their_step() {
        assert_eq!(
            texts(0.0, 0.5),
            ("v (m)".into(), "0.0 0.1 0.2 0.3 0.4 0.5".into())
        );
        assert_eq!(texts(-3.0, 3.0).1, "−2 0 2");
        assert_eq!(texts(0.0, 20_000.0).1, "0 5000 10000 15000 20000");
    }

    /// The power of ten goes into the title, in threes.
    #[test]
    fn very_small_and_very_large_numbers_share_a_power_of_ten() {
        assert_eq!(
            texts(0.0, 2e-9),
            ("v (10⁻⁹ m)".into(), "0.0 0.5 1.0 1.5 2.0".into())
        );
        assert_eq!(
            texts(-1e9, 1e9),
            ("v (10⁹ m)".into(), "−1.0 −0.5 0.0 0.5 1.0".into())
        );
    }

    /// Values that differ late only are given from a round number.
    #[test]
    fn late_digits_are_given_as_differences() {
        let (title, ticks) = texts(1e9 - 1e-3, 1e9 + 1e-3);
        assert_eq!(title, "v − 1000000000 (m)");
        assert_eq!(ticks, "−0.0010 −0.0005 0.0000 0.0005 0.0010");
    }

    /// Degrees go by 90, 45, 30, 15 and 10.
    #[test]
    fn a_circle_is_parted_as_a_compass() {
        let ruler = Ruler::new(&Axis::new("heading", "deg"), Scale::Linear, (0.0, 360.0), 7);
        assert_eq!(
            ruler
                .ticks
                .iter()
                .map(|tick| tick.text.as_str())
                .collect::<Vec<_>>(),
            ["0", "90", "180", "270", "360"]
        );
    }

    /// Logarithmic ticks are powers of ten, or 1, 2, 5 where there are few.
    #[test]
    fn decades_read_as_numbers_or_as_powers() {
        let log = |low: f64, high: f64| {
            let ruler = Ruler::new(
                &Axis::new("v", ""),
                Scale::Log,
                (low.log10(), high.log10()),
                5,
            );
            ruler
                .ticks
                .into_iter()
                .map(|tick| tick.text)
                .collect::<Vec<_>>()
        };
        assert_eq!(log(1e-3, 10.0), ["0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!(log(1e-9, 1e-7), ["10⁻⁹", "10⁻⁸", "10⁻⁷"]);
        assert_eq!(log(3.0, 60.0), ["5", "10", "20", "50"]);
        assert_eq!(log(3.0, 3.3), ["3.0", "3.1", "3.2", "3.3"]);
        assert!(log(1e-200, 1e200).len() <= 7);
    }

    /// A range without length gets one.
    #[test]
    fn degenerate_ranges_become_ranges() {
        assert_eq!(widened((0.0, 0.0), 0.05), (-1.0, 1.0));
        assert_eq!(widened((5.0, 5.0), 0.05), (4.5, 5.5));
        assert_eq!(extent([f64::NAN, f64::INFINITY]), None);
        assert_eq!(extent([f64::NAN, 2.0, 1.0]), Some((1.0, 2.0)));
        assert_eq!(fixed(Some((3.0, 1.0))), Some((1.0, 3.0)));
        assert_eq!(fixed(Some((3.0, 3.0))), None);
        assert_eq!(fixed(Some((f64::NAN, 3.0))), None);
    }

    proptest::proptest! {
        /// Any two numbers give between 2 and 12 short ticks, all different.
        #[test]
        fn every_range_has_a_few_ticks_that_differ(a in proptest::num::f64::NORMAL, b in proptest::num::f64::NORMAL) {
            if let Some(range) = extent([a, b]) {
                let (low, high) = widened(range, 0.04);
                let ruler = Ruler::new(&Axis::new("v", ""), Scale::Linear, (low, high), 5);
                proptest::prop_assert!((2..=12).contains(&ruler.ticks.len()), "{:?}", ruler);
                let texts: std::collections::HashSet<_> = ruler.ticks.iter().map(|tick| &tick.text).collect();
                proptest::prop_assert_eq!(texts.len(), ruler.ticks.len());
                proptest::prop_assert!(ruler.ticks.iter().all(|tick| tick.text.chars().count() <= 9), "{:?}", ruler);
            }
        }
    }
}
