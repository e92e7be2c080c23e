//! How long decoding alone takes: `cargo run --release -p bags --example decode BAG`.

use std::time::Instant;

use bags::{Bag, Sample, SensorOptions, SensorStream};

fn main() -> Result<(), bags::Error> {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: decode BAG");
        return Ok(());
    };
    let begin = Instant::now();
    let bag = Bag::open(path)?;
    let mut stream = SensorStream::new(&bag, &SensorOptions::default())?;
    let (mut imu, mut others) = (0_u64, 0_u64);
    while let Some(sample) = stream.next()? {
        match sample {
            Sample::Imu(_) => imu += 1,
            _ => others += 1,
        }
    }
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "{imu} Imu and {others} other messages in {seconds:.3} s, {:.2} M/s",
        (imu + others) as f64 * 1e-6 / seconds
    );
    Ok(())
}
