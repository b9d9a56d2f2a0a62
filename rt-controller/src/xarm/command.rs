//! Typed requests: what a client may ask, in SI units.

use super::bytes::{ByteReader, ByteWriter, EmitError};
use super::pose::TcpPose;
use super::register::Register;
use super::status::Mode;
use shared_types::JointVector;

/// Type number of the linear speed limit factor in registers 232 and 233.
const SPEED_FACTOR_PARAMETER: u8 = 1;

/// State to go to (register 12).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateRequest {
    /// 0: ready; also clears the error code.
    Ready,
    /// 3: pause.
    Pause,
    /// 4: stop.
    Stop,
    /// 6: decelerated stop.
    DeceleratedStop,
}

/// Which joint angles register 42 is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointQuery {
    /// No parameter: the commanded position.
    Commanded,
    /// The first `quantities` of position, velocity, effort (1 to 3); measured
    /// ones, or their targets.
    Quantities {
        /// 1 position, 2 also velocity, 3 also effort.
        quantities: u8,
        /// Targets instead of measured values (firmware 2.6.107).
        targets: bool,
    },
}

impl JointQuery {
    /// Measured positions only.
    pub const MEASURED: Self = Self::Quantities {
        quantities: 1,
        targets: false,
    };
}

/// A request. Registers without a variant are configuration this system never
/// touches; [`Command::parse`] names them in [`CommandError::Untyped`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Version text.
    Version,
    /// Serial numbers of arm and control box.
    SerialNumbers,
    /// Enables or disables drives; the arm then needs `SetState(Ready)`.
    MotionEnable {
        /// 1 to 7, or [`Command::ALL_JOINTS`].
        joint: u8,
        /// On or off.
        enable: bool,
    },
    /// Sets the state.
    SetState(StateRequest),
    /// Asks for the state.
    GetState,
    /// Asks for the number of commands in the buffer.
    Buffered,
    /// Asks for error and warning code.
    GetFault,
    /// Clears the error; the arm then needs `SetState(Ready)`.
    CleanError,
    /// Clears the warning.
    CleanWarning,
    /// Brakes.
    Brake {
        /// 1 to 7, or [`Command::ALL_JOINTS`].
        joint: u8,
        /// Whether the brake lets go.
        release: bool,
    },
    /// Sets the mode; the arm then needs `SetState(Ready)`.
    SetMode(Mode),
    /// Moves to joint angles with the arm's own planner (mode 0).
    MoveJoint {
        /// Target (rad).
        target: JointVector,
        /// Speed of the fastest joint (rad/s).
        speed_rad_s: f64,
        /// Its acceleration (rad/s²).
        acceleration_rad_s2: f64,
        /// Whether the checked form (with a trailing byte) is meant.
        checked: Option<u8>,
    },
    /// Moves to all zero (mode 0).
    MoveHome {
        /// Speed of the fastest joint (rad/s).
        speed_rad_s: f64,
        /// Its acceleration (rad/s²).
        acceleration_rad_s2: f64,
        /// Whether the checked form (with a trailing byte) is meant.
        checked: Option<u8>,
    },
    /// Streamed setpoint (mode 1), executed as a step (rad). The frame's speed,
    /// acceleration and time are ignored by the controller and sent as zero.
    ServoJoint(JointVector),
    /// Joint jerk of the arm's planner (rad/s³).
    JointJerk(f64),
    /// Joint acceleration limit of the arm's planner (rad/s²).
    JointAcceleration(f64),
    /// Tool centre point in the flange frame; the arm then needs `SetState(Ready)`.
    TcpOffset(TcpPose),
    /// Load on the flange.
    TcpLoad {
        /// Mass (kg).
        mass_kg: f64,
        /// Centre of mass in the flange frame (m).
        centre_m: [f64; 3],
    },
    /// Collision sensitivity 0 to 5; the arm then needs `SetState(Ready)`.
    CollisionSensitivity(u8),
    /// Teach sensitivity 1 to 5; the arm then needs `SetState(Ready)`.
    TeachSensitivity(u8),
    /// Asks for the TCP pose.
    TcpPose,
    /// Asks for joint angles.
    JointPosition(JointQuery),
    /// Asks for the TCP pose at joint angles (rad).
    ForwardKinematics(JointVector),
    /// Asks whether joint angles (rad) are outside the range.
    JointLimitTest(JointVector),
    /// Joint velocity (mode 4).
    JointVelocity {
        /// Velocity (rad/s).
        velocity: JointVector,
        /// Whether all joints reach their velocity at the same time.
        synchronised: bool,
        /// The arm stops by itself after this time (s); never without it.
        duration_s: Option<f64>,
    },
    /// Sets the linear speed limit in servo mode, as a factor of 1 m/s.
    SetSpeedLimitFactor(f64),
    /// Asks for that factor.
    GetSpeedLimitFactor,
    /// Asks for feedback pushes not yet seen.
    FeedbackCheck,
    /// Which feedback pushes to send; 0 is none.
    FeedbackMask(u8),
}

/// Why parameters are no request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// Not a register of this controller.
    #[error("unknown register {0:#04x}")]
    UnknownRegister(u8),
    /// A register of the controller without a typed form here.
    #[error("register {0:?} ({purpose}) has no typed form", purpose = .0.purpose())]
    Untyped(Register),
    /// Fewer parameters than the register needs.
    #[error("register {register:?} with {given} parameter bytes: too few")]
    TooShort {
        /// Register.
        register: Register,
        /// Parameter bytes found.
        given: usize,
    },
    /// A parameter is not finite or not one of the allowed numbers.
    #[error("register {0:?} with a parameter that is not finite or out of range")]
    BadValue(Register),
}

impl Command {
    /// Joint number that means all seven.
    pub const ALL_JOINTS: u8 = 8;

    /// Register of the request.
    #[must_use]
    pub const fn register(&self) -> Register {
        match self {
            Self::Version => Register::Version,
            Self::SerialNumbers => Register::SerialNumbers,
            Self::MotionEnable { .. } => Register::MotionEnable,
            Self::SetState(_) => Register::SetState,
            Self::GetState => Register::GetState,
            Self::Buffered => Register::Buffered,
            Self::GetFault => Register::Fault,
            Self::CleanError => Register::CleanError,
            Self::CleanWarning => Register::CleanWarning,
            Self::Brake { .. } => Register::Brake,
            Self::SetMode(_) => Register::SetMode,
            Self::MoveJoint { .. } => Register::MoveJoint,
            Self::MoveHome { .. } => Register::MoveHome,
            Self::ServoJoint(_) => Register::ServoJoint,
            Self::JointJerk(_) => Register::JointJerk,
            Self::JointAcceleration(_) => Register::JointAcceleration,
            Self::TcpOffset(_) => Register::TcpOffset,
            Self::TcpLoad { .. } => Register::TcpLoad,
            Self::CollisionSensitivity(_) => Register::CollisionSensitivity,
            Self::TeachSensitivity(_) => Register::TeachSensitivity,
            Self::TcpPose => Register::TcpPose,
            Self::JointPosition(_) => Register::JointPosition,
            Self::ForwardKinematics(_) => Register::ForwardKinematics,
            Self::JointLimitTest(_) => Register::JointLimitTest,
            Self::JointVelocity { .. } => Register::JointVelocity,
            Self::SetSpeedLimitFactor(_) => Register::SetParameter,
            Self::GetSpeedLimitFactor => Register::GetParameter,
            Self::FeedbackCheck => Register::FeedbackCheck,
            Self::FeedbackMask(_) => Register::FeedbackMask,
        }
    }

    /// Writes the parameters. RT-safe.
    pub(super) fn emit_parameters(&self, out: &mut ByteWriter<'_>) -> Result<(), EmitError> {
        match self {
            Self::Version
            | Self::SerialNumbers
            | Self::GetState
            | Self::Buffered
            | Self::GetFault
            | Self::CleanError
            | Self::CleanWarning
            | Self::TcpPose
            | Self::FeedbackCheck
            | Self::JointPosition(JointQuery::Commanded) => Ok(()),
            Self::MotionEnable {
                joint,
                enable: flag,
            }
            | Self::Brake {
                joint,
                release: flag,
            } => out.bytes(&[*joint, u8::from(*flag)]),
            Self::SetState(state) => out.u8(state.code()),
            Self::SetMode(mode) => out.u8(mode.code()),
            Self::CollisionSensitivity(byte)
            | Self::TeachSensitivity(byte)
            | Self::FeedbackMask(byte) => out.u8(*byte),
            Self::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => {
                out.joints(target)?;
                emit_move(out, *speed_rad_s, *acceleration_rad_s2, *checked)
            }
            Self::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => emit_move(out, *speed_rad_s, *acceleration_rad_s2, *checked),
            Self::ServoJoint(target) => {
                out.joints(target)?;
                out.f32s_le(&[0.0; 3])
            }
            Self::JointJerk(value) | Self::JointAcceleration(value) => out.f32_le(*value),
            Self::TcpOffset(pose) => pose.emit(out),
            Self::TcpLoad { mass_kg, centre_m } => {
                out.f32_le(*mass_kg)?;
                centre_m.iter().try_for_each(|v| out.length(*v))
            }
            Self::JointPosition(JointQuery::Quantities {
                quantities,
                targets,
            }) => out.u8((quantities & 0x0F) | if *targets { 0x10 } else { 0 }),
            Self::ForwardKinematics(q) | Self::JointLimitTest(q) => out.joints(q),
            Self::JointVelocity {
                velocity,
                synchronised,
                duration_s,
            } => {
                out.joints(velocity)?;
                out.u8(u8::from(*synchronised))?;
                duration_s.map_or(Ok(()), |duration_s| out.f32_le(duration_s))
            }
            Self::SetSpeedLimitFactor(factor) => {
                out.u8(SPEED_FACTOR_PARAMETER)?;
                out.f32_le(*factor)
            }
            Self::GetSpeedLimitFactor => out.u8(SPEED_FACTOR_PARAMETER),
        }
    }

    /// Types a request. Longer parameter lists than needed are accepted: newer
    /// clients append fields. RT-safe.
    ///
    /// # Errors
    /// [`CommandError`]; never panics, whatever the bytes.
    pub fn parse(register: u8, parameters: &[u8]) -> Result<Self, CommandError> {
        let register =
            Register::from_code(register).ok_or(CommandError::UnknownRegister(register))?;
        if register == Register::SetState
            && parameters
                .first()
                .is_some_and(|code| StateRequest::from_code(*code).is_none())
        {
            return Err(CommandError::BadValue(register));
        }
        let mut bytes = ByteReader::new(parameters);
        let command = parse_status_request(register, &mut bytes)
            .or_else(|| parse_motion(register, &mut bytes))
            .or_else(|| parse_setting(register, &mut bytes))
            .ok_or(CommandError::Untyped(register))?
            .ok_or(CommandError::TooShort {
                register,
                given: parameters.len(),
            })?;
        if command.is_well_formed() {
            Ok(command)
        } else {
            Err(CommandError::BadValue(register))
        }
    }

    /// Whether every number is finite and every choice one that exists.
    #[must_use]
    pub fn is_well_formed(&self) -> bool {
        match self {
            Self::MotionEnable { joint, .. } | Self::Brake { joint, .. } => {
                (1..=Self::ALL_JOINTS).contains(joint)
            }
            Self::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                ..
            } => target.is_finite() && speed_rad_s.is_finite() && acceleration_rad_s2.is_finite(),
            Self::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                ..
            } => speed_rad_s.is_finite() && acceleration_rad_s2.is_finite(),
            Self::ServoJoint(q) | Self::ForwardKinematics(q) | Self::JointLimitTest(q) => {
                q.is_finite()
            }
            Self::JointJerk(v) | Self::JointAcceleration(v) | Self::SetSpeedLimitFactor(v) => {
                v.is_finite() && *v > 0.0
            }
            Self::TcpOffset(pose) => pose.is_finite(),
            Self::TcpLoad { mass_kg, centre_m } => {
                mass_kg.is_finite() && *mass_kg >= 0.0 && centre_m.iter().all(|v| v.is_finite())
            }
            Self::CollisionSensitivity(level) => *level <= 5,
            Self::TeachSensitivity(level) => (1..=5).contains(level),
            Self::JointVelocity {
                velocity,
                duration_s,
                ..
            } => velocity.is_finite() && duration_s.is_none_or(f64::is_finite),
            Self::JointPosition(JointQuery::Quantities { quantities, .. }) => {
                (1..=3).contains(quantities)
            }
            _ => true,
        }
    }
}

impl StateRequest {
    const fn code(self) -> u8 {
        match self {
            Self::Ready => 0,
            Self::Pause => 3,
            Self::Stop => 4,
            Self::DeceleratedStop => 6,
        }
    }

    const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Ready),
            3 => Some(Self::Pause),
            4 => Some(Self::Stop),
            6 => Some(Self::DeceleratedStop),
            _ => None,
        }
    }
}

fn emit_move(
    out: &mut ByteWriter<'_>,
    speed_rad_s: f64,
    acceleration_rad_s2: f64,
    checked: Option<u8>,
) -> Result<(), EmitError> {
    out.f32s_le(&[speed_rad_s, acceleration_rad_s2, 0.0])?;
    checked.map_or(Ok(()), |check| out.u8(check))
}

/// Speed, acceleration, (ignored) time, optional check byte of a move.
fn parse_move(bytes: &mut ByteReader<'_>) -> Option<(f64, f64, Option<u8>)> {
    let [speed_rad_s, acceleration_rad_s2, _time_s] = bytes.f32s_le()?;
    Some((speed_rad_s, acceleration_rad_s2, bytes.u8()))
}

/// Outer `None`: not one of these registers; inner `None`: too short.
type Parsed = Option<Option<Command>>;

fn parse_status_request(register: Register, bytes: &mut ByteReader<'_>) -> Parsed {
    Some(match register {
        Register::Version => Some(Command::Version),
        Register::SerialNumbers => Some(Command::SerialNumbers),
        Register::GetState => Some(Command::GetState),
        Register::Buffered => Some(Command::Buffered),
        Register::Fault => Some(Command::GetFault),
        Register::TcpPose => Some(Command::TcpPose),
        Register::JointPosition => Some(Command::JointPosition(match bytes.u8() {
            None => JointQuery::Commanded,
            Some(byte) => JointQuery::Quantities {
                quantities: byte & 0x0F,
                targets: byte & 0xF0 != 0,
            },
        })),
        Register::ForwardKinematics => bytes.joints().map(Command::ForwardKinematics),
        Register::JointLimitTest => bytes.joints().map(Command::JointLimitTest),
        Register::GetParameter => match bytes.u8() {
            Some(SPEED_FACTOR_PARAMETER) => Some(Command::GetSpeedLimitFactor),
            Some(_) => return None,
            None => None,
        },
        Register::FeedbackCheck => Some(Command::FeedbackCheck),
        Register::FeedbackMask => bytes.u8().map(Command::FeedbackMask),
        _ => return None,
    })
}

fn parse_motion(register: Register, bytes: &mut ByteReader<'_>) -> Parsed {
    Some(match register {
        Register::MoveJoint => (|| {
            let target = bytes.joints()?;
            let (speed_rad_s, acceleration_rad_s2, checked) = parse_move(bytes)?;
            Some(Command::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            })
        })(),
        Register::MoveHome => parse_move(bytes).map(
            |(speed_rad_s, acceleration_rad_s2, checked)| Command::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            },
        ),
        Register::ServoJoint => bytes.joints().map(Command::ServoJoint),
        Register::JointVelocity => (|| {
            Some(Command::JointVelocity {
                velocity: bytes.joints()?,
                synchronised: bytes.u8()? != 0,
                duration_s: bytes.f32_le(),
            })
        })(),
        _ => return None,
    })
}

fn parse_setting(register: Register, bytes: &mut ByteReader<'_>) -> Parsed {
    let mut joint_and_flag = || Some((bytes.u8()?, bytes.u8()? != 0));
    Some(match register {
        Register::MotionEnable => {
            joint_and_flag().map(|(joint, enable)| Command::MotionEnable { joint, enable })
        }
        Register::Brake => {
            joint_and_flag().map(|(joint, release)| Command::Brake { joint, release })
        }
        Register::SetState => bytes
            .u8()
            .and_then(StateRequest::from_code)
            .map(Command::SetState),
        Register::SetMode => bytes
            .u8()
            .map(|code| Command::SetMode(Mode::from_code(code))),
        Register::CleanError => Some(Command::CleanError),
        Register::CleanWarning => Some(Command::CleanWarning),
        Register::JointJerk => bytes.f32_le().map(Command::JointJerk),
        Register::JointAcceleration => bytes.f32_le().map(Command::JointAcceleration),
        Register::TcpOffset => TcpPose::parse(bytes).map(Command::TcpOffset),
        Register::TcpLoad => (|| {
            Some(Command::TcpLoad {
                mass_kg: bytes.f32_le()?,
                centre_m: [bytes.length()?, bytes.length()?, bytes.length()?],
            })
        })(),
        Register::CollisionSensitivity => bytes.u8().map(Command::CollisionSensitivity),
        Register::TeachSensitivity => bytes.u8().map(Command::TeachSensitivity),
        Register::SetParameter => match bytes.u8() {
            Some(SPEED_FACTOR_PARAMETER) => bytes.f32_le().map(Command::SetSpeedLimitFactor),
            Some(_) => return None,
            None => None,
        },
        _ => return None,
    })
}

#[cfg(test)]
mod tests;
