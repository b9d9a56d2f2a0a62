//! The overrun policy, skip and keep the phase: when a cycle comes late, whole
//! missed periods are skipped and counted, later deadlines stay where they
//! were, nothing is caught up.
//!
//! A burst of setpoints is worse than a gap: the arm executes only the newest
//! and derives wrong accelerations from bunched ones. For the same reason a
//! setpoint that goes out late is the one of that later instant, and one that
//! became late only while it was computed does not go out at all.

/// Two setpoints are never closer than this part of a period.
const MIN_GAP_PART: (u64, u64) = (4, 5);

/// Shortest time between two setpoints that are due every `period_ns` (ns).
#[must_use]
pub const fn min_gap_ns(period_ns: u64) -> u64 {
    let (part, whole) = MIN_GAP_PART;
    period_ns.saturating_mul(part) / whole
}

/// Lateness up to this part of a period is no lateness: 0.2 ms at 250 Hz.
const PUNCTUAL_PART: u64 = 20;

/// How much later than `deadline_ns` the instant lies that a setpoint computed
/// at `woke_ns`, after `missed` lost cycles, is for (ns). RT-safe.
///
/// A punctual setpoint is for its deadline, so that jitter does not get into
/// the motion. A late one, or one after a gap, is for the instant at which it is
/// really sent: the arm sees its setpoints as far apart in time as they are on
/// the path, and never a step of two periods within one.
#[must_use]
pub fn setpoint_late_ns(deadline_ns: u64, woke_ns: u64, missed: u32, period_ns: u64) -> u32 {
    let late_ns = woke_ns.saturating_sub(deadline_ns);
    if missed == 0 && late_ns <= period_ns / PUNCTUAL_PART {
        0
    } else {
        u32::try_from(late_ns).unwrap_or(u32::MAX)
    }
}

/// Setpoints that were computed and not sent, because the thread was held up
/// between its wake-up and the send.
///
/// Sent all the same, the next one would follow too soon for the way between the
/// two, and the arm would see more speed than the motion has; without it the arm
/// sees one longer step in one longer time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StaleSetpointDrop {
    in_a_row: u32,
}

impl StaleSetpointDrop {
    /// Cycles since the last setpoint sent that had theirs held back; they count
    /// as missed. RT-safe.
    #[must_use]
    pub const fn missed(&self) -> u32 {
        self.in_a_row
    }

    /// Whether the setpoint about to be sent at `now_ns` must not go out: whether
    /// more time has passed since the wake-up at `woke_ns` than a wake-up may be
    /// late. Ask once per setpoint. RT-safe.
    #[must_use]
    pub fn holds(&mut self, woke_ns: u64, now_ns: u64, period_ns: u64) -> bool {
        let stale = now_ns.saturating_sub(woke_ns) > (period_ns / PUNCTUAL_PART).max(1);
        self.in_a_row = if stale {
            self.in_a_row.saturating_add(1)
        } else {
            0
        };
        stale
    }
}

/// When a cycle runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wake {
    /// Its planned instant (ns).
    pub deadline_ns: u64,
    /// Cycles skipped before it.
    pub missed: u32,
}

fn skip(deadline_ns: u64, cycles: u64, period_ns: u64) -> Wake {
    Wake {
        deadline_ns: deadline_ns.saturating_add(cycles.saturating_mul(period_ns)),
        missed: u32::try_from(cycles).unwrap_or(u32::MAX),
    }
}

/// The cycle that really runs when a thread due at `deadline_ns` woke at
/// `woke_ns`: deadlines passed by a whole period or more are skipped. RT-safe.
#[must_use]
pub fn after_wake(deadline_ns: u64, woke_ns: u64, period_ns: u64) -> Wake {
    let late_ns = woke_ns.saturating_sub(deadline_ns);
    skip(
        deadline_ns,
        late_ns.checked_div(period_ns).unwrap_or(0),
        period_ns,
    )
}

/// The next cycle after the one due at `deadline_ns` that sent its setpoint at
/// `sent_ns`, at its deadline if it sent none, and ended at `now_ns`: the first deadline that is still ahead and
/// leaves a gap to the setpoint just sent. RT-safe.
#[must_use]
pub fn next_wake(deadline_ns: u64, sent_ns: u64, now_ns: u64, period_ns: u64) -> Wake {
    let next_ns = deadline_ns.saturating_add(period_ns);
    let earliest_ns = now_ns.max(sent_ns.saturating_add(min_gap_ns(period_ns)));
    let behind_ns = earliest_ns.saturating_sub(next_ns);
    let cycles = if period_ns == 0 {
        0
    } else {
        behind_ns.div_ceil(period_ns)
    };
    skip(next_ns, cycles, period_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const P: u64 = 4_000_000;

    fn at(periods: u64, missed: u32) -> Wake {
        let deadline_ns = periods * P;
        Wake {
            deadline_ns,
            missed,
        }
    }

    #[test]
    fn punctual_cycles_follow_each_other_and_a_late_wake_skips_what_would_come_too_close() {
        // Woke 0.05 and 3.5 ms late: in the second case the next deadline is only
        // 0.5 ms away.
        for (woke_us, ended_us, next) in [(50, 150, at(11, 0)), (3500, 3600, at(12, 1))] {
            let [woke_ns, ended_ns] = [woke_us, ended_us].map(|us| 10 * P + us * 1000);
            assert_eq!(next_wake(10 * P, woke_ns, ended_ns, P), next);
        }
    }

    #[test]
    fn a_long_sleep_loses_whole_cycles_and_keeps_the_phase() {
        assert_eq!(after_wake(10 * P, 13 * P + 700_000, P), at(13, 3));
        assert_eq!(after_wake(10 * P, 10 * P - 5, P).missed, 0);
    }

    #[test]
    fn a_late_setpoint_is_for_the_instant_at_which_it_is_sent() {
        let late = |us: u64, missed| setpoint_late_ns(10 * P, 10 * P + us * 1000, missed, P);
        assert_eq!((late(0, 0), late(200, 0), late(201, 0)), (0, 0, 201_000));
        assert_eq!((late(0, 1), late(50, 1)), (0, 50_000));
        assert_eq!(setpoint_late_ns(10 * P, 9 * P, 3, P), 0);
    }

    #[test]
    fn a_setpoint_that_grew_old_is_held_back_and_counts_as_missed() {
        let mut held = StaleSetpointDrop::default();
        assert!(!held.holds(10 * P, 10 * P + 200_000, P));
        assert!(held.holds(11 * P, 11 * P + 200_001, P));
        assert!(held.holds(12 * P, 13 * P, P));
        assert_eq!(held.missed(), 2);
        assert!(!held.holds(13 * P, 13 * P - 5, P));
        assert_eq!(held.missed(), 0);
    }

    proptest! {
        #[test]
        fn setpoints_keep_their_distance_and_deadlines_their_phase(
            late in 0_u64..50_000_000, work in 0_u64..20_000_000, base in 1_u64..1_000_000,
        ) {
            let due = base + 7 * P;
            let woke = due + late;
            let this = after_wake(due, woke, P);
            prop_assert!(this.deadline_ns <= woke && woke < this.deadline_ns + P);
            let next = next_wake(this.deadline_ns, woke, woke + work, P);
            prop_assert_eq!((next.deadline_ns - base) % P, 0);
            prop_assert_eq!(next.deadline_ns, this.deadline_ns + P * (1 + u64::from(next.missed)));
            prop_assert!(next.deadline_ns >= woke + work);
            prop_assert!(next.deadline_ns - woke >= P / 5 * 4);
        }

        #[test]
        fn any_numbers_return(a: u64, b: u64, c: u64, d: u64) {
            let _ = (after_wake(a, b, d), next_wake(a, b, c, d), setpoint_late_ns(a, b, 0, d));
        }
    }
}
