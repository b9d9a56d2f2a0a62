//! What each request does to the controller.

use super::*;
use rt_controller::xarm::reply::Text;
use rt_controller::xarm::{JointQuery, StateRequest};
use shared_types::kinematics;

/// Version text of a real arm before its firmware: 7 axes, type 7, 1305 arm.
const MODEL: &str = "7,7,XS1305,AC1304,v";
/// Serial numbers of arm and control box, a NUL between them.
const SERIAL_NUMBERS: &str = "XS130500000000\0AC130400000000";
/// Speed and acceleration of a move that names none (SDK defaults: 20 deg/s,
/// 500 deg/s²).
const DEFAULT_MOVE_SPEED_RAD_S: f64 = 0.349_066;
const DEFAULT_MOVE_ACCELERATION_RAD_S2: f64 = 8.726_646;

impl ArmModel {
    /// Takes a request as it came from the wire at `at` and gives the reply.
    pub fn request(&mut self, at: MonotonicNs, register: u8, parameters: &[u8]) -> Answer {
        self.request_from(None, at, register, parameters)
    }

    /// The same for a request of a known client (its number, transaction id).
    pub(in crate::arm) fn request_from(
        &mut self,
        origin: Option<(u32, u16)>,
        at: MonotonicNs,
        register: u8,
        parameters: &[u8],
    ) -> Answer {
        self.origin = origin;
        let answer = match Command::parse(register, parameters) {
            Ok(command) if !self.knows(&command) => {
                self.refuse(&CommandError::UnknownRegister(register), parameters)
            }
            Ok(command) => self.command(at, &command),
            Err(error) => self.refuse(&error, parameters),
        };
        self.tell_state();
        self.origin = None;
        answer
    }

    /// A command of the client of number `client` outside any connection.
    pub(in crate::arm) fn command_from(&mut self, client: u32, at: MonotonicNs, command: &Command) {
        self.origin = Some((client, 0));
        self.command(at, command);
        self.tell_state();
        self.origin = None;
    }

    /// Whether a command to this register would be taken up as a setpoint or
    /// velocity now.
    pub(in crate::arm) fn takes_motion(&self, register: u8) -> bool {
        let mode = match Register::from_code(register) {
            Some(Register::ServoJoint) => Mode::Servo,
            Some(Register::JointVelocity) => Mode::JointVelocity,
            _ => return false,
        };
        self.can_move() && self.mode == mode
    }

    /// Whether the firmware has this command.
    fn knows(&self, command: &Command) -> bool {
        let firmware = self.config.firmware;
        match command {
            Command::JointPosition(JointQuery::Quantities { .. }) => firmware.has_joint_states(),
            Command::SetSpeedLimitFactor(_) | Command::GetSpeedLimitFactor => {
                firmware.has_speed_factor()
            }
            Command::FeedbackCheck | Command::FeedbackMask(_) => firmware.has_feedback(),
            _ => true,
        }
    }

    /// Registers without a typed command; what is not understood sets a warning
    /// and marks the reply as invalid.
    fn refuse(&mut self, error: &CommandError, parameters: &[u8]) -> Answer {
        let code = match error {
            CommandError::Untyped(register) => {
                self.counters.requests += 1;
                self.log(ArmEvent::Request {
                    register: register.code(),
                });
                if let Some(data) = self.raw(*register, parameters) {
                    return Answer {
                        status: self.status(),
                        data: AnswerData::Raw(data),
                    };
                }
                warning::UNKNOWN_COMMAND
            }
            CommandError::UnknownRegister(_) => warning::UNKNOWN_COMMAND,
            CommandError::TooShort { .. } | CommandError::BadValue(_) => warning::BAD_PARAMETER,
        };
        self.warn(code);
        let mut answer = self.answer(ReplyData::None);
        answer.status.0 |= Status::INVALID;
        answer
    }

    /// Executes a command that arrived at `at`.
    pub fn command(&mut self, at: MonotonicNs, command: &Command) -> Answer {
        if !matches!(
            command,
            Command::ServoJoint(_) | Command::JointVelocity { .. }
        ) {
            self.counters.requests += 1;
            self.log(ArmEvent::Request {
                register: command.register().code(),
            });
        }
        let data = self
            .answer_query(command)
            .or_else(|| self.run_motion(at, command))
            .unwrap_or_else(|| self.change_setting(command));
        self.answer(data)
    }

    fn answer(&self, data: ReplyData) -> Answer {
        Answer {
            status: self.status(),
            data: AnswerData::Typed(data),
        }
    }

    /// Commands that only read.
    fn answer_query(&mut self, command: &Command) -> Option<ReplyData> {
        Some(match command {
            Command::Version => {
                ReplyData::Text(Text::new(&format!("{MODEL}{}", self.config.firmware)))
            }
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
                    effort: self.effort_nm(),
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
                } else {
                    self.ignore(command);
                }
                ReplyData::None
            }
            Command::JointVelocity {
                velocity,
                synchronised,
                duration_s,
            } => {
                if self.can_move() && self.mode == Mode::JointVelocity {
                    let known = self.config.firmware.has_velocity_duration();
                    let wish = VelocityCommand {
                        qd: *velocity,
                        synchronised: *synchronised,
                        duration_s: duration_s.filter(|_| known),
                    };
                    self.take_velocity(at, wish);
                } else {
                    self.ignore(command);
                }
                ReplyData::None
            }
            Command::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => {
                let speeds = [*speed_rad_s, *acceleration_rad_s2];
                self.queue_move(command.register(), target, speeds, *checked)
            }
            Command::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => {
                let speeds = [*speed_rad_s, *acceleration_rad_s2];
                self.queue_move(command.register(), &JointVector::ZERO, speeds, *checked)
            }
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
            Ok(()) => {
                self.counters.motion_commands += 1;
                self.log(ArmEvent::Setpoint(q));
                self.run_stream(at);
            }
            Err(error) => self.raise(error),
        }
    }

    /// A motion command that cannot be executed now is answered, no more.
    fn ignore(&mut self, command: &Command) {
        self.counters.ignored += 1;
        self.log(ArmEvent::Ignored {
            register: command.register().code(),
        });
    }

    fn take_velocity(&mut self, at: MonotonicNs, wish: VelocityCommand) {
        let limits = &self.config.limits.velocity_max_rad_s;
        if (0..JOINTS).any(|j| wish.qd[j].abs() > limits[j]) {
            return self.raise(ErrorCode::SPEED_LIMIT);
        }
        self.counters.motion_commands += 1;
        self.log(ArmEvent::Velocity {
            qd: wish.qd,
            duration_s: wish.duration_s,
        });
        let at = at.max(self.time);
        self.velocity.offer(at, wish);
        self.run_velocity(at);
    }

    fn queue_move(
        &mut self,
        register: Register,
        target: &JointVector,
        [speed_rad_s, acceleration_rad_s2]: [f64; 2],
        checked: Option<u8>,
    ) -> ReplyData {
        let outside = self.config.limits.position_violation(target).is_some();
        let only_check = checked.is_some_and(|kind| kind > 0);
        if self.can_move() && self.mode == Mode::Position && !only_check {
            if outside {
                self.raise(ErrorCode::JOINT_LIMIT);
            } else if self.moves.len() >= BUFFER_CAPACITY {
                self.warn(warning::QUEUE_FULL);
            } else {
                self.tasks = self.tasks.wrapping_add(1);
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
                    task: Task {
                        origin: self.origin,
                        register,
                        number: self.tasks,
                    },
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
                    self.phase = Phase::Ready;
                }
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
