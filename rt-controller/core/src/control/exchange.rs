//! What goes into a control cycle and what comes out of it.

use super::motion::Motion;
use crate::xarm::{StateRequest, Status};
use alloc::boxed::Box;
use arm_model::JointVector;
use shared_types::ipc::{CauseRecord, CycleRecord, GuardianBeat, OperatorBeat, Reports};
use shared_types::{Arming, FaultCode};

/// What the bridge asks of the cycle.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlCommand {
    /// The arm is enabled and in its streaming mode; hold this pose (rad).
    /// Everything known about the run before is forgotten.
    Engage {
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
    /// Allow motions of an operating mode.
    Arm(Arming),
    /// Allow no motion any more; one that runs is braked.
    Disarm,
}

/// What the command link showed since the last cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinkInput {
    /// Status bits of the replies that came, or-ed; `None` if none came.
    pub status: Option<Status>,
    /// Round trip of the newest reply, 0 if none came (ns).
    pub reply_ns: u32,
    /// Age of the oldest setpoint without a reply, 0 if all are answered (ns).
    pub unanswered_ns: u64,
    /// Setpoints without a reply, overtaken ones left out.
    pub unanswered: u16,
    /// Replies that came a second time since the last cycle.
    pub duplicates: u16,
    /// Replies that came out of order since the last cycle.
    pub out_of_order: u16,
    /// Replies to commands never sent here since the last cycle: somebody else
    /// uses this connection's number space.
    pub foreign: u16,
    /// Commands since the last cycle that were not sent, because too many were
    /// unanswered, the network took none, or the last one was too recent.
    pub skipped: u16,
    /// Whether the connection is gone.
    pub lost: bool,
}

/// What the arm says about itself five times a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ArmCodes {
    /// Error code, 0 for none.
    pub error: u8,
    /// Warning code, 0 for none.
    pub warning: u8,
    /// State, as in [`crate::xarm::ArmState`].
    pub state: u8,
    /// Mode, as in [`crate::xarm::Mode`].
    pub mode: u8,
    /// When it arrived (CLOCK_MONOTONIC, ns).
    pub arrival_ns: u64,
}

/// Everything a cycle may know.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CycleInput {
    /// Planned wake-up (CLOCK_MONOTONIC, ns).
    pub deadline_ns: u64,
    /// Cycles missed before this one.
    pub missed: u32,
    /// How much later than the deadline the instant is that the setpoint is for,
    /// 0 when the cycle was punctual (ns).
    pub late_ns: u32,
    /// At most one command.
    pub command: Option<ControlCommand>,
    /// Newest heartbeat of the operator, with the dead-man switch.
    pub operator: OperatorBeat,
    /// Newest heartbeat of the guardian.
    pub guardian: GuardianBeat,
    /// Command link.
    pub link: LinkInput,
    /// The arm's own codes, if they came since the last cycle.
    pub codes: Option<ArmCodes>,
    /// Joint reports since the last cycle, oldest first.
    pub reports: Reports,
    /// Joint reports dropped as broken since the last cycle.
    pub broken_reports: u32,
}

/// What is commanded in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ArmCommand {
    /// Be there (rad); servo-position mode.
    Position(JointVector),
    /// Move like this; joint-velocity mode.
    Velocity {
        /// Joint velocities (rad/s).
        qd: JointVector,
        /// The arm stops by itself this long after the command (s).
        duration_s: f64,
    },
}

/// What happened, for the bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControlEvent {
    /// The arm is held.
    Engaged,
    /// A stop was commanded while no arm was held: nothing moves.
    AtRest,
    /// The controller is armed.
    Armed(Arming),
    /// The controller is not armed any more; `fault` says why, `None` when it
    /// was ordered or the one shot is over.
    Disarmed {
        /// Why.
        fault: FaultCode,
    },
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
    /// A command was refused; nothing moved for it.
    Refused {
        /// Number of the motion, `None` for an engagement or an arming.
        id: Option<u64>,
        /// Why.
        fault: FaultCode,
    },
    /// A fault is latched and no setpoints are sent any more. Exactly one comes
    /// per stop.
    Latched(CauseRecord),
}

/// Events of one cycle at most: a command's, a motion's end, an end of arming, a
/// latch.
pub const EVENTS_PER_CYCLE: usize = 6;

/// What a cycle wants done.
#[derive(Debug, Default, PartialEq)]
pub struct CycleOutput {
    /// The command for the arm; at most one per cycle.
    pub command: Option<ArmCommand>,
    /// State to ask of the arm.
    pub request: Option<StateRequest>,
    /// What happened.
    pub events: heapless::Vec<ControlEvent, EVENTS_PER_CYCLE>,
    /// Motions that are over, to be dropped outside the real-time thread.
    pub retired: heapless::Vec<Box<Motion>, 2>,
    /// The cycle's record; timing fields are the caller's.
    pub record: CycleRecord,
}

impl CycleOutput {
    /// Position commanded in servo-position mode, if one is (rad).
    #[must_use]
    pub const fn setpoint(&self) -> Option<JointVector> {
        match self.command {
            Some(ArmCommand::Position(q)) => Some(q),
            Some(ArmCommand::Velocity { .. }) | None => None,
        }
    }
}
