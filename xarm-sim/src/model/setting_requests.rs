//! Requests that change state, mode or configuration.

use super::*;
use rt_controller::xarm::StateRequest;

impl ArmModel {
    /// Commands that change state, mode or configuration.
    pub(super) fn change_setting(&mut self, command: &Command) -> ReplyData {
        match command {
            Command::SetState(state) => self.set_state(*state),
            Command::SetMode(mode) => {
                self.mode = *mode;
                self.system_reset();
            }
            Command::MotionEnable { joint, enable } => {
                let bits = joint_bits(*joint);
                set_bits(&mut self.enabled, bits, *enable);
                set_bits(&mut self.brakes_released, bits, *enable);
                self.system_reset();
            }
            Command::Brake { joint, release } => {
                set_bits(&mut self.brakes_released, joint_bits(*joint), *release);
                self.system_reset();
            }
            Command::CleanError => {
                self.clear_error();
                self.system_reset();
            }
            Command::CleanWarning => self.warning = 0,
            Command::JointJerk(value) => {
                self.settings.joint_jerk_rad_s3 = *value;
                return ReplyData::Buffered(self.buffered());
            }
            Command::JointAcceleration(value) => {
                self.settings.joint_acceleration_rad_s2 =
                    value.min(self.config.limits.acceleration_max_rad_s2[0]);
                return ReplyData::Buffered(self.buffered());
            }
            Command::TcpOffset(offset) => {
                self.settings.tcp_offset = *offset;
                self.system_reset();
            }
            Command::TcpLoad { mass_kg, centre_m } => {
                self.settings.load_kg = *mass_kg;
                self.settings.load_centre_m = *centre_m;
            }
            Command::CollisionSensitivity(level) => {
                self.settings.collision_sensitivity = *level;
                self.system_reset();
            }
            Command::TeachSensitivity(level) => {
                self.settings.teach_sensitivity = *level;
                self.system_reset();
            }
            Command::SetSpeedLimitFactor(factor) => self.settings.speed_limit_factor = *factor,
            _ => {}
        }
        ReplyData::None
    }

    /// Clears the error, unless its cause is still there.
    fn clear_error(&mut self) {
        let broken = (0..JOINTS).find(|j| self.servo_error[*j] != 0);
        self.error = match broken.and_then(|j| u8::try_from(j).ok()) {
            _ if !self.pressed.is_none() => self.pressed,
            Some(joint) => ErrorCode(11 + joint),
            None => ErrorCode::NONE,
        };
    }

    fn set_state(&mut self, state: StateRequest) {
        match state {
            StateRequest::Ready => {
                self.clear_error();
                if self.error.is_none() {
                    self.phase = ArmState::Ready;
                }
            }
            StateRequest::Pause => {
                if self.phase == ArmState::Ready {
                    self.servo.reset();
                    self.brake();
                    self.phase = ArmState::Paused;
                }
            }
            StateRequest::Stop => {
                self.drop_motion();
                self.phase = ArmState::Stopped;
            }
            StateRequest::DeceleratedStop => {
                self.drop_motion();
                if self.phase == ArmState::Ready || self.phase == ArmState::Paused {
                    self.phase = ArmState::Stopping;
                }
            }
        }
    }
}

/// Bits of joint 1 to 7, or of all for any other number.
fn joint_bits(joint: u8) -> u8 {
    match joint {
        1..=7 => 1 << (joint - 1),
        _ => ALL_JOINTS,
    }
}

fn set_bits(field: &mut u8, bits: u8, on: bool) {
    if on {
        *field |= bits;
    } else {
        *field &= !bits;
    }
}
