//! What a check found: the fault, and by how much.

use serde::{Deserialize, Serialize};
use shared_types::FaultCode;
use shared_types::ipc::LimitBroken;

/// A fault with the numbers that make it one. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Violation {
    /// The fault.
    pub fault: FaultCode,
    /// Joint 1 to 7; 0 when it is about no single joint.
    pub joint: u8,
    /// What was found, in the unit of its limit.
    pub value: f64,
    /// What is allowed.
    pub limit: f64,
}

impl Violation {
    /// About the whole arm or the link.
    #[must_use]
    pub const fn new(fault: FaultCode, value: f64, limit: f64) -> Self {
        Self {
            fault,
            joint: 0,
            value,
            limit,
        }
    }

    /// Without numbers.
    #[must_use]
    pub const fn plain(fault: FaultCode) -> Self {
        Self::new(fault, 0.0, 0.0)
    }

    /// About joint `index` (0-based).
    #[must_use]
    pub fn of_joint(fault: FaultCode, index: usize, value: f64, limit: f64) -> Self {
        Self {
            joint: u8::try_from(index.saturating_add(1)).unwrap_or(0),
            ..Self::new(fault, value, limit)
        }
    }

    /// About a time in nanoseconds, given in seconds.
    #[must_use]
    pub const fn of_time(fault: FaultCode, value_ns: u64, limit_ns: u64) -> Self {
        Self::new(fault, value_ns as f64 * 1e-9, limit_ns as f64 * 1e-9)
    }

    /// Part of the limit that was found; NaN without numbers.
    #[must_use]
    #[allow(
        clippy::arithmetic_side_effects,
        reason = "division of floats, which cannot panic"
    )]
    pub const fn part(&self) -> f64 {
        self.value / self.limit
    }

    /// As the cause record holds it.
    #[must_use]
    pub fn limit_broken(&self) -> LimitBroken {
        LimitBroken {
            joint: u32::from(self.joint),
            reserved: 0,
            value: self.value,
            limit: self.limit,
        }
    }
}
