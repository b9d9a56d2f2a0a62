//! What goes into a control cycle and what comes out of it.

use super::motion::Motion;
use crate::xarm::{StateRequest, Status};
use shared_types::ipc::{CycleRecord, JointReport, OperatorBeat};
use shared_types::{FaultCode, JointVector};

/// What the relay asks of the cycle.
#[derive(Debug)]
pub enum Order {
    /// The arm is enabled and in servo mode; hold this pose (rad).
    Adopt {
        /// Pose to hold (rad).
        hold: JointVector,
    },
    /// Begin a motion.
    Run {
        /// Number of the motion, for its events.
        id: u64,
        /// The whole motion; it comes back in [`CycleOutput::retired`].
        motion: Box<Motion>,
    },
    /// Brake and latch.
    Stop,
}

/// What the command link showed since the last cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinkInput {
    /// Status bits of the replies that came, or-ed; `None` if none came.
    pub status: Option<Status>,
    /// Round trip of the newest reply, 0 if none came (ns).
    pub reply_ns: u32,
    /// Age of the oldest setpoint without a reply, 0 if all are answered (ns).
    pub unanswered_ns: u64,
    /// Whether the connection is gone.
    pub lost: bool,
}

/// Everything a cycle may know.
#[derive(Debug, Default)]
pub struct CycleInput {
    /// Planned wake-up (CLOCK_MONOTONIC, ns).
    pub deadline_ns: u64,
    /// Cycles missed before this one.
    pub missed: u32,
    /// At most one order.
    pub order: Option<Order>,
    /// Newest heartbeat.
    pub operator: OperatorBeat,
    /// Command link.
    pub link: LinkInput,
    /// Newest joint report, if one came since the last cycle.
    pub report: Option<JointReport>,
}

/// What happened, for the relay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlEvent {
    /// The arm is held.
    Adopted,
    /// A motion's first setpoint is due at `start_ns`.
    Started {
        /// Number of the motion.
        id: u64,
        /// Deadline of the first setpoint (ns).
        start_ns: u64,
    },
    /// A motion's last setpoint was due at `end_ns`.
    Finished {
        /// Number of the motion.
        id: u64,
        /// Deadline of the first setpoint (ns).
        start_ns: u64,
        /// Deadline of the last setpoint (ns).
        end_ns: u64,
    },
    /// An order was refused; nothing moved for it.
    Refused {
        /// Number of the motion, `None` for an adoption.
        id: Option<u64>,
        /// Why.
        fault: FaultCode,
    },
    /// A fault is latched and no setpoints are sent any more.
    Latched {
        /// Cause.
        fault: FaultCode,
        /// Cycle in which it was noticed.
        cycle: u64,
    },
}

/// What a cycle wants done.
#[derive(Debug, Default)]
pub struct CycleOutput {
    /// Setpoint to send (rad).
    pub setpoint: Option<JointVector>,
    /// State to ask of the arm.
    pub request: Option<StateRequest>,
    /// What happened.
    pub events: heapless::Vec<ControlEvent, 4>,
    /// Motions that are over, to be dropped outside the real-time thread.
    pub retired: heapless::Vec<Box<Motion>, 2>,
    /// The cycle's record; timing fields are the caller's.
    pub record: CycleRecord,
}
