//! Why the arm was stopped: one record per stop.

use crate::fault::FaultCode;
#[cfg(feature = "std")]
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Which limit was met or broken, with both numbers. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct LimitBroken {
    /// Joint 1 to 7; 0 when it is about no single joint.
    pub joint: u32,
    /// Zero.
    pub reserved: u32,
    /// What was found. Its unit follows from the code: rad, rad/s, rad/s²,
    /// rad/s³ or m/s for setpoints, m for a step, s for silences and stalls,
    /// rad for tracking, cycles for misses, and for an error of the arm the speed
    /// that was nearest to its limit (rad/s of a joint, m/s of the tool); both
    /// numbers are zero where there is nothing to measure.
    pub value: f64,
    /// What is allowed.
    pub limit: f64,
}

/// What happened since the arm was last engaged without stopping it: each of
/// these marks the run. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct RunCounts {
    /// Cycles missed.
    pub missed: u32,
    /// Replies that came twice.
    pub duplicates: u32,
    /// Replies that came out of order.
    pub out_of_order: u32,
    /// Setpoints not sent because the arm or the network had not taken the ones
    /// before.
    pub skipped: u32,
    /// Joint reports dropped as truncated, of wrong length or not finite.
    pub broken_reports: u32,
    /// Times the arm's clock had to be followed anew.
    pub clock_resyncs: u32,
    /// Cycles in which the arm showed a warning.
    pub warnings: u32,
    /// Zero.
    pub reserved: u32,
}

/// One stop: the first cause, where it met the motion, and by how much.
/// Exactly one is made per latched stop. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct CauseRecord {
    /// [`super::PAYLOAD_VERSION`].
    pub version: u32,
    /// Cause, raw [`FaultCode`].
    pub code: u16,
    /// The arm's own error code as far as known, 0 for none.
    pub arm_error: u8,
    /// The arm's own warning code as far as known, 0 for none.
    pub arm_warning: u8,
    /// Mode when it was noticed, raw [`super::ControllerMode`].
    pub mode: u8,
    /// How it was met: 0 refused or counted, 1 slowed along the path, 2 braked
    /// in joint space, 3 no setpoints any more.
    pub path: u8,
    /// 1 when the arm itself was asked to stop.
    pub stop_arm: u8,
    /// Armed operating mode, raw [`crate::OperatingMode`]; 0 when not armed.
    pub operating_mode: u8,
    /// Code of what made the stop harder on the way, 0 if nothing did.
    pub second_code: u16,
    /// Zero.
    pub reserved: u16,
    /// Cycle in which it was noticed.
    pub cycle: u64,
    /// Deadline of that cycle (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Cycle in which setpoints ended.
    pub rest_cycle: u64,
    /// Motion that ran, 0 if none did.
    pub motion_id: u64,
    /// Time on that motion (s), negative if none ran.
    pub trajectory_s: f64,
    /// Which limit, with value and limit.
    pub limit: LimitBroken,
    /// Counts until then.
    pub counts: RunCounts,
}

impl CauseRecord {
    /// The cause.
    #[must_use]
    pub fn fault(&self) -> FaultCode {
        FaultCode::from_raw(self.code).unwrap_or_default()
    }
}
