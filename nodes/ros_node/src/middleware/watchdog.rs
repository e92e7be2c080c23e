//! Notices that the middleware does not work any more, whatever way that came about.
//!
//! Three things are looked at, from a thread that nothing of RustDDS can hold up:
//! - **A thread of RustDDS is gone.** It never comes back; there is no false alarm.
//! - **A thread of RustDDS stands still**: it has been waiting since the last look, and has not woken up in between, for
//!   [`STILL`] looks in a row. Its loops wake up every 2 s and every 5 s with nothing to do, so it is locked up. A thread that is slow
//!   because the machine is busy is not waiting; one that is stopped is not either; and looks are counted, not seconds, so
//!   that a process which was stopped for an hour has looked once.
//! - **Memory is beyond its bound** ([`super::memory`]).
//!
//! Then the node ends with a FATAL line and status 1, so that a supervisor starts it again. What it keeps of its state is written,
//! where its own thread still works; where that hangs too, the process ends all the same. It looks before the node has joined the
//! domain: while a node starts, its own thread waits for those of RustDDS, and nobody else would notice that it waits for good.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use tokio::sync::watch;

use super::memory;
use super::threads::{self, Thread};
use crate::logging;
use crate::shutdown::Shutdown;
use crate::supervisor::Limits;

/// Between two looks at the memory, which grows by a gigabyte a second at worst.
const SOON: Duration = Duration::from_millis(200);
/// Looks at the memory for one at the threads.
const LOOKS: u32 = 5;
/// Between two looks at the threads.
const PERIOD: Duration = Duration::from_secs(1);
/// Looks at which a thread that waits must have woken up at least once.
const STILL: u32 = 30;
/// What a main function without a limit has, to end.
const LONGEST: Duration = Duration::from_secs(300);
/// What the rest of the process has, beside its main function.
const REST: Duration = Duration::from_secs(5);

/// Looks after the middleware of the process until it is dropped.
#[derive(Debug)]
pub(crate) struct Watchdog {
    _told: SyncSender<()>,
}

impl Watchdog {
    /// To be called before the participant is made. `ready` says that the node has started. Where the main function has not ended
    /// within its limit, the process is ended.
    pub(crate) fn start(
        shutdown: Shutdown,
        ready: watch::Receiver<bool>,
        limits: Limits,
        status: u8,
    ) -> Self {
        let (told, orders) = sync_channel(0);
        let thread = std::thread::Builder::new().name("watchdog".to_owned());
        let begun = thread.spawn(move || {
            if let Some(reason) = look_after(&ready, limits.memory, &orders) {
                logging::fatal(&reason);
                shutdown.break_down();
                // A node that has not started has nothing to put in order.
                let limit = if *ready.borrow() {
                    limits.ending.unwrap_or(LONGEST)
                } else {
                    Duration::ZERO
                };
                end_at_last(&orders, limit + REST, status);
            }
        });
        if let Err(error) = begun {
            tracing::error!("watchdog: {error}: nobody notices where the middleware ends");
        }
        Self { _told: told }
    }
}

/// Why the middleware does not work any more; `None` where the node ends before.
fn look_after(ready: &watch::Receiver<bool>, memory: u64, orders: &Receiver<()>) -> Option<String> {
    let mut threads = Watch::default();
    let mut has_started = false;
    let mut look = 0_u32;
    loop {
        look = look.wrapping_add(1);
        match orders.recv_timeout(SOON) {
            Err(RecvTimeoutError::Timeout) => {}
            _ => return None,
        }
        if let Some(reason) = memory::beyond(memory) {
            return Some(reason);
        }
        if !look.is_multiple_of(LOOKS) {
            continue;
        }
        let now = match threads::of_middleware(Path::new(threads::OWN)) {
            Ok(now) => now,
            Err(error) => {
                // What cannot be read now can be at the next look; it is told at the first one.
                if look == LOOKS {
                    tracing::warn!(
                        "{}: {error}: nobody notices where the middleware ends",
                        threads::OWN
                    );
                }
                continue;
            }
        };
        if !has_started {
            threads.meet(&now);
            has_started = *ready.borrow();
            if has_started && threads.len() < 2 {
                tracing::error!(
                    "{} threads of RustDDS are there, expected two: nobody notices where they end",
                    threads.len()
                );
            }
        }
        if let Some(reason) = threads.look(&now) {
            return Some(reason);
        }
    }
}

/// Ends the process where it does not end by itself.
fn end_at_last(orders: &Receiver<()>, limit: Duration, status: u8) {
    if orders.recv_timeout(limit) == Err(RecvTimeoutError::Timeout) {
        logging::fatal(&format!(
            "the process has not ended within {:.0} s, and is ended where it stands",
            limit.as_secs_f64()
        ));
        std::process::exit(i32::from(status));
    }
}

/// What was seen of the threads.
#[derive(Debug, Default)]
struct Watch {
    threads: BTreeMap<u32, (Thread, u32)>,
}

impl Watch {
    /// Looks after these too from now on.
    fn meet(&mut self, now: &BTreeMap<u32, Thread>) {
        for (number, thread) in now {
            let begin = || (thread.clone(), 0);
            self.threads.entry(*number).or_insert_with(begin);
        }
    }

    fn len(&self) -> usize {
        self.threads.len()
    }

    /// Why the middleware does not work any more, where that is so.
    fn look(&mut self, now: &BTreeMap<u32, Thread>) -> Option<String> {
        for (number, (before, still)) in &mut self.threads {
            let name = &before.name;
            let Some(thread) = now.get(number).filter(|thread| thread.name == *name) else {
                return Some(format!(
                    "the middleware does not work any more: its thread '{name}' has ended; the node ends, to be started again"
                ));
            };
            *still = if thread.stands_still_since(before) {
                *still + 1
            } else {
                0
            };
            if *still >= STILL {
                return Some(format!(
                    "the middleware does not work any more: its thread '{name}' has not moved for {:.0} s; the node ends, \
                     to be started again",
                    (PERIOD * *still).as_secs_f64()
                ));
            }
            before.clone_from(thread);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::middleware::threads::tests::status;

    fn seen(loops: Thread, discovery: Option<Thread>) -> BTreeMap<u32, Thread> {
        let discovery = discovery.map(|thread| (12, thread));
        std::iter::once((11, loops)).chain(discovery).collect()
    }

    /// A thread that has ended is told at once, also where another has its number now.
    #[test]
    fn a_thread_that_has_ended_is_told() {
        let asleep = || status("S (sleeping)", 1);
        let mut watch = Watch::default();
        watch.meet(&seen(asleep(), Some(asleep())));
        assert_eq!(watch.look(&seen(asleep(), Some(asleep()))), None);
        let told = watch.look(&seen(asleep(), None)).unwrap();
        assert!(told.contains("'RustDDS discove' has ended"), "{told}");
        let mut other = asleep();
        other.name = "tokio-runtime-w".to_owned();
        assert!(watch.look(&seen(asleep(), Some(other))).is_some());
    }

    /// A thread that waits and never wakes up is told after thirty looks. One that wakes up now and then, is kept from working by a
    /// busy machine, or is stopped, is not, however long it is looked at.
    #[test]
    fn only_a_thread_that_stands_still_is_told() {
        let busy = |look: u64| {
            seen(
                status("R (running)", 1),
                Some(status("S (sleeping)", look / 6)),
            )
        };
        let mut watch = Watch::default();
        watch.meet(&busy(0));
        for look in 0..10_000 {
            assert_eq!(watch.look(&busy(look)), None);
        }
        let stopped = || seen(status("T (stopped)", 1), Some(status("T (stopped)", 1)));
        for _ in 0..10_000 {
            assert_eq!(watch.look(&stopped()), None);
        }
        let locked_up = || seen(status("S (sleeping)", 7), Some(status("R (running)", 1)));
        let told: Vec<String> = (0..=STILL)
            .filter_map(|_| watch.look(&locked_up()))
            .collect();
        assert!(
            told.len() == 1 && told[0].contains("has not moved for 30 s"),
            "{told:?}"
        );
    }
}
