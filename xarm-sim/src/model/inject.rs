//! Ways to make the arm misbehave.

use super::{ALL_JOINTS, ArmModel, CURRENT_SPIKE_S, Phase};
use crate::event::ArmEvent;
use crate::firmware::Firmware;
use arm_model::JOINTS;
use rt_controller::xarm::{ArmState, ErrorCode, Mode};
use shared_types::MonotonicNs;

impl ArmModel {
    /// Raises an error: the arm brakes, drops its buffer and goes to state 4 and
    /// mode 0.
    pub fn raise(&mut self, error: ErrorCode) {
        self.error = error;
        self.log(ArmEvent::Error(error));
        self.drop_motion();
        self.phase = Phase::Stopped;
        self.mode = Mode::Position;
    }

    /// Presses an emergency stop; clearing its error does not help until it is
    /// released.
    pub fn press_stop(&mut self, code: ErrorCode) {
        self.pressed = code;
        self.raise(code);
    }

    /// Releases the emergency stop; its error stays.
    pub fn release_stop(&mut self) {
        self.pressed = ErrorCode::NONE;
    }

    /// A drive raises S code `code`; joints are numbered from 1. Clearing does
    /// not help until [`Self::mend_drives`] or [`Self::switch_on`].
    pub fn break_drive(&mut self, joint: u8, code: u8) {
        if let Some(error) = self.servo_error.get_mut(usize::from(joint).wrapping_sub(1)) {
            *error = code;
        }
        // C11 to C17 are the drives of joint 1 to 7.
        self.raise(ErrorCode(10_u8.saturating_add(joint)));
    }

    /// Drives work again; the error stays until it is cleared.
    pub fn mend_drives(&mut self) {
        self.servo_error = [0; JOINTS];
    }

    /// Sets a warning.
    pub fn warn(&mut self, code: u8) {
        self.warning = code;
        self.log(ArmEvent::Warning(code));
    }

    /// Hits something: current rises, and with detection on there is C31.
    pub fn collide(&mut self) {
        self.spike_until = self.time.plus_s(CURRENT_SPIKE_S);
        if self.settings.collision_sensitivity > 0 {
            self.raise(ErrorCode::COLLISION);
        }
    }

    /// Goes to a state by itself.
    pub fn change_state(&mut self, state: ArmState) {
        self.drop_motion();
        self.phase = match state {
            ArmState::Paused => Phase::Paused,
            ArmState::Stopping => Phase::Decelerating,
            ArmState::NeedsReset => Phase::NeedsReset,
            ArmState::Moving | ArmState::Ready => Phase::Ready,
            ArmState::Stopped | ArmState::Other(_) => Phase::Stopped,
        };
    }

    /// Goes to a mode by itself, as if somebody had set it.
    pub fn change_mode(&mut self, mode: Mode) {
        self.mode = mode;
        self.system_reset();
    }

    /// All joints follow `lag_s` later than they would.
    pub fn delay_joints(&mut self, lag_s: f64) {
        for joint in &mut self.joints {
            joint.extra_lag_s = lag_s;
        }
    }

    /// Holds or frees a joint, numbered from 1.
    pub fn hold_joint(&mut self, joint: u8, stuck: bool) {
        if let Some(joint) = self.joints.get_mut(usize::from(joint).wrapping_sub(1)) {
            joint.stuck = stuck;
        }
    }

    /// Moves the reading of an encoder, joints numbered from 1 (rad).
    pub fn shift_encoder(&mut self, joint: u8, by_rad: f64) {
        if (1..=ALL_JOINTS.count_ones()).contains(&u32::from(joint)) {
            self.encoder_offset[usize::from(joint) - 1] += by_rad;
        }
    }

    /// The controller's clock, to make it wrong.
    pub fn clock_mut(&mut self) -> &mut crate::ControllerClock {
        &mut self.clock
    }

    /// Another firmware.
    pub fn set_firmware(&mut self, firmware: Firmware) {
        self.config.firmware = firmware;
    }

    /// Power goes: drives off, brakes engaged.
    pub fn switch_off(&mut self) {
        self.drop_motion();
        self.phase = Phase::Stopped;
        self.enabled = 0;
        self.brakes_released = 0;
    }

    /// Power comes: as after a start, with the saved configuration.
    pub fn switch_on(&mut self, at: MonotonicNs) {
        self.mode = Mode::Position;
        self.error = ErrorCode::NONE;
        self.warning = 0;
        self.settings = self.saved;
        self.mend_drives();
        self.clock.restart(at);
    }
}
