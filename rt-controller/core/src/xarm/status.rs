//! What the arm says about itself: the status byte of every reply, states and
//! modes.

/// Status byte of a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status(pub u8);

impl Status {
    /// The result is invalid, the request failed.
    pub const INVALID: u8 = 0x08;
    /// Not able to move: state 4 or 5, an error, or not enabled.
    pub const NOT_READY: u8 = 0x10;
    /// A warning is set.
    pub const WARNING: u8 = 0x20;
    /// An error is set.
    pub const ERROR: u8 = 0x40;

    /// Whether the request failed or its result means nothing.
    #[must_use]
    pub const fn is_invalid(self) -> bool {
        self.0 & Self::INVALID != 0
    }

    /// Whether the arm cannot move.
    #[must_use]
    pub const fn is_not_ready(self) -> bool {
        self.0 & Self::NOT_READY != 0
    }

    /// Whether a warning is set; read it with `Command::GetFault`.
    #[must_use]
    pub const fn has_warning(self) -> bool {
        self.0 & Self::WARNING != 0
    }

    /// Whether an error is set; read it with `Command::GetFault`.
    #[must_use]
    pub const fn has_error(self) -> bool {
        self.0 & Self::ERROR != 0
    }

    /// Whether a motion request was taken: neither invalid, nor refused.
    #[must_use]
    pub const fn accepts_motion(self) -> bool {
        self.0 & (Self::INVALID | Self::NOT_READY | Self::ERROR) == 0
    }
}

/// State of the arm, as register 13 and the reports give it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ArmState {
    /// 1: moving.
    Moving,
    /// 2: ready and idle.
    Ready,
    /// 3: paused.
    Paused,
    /// 4: stopped; every error leads here.
    #[default]
    Stopped,
    /// 5: mode or configuration changed; needs `SetState(Ready)`.
    NeedsReset,
    /// 6: decelerating to a stop.
    Stopping,
    /// A number this list does not have.
    Other(u8),
}

impl ArmState {
    /// From the number on the wire.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::Moving,
            2 => Self::Ready,
            3 => Self::Paused,
            4 => Self::Stopped,
            5 => Self::NeedsReset,
            6 => Self::Stopping,
            other => Self::Other(other),
        }
    }

    /// The number on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Moving => 1,
            Self::Ready => 2,
            Self::Paused => 3,
            Self::Stopped => 4,
            Self::NeedsReset => 5,
            Self::Stopping => 6,
            Self::Other(code) => code,
        }
    }

    /// Whether motion requests can be executed: moving or ready.
    #[must_use]
    pub const fn can_move(self) -> bool {
        matches!(self, Self::Moving | Self::Ready)
    }
}

/// Mode of the arm (register 19).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// 0: the arm's own planner; default after boot and after an error.
    #[default]
    Position,
    /// 1: servo, for streamed joint setpoints.
    Servo,
    /// 4: joint velocity.
    JointVelocity,
    /// Any other: hand guiding 2, Cartesian velocity 5, online planning 6 and 7.
    Other(u8),
}

impl Mode {
    /// From the number on the wire.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            0 => Self::Position,
            1 => Self::Servo,
            4 => Self::JointVelocity,
            other => Self::Other(other),
        }
    }

    /// The number on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Position => 0,
            Self::Servo => 1,
            Self::JointVelocity => 4,
            Self::Other(code) => code,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_the_round_trip() {
        for code in 0..=u8::MAX {
            assert_eq!(ArmState::from_code(code).code(), code);
            assert_eq!(Mode::from_code(code).code(), code);
        }
    }

    /// The vendor's example: enabling all joints before set state answers 0x10.
    #[test]
    fn not_ready_is_no_error() {
        let status = Status(0x10);
        assert!(status.is_not_ready() && !status.has_error() && !status.is_invalid());
        assert!(!status.accepts_motion());
        assert!(Status(0x20).accepts_motion());
    }
}
