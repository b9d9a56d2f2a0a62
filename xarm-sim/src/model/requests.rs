//! What each request does to the controller.

use super::*;
use arm_model::kinematics::{self, JOINT_ORIGIN_M, JOINT_QUARTER_TURNS_X};
use rt_controller::xarm::reply::Text;
use rt_controller::xarm::version::SIMULATED_SERIAL_NUMBER;
use rt_controller::xarm::{EmitError, JointQuery, Reply, Request};

/// Version text of a real arm before its firmware: 7 axes, type 7, 1305 arm.
const MODEL: &str = "7,7,XS1305,AC1304,v";
/// Serial numbers of arm and control box, a NUL between them.
fn serial_numbers() -> String {
    format!("{SIMULATED_SERIAL_NUMBER}\0AC130400000000")
}

/// Data of a reply.
#[derive(Debug, Clone, PartialEq)]
pub enum AnswerData {
    /// Of a register with a typed reply.
    Typed(ReplyData),
    /// Of any other, as sent.
    Raw(Vec<u8>),
}

/// Reply to a request.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Status byte.
    pub status: Status,
    /// Data.
    pub data: AnswerData,
}

impl Answer {
    /// Writes the reply to `request` to the front of `out`; returns its length.
    ///
    /// # Errors
    /// [`EmitError::BufferTooSmall`].
    pub fn emit(&self, out: &mut [u8], request: &Request<'_>) -> Result<usize, EmitError> {
        match &self.data {
            AnswerData::Typed(data) => data.emit(out, request, self.status),
            AnswerData::Raw(data) => Reply {
                transaction: request.transaction,
                protocol: request.protocol,
                register: request.register,
                status: self.status,
                data,
            }
            .emit(out),
        }
    }
}

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

    /// Data of the reply to a register without a typed command; `None` when
    /// this controller does not know what to do with it.
    fn raw(&mut self, register: Register, parameters: &[u8]) -> Option<Vec<u8>> {
        Some(match register {
            Register::ReportedEffort => vec![u8::from(self.settings.reports_current)],
            Register::GetReducedMode => vec![u8::from(self.settings.reduced.on)],
            Register::ReducedState => self.settings.reduced_state(),
            Register::JointTorque => self.effort_nm().iter().flat_map(f32_le).collect(),
            Register::DhTable => dh_table(),
            Register::PowerBoardVersion => vec![0; 6],
            Register::HardwareTypes => vec![0; 2],
            Register::SaveConfiguration => {
                self.saved = self.settings;
                Vec::new()
            }
            Register::ClearConfiguration => {
                self.saved = Settings::factory(&self.config);
                self.settings = self.saved;
                Vec::new()
            }
            register => {
                self.settings.set_raw(register, parameters)?;
                Vec::new()
            }
        })
    }

    /// Executes a command that arrived at `at`.
    pub fn command(&mut self, at: MonotonicNs, command: &Command) -> Answer {
        if !command.is_setpoint() {
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
            Command::SerialNumbers => ReplyData::Text(Text::new(&serial_numbers())),
            Command::GetState => ReplyData::State(self.state()),
            Command::Buffered => ReplyData::Buffered(self.buffered()),
            Command::GetFault => ReplyData::Fault {
                error: self.error.0,
                warning: self.warning,
            },
            Command::DigitalInputs => ReplyData::DigitalInputs(self.config.digital_inputs),
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

fn f32_le(value: &f64) -> [u8; 4] {
    (*value as f32).to_le_bytes()
}

/// The vendor's table, modified convention: offset (rad), d (mm), alpha (rad), a (mm) of
/// each joint.
fn dh_table() -> Vec<u8> {
    let rows = JOINT_ORIGIN_M.into_iter().zip(JOINT_QUARTER_TURNS_X);
    rows.flat_map(|([x, y, z], turns)| {
        let alpha_rad = core::f32::consts::FRAC_PI_2 * f32::from(turns);
        // One of y and z is zero: a joint is moved along its own axis or along the turned one.
        let [d_mm, a_mm] = [y.abs() + z, x].map(|m| (m * 1e3) as f32);
        [0.0, d_mm, alpha_rad, a_mm]
    })
    .flat_map(f32::to_le_bytes)
    .collect()
}
