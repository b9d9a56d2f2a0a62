//! Why the controller stopped or refused: one code per cause.

use serde::{Deserialize, Serialize};

/// Every cause once: its number, what happened and what to do.
macro_rules! fault_codes {
    ($($(#[$meta:meta])? $name:ident = $number:literal: $explanation:literal;)+) => {
        /// Cause of a stop or a refusal. Plain numbers, no text, RT-safe to copy. The
        /// numbers are part of recorded runs and never change.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        #[repr(u16)]
        pub enum FaultCode {
            $(#[doc = $explanation] $(#[$meta])? $name = $number,)+
        }

        impl FaultCode {
            /// All codes, for tables and tests.
            pub const ALL: [Self; [$($number),+].len()] = [$(Self::$name),+];

            /// What happened and what to do, one sentence each. Running a command of `wag`
            /// again starts a fresh controller, whose bring-up clears the arm's errors; a
            /// program that keeps its controller sends
            /// [`crate::ipc::message::ControllerRequest::Acknowledge`] instead.
            #[must_use]
            pub const fn explain(self) -> &'static str {
                match self {
                    $(Self::$name => $explanation,)+
                }
            }
        }
    };
}

fault_codes! {
    #[default]
    None = 0: "no fault";
    OperatorStop = 1: "the operator asked for a stop; to go on, run the command again";
    OperatorLost = 2:
        "the operator's heartbeat is silent; its program ended, or the computer was too busy for it; end what else computes there, then run the command again";
    GuardianLost = 3:
        "the guardian that stops the arm when the controller dies is silent, or the arm does not answer it; look into its log, restart it, then run the command again";
    DeadManReleased = 4:
        "standard input stopped the arm (Enter or other input, or the hold-to-run key was let go), or it has ended; run the command again with it open, or the key held";
    Disarmed = 5:
        "the arming was withdrawn while the arm moved; arm again by running the command again";
    SetpointNotFinite = 10:
        "a setpoint was not a finite number; this is a defect, keep the run folder and report it";
    SetpointPosition = 11: "a setpoint left a joint's range; check the plan with `wag check`";
    SetpointVelocity = 12:
        "a setpoint broke a joint's speed limit; check the plan with `wag check`";
    SetpointAcceleration = 13:
        "a setpoint broke a joint's acceleration limit; check the plan with `wag check`";
    SetpointTcpSpeed = 14:
        "a setpoint broke the tool's speed limit (the arm would stop with C60); check the plan with `wag check`";
    SetpointJerk = 15: "a setpoint broke a joint's jerk limit; check the plan with `wag check`";
    SetpointStep = 16:
        "a setpoint was farther from the one before than the arm may be sent at once; check the plan with `wag check`";
    SetpointUnstoppable = 17:
        "from a setpoint the arm could not have stopped before the end of a joint's range; keep the plan farther from the ends";
    DeadlineMissed = 20:
        "the control thread was held up for too many cycles; give it real-time priority and a core of its own";
    ReplyStalled = 21:
        "the arm did not answer in time; use a direct cable and nothing else on that network port";
    LinkLost = 22:
        "the connection to the arm was lost; check power and cable, then run the command again";
    ReportStale = 23:
        "no joint reports come, or no longer; check the arm's report ports, then run the command again";
    TrackingError = 24:
        "the arm is not at its setpoint; look for an obstacle, then run the command again";
    LateCycles = 25:
        "the control thread was late by more than two cycles; give it real-time priority and a core of its own";
    ReportFrozen = 26:
        "joint reports come but their values stand still; restart the arm's controller, then run the command again";
    ReportClock = 27:
        "the time stamps of the joint reports jump; restart the arm's controller, then run the command again";
    ReportBroken = 28:
        "joint reports come truncated or hold nonsense; check cable and firmware, then run the command again";
    ArmError = 30:
        "the arm raised an error of its own (its code is in the record); remove the cause, then run the command again";
    ArmModeChanged = 31:
        "the arm left servo mode, probably by another program or its emergency stop; make sure there is one commander, then run the command again";
    ArmNotReady = 32:
        "the arm refused to move (stopped, in error or not enabled); clear its state, then run the command again";
    JointStuck = 33:
        "a joint does not follow; look for an obstacle or a failed drive before you run the command again";
    EncoderJump = 34:
        "a measured joint angle jumped; have its encoder checked before you run the command again";
    StartPoseMismatch = 40:
        "the arm stands too far from the start of the plan; move it to the start pose first";
    PlanOutOfLimits = 41: "the plan breaks a limit; check it with `wag check`";
    PlanHashMismatch = 42: "the plan was damaged on its way; send it again";
    WrongMode = 43: "the command does not fit the controller's present mode";
    NotArmed = 44:
        "the arm is not armed for this motion; arm it, for a wiggle or a throw with the area confirmed clear";
    OperatingModeExceeded = 45:
        "the motion is faster than its operating mode allows; slow it down or arm for a faster one";
    ArmingExpired = 46:
        "the arming ran out, or the instant by which the motion had to begin was over, before it began; look whether the area is still clear and arm again";
    UploadTimedOut = 47:
        "the upload of the plan did not end in time; see whether the planner still runs and send it again";
    SecondCommander = 50:
        "somebody else commands the arm; end the other program, then run the command again";
    UnsupportedFirmware = 51:
        "the arm's firmware is too old or unknown; update it with the vendor's tool";
    ArmDiffers = 52:
        "the arm is configured otherwise than the controller; make its tool offset, speed limit and ranges agree with the limits file";
}

impl FaultCode {
    /// The code of a raw number, if there is one. RT-safe.
    #[must_use]
    pub fn from_raw(raw: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|c| *c as u16 == raw)
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
