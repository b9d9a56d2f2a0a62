//! The controller as a pure state machine: requests and time in, replies and
//! joint motion out. No socket, no clock.
//!
//! Sequences follow the vendor's manual: a change of mode or configuration
//! ("system reset") drops all motion and leaves state 5 until the state is set
//! to ready; any error stops the arm, leads to state 4 and mode 0.

use super::config::ArmConfig;
use super::history::JointSample;
use super::joint::JointDynamics;
use super::reference::{Move, Reference};
use super::servo::{ServoStream, SetpointLimits};
use rt_controller::xarm::{
    ArmState, Command, CommandError, ErrorCode, Mode, Register, ReplyData, Status, TcpPose,
};
use shared_types::{JOINTS, JointState, JointVector, Limits, MonotonicNs};
use std::collections::VecDeque;

mod requests;

/// Step of the model (s, ns).
pub const STEP_S: f64 = 1e-3;
const STEP_NS: u64 = 1_000_000;
/// All seven joints, one bit each.
const ALL_JOINTS: u8 = 0x7F;
/// Moves the buffer holds; more raise warning 11.
const BUFFER_CAPACITY: usize = 2048;
/// Joint speed under which the arm counts as standing (rad/s).
const STANDING_RAD_S: f64 = 2e-3;

/// Warning codes of the controller.
mod warning {
    pub(super) const QUEUE_FULL: u8 = 11;
    pub(super) const BAD_PARAMETER: u8 = 12;
    pub(super) const UNKNOWN_COMMAND: u8 = 13;
}

/// Reply to a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Status byte.
    pub status: Status,
    /// Data.
    pub data: ReplyData,
}

/// What the controller allows, apart from errors and enabling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Ready,
    Paused,
    Decelerating,
    Stopped,
    NeedsReset,
}

/// Configuration that clients may change.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settings {
    pub(super) tcp_offset: TcpPose,
    pub(super) load_kg: f64,
    pub(super) load_centre_m: [f64; 3],
    pub(super) collision_sensitivity: u8,
    pub(super) teach_sensitivity: u8,
    pub(super) joint_jerk_rad_s3: f64,
    pub(super) joint_acceleration_rad_s2: f64,
    pub(super) speed_limit_factor: f64,
}

/// A simulated xArm 7 controller with its joints.
#[derive(Debug, Clone)]
pub struct ArmModel {
    config: ArmConfig,
    time: MonotonicNs,
    joints: [JointDynamics; JOINTS],
    pub(super) reference: Reference,
    servo: ServoStream,
    moves: VecDeque<Move>,
    phase: Phase,
    pub(super) mode: Mode,
    pub(super) error: ErrorCode,
    pub(super) warning: u8,
    /// Bit `i`: joint `i + 1` is enabled.
    pub(super) enabled: u8,
    /// Bit `i`: the brake of joint `i + 1` is released.
    pub(super) brakes_released: u8,
    pub(super) settings: Settings,
}

impl ArmModel {
    /// An arm just switched on at `start`: stopped, drives off.
    #[must_use]
    pub fn new(config: ArmConfig, start: MonotonicNs) -> Self {
        let limits = &config.limits;
        let settings = Settings {
            tcp_offset: TcpPose {
                position_m: limits.tcp_offset_m,
                rpy_rad: [0.0; 3],
            },
            load_kg: 0.0,
            load_centre_m: [0.0; 3],
            collision_sensitivity: 3,
            teach_sensitivity: 3,
            joint_jerk_rad_s3: 20.0,
            joint_acceleration_rad_s2: limits.acceleration_max_rad_s2[0],
            speed_limit_factor: config.speed_limit_factor,
        };
        Self {
            time: start,
            joints: config.joints(),
            reference: Reference::at_rest(config.initial_q),
            servo: ServoStream::default(),
            moves: VecDeque::new(),
            phase: Phase::Stopped,
            mode: Mode::Position,
            error: ErrorCode::NONE,
            warning: 0,
            enabled: 0,
            brakes_released: 0,
            settings,
            config,
        }
    }

    /// Time of the last step.
    #[must_use]
    pub fn time(&self) -> MonotonicNs {
        self.time
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

    /// Joint motion as the encoders tell it: positions in encoder steps.
    #[must_use]
    pub fn measured_motion(&self) -> JointState {
        let step = self.config.encoder_resolution_rad;
        let truth = self.true_motion();
        JointState {
            q: truth.q.map(|q| (q / step).round() * step),
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

    pub(super) fn limits(&self) -> &Limits {
        &self.config.limits
    }

    /// State as register 13 and the reports give it.
    #[must_use]
    pub fn state(&self) -> ArmState {
        match self.phase {
            Phase::Ready if self.is_moving() => ArmState::Moving,
            Phase::Ready => ArmState::Ready,
            Phase::Paused => ArmState::Paused,
            Phase::Decelerating => ArmState::Stopping,
            Phase::Stopped => ArmState::Stopped,
            Phase::NeedsReset => ArmState::NeedsReset,
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
        self.phase == Phase::Ready && self.error.is_none() && self.enabled == ALL_JOINTS
    }

    fn status(&self) -> Status {
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

    /// Runs whole steps up to `now` and gives the motion after each.
    pub fn advance_to(&mut self, now: MonotonicNs, mut each: impl FnMut(JointSample)) {
        while self.time.0 + STEP_NS <= now.0 {
            self.step();
            each(JointSample {
                at: self.time,
                state: self.true_motion(),
            });
        }
    }

    /// One step of 1 ms.
    pub fn step(&mut self) {
        let end = MonotonicNs(self.time.0 + STEP_NS);
        if self.mode == Mode::Servo {
            self.run_stream(end);
        } else {
            self.start_next_move();
        }
        let before = self.reference.q;
        self.reference.advance(end, STEP_S, &self.config.limits);
        if self.reference.q != before {
            self.guard_reference(before);
            self.drive_joints(end);
        }
        if self.phase == Phase::Decelerating && !self.is_moving() {
            self.phase = Phase::Stopped;
        }
        for joint in &mut self.joints {
            joint.advance(self.time, end);
        }
        self.time = end;
    }

    /// Executes the streamed setpoint that is due, holds when none comes.
    fn run_stream(&mut self, end: MonotonicNs) {
        if !self.can_move() {
            return;
        }
        if let Some(setpoint) = self.servo.take(end) {
            self.reference.jump(setpoint.q, setpoint.qd);
            self.drive_joints(setpoint.at);
        } else if self.servo.is_silent(end) && !self.reference.is_busy() {
            self.reference.hold();
        }
    }

    fn start_next_move(&mut self) {
        if !self.can_move() || self.mode != Mode::Position || self.reference.is_busy() {
            return;
        }
        match self.moves.front() {
            Some(next) if (next.target - self.reference.q).max_abs() > 1e-6 => {
                self.reference.start_move(next);
            }
            // The move at the front has arrived.
            Some(_) => {
                self.moves.pop_front();
            }
            None => {}
        }
    }

    /// A velocity command that would leave the joint range stops with C23.
    fn guard_reference(&mut self, before: JointVector) {
        if self.mode == Mode::JointVelocity
            && self.phase == Phase::Ready
            && self
                .config
                .limits
                .position_violation(&self.reference.q)
                .is_some()
        {
            self.reference.jump(before, JointVector::ZERO);
            self.raise(ErrorCode::JOINT_LIMIT);
        }
    }

    fn drive_joints(&mut self, at: MonotonicNs) {
        for (joint, q) in self.joints.iter_mut().zip(self.reference.q.iter()) {
            joint.command(at, *q);
        }
    }

    /// Raises an error: the arm brakes, drops its buffer and goes to state 4 and
    /// mode 0.
    pub fn raise(&mut self, error: ErrorCode) {
        self.error = error;
        self.drop_motion();
        self.phase = Phase::Stopped;
        self.mode = Mode::Position;
    }

    /// Brakes at the joints' largest acceleration and forgets what was planned.
    fn drop_motion(&mut self) {
        self.moves.clear();
        self.servo.reset();
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
            Phase::NeedsReset
        } else {
            Phase::Stopped
        };
    }

    fn setpoint_limits(&self) -> SetpointLimits<'_> {
        SetpointLimits {
            joints: &self.config.limits,
            tcp_offset: self.settings.tcp_offset.position(),
            tcp_speed_max_m_s: self.settings.speed_limit_factor,
        }
    }
}

#[cfg(test)]
mod tests;
