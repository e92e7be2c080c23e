//! Bags that this project did not make, as the reader of bags has them.

use bags::{Bag, Sample, SensorOptions, SensorStream};
use suite_tests::data_file;

fn counts(bag: &Bag) -> ([u64; 3], i64) {
    let mut stream = SensorStream::new(bag, &SensorOptions::default()).unwrap();
    let mut counts = [0; 3];
    let mut longest_interval = 0;
    let mut last = None;
    while let Some(sample) = stream.next().unwrap() {
        match sample {
            Sample::Imu(imu) => {
                counts[0] += 1;
                assert!(imu.is_finite());
                longest_interval =
                    longest_interval.max(last.map_or(0, |last| imu.stamp.nanos() - last));
                last = Some(imu.stamp.nanos());
            }
            Sample::Joints(_) => counts[1] += 1,
            Sample::Velocity(..) => {}
            Sample::Fix(fix) => {
                assert!(fix.position.is_some());
                counts[2] += 1;
            }
        }
    }
    assert_eq!(stream.warnings(), []);
    (counts, longest_interval)
}

/// The independent simulation: 4 h at 10 Hz without a gap.
#[test]
fn eight_position() {
    let Some(path) = data_file("eight_position.mcap") else {
        return;
    };
    let bag = Bag::open(path).unwrap();
    assert_eq!(bag.warnings(), []);
    assert_eq!(counts(&bag), ([144_000, 144_000, 14_400], 100_000_000));
}

/// The real record: 1847 s at 100 Hz.
#[test]
fn rlg_static() {
    let Some(path) = data_file("rlg_static.mcap") else {
        return;
    };
    let bag = Bag::open(path).unwrap();
    let (counts, interval) = counts(&bag);
    assert!((184_000..185_500).contains(&counts[0]), "{counts:?}");
    assert_eq!(interval, 10_000_000);
}
