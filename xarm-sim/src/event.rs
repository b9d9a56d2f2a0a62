//! What happened inside the arm, for tests and logs.

use super::fault::FaultKind;
use arm_model::JointVector;
use rt_controller::xarm::{ArmState, ErrorCode, Mode};
use shared_types::MonotonicNs;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Events kept: some minutes of setpoints.
const KEPT_EVENTS: usize = 100_000;

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
    /// Other requests.
    pub requests: u64,
}

/// The arm's own log: what it got, from whom, and what happened to it, oldest
/// first, shared with whoever holds a clone. The oldest give way to new ones.
#[derive(Debug, Clone, Default)]
pub struct EventLog {
    events: Arc<Mutex<VecDeque<TimedEvent>>>,
}

impl EventLog {
    fn events(&self) -> MutexGuard<'_, VecDeque<TimedEvent>> {
        // A panic elsewhere leaves whole events behind.
        self.events.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn extend(&self, new: &[TimedEvent]) {
        let mut events = self.events();
        events.extend(new);
        let surplus = events.len().saturating_sub(KEPT_EVENTS);
        events.drain(..surplus);
    }

    /// Events later than `after`, oldest first.
    #[must_use]
    pub fn since(&self, after: MonotonicNs) -> Vec<TimedEvent> {
        let events = self.events();
        events.iter().filter(|e| e.at > after).copied().collect()
    }
}
