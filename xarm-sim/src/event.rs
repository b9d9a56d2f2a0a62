//! What happened inside the arm, for tests and logs.

use super::fault::FaultKind;
use arm_model::JointVector;
use rt_controller::xarm::{ArmState, ErrorCode, Mode};
use shared_types::MonotonicNs;

/// Something that happened inside the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ArmEvent {
    /// A setpoint arrived and passed its checks (rad).
    Setpoint(JointVector),
    /// A velocity command arrived and passed its checks.
    Velocity {
        /// Velocity (rad/s).
        qd: JointVector,
        /// Time after which the arm stops by itself (s).
        duration_s: Option<f64>,
    },
    /// A motion command arrived that cannot be executed now.
    Ignored {
        /// Its register.
        register: u8,
    },
    /// Any other request arrived.
    Request {
        /// Its register.
        register: u8,
    },
    /// The arm raised an error.
    Error(ErrorCode),
    /// The arm set a warning.
    Warning(u8),
    /// State or mode changed.
    State {
        /// State now.
        state: ArmState,
        /// Mode now.
        mode: Mode,
    },
    /// A fault of the script began or ended.
    Fault {
        /// Entry of the script, from 1.
        entry: usize,
        /// What it is.
        kind: FaultKind,
        /// Whether it began.
        begins: bool,
    },
}

/// An event and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedEvent {
    /// When.
    pub at: MonotonicNs,
    /// From which client; `None` for what the arm did by itself.
    pub client: Option<u32>,
    /// What.
    pub event: ArmEvent,
}

/// Counts since the arm was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ArmCounters {
    /// Motion commands (setpoints, velocities) that could be taken up.
    pub motion_commands: u64,
    /// Those executed.
    pub executed: u64,
    /// Those overwritten by a newer one before their turn.
    pub dropped: u64,
    /// Cycles of the controller without a new setpoint while a stream ran;
    /// counted only when it takes setpoints on its own clock.
    pub repeated: u64,
    /// Motion commands that came while the arm could not move or was in another
    /// mode.
    pub ignored: u64,
}
