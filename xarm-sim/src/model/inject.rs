//! Ways to make the arm misbehave.

use super::{ArmModel, CURRENT_SPIKE_S};
use crate::event::ArmEvent;
use crate::fault::FaultKind;
use arm_model::JOINTS;
use rt_controller::xarm::{ArmState, ErrorCode, Mode};
use shared_types::MonotonicNs;

impl ArmModel {
    /// Does to the arm itself what a fault does when it begins and when it ends.
    pub(crate) fn change(&mut self, at: MonotonicNs, kind: &FaultKind, begins: bool) {
        // What lasts is set when it begins and undone when it ends.
        let or_zero = |value: f64| if begins { value } else { 0.0 };
        // Joints are numbered from 1.
        let index = |joint: u8| usize::from(joint).wrapping_sub(1);
        match *kind {
            FaultKind::Warning { code } => self.warn(code),
            FaultKind::RaiseError { code } => self.raise(ErrorCode(code)),
            // Clearing does not help until the drives are mended or power was off.
            FaultKind::ServoError { joint, code } if begins => {
                if let Some(error) = self.servo_error.get_mut(index(joint)) {
                    *error = code;
                }
                // C11 to C17 are the drives of joint 1 to 7.
                self.raise(ErrorCode(10_u8.saturating_add(joint)));
            }
            FaultKind::ServoError { .. } => self.servo_error = [0; JOINTS],
            // Clearing its error does not help until it is released; then the error stays.
            FaultKind::EmergencyStop { code } if begins => {
                self.pressed = ErrorCode(code);
                self.raise(self.pressed);
            }
            FaultKind::EmergencyStop { .. } => self.pressed = ErrorCode::NONE,
            FaultKind::Collision => self.collide(),
            FaultKind::StateChanged { state } => {
                self.drop_motion();
                self.phase = match ArmState::from_code(state) {
                    ArmState::Moving => ArmState::Ready,
                    ArmState::Other(_) => ArmState::Stopped,
                    phase => phase,
                };
            }
            FaultKind::ModeChanged { mode } => {
                self.mode = Mode::from_code(mode);
                self.system_reset();
            }
            FaultKind::PowerCycle if begins => {
                self.drop_motion();
                self.phase = ArmState::Stopped;
                self.enabled = 0;
                self.brakes_released = 0;
            }
            FaultKind::PowerCycle => self.switch_on(at),
            FaultKind::FirmwareChanged { version } => self.config.firmware = version,
            FaultKind::ReportTimeJump { by_s } => self.clock.jump(by_s),
            FaultKind::ReportTimeWrap => self.clock.restart(at),
            FaultKind::ReportTimeDrift { ppm } => self.clock.set_stamp_rate(at, or_zero(ppm)),
            FaultKind::ClockRate { ppm } => {
                let own_ppm = self.config.clock_ppm;
                self.clock.set_rate(at, if begins { ppm } else { own_ppm });
            }
            FaultKind::TrackingLag { lag_s } => {
                for joint in &mut self.joints {
                    joint.extra_lag_s = or_zero(lag_s);
                }
            }
            FaultKind::JointStuck { joint } => {
                if let Some(joint) = self.joints.get_mut(index(joint)) {
                    joint.stuck = begins;
                }
            }
            FaultKind::EncoderJump { joint, by_rad } => {
                let sign = if begins { 1.0 } else { -1.0 };
                if let Some(offset) = self.encoder_offset.0.get_mut(index(joint)) {
                    *offset += sign * by_rad;
                }
            }
            _ => {}
        }
    }

    /// Raises an error: the arm brakes, drops its buffer and goes to state 4 and
    /// mode 0.
    pub(super) fn raise(&mut self, error: ErrorCode) {
        self.error = error;
        self.log(ArmEvent::Error(error));
        self.drop_motion();
        self.phase = ArmState::Stopped;
        self.mode = Mode::Position;
    }

    /// Sets a warning.
    pub(super) fn warn(&mut self, code: u8) {
        self.warning = code;
        self.log(ArmEvent::Warning(code));
    }

    /// Hits something: current rises, and with detection on there is C31.
    pub(super) fn collide(&mut self) {
        self.spike_until = self.time.plus_s(CURRENT_SPIKE_S);
        if self.settings.collision_sensitivity > 0 {
            self.raise(ErrorCode::COLLISION);
        }
    }

    /// Power comes: as after a start, with the saved configuration.
    fn switch_on(&mut self, at: MonotonicNs) {
        self.mode = Mode::Position;
        self.error = ErrorCode::NONE;
        self.warning = 0;
        self.settings = self.saved;
        self.servo_error = [0; JOINTS];
        self.clock.restart(at);
    }
}
