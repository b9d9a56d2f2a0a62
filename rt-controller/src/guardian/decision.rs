//! What the guardian does and when: pure, no clock, no I/O.
//!
//! ```text
//!            controller fresh        lost or cut off while moving
//!  Waiting ------------------> Watching -----------------> Stopping
//!     ^                           |                          |   | 3 s without
//!     |    lost at rest           |      state 4 or 5 read   |   | state 4
//!     +---------------------------+            +-------------+   v
//!     |                                        v          StopUnconfirmed
//!     +------------------ another controller, at rest ----------+
//!                                           Stopped
//! ```
//!
//! Cut off is a controller that lives but has lost its link to the moving arm:
//! it cannot ask for the stop itself. A stop under way ends when the fault is
//! acknowledged, since the controller has a new link by then.
//!
//! Stopping is the way the vendor's own SDK does it: state 4 is asked for, then
//! read; again every 0.1 s for at most 3 s.

use crate::xarm::ArmState;

/// The stop is asked for this often (ns).
pub const ASK_EVERY_NS: u64 = 100_000_000;
/// Silence at rest after which the controller is looked for anew (ns).
const FORGET_AFTER_NS: u64 = 500_000_000;
/// Time in which the arm must be seen stopped (ns).
pub const STOP_WITHIN_NS: u64 = 3_000_000_000;

/// What the guardian knows in one turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GuardianInput {
    /// Now (CLOCK_MONOTONIC, ns).
    pub now_ns: u64,
    /// The controller's newest sign of life, `None` without a controller.
    pub pulse: Option<Pulse>,
    /// State of the arm, if it was read since the last turn.
    pub arm_state: Option<u8>,
    /// Whether there is a connection to the arm.
    pub connected: bool,
}

/// The controller's sign of life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pulse {
    /// When its newest cycle woke (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Whether the arm moved in it.
    pub moving: bool,
    /// Whether its control thread or its process has ended.
    pub ended: bool,
    /// Whether it has latched and its link to the arm failed, so that a request for a stop of
    /// its own may not have reached the arm.
    pub cut_off: bool,
}

/// Why the arm is being stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Emergency {
    /// The controller ended or fell silent.
    #[default]
    Lost,
    /// The controller lives but cannot reach the arm.
    CutOff,
}

/// What the guardian is doing. Numbers are part of the shared layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum GuardianPhase {
    /// There is no controller.
    #[default]
    Waiting = 0,
    /// The controller lives.
    Watching = 1,
    /// The controller was lost while the arm moved: it is being stopped.
    Stopping = 2,
    /// The arm was seen stopped.
    Stopped = 3,
    /// The arm was asked to stop but never seen stopped.
    StopUnconfirmed = 4,
}

/// What is to be done after a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GuardianOutput {
    /// Ask the arm for state 4, then read its state.
    pub ask_stop: bool,
    /// The phase changed in this turn.
    pub changed: Option<GuardianPhase>,
    /// Look for a controller anew: the one known is gone.
    pub look_again: bool,
}

/// The guardian's watchdog state machine. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Guardian {
    silence_ns: u64,
    phase: GuardianPhase,
    since_ns: u64,
    requested_ns: Option<u64>,
    lost_stamp_ns: u64,
    emergency: Emergency,
    /// Whether the arm moved when the controller was seen last.
    moved: bool,
}

impl Guardian {
    /// Takes a controller for lost after `silence_ns` without a sign of life.
    #[must_use]
    pub const fn new(silence_ns: u64) -> Self {
        Self {
            silence_ns,
            phase: GuardianPhase::Waiting,
            since_ns: 0,
            requested_ns: None,
            lost_stamp_ns: 0,
            emergency: Emergency::Lost,
            moved: false,
        }
    }

    /// Why the arm is being stopped, or was.
    #[must_use]
    pub const fn emergency(&self) -> Emergency {
        self.emergency
    }

    /// Present phase.
    #[must_use]
    pub const fn phase(&self) -> GuardianPhase {
        self.phase
    }

    /// From the lost controller's last sign of life to the first request for a
    /// stop (ns), once there was one.
    #[must_use]
    pub fn reaction_ns(&self) -> Option<u64> {
        let stopped = matches!(
            self.phase,
            GuardianPhase::Stopping | GuardianPhase::Stopped | GuardianPhase::StopUnconfirmed
        );
        stopped.then(|| self.since_ns.saturating_sub(self.lost_stamp_ns))
    }

    /// The request of the last turn could not be sent: it is due at once.
    pub fn was_not_sent(&mut self) {
        self.requested_ns = None;
    }

    /// One turn.
    pub fn step(&mut self, input: &GuardianInput) -> GuardianOutput {
        let before = self.phase;
        let mut out = match self.phase {
            GuardianPhase::Waiting => self.wait(input),
            GuardianPhase::Watching => self.watch(input),
            GuardianPhase::Stopping => self.stop(input),
            GuardianPhase::Stopped | GuardianPhase::StopUnconfirmed => self.rest(input),
        };
        out.changed = (self.phase != before).then_some(self.phase);
        out
    }

    fn is_lost(&self, input: &GuardianInput, pulse: &Pulse) -> bool {
        pulse.ended || input.now_ns.saturating_sub(pulse.stamp_ns) > self.silence_ns
    }

    fn enter(&mut self, phase: GuardianPhase, now_ns: u64) {
        self.phase = phase;
        self.since_ns = now_ns;
    }

    fn wait(&mut self, input: &GuardianInput) -> GuardianOutput {
        let Some(pulse) = input.pulse else {
            return look_again(true);
        };
        if !self.is_lost(input, &pulse) {
            self.enter(GuardianPhase::Watching, input.now_ns);
            self.moved = pulse.moving;
            return GuardianOutput::default();
        }
        if pulse.moving {
            // It began to move and was lost before it could be watched.
            return self.stop_for(Emergency::Lost, &pulse, input);
        }
        look_again(is_gone(input, &pulse))
    }

    fn watch(&mut self, input: &GuardianInput) -> GuardianOutput {
        let Some(pulse) = input.pulse else {
            return GuardianOutput::default();
        };
        let moved = core::mem::replace(&mut self.moved, pulse.moving);
        if !self.is_lost(input, &pulse) {
            if pulse.cut_off && moved {
                return self.stop_for(Emergency::CutOff, &pulse, input);
            }
            return GuardianOutput::default();
        }
        if !pulse.moving {
            // At rest the arm holds by itself.
            self.enter(GuardianPhase::Waiting, input.now_ns);
            return look_again(is_gone(input, &pulse));
        }
        self.stop_for(Emergency::Lost, &pulse, input)
    }

    fn stop_for(
        &mut self,
        emergency: Emergency,
        pulse: &Pulse,
        input: &GuardianInput,
    ) -> GuardianOutput {
        self.enter(GuardianPhase::Stopping, input.now_ns);
        self.emergency = emergency;
        self.lost_stamp_ns = pulse.stamp_ns;
        self.requested_ns = None;
        self.ask(input)
    }

    fn stop(&mut self, input: &GuardianInput) -> GuardianOutput {
        let stopped = |code| {
            matches!(
                ArmState::from_code(code),
                ArmState::Stopped | ArmState::NeedsReset
            )
        };
        let reached_again = |pulse: &Pulse| !self.is_lost(input, pulse) && !pulse.cut_off;
        if self.emergency == Emergency::CutOff && input.pulse.as_ref().is_some_and(reached_again) {
            self.enter(GuardianPhase::Watching, input.now_ns);
            return GuardianOutput::default();
        }
        // A state read before the first request says nothing.
        if self.requested_ns.is_some() && input.arm_state.is_some_and(stopped) {
            self.phase = GuardianPhase::Stopped;
            return GuardianOutput::default();
        }
        if input.now_ns.saturating_sub(self.since_ns) > STOP_WITHIN_NS {
            self.phase = GuardianPhase::StopUnconfirmed;
            return GuardianOutput::default();
        }
        self.ask(input)
    }

    /// Asks when it is time and there is a connection.
    fn ask(&mut self, input: &GuardianInput) -> GuardianOutput {
        let due = self
            .requested_ns
            .is_none_or(|at_ns| input.now_ns.saturating_sub(at_ns) >= ASK_EVERY_NS);
        let ask_stop = due && input.connected;
        if ask_stop {
            self.requested_ns = Some(input.now_ns);
        }
        GuardianOutput {
            ask_stop,
            ..GuardianOutput::default()
        }
    }

    /// Latched: only another sign of life than the lost one's, at rest, is
    /// watched again.
    fn rest(&mut self, input: &GuardianInput) -> GuardianOutput {
        let again = input.pulse.filter(|pulse| {
            !self.is_lost(input, pulse) && !pulse.moving && pulse.stamp_ns != self.lost_stamp_ns
        });
        if again.is_some() {
            self.enter(GuardianPhase::Watching, input.now_ns);
            return GuardianOutput::default();
        }
        look_again(input.pulse.is_none_or(|pulse| self.is_lost(input, &pulse)))
    }
}

/// Whether a controller that is lost at rest will not come back.
fn is_gone(input: &GuardianInput, pulse: &Pulse) -> bool {
    pulse.ended || input.now_ns.saturating_sub(pulse.stamp_ns) > FORGET_AFTER_NS
}

/// Nothing to do but, perhaps, to look for another controller.
fn look_again(look_again: bool) -> GuardianOutput {
    GuardianOutput {
        look_again,
        ..GuardianOutput::default()
    }
}

#[cfg(test)]
#[path = "decision_tests.rs"]
mod tests;
