//! A loop that does nothing: what of a cycle's duration is the machine's.
//!
//! It wakes at deadlines of the same period, with the same priority on the same
//! core, and reads the clock until as much time has passed as a cycle takes. What
//! it takes longer than that is interrupts, of this system or of the host below
//! it: no code, however short of work, can be without them.

use super::{LoopbackError, WARM_UP};
use crate::os::{Clock, MonotonicClock, RealTimeSettings, enter_real_time};
use std::time::Duration;

/// Durations (ns) of the cycles of a bare loop that reads the clock for
/// `work_ns`, every `period` for `span`. Blocks for as long.
pub(super) fn bare_slice(
    real_time: &RealTimeSettings,
    work_ns: u64,
    period: Duration,
    span: Duration,
) -> Result<Vec<u64>, LoopbackError> {
    let count = span.as_nanos() / period.as_nanos().max(1);
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let period_ns = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX);
    let real_time = real_time.clone();
    let body = move || {
        let mut clock = MonotonicClock;
        let mut spans_ns = Vec::with_capacity(count.saturating_add(WARM_UP));
        // What could not be had, the loop's own thread has said.
        let _ = enter_real_time(&real_time);
        let mut deadline_ns = clock.now_ns();
        for _ in 0..count.saturating_add(WARM_UP) {
            deadline_ns = deadline_ns.saturating_add(period_ns);
            clock.sleep_until(deadline_ns);
            let woke_ns = clock.now_ns();
            let mut now_ns = woke_ns;
            while now_ns.saturating_sub(woke_ns) < work_ns {
                now_ns = clock.now_ns();
            }
            spans_ns.push(now_ns.saturating_sub(woke_ns));
        }
        spans_ns.drain(..WARM_UP);
        spans_ns
    };
    let thread = std::thread::Builder::new()
        .name("bare loop".to_owned())
        .spawn(body)?;
    thread.join().map_err(|_panic| LoopbackError::Ended)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_takes_as_long_as_it_is_told_to() {
        let ordinary = RealTimeSettings::ordinary();
        let [period, span] = [1, 20].map(Duration::from_millis);
        let spans_ns = bare_slice(&ordinary, 50_000, period, span).unwrap();
        assert_eq!(spans_ns.len(), 20);
        assert!(spans_ns.iter().all(|ns| *ns >= 50_000), "{spans_ns:?}");
    }
}
