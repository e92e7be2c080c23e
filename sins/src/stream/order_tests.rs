#![allow(clippy::unwrap_used)]
use proptest::prelude::*;

use super::*;

fn run(millis: impl IntoIterator<Item = i64>) -> (StampOrder<()>, Vec<(i64, Follows)>) {
    let mut order = StampOrder::default();
    for ms in millis {
        order.push(Stamp::from_nanos(ms * 1_000_000), ());
    }
    order.end();
    let mut used = Vec::new();
    while let Some(next) = order.pop() {
        if let Ordered::Next(stamp, (), follows) = next {
            used.push((stamp.nanos() / 1_000_000, follows));
        }
    }
    (order, used)
}

fn grid(from: i64, to: i64) -> impl Iterator<Item = i64> {
    (from..to).map(|k| 10 * k)
}

/// Two missing samples are one gap of two.
#[test]
fn a_hole_is_counted_by_stamp() {
    let (order, used) = run(grid(0, 20).chain(grid(22, 40)));
    let counts = order.counts();
    assert_eq!((counts.gaps, counts.lost, counts.samples), (1, 2, 38));
    let hole = Follows::Hole {
        interval_s: 0.03,
        lost: 2,
    };
    assert_eq!(used[20], (220, hole));
}

/// Stamps that are each off by up to a fifth of an interval, and single ones that are off by more, lose nothing.
#[test]
fn jitter_is_no_loss() {
    let mut off = 1_u64;
    let jittered = (0..20_000_i64).map(|k| {
        off = off.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        100 * k + i64::from((off >> 33) as u32) % 41 - 20
    });
    assert_eq!(run(jittered).0.counts().lost, 0);
    let late = (0..100_i64).map(|k| 10 * k + if k == 50 { 9 } else { 0 });
    let counts = run(late).0.counts();
    assert_eq!((counts.gaps, counts.samples), (0, 100));
}

/// Two samples in one burst at the start, and a hole at the start, do not become the usual interval.
#[test]
fn the_first_interval_is_not_the_usual_one() {
    for first in [vec![0, 1], vec![-200, -190], vec![9]] {
        let count = first.len() as u64;
        let (order, _) = run(first.into_iter().chain(grid(1, 2000)));
        let counts = order.counts();
        assert!(counts.gaps <= 1, "{counts:?}");
        assert_eq!(counts.samples + counts.refused(), 1999 + count);
        assert!((order.usual_interval_s().unwrap() - 0.01).abs() < 1e-6);
    }
}

/// Neighbours that come swapped are put in order; nothing is lost and nothing refused.
#[test]
fn swapped_neighbours_are_put_in_order() {
    let swapped = grid(0, 100).collect::<Vec<_>>();
    let mut swapped = swapped;
    for at in [20, 40, 42, 90] {
        swapped.swap(at, at + 1);
    }
    let (order, used) = run(swapped);
    assert!(used.iter().map(|(ms, _)| *ms).eq(grid(0, 100)));
    assert_eq!((order.counts().gaps, order.counts().refused()), (0, 0));
    assert!(order.counts().reordered >= 4);
}

/// A stamp that is alone (zero, an hour off, ten seconds ahead) is refused and counted, and the clock goes on as it was.
#[test]
fn a_lone_stamp_moves_nothing() {
    for bad in [0, 3_600_000 + 5000, 5000 - 3_600_000, 15_000] {
        let stamps = grid(400, 500)
            .chain([bad])
            .chain(grid(501, 600))
            .collect::<Vec<_>>();
        let (order, used) = run(stamps);
        let counts = order.counts();
        assert_eq!(
            (counts.alone, counts.gaps, counts.lost, counts.restarts),
            (1, 1, 1, 0),
            "{bad}"
        );
        assert_eq!(used.len(), 199);
    }
}

/// A clock set back by less than any bridge is a new epoch, and the interval over it is none; by one grid step too.
#[test]
fn a_clock_set_back_is_a_new_epoch() {
    for back in [400, 37, 3, 2] {
        let values = (0..1000_i64).chain(1000 - back..2000);
        let mut order = StampOrder::default();
        for (value, k) in values.enumerate() {
            order.push(Stamp::from_nanos(k * 10_000_000), value);
        }
        order.end();
        let begun = std::iter::from_fn(|| order.pop())
            .filter_map(|next| match next {
                Ordered::Next(_, _, Follows::Begins(cause)) => Some(cause),
                _ => None,
            })
            .collect::<Vec<_>>();
        assert_eq!(begun.len(), 2, "{back}: {begun:?}");
        assert!(matches!(begun[1], EpochCause::SetBack { .. }));
        assert_eq!(order.counts().restarts, 1);
    }
}

/// Repeats of a sample, and a stamp that stands still, are counted; so are late ones whose place is taken.
#[test]
fn what_cannot_be_ordered_is_counted() {
    let twice = grid(0, 100).flat_map(|ms| [ms, ms]);
    let counts = run(twice).0.counts();
    assert_eq!(
        (counts.samples, counts.repeated, counts.gaps),
        (100, 100, 0)
    );
    let still = grid(0, 50).chain(std::iter::repeat_n(490, 30));
    let counts = run(still).0.counts();
    assert_eq!((counts.samples, counts.repeated), (50, 30));
    let late = grid(0, 50)
        .chain(grid(53, 60))
        .chain([500, 510])
        .chain(grid(60, 80));
    let counts = run(late).0.counts();
    assert_eq!((counts.backward, counts.lost, counts.restarts), (2, 3, 0));
}

/// Another rate becomes the usual one, and every sample of it is used.
#[test]
fn a_change_of_rate_is_followed() {
    let (order, used) = run(grid(0, 500).chain((0..1000).map(|k| 5000 + 40 * k)));
    assert_eq!(used.len(), 1500);
    assert!((order.usual_interval_s().unwrap() - 0.04).abs() < 1e-3);
}

proptest! {
    /// Whatever stamps come: time never runs back inside an epoch, and the counts add up to what was pushed.
    #[test]
    fn time_runs_on_and_counts_add_up(
        steps in prop::collection::vec(
            prop_oneof![
                8 => 8_i64..12, 1 => -3000_i64..3000, 1 => Just(0_i64), 1 => Just(-10_i64), 1 => Just(20_i64)
            ],
            0..400,
        ),
    ) {
        let mut now = 1_000_000_i64;
        let stamps = steps.iter().map(|step| { now += step; now }).collect::<Vec<_>>();
        let (order, used) = run(stamps);
        let counts = order.counts();
        prop_assert_eq!(counts.samples + counts.refused(), steps.len() as u64);
        prop_assert_eq!(counts.samples, used.len() as u64);
        for pair in used.windows(2) {
            let begins = matches!(pair[1].1, Follows::Begins(_));
            prop_assert!(begins || pair[1].0 > pair[0].0, "{pair:?}");
        }
    }
}
