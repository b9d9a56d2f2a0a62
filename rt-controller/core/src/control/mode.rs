//! Modes and what leads from one to another.
//!
//! ```text
//!             Engage              MoveBegun / StreamBegun
//!  Offline ----------> Idle --------------------------------> Moving / Streaming
//!                      ^  ^ \                MotionDone           |     |
//!               Engage  |   \_\____________________________________/     |
//!                      |      \ BrakeFault, LatchFault                  | BrakeFault
//!                      |       v                 BrakeDone              v
//!                      +--- Faulted <------------------------------- Braking
//!                              ^       LatchFault (from any mode)
//! ```

use super::motion::Motion;
use super::stopping::Stop;
use alloc::boxed::Box;
use serde::{Deserialize, Serialize};
use shared_types::FaultCode;
use shared_types::ipc::{CauseRecord, ControllerMode};

/// A motion under way; `M` stands for the motion itself.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Running<M = Box<Motion>> {
    pub(super) id: u64,
    pub(super) start_ns: u64,
    pub(super) motion: M,
}

/// A stop under way, off the motion that ran.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Braking<M = Box<Motion>> {
    pub(super) running: Running<M>,
    pub(super) start_ns: u64,
    pub(super) stop: Stop,
    pub(super) fault: FaultCode,
    pub(super) cause: CauseRecord,
}

/// The mode, with what only that mode has.
#[derive(Debug, Default, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, in place: the real-time path makes no boxes"
)]
pub(super) enum ModeState<M = Box<Motion>> {
    #[default]
    Offline,
    Idle,
    /// Moving or Streaming, by what kind of motion it is.
    Following(Running<M>),
    Braking(Braking<M>),
    Faulted(FaultCode),
}

impl ModeState {
    pub(super) fn mode(&self) -> ControllerMode {
        match self {
            Self::Offline => ControllerMode::Offline,
            Self::Idle => ControllerMode::Idle,
            Self::Following(running) => running.motion.mode(),
            Self::Braking(_) => ControllerMode::Braking,
            Self::Faulted(_) => ControllerMode::Faulted,
        }
    }
}

impl<M> ModeState<M> {
    pub(super) const fn fault(&self) -> FaultCode {
        match self {
            Self::Offline | Self::Idle | Self::Following(_) => FaultCode::None,
            Self::Braking(braking) => braking.fault,
            Self::Faulted(fault) => *fault,
        }
    }

    pub(super) const fn running(&self) -> Option<&Running<M>> {
        match self {
            Self::Following(running) | Self::Braking(Braking { running, .. }) => Some(running),
            Self::Offline | Self::Idle | Self::Faulted(_) => None,
        }
    }

    pub(super) const fn stop(&self) -> Option<&Stop> {
        match self {
            Self::Braking(braking) => Some(&braking.stop),
            Self::Offline | Self::Idle | Self::Following(_) | Self::Faulted(_) => None,
        }
    }

    /// Becomes `next`; what ran comes back.
    pub(super) fn change_to(&mut self, next: Self) -> Option<Running<M>> {
        match core::mem::replace(self, next) {
            Self::Following(running) | Self::Braking(Braking { running, .. }) => Some(running),
            Self::Offline | Self::Idle | Self::Faulted(_) => None,
        }
    }

    /// The same with another stand-in for the motion, which `of` finds by its
    /// number; `None` if it finds none.
    pub(super) fn try_map<N>(&self, of: impl FnOnce(u64, &M) -> Option<N>) -> Option<ModeState<N>> {
        let other = |running: &Running<M>| {
            Some(Running {
                id: running.id,
                start_ns: running.start_ns,
                motion: of(running.id, &running.motion)?,
            })
        };
        Some(match self {
            Self::Offline => ModeState::Offline,
            Self::Idle => ModeState::Idle,
            Self::Following(running) => ModeState::Following(other(running)?),
            Self::Braking(braking) => ModeState::Braking(Braking {
                running: other(&braking.running)?,
                start_ns: braking.start_ns,
                stop: braking.stop,
                fault: braking.fault,
                cause: braking.cause,
            }),
            Self::Faulted(fault) => ModeState::Faulted(*fault),
        })
    }
}

/// What may change the mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// The arm is enabled, in servo mode, and its pose is known.
    Engage,
    /// A move to a pose begins.
    MoveBegun,
    /// A trajectory begins.
    StreamBegun,
    /// The motion reached its end.
    MotionDone,
    /// A fault under which the arm can still follow setpoints.
    BrakeFault,
    /// The brake came to rest.
    BrakeDone,
    /// A fault under which no setpoint may be sent.
    LatchFault,
}

/// The mode after `trigger`, `None` where it does not apply. RT-safe.
#[must_use]
pub const fn next_mode(mode: ControllerMode, trigger: Trigger) -> Option<ControllerMode> {
    use ControllerMode as M;
    use Trigger as T;
    match (mode, trigger) {
        (M::Offline | M::Faulted, T::Engage) | (M::Moving | M::Streaming, T::MotionDone) => {
            Some(M::Idle)
        }
        (M::Idle, T::MoveBegun) => Some(M::Moving),
        (M::Idle, T::StreamBegun) => Some(M::Streaming),
        (M::Moving | M::Streaming, T::BrakeFault) => Some(M::Braking),
        (M::Idle, T::BrakeFault | T::LatchFault)
        | (M::Moving | M::Streaming, T::LatchFault)
        | (M::Braking, T::BrakeDone | T::LatchFault) => Some(M::Faulted),
        (M::Offline | M::Faulted, T::BrakeFault | T::LatchFault)
        | (M::Idle | M::Moving | M::Streaming | M::Braking, T::Engage)
        | (
            M::Offline | M::Moving | M::Streaming | M::Braking | M::Faulted,
            T::MoveBegun | T::StreamBegun,
        )
        | (M::Offline | M::Idle | M::Braking | M::Faulted, T::MotionDone)
        | (M::Offline | M::Idle | M::Moving | M::Streaming | M::Faulted, T::BrakeDone)
        | (M::Braking, T::BrakeFault) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ControllerMode as M;
    use Trigger as T;

    /// Only an engagement leaves a fault, a motion begins in `Idle` only and can always
    /// be stopped. By initial: the mode after each trigger, a dot where it does not apply.
    #[test]
    fn every_mode_after_every_trigger() {
        let triggers = [
            T::Engage,
            T::MoveBegun,
            T::StreamBegun,
            T::MotionDone,
            T::BrakeFault,
            T::BrakeDone,
            T::LatchFault,
        ];
        for (mode, expected) in [
            (M::Offline, "I......"),
            (M::Idle, ".MS.F.F"),
            (M::Moving, "...IB.F"),
            (M::Streaming, "...IB.F"),
            (M::Braking, ".....FF"),
            (M::Faulted, "I......"),
        ] {
            let after = triggers.map(|trigger| match next_mode(mode, trigger) {
                Some(next) => format!("{next:?}").remove(0),
                None => '.',
            });
            assert_eq!(String::from_iter(after), expected, "{mode:?}");
        }
    }
}
