//! Types the parameters of a request.

use super::{Command, JointQuery, SPEED_FACTOR_PARAMETER, StateRequest};
use crate::xarm::bytes::ByteReader;
use crate::xarm::pose::TcpPose;
use crate::xarm::register::Register;
use crate::xarm::status::Mode;

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
