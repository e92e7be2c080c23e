//! The threads of the middleware, as the kernel tells of them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Threads of this process.
pub(super) const OWN: &str = "/proc/self/task";
/// How the names of RustDDS's threads begin.
const NAMES: &str = "RustDDS";

/// Whether this thread is one of RustDDS's. Asks the kernel, because an allocator may use nothing that allocates.
#[allow(
    unsafe_code,
    reason = "the standard library's name of a thread may allocate"
)]
pub(crate) fn is_of_middleware() -> bool {
    let mut name = [0_u8; 16];
    // SAFETY: the kernel writes at most 16 bytes, with the zero at the end.
    let asked = unsafe { libc::prctl(libc::PR_GET_NAME, name.as_mut_ptr()) };
    asked == 0 && name.starts_with(NAMES.as_bytes())
}

/// What a thread has done so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Thread {
    pub(super) name: String,
    /// Whether it waits for something.
    pub(super) sleeps: bool,
    /// How often it has begun to wait, and how often it was made to: no thread works on without.
    switches: u64,
}

impl Thread {
    /// Whether it has come no further since it was `before`: it waited then, and waits still.
    pub(super) fn stands_still_since(&self, before: &Self) -> bool {
        self.sleeps && self == before
    }

    fn read(status: &str) -> Option<Self> {
        let field = |name: &str| {
            status
                .lines()
                .find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))
                .map(str::trim)
        };
        let count = |name: &str| field(name)?.parse::<u64>().ok();
        Some(Self {
            name: field("Name")?.to_owned(),
            sleeps: matches!(field("State")?.chars().next()?, 'S' | 'D' | 'I'),
            switches: count("voluntary_ctxt_switches")?
                .wrapping_add(count("nonvoluntary_ctxt_switches")?),
        })
    }
}

/// The threads of the middleware that live, by their numbers.
pub(super) fn of_middleware(tasks: &Path) -> std::io::Result<BTreeMap<u32, Thread>> {
    let mut threads = BTreeMap::new();
    for task in fs::read_dir(tasks)? {
        let task = task?;
        let number = task.file_name().to_str().and_then(|name| name.parse().ok());
        // One that ends while it is looked at is not there.
        let Ok(status) = fs::read_to_string(task.path().join("status")) else {
            continue;
        };
        if let (Some(number), Some(thread)) = (number, Thread::read(&status))
            && thread.name.starts_with(NAMES)
        {
            threads.insert(number, thread);
        }
    }
    Ok(threads)
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    pub(in super::super) fn status(state: &str, voluntary: u64) -> Thread {
        let text = format!(
            "Name:\tRustDDS discove\nState:\t{state}\nTgid:\t7\nvoluntary_ctxt_switches:\t{voluntary}\n\
             nonvoluntary_ctxt_switches:\t3\n"
        );
        Thread::read(&text).unwrap()
    }

    /// A thread that waits and has done nothing in between stands still; one that has woken up, is stopped or is busy does not.
    #[test]
    fn who_wakes_up_does_not_stand_still() {
        let before = status("S (sleeping)", 10);
        assert!(status("S (sleeping)", 10).stands_still_since(&before));
        assert!(!status("S (sleeping)", 11).stands_still_since(&before));
        assert!(!status("R (running)", 10).stands_still_since(&before));
        let stopped = status("T (stopped)", 10);
        assert!(!stopped.stands_still_since(&stopped));
    }

    /// Threads are found by their names, and are gone when they have ended.
    #[test]
    fn threads_are_found_by_name() {
        let (end, ended) = std::sync::mpsc::channel::<()>();
        let thread = std::thread::Builder::new()
            .name("RustDDS for a test".to_owned())
            .spawn(move || ended.recv())
            .unwrap();
        let is_there = || {
            let there = of_middleware(Path::new(OWN)).unwrap();
            there
                .values()
                .any(|thread| thread.name == "RustDDS for a t")
        };
        // The name is given by the thread itself, when it begins.
        while !is_there() {
            std::thread::yield_now();
        }
        drop(end);
        let _over = thread.join().unwrap();
        while is_there() {
            std::thread::yield_now();
        }
    }
}
