//! Why the controller stopped or refused: one code per cause.

use serde::{Deserialize, Serialize};

/// Cause of a stop or a refusal. Plain numbers, no text, RT-safe to copy. The
/// numbers are part of recorded runs and never change.
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
    /// The guardian's heartbeat went silent.
    GuardianLost = 3,
    /// The operator let go of the dead-man switch while moving.
    DeadManReleased = 4,
    /// The arming was withdrawn while moving.
    Disarmed = 5,
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
    /// A setpoint broke a joint's jerk limit.
    SetpointJerk = 15,
    /// A setpoint was too far from the one before.
    SetpointStep = 16,
    /// From a setpoint the arm could not stop within its limits.
    SetpointUnstoppable = 17,
    /// Too many cycles were missed at once.
    DeadlineMissed = 20,
    /// The arm did not answer for too long.
    ReplyStalled = 21,
    /// The connection to the arm was lost.
    LinkLost = 22,
    /// Joint reports stopped.
    ReportStale = 23,
    /// The arm is not where it was told to be.
    TrackingError = 24,
    /// Some cycles were missed at once, few enough to slow down along the path.
    LateCycles = 25,
    /// Joint reports kept the same values while the arm was told to move.
    ReportFrozen = 26,
    /// The clock of the joint reports cannot be followed.
    ReportClock = 27,
    /// Too many broken joint reports in a row.
    ReportBroken = 28,
    /// The arm raised an error code (`arm_error` of the cause).
    ArmError = 30,
    /// The arm left servo mode or its ready state.
    ArmModeChanged = 31,
    /// The arm answered a setpoint with "not able to move".
    ArmNotReady = 32,
    /// A joint stood still although it was told to move.
    JointStuck = 33,
    /// A measured joint jumped farther than any joint can move.
    EncoderJump = 34,
    /// The arm stands too far from the plan's start.
    StartPoseMismatch = 40,
    /// The plan breaks a limit.
    PlanOutOfLimits = 41,
    /// The plan's hash does not match its content.
    PlanHashMismatch = 42,
    /// The command does not fit the present mode.
    WrongMode = 43,
    /// The arm is not armed for this motion.
    NotArmed = 44,
    /// A motion was faster than its operating mode allows.
    OperatingModeExceeded = 45,
    /// The arming ran out before the motion began.
    ArmingExpired = 46,
    /// The upload of a plan did not end in time.
    UploadTimedOut = 47,
    /// Somebody else commands the arm.
    SecondCommander = 50,
    /// The arm's firmware cannot be driven.
    UnsupportedFirmware = 51,
    /// The arm is configured otherwise than the controller.
    ArmDiffers = 52,
}

impl FaultCode {
    /// All codes, for tables and tests.
    pub const ALL: [Self; 39] = [
        Self::None,
        Self::OperatorStop,
        Self::OperatorLost,
        Self::GuardianLost,
        Self::DeadManReleased,
        Self::Disarmed,
        Self::SetpointNotFinite,
        Self::SetpointPosition,
        Self::SetpointVelocity,
        Self::SetpointAcceleration,
        Self::SetpointTcpSpeed,
        Self::SetpointJerk,
        Self::SetpointStep,
        Self::SetpointUnstoppable,
        Self::DeadlineMissed,
        Self::ReplyStalled,
        Self::LinkLost,
        Self::ReportStale,
        Self::TrackingError,
        Self::LateCycles,
        Self::ReportFrozen,
        Self::ReportClock,
        Self::ReportBroken,
        Self::ArmError,
        Self::ArmModeChanged,
        Self::ArmNotReady,
        Self::JointStuck,
        Self::EncoderJump,
        Self::StartPoseMismatch,
        Self::PlanOutOfLimits,
        Self::PlanHashMismatch,
        Self::WrongMode,
        Self::NotArmed,
        Self::OperatingModeExceeded,
        Self::ArmingExpired,
        Self::UploadTimedOut,
        Self::SecondCommander,
        Self::UnsupportedFirmware,
        Self::ArmDiffers,
    ];

    /// The code of a raw number, if there is one. RT-safe.
    #[must_use]
    pub fn from_raw(raw: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|c| *c as u16 == raw)
    }

    /// What happened and what to do, one sentence each. Running a command of `wag`
    /// again starts a fresh controller, whose bring-up clears the arm's errors; a
    /// program that keeps its controller sends
    /// [`crate::ipc::message::ControllerRequest::Acknowledge`] instead.
    #[must_use]
    #[allow(clippy::too_many_lines, reason = "one line per code")]
    pub const fn explain(self) -> &'static str {
        match self {
            Self::None => "no fault",
            Self::OperatorStop => "the operator asked for a stop; to go on, run the command again",
            Self::OperatorLost => {
                "the operator's heartbeat went silent while the arm moved; run the command again, and keep its program running while the arm moves"
            }
            Self::GuardianLost => {
                "the guardian that stops the arm when the controller dies went silent; restart it, then run the command again"
            }
            Self::DeadManReleased => {
                "the operator let go of the dead-man switch while the arm moved; hold it, then run the command again"
            }
            Self::Disarmed => {
                "the arming was withdrawn while the arm moved; arm again by running the command again"
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
            Self::SetpointJerk => {
                "a setpoint broke a joint's jerk limit; check the plan with `wag check`"
            }
            Self::SetpointStep => {
                "a setpoint was farther from the one before than the arm may be sent at once; check the plan with `wag check`"
            }
            Self::SetpointUnstoppable => {
                "from a setpoint the arm could not have stopped before the end of a joint's range; keep the plan farther from the ends"
            }
            Self::DeadlineMissed => {
                "the control thread was held up for too many cycles; give it real-time priority and a core of its own"
            }
            Self::ReplyStalled => {
                "the arm did not answer in time; use a direct cable and nothing else on that network port"
            }
            Self::LinkLost => {
                "the connection to the arm was lost; check power and cable, then run the command again"
            }
            Self::ReportStale => {
                "joint reports stopped coming; check the arm's report ports, then run the command again"
            }
            Self::TrackingError => {
                "the arm is not where it was told to be; look for an obstacle, then run the command again"
            }
            Self::LateCycles => {
                "the control thread was late by more than two cycles and the motion was slowed to rest; give it real-time priority and a core of its own"
            }
            Self::ReportFrozen => {
                "joint reports come but their values stand still; restart the arm's controller, then run the command again"
            }
            Self::ReportClock => {
                "the time stamps of the joint reports jump; restart the arm's controller, then run the command again"
            }
            Self::ReportBroken => {
                "joint reports come torn or hold nonsense; check cable and firmware, then run the command again"
            }
            Self::ArmError => {
                "the arm raised an error of its own (its code is in the record); remove the cause, then run the command again"
            }
            Self::ArmModeChanged => {
                "the arm left servo mode, probably by another program or its emergency stop; make sure there is one commander, then run the command again"
            }
            Self::ArmNotReady => {
                "the arm refused to move (stopped, in error or not enabled); clear its state, then run the command again"
            }
            Self::JointStuck => {
                "a joint does not follow; look for an obstacle or a failed drive before you run the command again"
            }
            Self::EncoderJump => {
                "a measured joint angle jumped; have its encoder checked before you run the command again"
            }
            Self::StartPoseMismatch => {
                "the arm stands too far from the start of the plan; move it to the start pose first"
            }
            Self::PlanOutOfLimits => "the plan breaks a limit; check it with `wag check`",
            Self::PlanHashMismatch => "the plan was damaged on its way; send it again",
            Self::WrongMode => "the command does not fit the controller's present mode",
            Self::NotArmed => {
                "the arm is not armed for this motion; arm it, for a throw with the area clear"
            }
            Self::OperatingModeExceeded => {
                "the motion is faster than its operating mode allows; slow it down or arm for a faster one"
            }
            Self::ArmingExpired => {
                "the arming ran out before the motion began; look whether the area is still clear and arm again"
            }
            Self::UploadTimedOut => {
                "the upload of the plan did not end in time; see whether the planner still runs and send it again"
            }
            Self::SecondCommander => {
                "somebody else commands the arm; end the other program, then run the command again"
            }
            Self::UnsupportedFirmware => {
                "the arm's firmware is too old or unknown; update it with the vendor's tool"
            }
            Self::ArmDiffers => {
                "the arm is configured otherwise than the controller; make its tool offset, speed limit and ranges agree with the limits file"
            }
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
