//! What each request does to the controller.

use super::*;
use rt_controller::xarm::reply::Text;
use rt_controller::xarm::{JointQuery, StateRequest};
use shared_types::kinematics;

/// Version text of a real arm: 7 axes, type 7, 1305 arm, firmware 2.7.1.
const VERSION: &str = "7,7,XS1305,AC1304,v2.7.1";
/// Serial numbers of arm and control box, a NUL between them.
const SERIAL_NUMBERS: &str = "XS130500000000\0AC130400000000";
/// Speed and acceleration of a move that names none (SDK defaults: 20 deg/s,
/// 500 deg/s²).
const DEFAULT_MOVE_SPEED_RAD_S: f64 = 0.349_066;
const DEFAULT_MOVE_ACCELERATION_RAD_S2: f64 = 8.726_646;

impl ArmModel {
    /// Takes a request as it came from the wire at `at` and gives the reply.
    pub fn request(&mut self, at: MonotonicNs, register: u8, parameters: &[u8]) -> Answer {
        match Command::parse(register, parameters) {
            Ok(command) => self.command(at, &command),
            Err(error) => self.refuse(&error),
        }
    }

    /// Settings without an effect on the simulation are accepted; anything else
    /// that is not understood sets a warning and marks the reply as invalid.
    fn refuse(&mut self, error: &CommandError) -> Answer {
        match error {
            CommandError::Untyped(register) if is_harmless_setting(*register) => {
                return self.answer(ReplyData::None);
            }
            CommandError::Untyped(_) | CommandError::UnknownRegister(_) => {
                self.warning = warning::UNKNOWN_COMMAND;
            }
            CommandError::TooShort { .. } | CommandError::BadValue(_) => {
                self.warning = warning::BAD_PARAMETER;
            }
        }
        let mut answer = self.answer(ReplyData::None);
        answer.status.0 |= Status::INVALID;
        answer
    }

    /// Executes a command that arrived at `at`.
    pub fn command(&mut self, at: MonotonicNs, command: &Command) -> Answer {
        let data = self
            .answer_query(command)
            .or_else(|| self.run_motion(at, command))
            .unwrap_or_else(|| self.change_setting(command));
        self.answer(data)
    }

    fn answer(&self, data: ReplyData) -> Answer {
        Answer {
            status: self.status(),
            data,
        }
    }

    /// Commands that only read.
    fn answer_query(&mut self, command: &Command) -> Option<ReplyData> {
        Some(match command {
            Command::Version => ReplyData::Text(Text::new(VERSION)),
            Command::SerialNumbers => ReplyData::Text(Text::new(SERIAL_NUMBERS)),
            Command::GetState => ReplyData::State(self.state()),
            Command::Buffered => ReplyData::Buffered(self.buffered()),
            Command::GetFault => ReplyData::Fault {
                error: self.error.0,
                warning: self.warning,
            },
            Command::TcpPose => ReplyData::Pose(self.tcp_pose(&self.measured_motion().q)),
            Command::JointPosition(JointQuery::Commanded) => ReplyData::Joints(self.reference.q),
            Command::JointPosition(JointQuery::Quantities {
                quantities,
                targets,
            }) => {
                let measured = self.measured_motion();
                let (position, velocity) = if *targets {
                    (self.reference.q, self.reference.qd)
                } else {
                    (measured.q, measured.qd)
                };
                ReplyData::JointMotion {
                    quantities: *quantities,
                    position,
                    velocity,
                    effort: JointVector::ZERO,
                }
            }
            Command::ForwardKinematics(q) => ReplyData::Pose(self.tcp_pose(q)),
            Command::JointLimitTest(q) => {
                ReplyData::OutsideLimits(self.config.limits.position_violation(q).is_some())
            }
            Command::GetSpeedLimitFactor => {
                ReplyData::SpeedLimitFactor(self.settings.speed_limit_factor)
            }
            _ => return None,
        })
    }

    /// Commands that move the arm; without effect while it cannot move.
    fn run_motion(&mut self, at: MonotonicNs, command: &Command) -> Option<ReplyData> {
        Some(match command {
            Command::ServoJoint(q) => {
                if self.can_move() && self.mode == Mode::Servo {
                    self.stream(at, *q);
                }
                ReplyData::None
            }
            Command::JointVelocity {
                velocity,
                duration_s,
                ..
            } => {
                if self.can_move() && self.mode == Mode::JointVelocity {
                    self.start_velocity(at, velocity, *duration_s);
                }
                ReplyData::None
            }
            Command::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => self.queue_move(target, *speed_rad_s, *acceleration_rad_s2, *checked),
            Command::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => self.queue_move(
                &JointVector::ZERO,
                *speed_rad_s,
                *acceleration_rad_s2,
                *checked,
            ),
            _ => return None,
        })
    }

    /// A streamed setpoint: checked on arrival, taken at once unless that would
    /// exceed 250 Hz, then by a later step.
    fn stream(&mut self, at: MonotonicNs, q: JointVector) {
        let at = at.max(self.time);
        let present = self.reference.q;
        let mut servo = std::mem::take(&mut self.servo);
        let verdict = servo.offer(at, q, present, &self.setpoint_limits());
        self.servo = servo;
        match verdict {
            Ok(()) => self.run_stream(at),
            Err(error) => self.raise(error),
        }
    }

    fn start_velocity(&mut self, at: MonotonicNs, velocity: &JointVector, duration_s: Option<f64>) {
        let limits = &self.config.limits.velocity_max_rad_s;
        if (0..JOINTS).any(|j| velocity[j].abs() > limits[j]) {
            return self.raise(ErrorCode::SPEED_LIMIT);
        }
        // A duration of zero, like none, means without end.
        let until = duration_s.filter(|s| *s > 0.0).map(|s| at.plus_s(s));
        self.reference.start_velocity(*velocity, until);
    }

    fn queue_move(
        &mut self,
        target: &JointVector,
        speed_rad_s: f64,
        acceleration_rad_s2: f64,
        checked: Option<u8>,
    ) -> ReplyData {
        let outside = self.config.limits.position_violation(target).is_some();
        let only_check = checked.is_some_and(|kind| kind > 0);
        if self.can_move() && self.mode == Mode::Position && !only_check {
            if outside {
                self.raise(ErrorCode::JOINT_LIMIT);
            } else if self.moves.len() >= BUFFER_CAPACITY {
                self.warning = warning::QUEUE_FULL;
            } else {
                let limits = &self.config.limits;
                let or_default = |value: f64, default: f64, max: f64| {
                    if value > 0.0 { value } else { default }.min(max)
                };
                self.moves.push_back(Move {
                    target: *target,
                    speed_rad_s: or_default(
                        speed_rad_s,
                        DEFAULT_MOVE_SPEED_RAD_S,
                        limits.velocity_max_rad_s[0],
                    ),
                    acceleration_rad_s2: or_default(
                        acceleration_rad_s2,
                        DEFAULT_MOVE_ACCELERATION_RAD_S2,
                        self.settings.joint_acceleration_rad_s2,
                    ),
                });
            }
        }
        let buffered = self.buffered();
        match checked {
            Some(_) => ReplyData::CheckedMove {
                buffered,
                result: u8::from(outside),
            },
            None => ReplyData::Buffered(buffered),
        }
    }

    /// Commands that change state, mode or configuration.
    fn change_setting(&mut self, command: &Command) -> ReplyData {
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
                self.error = ErrorCode::NONE;
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

    fn set_state(&mut self, state: StateRequest) {
        match state {
            StateRequest::Ready => {
                self.error = ErrorCode::NONE;
                self.phase = Phase::Ready;
            }
            StateRequest::Pause => {
                if self.phase == Phase::Ready {
                    self.servo.reset();
                    self.brake();
                    self.phase = Phase::Paused;
                }
            }
            StateRequest::Stop => {
                self.drop_motion();
                self.phase = Phase::Stopped;
            }
            StateRequest::DeceleratedStop => {
                self.drop_motion();
                if self.phase == Phase::Ready || self.phase == Phase::Paused {
                    self.phase = Phase::Decelerating;
                }
            }
        }
    }

    /// Pose of the tool centre point at joint angles `q` (rad).
    pub(in crate::arm) fn tcp_pose(&self, q: &JointVector) -> TcpPose {
        let (p, r) = kinematics::flange_pose(q);
        let offset = &self.settings.tcp_offset;
        TcpPose::from_frame(&(p + r * offset.position()), &(r * offset.attitude()))
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

/// Settings that a real arm takes and this one has no use for.
fn is_harmless_setting(register: Register) -> bool {
    matches!(
        register,
        Register::ReloadDynamics
            | Register::SystemControl
            | Register::TcpJerk
            | Register::TcpAcceleration
            | Register::ClearConfiguration
            | Register::SaveConfiguration
            | Register::GravityDirection
            | Register::ReducedTcpSpeed
            | Register::ReducedJointSpeed
            | Register::SetReducedMode
            | Register::SafetyBoundary
            | Register::ReducedJointRange
            | Register::Fence
            | Register::CollisionRebound
            | Register::ApproximateMotion
            | Register::ReportEffort
            | Register::SelfCollisionCheck
            | Register::ToolModel
            | Register::SimulationMode
            | Register::SetParameter
    )
}
