//! What commands lead to.

use super::arming::ArmingState;
use super::cycle::{ControlState, emit, give_back};
use super::exchange::{ControlCommand, ControlEvent, CycleInput, CycleOutput};
use super::limiter::Limiter;
use super::mode::{ModeState, Running, Trigger, next_mode};
use super::motion::Motion;
use super::velocity_interface::VelocityInterface;
use super::violation::Violation;
use alloc::boxed::Box;
use arm_model::{JointState, JointVector};
use shared_types::ipc::ControllerMode;
use shared_types::{Arming, FaultCode, MonotonicNs, OperatingMode};

/// Starts closer than this are equal (rad); a larger difference would be a jump.
const START_TOLERANCE_RAD: f64 = 1e-9;
/// The arm may stand this far from where it was commanded or predicted to be when a motion begins
/// (rad): half a degree.
const START_DEVIATION_MAX_RAD: f64 = 0.5 * core::f64::consts::PI / 180.0;

impl ControlState {
    /// Handles a command; `before` is the mode before this cycle looked at anything.
    pub(super) fn handle(
        &mut self,
        command: ControlCommand,
        before: ControllerMode,
        input: &CycleInput,
        out: &mut CycleOutput,
    ) {
        let deadline_ns = input.deadline_ns;
        let done = match command {
            // Given before this very cycle's stop, so it acknowledges nothing.
            ControlCommand::Engage { .. } if before != self.mode() => Err(FaultCode::WrongMode),
            ControlCommand::Engage { hold } => self.engage(hold, input),
            ControlCommand::Arm(arming) => self.arm(arming, input),
            ControlCommand::Run { id, motion } => return self.run(id, motion, input, out),
            ControlCommand::Stop
                if matches!(before, ControllerMode::Offline | ControllerMode::Faulted) =>
            {
                Ok(ControlEvent::AtRest)
            }
            ControlCommand::Stop => {
                return self.react(Violation::plain(FaultCode::OperatorStop), deadline_ns, out);
            }
            ControlCommand::Disarm if self.mode().is_moving() => {
                return self.react(Violation::plain(FaultCode::Disarmed), deadline_ns, out);
            }
            ControlCommand::Disarm => return self.disarm(FaultCode::None, out),
        };
        let refused = |fault| ControlEvent::Refused { id: None, fault };
        emit(out, done.unwrap_or_else(refused));
    }

    fn arm(&mut self, arming: Arming, input: &CycleInput) -> Result<ControlEvent, FaultCode> {
        if self.mode() != ControllerMode::Idle {
            return Err(FaultCode::WrongMode);
        }
        if input.operator.released != 0 {
            return Err(FaultCode::DeadManReleased);
        }
        let armed = self.arming.arm(arming, input.deadline_ns);
        armed.map(ControlEvent::Armed)
    }

    pub(super) fn disarm(&mut self, fault: FaultCode, out: &mut CycleOutput) {
        if core::mem::take(&mut self.arming) != ArmingState::Disarmed {
            emit(out, ControlEvent::Disarmed { fault });
        }
    }

    fn engage(&mut self, hold: JointVector, input: &CycleInput) -> Result<ControlEvent, FaultCode> {
        if input.link.lost {
            // A link that broke on its way here.
            return Err(FaultCode::LinkLost);
        }
        next_mode(self.mode(), Trigger::Engage).ok_or(FaultCode::WrongMode)?;
        if !hold.is_finite() {
            return Err(FaultCode::SetpointNotFinite);
        }
        if self.limits.position_violation(&hold).is_some() {
            return Err(FaultCode::SetpointPosition);
        }
        let deadline_ns = input.deadline_ns;
        self.state = ModeState::Idle;
        self.arming = ArmingState::Disarmed;
        self.commanded = JointState::at_rest(hold);
        self.limiter = Limiter::at_rest(hold, &self.limits);
        self.tcp_speed_max_m_s = self.limits.tcp_speed_max_m_s;
        self.velocity = VelocityInterface::default();
        self.sent_ns = MonotonicNs(deadline_ns).plus_s(-self.period_s()).0;
        self.monitor = self.monitor.engaged(deadline_ns, hold);
        self.monitor.observe(input, &self.limits);
        Ok(ControlEvent::Engaged)
    }

    fn run(&mut self, id: u64, motion: Box<Motion>, input: &CycleInput, out: &mut CycleOutput) {
        match self.admit(&motion, input) {
            Ok((mode, operating_mode)) => {
                // The planned instant, also of a late cycle: punctual setpoints then lie
                // at whole periods of every motion, the same ones in every run.
                let start_ns = input.deadline_ns.saturating_sub(input.late_ns.into());
                let (is_move, limit_m_s) = (
                    mode == ControllerMode::Moving,
                    self.limits.tcp_speed_max_m_s,
                );
                self.tcp_speed_max_m_s =
                    self.settings
                        .tool_speed_max_m_s(is_move, operating_mode, limit_m_s);
                let shot =
                    mode == ControllerMode::Streaming && operating_mode == OperatingMode::Throw;
                if self.settings.arming_required && shot {
                    self.arming = ArmingState::Spent;
                }
                self.monitor.reports.motion_begins();
                self.state = ModeState::Following(Running {
                    id,
                    start_ns,
                    motion,
                });
                emit(out, ControlEvent::Started { id, start_ns });
            }
            Err(fault) => {
                let id = Some(id);
                emit(out, ControlEvent::Refused { id, fault });
                give_back(out, motion);
            }
        }
    }

    /// Whether a motion may begin now; its mode and the operating mode it runs under.
    fn admit(
        &self,
        motion: &Motion,
        input: &CycleInput,
    ) -> Result<(ControllerMode, OperatingMode), FaultCode> {
        let trigger = match motion {
            Motion::Spline(_) => Trigger::StreamBegun,
            Motion::Move { .. } => Trigger::MoveBegun,
        };
        let mode = next_mode(self.mode(), trigger).ok_or(FaultCode::WrongMode)?;
        let off = motion.start().zip_with(self.commanded.q, |a, b| a - b);
        if !off.is_finite() || off.max_abs() > START_TOLERANCE_RAD {
            return Err(FaultCode::StartPoseMismatch);
        }
        if let Some(fault) = self.monitor.refusal(input.deadline_ns) {
            return Err(fault);
        }
        if self.monitor.tracking_error_rad() > START_DEVIATION_MAX_RAD {
            return Err(FaultCode::StartPoseMismatch);
        }
        if input.operator.released != 0 {
            return Err(FaultCode::DeadManReleased);
        }
        let operating_mode = if self.settings.arming_required {
            self.arming.admit(input.deadline_ns)?
        } else {
            OperatingMode::Throw
        };
        Ok((mode, operating_mode))
    }
}
