//! How long the parts of a cycle took.

use shared_types::ipc::CycleRecord;

/// Times of one cycle (ns).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleTimes {
    /// From the deadline to the first instruction after the sleep.
    pub wake_ns: u64,
    /// The receive call and what it brought.
    pub receive_ns: u64,
    /// Everything else up to the setpoint: inputs, core, record.
    pub compute_ns: u64,
    /// The send call.
    pub send_ns: u64,
    /// Cycles skipped before this one.
    pub missed: u32,
}

impl CycleTimes {
    /// Of a cycle whose poll took `poll_ns`.
    pub(super) fn of(record: &CycleRecord, poll_ns: u32) -> Self {
        Self {
            wake_ns: record.wake_late_ns.into(),
            receive_ns: poll_ns.into(),
            compute_ns: record.compute_ns.saturating_sub(poll_ns).into(),
            send_ns: record.send_ns.saturating_sub(record.compute_ns).into(),
            missed: record.missed,
        }
    }
}
