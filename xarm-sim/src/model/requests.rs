//! What each request does to the controller.

use super::*;
use arm_model::kinematics;
use rt_controller::xarm::reply::Text;
use rt_controller::xarm::{JointQuery, Request};

/// Version text of a real arm before its firmware: 7 axes, type 7, 1305 arm.
const MODEL: &str = "7,7,XS1305,AC1304,v";
/// Serial numbers of arm and control box, a NUL between them.
const SERIAL_NUMBERS: &str = "XS130500000000\0AC130400000000";
impl ArmModel {
    /// Takes a request as it came from the wire at `at` and gives the reply. It is of the
    /// client of number `client`.
    pub(crate) fn request_from(
        &mut self,
        client: u32,
        at: MonotonicNs,
        request: &Request<'_>,
    ) -> Answer {
        let (register, parameters) = (request.register, request.parameters);
        let origin = (client, request.transaction);
        self.on_behalf_of(origin, at, |model| {
            match Command::parse(register, parameters) {
                Ok(command) if !model.knows(&command) => {
                    model.refuse(&CommandError::UnknownRegister(register), parameters)
                }
                Ok(command) => model.command(at, &command),
                Err(error) => model.refuse(&error, parameters),
            }
        })
    }

    /// A command of the client of number `client` outside any connection.
    pub(crate) fn command_from(&mut self, client: u32, at: MonotonicNs, command: &Command) {
        self.on_behalf_of((client, 0), at, |model| model.command(at, command));
    }

    /// Executes what a client (its number, transaction id) sent, arrived at `at`.
    fn on_behalf_of(
        &mut self,
        origin: (u32, u16),
        at: MonotonicNs,
        execute: impl FnOnce(&mut Self) -> Answer,
    ) -> Answer {
        self.origin = Some(origin);
        self.arrived = self.arrived.max(at);
        let answer = execute(self);
        self.tell_state();
        self.origin = None;
        answer
    }

    /// Whether a command to this register would be taken up as a setpoint or
    /// velocity now.
    pub(crate) fn takes_motion(&self, register: u8) -> bool {
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

    /// Pose of the tool centre point at joint angles `q` (rad).
    pub(crate) fn tcp_pose(&self, q: &JointVector) -> TcpPose {
        let (p, r) = kinematics::flange_pose(q);
        let offset = &self.settings.tcp_offset;
        TcpPose::from_frame(&(p + r * offset.position()), &(r * offset.attitude()))
    }
}
