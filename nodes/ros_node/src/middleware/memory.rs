//! Bounds on what the middleware takes, because whoever is on the network decides how much RustDDS takes: a fragment may claim a
//! message of 4 GiB, a heartbeat 2^31 samples that are missing (`docs/upstream/rustdds-hostile-datagrams.md`).
//!
//! One allocation is bounded by [`BoundedAllocator`], all together by the watchdog. What is beyond is no abort, as a limit of the system
//! would be, but the end of the node in order, with its state kept.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use super::threads::is_of_middleware;

/// The largest allocation that a thread of RustDDS may ask for \[bytes\]: no message of ROS on a ship's network is larger.
const LARGEST: usize = 64 << 20;

/// What was asked for, where it was too much.
static REFUSED: AtomicUsize = AtomicUsize::new(0);

/// The allocator of the system, with a bound on what RustDDS's own threads may ask for at once.
///
/// An executable has it by `#[global_allocator] static ALLOCATOR: BoundedAllocator = BoundedAllocator;`. A thread that asks for more than
/// 64 MiB stands still from then on, which costs nobody anything, and the node ends ([`crate::run`]). Other threads take what they need.
#[derive(Clone, Copy, Debug)]
pub struct BoundedAllocator;

impl BoundedAllocator {
    #[inline]
    fn look(size: usize) {
        if size > LARGEST && is_of_middleware() {
            stand_still(size);
        }
    }
}

#[cold]
fn stand_still(size: usize) -> ! {
    REFUSED.store(size, Ordering::SeqCst);
    loop {
        // Nothing is left to be done here: neither memory nor a panic may come out of an allocator.
        std::thread::sleep(Duration::from_secs(3600));
    }
}

// SAFETY: everything is left to the allocator of the system.
#[allow(unsafe_code, reason = "an allocator is told so")]
unsafe impl GlobalAlloc for BoundedAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::look(layout.size());
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::look(layout.size());
        // SAFETY: as the caller's.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::look(size);
        // SAFETY: as the caller's.
        unsafe { System.realloc(memory, layout, size) }
    }
}

/// Why the node has to end, where a bound was reached.
pub(super) fn beyond(limit: u64) -> Option<String> {
    let mebibytes = |bytes: u64| bytes >> 20;
    let refused = REFUSED.load(Ordering::SeqCst) as u64;
    if refused > 0 {
        return Some(format!(
            "a message from outside asks the middleware for {} MiB, expected at most {}; the node ends, to be started again",
            mebibytes(refused),
            mebibytes(LARGEST as u64)
        ));
    }
    let used = used(Path::new("/proc/self/status"))?;
    (used > limit).then(|| {
        format!(
            "{} MiB of memory are used, expected at most {}; the node ends, to be started again",
            mebibytes(used),
            mebibytes(limit)
        )
    })
}

/// Memory of the process's own, without what is mapped from files \[bytes\].
fn used(status: &Path) -> Option<u64> {
    let text = std::fs::read_to_string(status).ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("RssAnon:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes << 10)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// What is used is told, and is too much where the limit is below it.
    #[test]
    fn memory_is_bounded() {
        let now = used(Path::new("/proc/self/status")).unwrap();
        assert!(now > 1 << 16);
        assert_eq!(beyond(u64::MAX), None);
        let told = beyond(0).unwrap();
        assert!(told.contains("expected at most 0"), "{told}");
    }

    /// Only RustDDS's threads are bounded.
    #[test]
    fn other_threads_take_what_they_need() {
        assert!(!is_of_middleware());
        let named = std::thread::Builder::new().name("RustDDS discovery thread".to_owned());
        assert!(named.spawn(is_of_middleware).unwrap().join().unwrap());
        BoundedAllocator::look(LARGEST + 1);
    }
}
