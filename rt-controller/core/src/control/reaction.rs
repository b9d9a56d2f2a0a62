//! How each fault is met: the table of reactions.
//!
//! | faults | setpoints | arm |
//! |---|---|---|
//! | refusals: plan, arming, mode, firmware | go on | left alone |
//! | late cycles, reports stale, frozen, broken or without a clock, guardian lost | slowed along the path | left ready |
//! | operator, dead-man switch, arming withdrawn, limiter | braked in joint space | left ready |
//! | tracking, stuck joint, encoder | braked in joint space | asked to stop |
//! | missed deadlines, silent link, second commander | none: the silence has already held the arm at the last setpoint, and any brake from there would begin with a jump | asked to stop |
//! | arm error, mode, not ready, link gone | none: they would not be followed, or come in a wrong mode | left alone: it has stopped, or cannot hear |

use shared_types::FaultCode;

/// What becomes of the setpoints, the softest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[repr(u8)]
pub enum StopCategory {
    /// They go on; the fault is a refusal or is counted.
    #[default]
    Continue = 0,
    /// Time on the path is scaled down to rest: the planned path is not left.
    OnPath = 1,
    /// Every joint is braked, jerk-limited, from where it was commanded last.
    JointSpace = 2,
    /// There are none any more.
    CutOff = 3,
}

/// How a fault is met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reaction {
    /// What becomes of the setpoints.
    pub path: StopCategory,
    /// Ask the arm to stop (set state 4) once the setpoints end.
    pub stop_arm: bool,
}

/// The reaction to each fault. RT-safe.
#[must_use]
pub const fn reaction(fault: FaultCode) -> Reaction {
    use FaultCode as F;
    let (path, stop_arm) = match fault {
        F::None
        | F::StartPoseMismatch
        | F::PlanOutOfLimits
        | F::PlanHashMismatch
        | F::WrongMode
        | F::NotArmed
        | F::ArmingExpired
        | F::UploadTimedOut
        | F::UnsupportedFirmware
        | F::ArmDiffers => (StopCategory::Continue, false),
        F::LateCycles
        | F::ReportStale
        | F::ReportFrozen
        | F::ReportClock
        | F::ReportBroken
        | F::GuardianLost => (StopCategory::OnPath, false),
        F::OperatorStop
        | F::OperatorLost
        | F::DeadManReleased
        | F::Disarmed
        | F::SetpointNotFinite
        | F::SetpointPosition
        | F::SetpointVelocity
        | F::SetpointAcceleration
        | F::SetpointTcpSpeed
        | F::SetpointJerk
        | F::SetpointStep
        | F::SetpointUnstoppable
        | F::OperatingModeExceeded => (StopCategory::JointSpace, false),
        F::TrackingError | F::JointStuck | F::EncoderJump => (StopCategory::JointSpace, true),
        F::DeadlineMissed | F::ReplyStalled | F::SecondCommander => (StopCategory::CutOff, true),
        F::LinkLost | F::ArmError | F::ArmModeChanged | F::ArmNotReady => {
            (StopCategory::CutOff, false)
        }
    };
    Reaction { path, stop_arm }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silent_or_stopped_arm_gets_no_setpoints() {
        for fault in [
            FaultCode::LinkLost,
            FaultCode::ArmError,
            FaultCode::ArmModeChanged,
            FaultCode::ArmNotReady,
            FaultCode::DeadlineMissed,
            FaultCode::ReplyStalled,
            FaultCode::SecondCommander,
        ] {
            assert_eq!(reaction(fault).path, StopCategory::CutOff, "{fault:?}");
        }
    }
}
