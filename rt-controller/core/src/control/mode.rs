//! Modes and what leads from one to another.
//!
//! ```text
//!             Adopt              MoveBegun / StreamBegun
//!  Offline ----------> Idle --------------------------------> Moving / Streaming
//!                      ^  ^ \                MotionDone           |     |
//!               Adopt  |   \_\____________________________________/     |
//!                      |      \ BrakeFault, LatchFault                  | BrakeFault
//!                      |       v                 BrakeDone              v
//!                      +--- Faulted <------------------------------- Braking
//!                              ^       LatchFault (from any mode)
//! ```

use shared_types::ipc::ControllerMode;

/// What may change the mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// The arm is enabled, in servo mode, and its pose is known.
    Adopt,
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

impl Trigger {
    /// All triggers, for tables and tests.
    pub const ALL: [Self; 7] = [
        Self::Adopt,
        Self::MoveBegun,
        Self::StreamBegun,
        Self::MotionDone,
        Self::BrakeFault,
        Self::BrakeDone,
        Self::LatchFault,
    ];
}

/// The mode after `trigger`, `None` where it does not apply. RT-safe.
#[must_use]
pub const fn next_mode(mode: ControllerMode, trigger: Trigger) -> Option<ControllerMode> {
    use ControllerMode as M;
    use Trigger as T;
    match (mode, trigger) {
        (M::Offline | M::Faulted, T::Adopt) | (M::Moving | M::Streaming, T::MotionDone) => {
            Some(M::Idle)
        }
        (M::Idle, T::MoveBegun) => Some(M::Moving),
        (M::Idle, T::StreamBegun) => Some(M::Streaming),
        (M::Moving | M::Streaming, T::BrakeFault) => Some(M::Braking),
        (M::Idle, T::BrakeFault | T::LatchFault)
        | (M::Moving | M::Streaming, T::LatchFault)
        | (M::Braking, T::BrakeDone | T::LatchFault) => Some(M::Faulted),
        (M::Offline | M::Faulted, T::BrakeFault | T::LatchFault)
        | (M::Idle | M::Moving | M::Streaming | M::Braking, T::Adopt)
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

    const MODES: [M; 6] = [
        M::Offline,
        M::Idle,
        M::Moving,
        M::Streaming,
        M::Braking,
        M::Faulted,
    ];

    #[test]
    fn only_an_adoption_leaves_a_fault() {
        for trigger in Trigger::ALL {
            let expected = (trigger == Trigger::Adopt).then_some(M::Idle);
            assert_eq!(next_mode(M::Faulted, trigger), expected, "{trigger:?}");
        }
    }

    #[test]
    fn motion_begins_in_idle_only_and_every_motion_can_be_stopped() {
        for mode in MODES {
            for begin in [Trigger::MoveBegun, Trigger::StreamBegun] {
                assert_eq!(next_mode(mode, begin).is_some(), mode == M::Idle);
            }
            if mode.is_moving() {
                assert_eq!(next_mode(mode, Trigger::LatchFault), Some(M::Faulted));
            }
        }
        for mode in [M::Moving, M::Streaming] {
            assert_eq!(next_mode(mode, Trigger::BrakeFault), Some(M::Braking));
        }
        assert_eq!(next_mode(M::Braking, Trigger::BrakeDone), Some(M::Faulted));
        assert_eq!(next_mode(M::Braking, Trigger::BrakeFault), None);
    }
}
