//! CLOCK_MONOTONIC, the clock that every stamp of the rig is taken from.

use rt_controller::os::{Clock, MonotonicClock, now_ns};
use shared_types::MonotonicNs;

/// Now.
#[must_use]
pub fn now() -> MonotonicNs {
    MonotonicNs(now_ns())
}

/// Sleeps until `deadline`; returns at once when it has passed.
pub fn sleep_until(deadline: MonotonicNs) {
    MonotonicClock.sleep_until(deadline.0);
}
