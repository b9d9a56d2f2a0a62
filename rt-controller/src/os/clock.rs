//! CLOCK_MONOTONIC: reading it, and sleeping until an absolute instant of it.

/// A clock that the control loop lives by.
pub trait Clock {
    /// Now (CLOCK_MONOTONIC, ns). RT-safe.
    fn now_ns(&self) -> u64;
    /// Sleeps until `deadline_ns`; returns at once if it has passed. RT-safe.
    fn sleep_until(&mut self, deadline_ns: u64);
}

/// The machine's clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct MonotonicClock;

const NS_PER_S: u64 = 1_000_000_000;

/// Now (CLOCK_MONOTONIC, ns). RT-safe: a read of shared kernel memory.
#[must_use]
pub fn now_ns() -> u64 {
    read_ns(libc::CLOCK_MONOTONIC)
}

/// Now (CLOCK_REALTIME, ns). RT-safe. Only to translate the kernel's stamps:
/// this clock may be stepped.
pub(super) fn realtime_ns() -> u64 {
    read_ns(libc::CLOCK_REALTIME)
}

fn read_ns(clock: libc::clockid_t) -> u64 {
    let mut now = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: `now` is a valid, writable timespec; both clock ids in use exist
    // on every Linux, so the call cannot fail.
    unsafe { libc::clock_gettime(clock, &raw mut now) };
    let seconds = u64::try_from(now.tv_sec).unwrap_or_default();
    let nanoseconds = u64::try_from(now.tv_nsec).unwrap_or_default();
    seconds.saturating_mul(NS_PER_S).saturating_add(nanoseconds)
}

impl Clock for MonotonicClock {
    fn now_ns(&self) -> u64 {
        now_ns()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        let at = libc::timespec {
            tv_sec: libc::time_t::try_from(deadline_ns / NS_PER_S).unwrap_or(libc::time_t::MAX),
            tv_nsec: libc::c_long::try_from(deadline_ns % NS_PER_S).unwrap_or_default(),
        };
        loop {
            // SAFETY: `at` is a valid timespec; the remainder pointer may be
            // null, and is not used for absolute sleeps.
            let code = unsafe {
                libc::clock_nanosleep(
                    libc::CLOCK_MONOTONIC,
                    libc::TIMER_ABSTIME,
                    &raw const at,
                    core::ptr::null_mut(),
                )
            };
            if code != libc::EINTR {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_wakes_early() {
        let mut clock = MonotonicClock;
        for ahead_ns in [0, 1_000, 3_000_000] {
            let deadline = clock.now_ns() + ahead_ns;
            clock.sleep_until(deadline);
            assert!(clock.now_ns() >= deadline);
        }
        clock.sleep_until(1);
    }
}
