//! Waits that a stop and a continuation do not end.
//!
//! After SIGSTOP and SIGCONT (Ctrl-Z and `fg`, a debugger, a container that was frozen) `epoll_wait` returns EINTR, whatever signals are
//! blocked and whatever handlers are there (signal(7)). RustDDS 0.15 takes that for the end of its event loops
//! (`docs/upstream/rustdds-eintr.md`). No option of it, of mio, or of the kernel helps; so the function itself waits on here. A program that
//! links this crate calls this `epoll_wait` instead of that of the C library, because a program's own symbols come first.
//!
//! Nobody misses the interruption: a signal that has a handler is told by what the handler does (tokio's writes to a pipe, which ends
//! the wait).

use std::ffi::{c_int, c_long};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Environment variable: `interruptible` leaves waits as the C library has them, to see what then happens.
const SWITCH: &str = "ROS_NODE_WAITS";

fn waits_on() -> bool {
    static WAITS_ON: OnceLock<bool> = OnceLock::new();
    *WAITS_ON.get_or_init(|| std::env::var_os(SWITCH).is_none_or(|value| value != "interruptible"))
}

/// Whether a wait is to go on, and how long \[ms\]; `None` where the caller is to be told of the interruption.
fn goes_on(interrupted: bool, deadline: Option<Instant>) -> Option<c_int> {
    if !interrupted {
        return None;
    }
    let Some(deadline) = deadline else {
        return Some(-1);
    };
    let left = deadline.saturating_duration_since(Instant::now());
    // Upwards: a wait never ends before its time.
    Some(c_int::try_from(left.as_micros().div_ceil(1000)).unwrap_or(c_int::MAX))
}

/// `epoll_wait(2)`, which waits on where it is interrupted.
///
/// # Safety
/// As that of the C library: `events` has room for `room` events.
#[allow(
    unsafe_code,
    reason = "the one place where a function of the C library is put in order"
)]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn epoll_wait(
    epoll: c_int,
    events: *mut libc::epoll_event,
    room: c_int,
    timeout_ms: c_int,
) -> c_int {
    // Before the call, so that nothing comes between it and its errno.
    let waits_on = waits_on();
    let limit = u64::try_from(timeout_ms).ok().map(Duration::from_millis);
    let deadline = limit.map(|limit| Instant::now() + limit);
    let mut timeout = timeout_ms;
    loop {
        let no_mask: *const libc::sigset_t = std::ptr::null();
        let size_of_mask: usize = 8;
        // SAFETY: the caller's pointers go to the kernel as they are, and the kernel writes at most `room` events.
        let found: c_long = unsafe {
            libc::syscall(
                libc::SYS_epoll_pwait,
                epoll,
                events,
                room,
                timeout,
                no_mask,
                size_of_mask,
            )
        };
        let error = (found < 0).then(std::io::Error::last_os_error);
        let interrupted =
            error.is_some_and(|error| error.kind() == std::io::ErrorKind::Interrupted);
        match goes_on(interrupted && waits_on, deadline) {
            Some(left) => timeout = left,
            None => return c_int::try_from(found).unwrap_or(-1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was interrupted waits for what is left of its time, or for ever; what was not goes back as it is.
    #[test]
    fn an_interrupted_wait_goes_on() {
        assert_eq!(goes_on(false, None), None);
        assert_eq!(goes_on(true, None), Some(-1));
        let soon = Instant::now() + Duration::from_secs(100);
        assert!(goes_on(true, Some(soon)).is_some_and(|left| (1..=100_000).contains(&left)));
        assert_eq!(goes_on(true, Some(Instant::now())), Some(0));
    }
}
