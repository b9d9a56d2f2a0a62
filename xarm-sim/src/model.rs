//! The controller as a pure state machine: requests and time in, replies and
//! joint motion out. No socket, no clock.
//!
//! Sequences follow the vendor's manual: a change of mode or configuration
//! ("system reset") drops all motion and leaves state 5 until the state is set
//! to ready; any error stops the arm, leads to state 4 and mode 0.

use super::collision::obstacle_depth_m;
use super::config::ArmConfig;
use super::controller_clock::ControllerClock;
use super::event::{ArmCounters, ArmEvent, TimedEvent};
use super::feedback::{Feedback, FeedbackKind};
use super::history::JointSample;
use super::joint::JointDynamics;
use super::pacer::Pacer;
use super::reference::{Move, Reference, Task};
use super::servo::ServoStream;
use super::setpoint_check::SetpointLimits;
use arm_model::{JOINTS, JointState, JointVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::xarm::{
    ArmState, Command, CommandError, ErrorCode, Mode, Register, ReplyData, Status, TcpPose,
};
use shared_types::MonotonicNs;
use std::collections::VecDeque;

mod effort;
mod inject;
mod motion_requests;
mod requests;
mod setting_requests;
mod settings;
mod step;

pub use requests::{Answer, AnswerData};
pub(super) use settings::Settings;

/// Step of the model (s, ns).
pub const STEP_S: f64 = 1e-3;
const STEP_NS: u64 = 1_000_000;
/// All seven joints, one bit each.
const ALL_JOINTS: u8 = 0x7F;
/// Moves the buffer holds; more raise warning 11.
const BUFFER_CAPACITY: usize = 2048;
/// Joint speed under which the arm counts as standing (rad/s).
const STANDING_RAD_S: f64 = 2e-3;
/// Tool speed limit in servo mode before firmware 2.3 (m/s).
const OLD_TCP_SPEED_M_S: f64 = 1.0;
/// How long a collision shows in the motor currents (s).
const CURRENT_SPIKE_S: f64 = 0.05;
/// A contact that deepens by this much is a new collision (m).
const CONTACT_STEP_M: f64 = 1e-4;

/// Warning codes of the controller.
mod warning {
    pub(super) const QUEUE_FULL: u8 = 11;
    pub(super) const BAD_PARAMETER: u8 = 12;
    pub(super) const UNKNOWN_COMMAND: u8 = 13;
}

/// A velocity command.
#[derive(Debug, Clone, Copy, Default)]
struct VelocityCommand {
    qd: JointVector,
    synchronised: bool,
    duration_s: Option<f64>,
}

/// A simulated xArm 7 controller with its joints.
#[derive(Debug, Clone)]
pub struct ArmModel {
    config: ArmConfig,
    clock: ControllerClock,
    time: MonotonicNs,
    /// When the newest request arrived.
    arrived: MonotonicNs,
    joints: [JointDynamics; JOINTS],
    /// What the encoders show too much (rad).
    encoder_offset: JointVector,
    pub(super) reference: Reference,
    servo: ServoStream,
    velocity: Pacer<VelocityCommand>,
    moves: VecDeque<Move>,
    /// Tasks given out to moves so far.
    tasks: u16,
    /// What the controller allows, apart from errors and enabling; never `Moving`.
    phase: ArmState,
    pub(super) mode: Mode,
    pub(super) error: ErrorCode,
    pub(super) warning: u8,
    /// Bit `i`: joint `i + 1` is enabled.
    pub(super) enabled: u8,
    /// Bit `i`: the brake of joint `i + 1` is released.
    pub(super) brakes_released: u8,
    pub(super) settings: Settings,
    /// What a power cycle brings back.
    saved: Settings,
    /// Code of the emergency stop that is pressed.
    pressed: ErrorCode,
    /// S code of each drive.
    pub(super) servo_error: [u8; JOINTS],
    /// Until when motor currents show a collision.
    spike_until: MonotonicNs,
    /// How deep the arm has got into an obstacle (m).
    contact_m: f64,
    counters: ArmCounters,
    /// Client and transaction id of the request being executed.
    origin: Option<(u32, u16)>,
    reported: (ArmState, Mode),
    events: Vec<TimedEvent>,
    feedback: Vec<Feedback>,
}

impl ArmModel {
    /// An arm just switched on at `start`: stopped, drives off.
    #[must_use]
    pub fn new(config: ArmConfig, start: MonotonicNs) -> Self {
        let settings = Settings::factory(&config);
        Self {
            clock: ControllerClock::new(start, config.uptime_s, config.clock_ppm),
            time: start,
            arrived: start,
            joints: config.joints(),
            encoder_offset: JointVector::ZERO,
            reference: Reference::at_rest(config.initial_q),
            servo: ServoStream::default(),
            velocity: Pacer::default(),
            moves: VecDeque::new(),
            tasks: 0,
            phase: ArmState::Stopped,
            mode: Mode::Position,
            error: ErrorCode::NONE,
            warning: 0,
            enabled: 0,
            brakes_released: 0,
            settings,
            saved: settings,
            pressed: ErrorCode::NONE,
            servo_error: [0; JOINTS],
            spike_until: start,
            contact_m: 0.0,
            counters: ArmCounters::default(),
            origin: None,
            reported: (ArmState::Stopped, Mode::Position),
            events: Vec::new(),
            feedback: Vec::new(),
            config,
        }
    }

    /// Time of the last step.
    #[must_use]
    pub fn time(&self) -> MonotonicNs {
        self.time
    }

    /// Reading of the controller's own clock (µs).
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.clock.time_us(self.time)
    }

    /// The controller's own clock.
    #[must_use]
    pub fn clock(&self) -> &ControllerClock {
        &self.clock
    }

    /// Counts since the arm was made.
    #[must_use]
    pub fn counters(&self) -> ArmCounters {
        ArmCounters {
            dropped: self.servo.pacer.dropped + self.velocity.dropped,
            repeated: self.servo.pacer.repeated + self.velocity.repeated,
            ..self.counters
        }
    }

    /// What has happened since the last call.
    pub fn take_events(&mut self) -> Vec<TimedEvent> {
        core::mem::take(&mut self.events)
    }

    pub(super) fn take_feedback(&mut self) -> Vec<Feedback> {
        core::mem::take(&mut self.feedback)
    }

    pub(super) fn log(&mut self, event: ArmEvent) {
        self.events.push(TimedEvent {
            at: self.time.max(self.arrived),
            client: self.origin.map(|(client, _)| client),
            event,
        });
    }

    /// Set-up, with the present firmware.
    #[must_use]
    pub fn config(&self) -> &ArmConfig {
        &self.config
    }

    /// True joint motion at [`time`](Self::time).
    #[must_use]
    pub fn true_motion(&self) -> JointState {
        let all = |f: fn(&JointDynamics) -> f64| {
            JointVector(core::array::from_fn(|i| f(&self.joints[i])))
        };
        JointState {
            q: all(|j| j.q),
            qd: all(|j| j.qd),
            qdd: all(|j| j.qdd),
        }
    }

    /// Joint motion as the encoders tell it: positions in encoder steps, with their noise.
    #[must_use]
    pub fn measured_motion(&self) -> JointState {
        let (step, noise) = (
            self.config.encoder_resolution_rad,
            self.config.encoder_noise_rad,
        );
        let truth = self.true_motion();
        let mut seen = truth.q + self.encoder_offset;
        if noise > 0.0 {
            // The same whoever asks at this time.
            let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed ^ self.time.0);
            for j in 0..JOINTS {
                // Twelve uniform parts are as good as a normal one of variance 1.
                let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum();
                seen[j] += noise * (normal - 6.0);
            }
        }
        JointState {
            q: seen.map(|q| (q / step).round() * step),
            ..truth
        }
    }

    /// What is asked of the joints at [`time`](Self::time).
    #[must_use]
    pub fn reference_motion(&self) -> JointState {
        JointState {
            q: self.reference.q,
            qd: self.reference.qd,
            qdd: self.reference.qdd,
        }
    }

    /// State as register 13 and the reports give it.
    #[must_use]
    pub fn state(&self) -> ArmState {
        match self.phase {
            ArmState::Ready if self.is_moving() => ArmState::Moving,
            phase => phase,
        }
    }

    fn is_moving(&self) -> bool {
        self.reference.is_busy()
            || !self.moves.is_empty()
            || self.true_motion().qd.max_abs() > STANDING_RAD_S
    }

    /// Commands in the buffer, the one being executed included.
    pub(super) fn buffered(&self) -> u16 {
        u16::try_from(self.moves.len()).unwrap_or(u16::MAX)
    }

    fn can_move(&self) -> bool {
        self.phase == ArmState::Ready && self.error.is_none() && self.enabled == ALL_JOINTS
    }

    pub(super) fn status(&self) -> Status {
        let mut bits = 0;
        if !self.can_move() {
            bits |= Status::NOT_READY;
        }
        if self.warning != 0 {
            bits |= Status::WARNING;
        }
        if !self.error.is_none() {
            bits |= Status::ERROR;
        }
        Status(bits)
    }

    /// Brakes at the joints' largest acceleration and forgets what was planned.
    fn drop_motion(&mut self) {
        for unfinished in core::mem::take(&mut self.moves) {
            self.tell_task(unfinished.task, FeedbackKind::Discarded);
        }
        self.servo.reset();
        self.velocity.clear();
        self.brake();
    }

    fn brake(&mut self) {
        self.reference
            .brake(self.config.limits.acceleration_max_rad_s2[0]);
    }

    /// What a change of mode or configuration does.
    fn system_reset(&mut self) {
        self.drop_motion();
        self.phase = if self.error.is_none() {
            ArmState::NeedsReset
        } else {
            ArmState::Stopped
        };
    }

    fn setpoint_limits(&self) -> SetpointLimits<'_> {
        let has_factor = self.config.firmware.has_speed_factor();
        SetpointLimits {
            joints: &self.config.limits,
            tcp_offset: self.settings.tcp_offset.position(),
            tcp_speed_max_m_s: if has_factor {
                self.settings.speed_limit_factor
            } else {
                OLD_TCP_SPEED_M_S
            },
            tcp_speed_code: if has_factor {
                ErrorCode::TCP_SPEED_LIMIT
            } else {
                ErrorCode::SPEED_LIMIT
            },
            self_collision: self.settings.self_collision,
            fence_m: self.settings.fence_m(),
        }
    }
}

#[cfg(test)]
mod tests;
