//! Why the controller stopped or refused: one code per cause.

use serde::{Deserialize, Serialize};

/// Cause of a stop or a refusal. Plain numbers, no text, RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u16)]
pub enum FaultCode {
    /// No fault.
    #[default]
    None = 0,
    /// The operator asked for a stop.
    OperatorStop = 1,
    /// The operator's heartbeat went silent while moving.
    OperatorLost = 2,
    /// A setpoint held a number that is not finite.
    SetpointNotFinite = 10,
    /// A setpoint left a joint's range.
    SetpointPosition = 11,
    /// A setpoint broke a joint's speed limit.
    SetpointVelocity = 12,
    /// A setpoint broke a joint's acceleration limit.
    SetpointAcceleration = 13,
    /// A setpoint broke the tool's speed limit.
    SetpointTcpSpeed = 14,
    /// Too many cycles were missed in a row.
    DeadlineMissed = 20,
    /// The arm did not answer for too many cycles.
    ReplyStalled = 21,
    /// The connection to the arm was lost.
    LinkLost = 22,
    /// Joint reports stopped or froze.
    ReportStale = 23,
    /// The arm is not where it was told to be.
    TrackingError = 24,
    /// The arm raised an error code (`arm_error` of the record).
    ArmError = 30,
    /// The arm left servo mode or its ready state.
    ArmModeChanged = 31,
    /// The arm answered a setpoint with "not able to move".
    ArmNotReady = 32,
    /// The arm stands too far from the plan's start.
    StartPoseMismatch = 40,
    /// The plan breaks a limit.
    PlanOutOfLimits = 41,
    /// The plan's hash does not match its content.
    PlanHashMismatch = 42,
    /// The command does not fit the present mode.
    WrongMode = 43,
}

impl FaultCode {
    /// All codes, for tables and tests.
    pub const ALL: [Self; 20] = [
        Self::None,
        Self::OperatorStop,
        Self::OperatorLost,
        Self::SetpointNotFinite,
        Self::SetpointPosition,
        Self::SetpointVelocity,
        Self::SetpointAcceleration,
        Self::SetpointTcpSpeed,
        Self::DeadlineMissed,
        Self::ReplyStalled,
        Self::LinkLost,
        Self::ReportStale,
        Self::TrackingError,
        Self::ArmError,
        Self::ArmModeChanged,
        Self::ArmNotReady,
        Self::StartPoseMismatch,
        Self::PlanOutOfLimits,
        Self::PlanHashMismatch,
        Self::WrongMode,
    ];

    /// The code of a raw number, if there is one.
    #[must_use]
    pub fn from_raw(raw: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|c| *c as u16 == raw)
    }

    /// What happened and what to do, one sentence each.
    #[must_use]
    pub const fn explain(self) -> &'static str {
        match self {
            Self::None => "no fault",
            Self::OperatorStop => "the operator asked for a stop; acknowledge to go on",
            Self::OperatorLost => {
                "the operator's heartbeat went silent while the arm moved; restart the operator's program, then acknowledge"
            }
            Self::SetpointNotFinite => {
                "a setpoint was not a finite number; this is a defect, keep the run folder and report it"
            }
            Self::SetpointPosition => {
                "a setpoint left a joint's range; check the plan with `wag check`"
            }
            Self::SetpointVelocity => {
                "a setpoint broke a joint's speed limit; check the plan with `wag check`"
            }
            Self::SetpointAcceleration => {
                "a setpoint broke a joint's acceleration limit; check the plan with `wag check`"
            }
            Self::SetpointTcpSpeed => {
                "a setpoint broke the tool's speed limit (the arm would stop with C60); check the plan with `wag check`"
            }
            Self::DeadlineMissed => {
                "the control thread was held up for too many cycles; give it real-time priority and a core of its own"
            }
            Self::ReplyStalled => {
                "the arm did not answer in time; use a direct cable and nothing else on that network port"
            }
            Self::LinkLost => {
                "the connection to the arm was lost; check power and cable, then acknowledge"
            }
            Self::ReportStale => {
                "joint reports stopped coming; check the arm's report ports, then acknowledge"
            }
            Self::TrackingError => {
                "the arm is not where it was told to be; look for an obstacle, then acknowledge"
            }
            Self::ArmError => {
                "the arm raised an error of its own (its code is in the record); remove the cause, then acknowledge"
            }
            Self::ArmModeChanged => {
                "the arm left servo mode, probably by another program or its emergency stop; make sure there is one commander, then acknowledge"
            }
            Self::ArmNotReady => {
                "the arm refused to move (stopped, in error or not enabled); clear its state, then acknowledge"
            }
            Self::StartPoseMismatch => {
                "the arm stands too far from the start of the plan; move it to the start pose first"
            }
            Self::PlanOutOfLimits => "the plan breaks a limit; check it with `wag check`",
            Self::PlanHashMismatch => "the plan was damaged on its way; send it again",
            Self::WrongMode => "the command does not fit the controller's present mode",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_unique_and_come_back() {
        for code in FaultCode::ALL {
            assert_eq!(FaultCode::from_raw(code as u16), Some(code));
            assert!(!code.explain().is_empty());
        }
        assert_eq!(FaultCode::from_raw(999), None);
    }
}
