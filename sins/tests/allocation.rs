//! What a sample takes of the allocator on the live path: nothing, between two covariance steps.
#![allow(missing_docs, clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sins::earth::Position;
use sins::machines::self_calibration::{ModelChoice, SelfCalibration, Settings};
use sins::simulation::{Run, Simulator, SimulatorSettings, Tick};
use sins::table::scheme::sequencer::SequencerSettings;
use sins::table::scheme::{Scheme, Sequencer};

thread_local! {
    /// Allocations of this thread so far.
    static TAKEN: Cell<u64> = const { Cell::new(0) };
}

/// The allocator of the system, counted.
struct Counting;

impl Counting {
    fn count() {
        // A thread that ends has no counter any more.
        TAKEN.try_with(|taken| taken.set(taken.get() + 1)).ok();
    }
}

// SAFETY: everything is left to the allocator of the system.
#[allow(unsafe_code, reason = "an allocator is counted so")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::count();
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::count();
        // SAFETY: as the caller's.
        unsafe { System.realloc(memory, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The eight positions at 100 Hz.
fn ticks(hours: f64) -> impl Iterator<Item = Tick> {
    let settings = SimulatorSettings::default();
    let program = Scheme::eight_position()
        .program(settings.plant.turntable)
        .unwrap();
    let sequencer = Sequencer::new(program, SequencerSettings::default()).unwrap();
    Run::new(Simulator::new(settings).unwrap(), sequencer, hours * 3600.0).map(Result::unwrap)
}

/// Samples behind alignment, how many of them gave no event, and the allocations of those.
struct Count {
    samples: u64,
    quiet: u64,
    taking: u64,
    worst: u64,
}

fn count(model: ModelChoice) -> Count {
    let mut machine = SelfCalibration::new(Settings {
        model,
        ..Settings::default()
    })
    .unwrap();
    let place = Position {
        latitude_rad: 0.8,
        longitude_rad: 2.2,
        height_m: 0.0,
    };
    machine.push_position(place).unwrap();
    let mut count = Count {
        samples: 0,
        quiet: 0,
        taking: 0,
        worst: 0,
    };
    for (number, tick) in ticks(0.5).enumerate() {
        let before = TAKEN.get();
        if let Some(joints) = tick.joints {
            machine.push_joints(joints).unwrap();
        }
        machine.push_imu(&tick.imu);
        let mut events = 0;
        while let Some(event) = machine.poll() {
            events += 1;
            drop(event);
        }
        let taken = TAKEN.get() - before;
        // Ten minutes: alignment is over, the first turn too, and every queue is as long as it gets.
        if number > 60_000 {
            count.samples += 1;
            if events == 0 {
                count.quiet += 1;
                count.taking += u64::from(taken > 0);
                count.worst = count.worst.max(taken);
            }
        }
    }
    count
}

/// Of a hundred samples a second 99 take nothing, by both models, with the judge's second filter: what is taken is taken in the step
/// of a second, with its estimate.
#[test]
fn a_sample_takes_nothing() {
    for model in [ModelChoice::Paper, ModelChoice::Whole] {
        let count = count(model);
        println!(
            "{model:?}: {} samples, {} without an event, {} of them took something, at most {} times",
            count.samples, count.quiet, count.taking, count.worst
        );
        assert!(count.quiet > count.samples * 9 / 10);
        assert_eq!(count.taking, 0, "{model:?}");
    }
    // Else nothing was counted.
    assert!(TAKEN.get() > 0);
}
