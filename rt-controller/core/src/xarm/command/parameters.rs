//! The parameters of requests, written and typed.

use super::{Command, JointQuery, StateRequest};
use crate::xarm::bytes::{ByteReader, Fields};
use crate::xarm::pose::TcpPose;
use crate::xarm::register::Register;
use crate::xarm::status::Mode;
use arm_model::JointVector;

/// Number of the linear speed limit factor in registers 232 and 233.
const SPEED_FACTOR: u8 = 1;

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
        let mut command = Self::blank(register).ok_or(CommandError::Untyped(register))?;
        match (&command, parameters.first()) {
            (Self::SetState(_), Some(code)) if StateRequest::from_code(*code).is_none() => {
                return Err(CommandError::BadValue(register));
            }
            (Self::SetSpeedLimitFactor(_) | Self::GetSpeedLimitFactor, Some(number))
                if *number != SPEED_FACTOR =>
            {
                return Err(CommandError::Untyped(register));
            }
            _ => {}
        }
        let mut bytes = ByteReader::new(parameters);
        command.fields(&mut bytes);
        if !bytes.found_all() {
            let given = parameters.len();
            Err(CommandError::TooShort { register, given })
        } else if command.is_well_formed() {
            Ok(command)
        } else {
            Err(CommandError::BadValue(register))
        }
    }

    /// The request of a register, its parameters not known yet; `None` for a register
    /// without a typed form.
    fn blank(register: Register) -> Option<Self> {
        let (joint, zero) = (0, JointVector::ZERO);
        Some(match register {
            Register::Version => Self::Version,
            Register::SerialNumbers => Self::SerialNumbers,
            Register::MotionEnable => Self::MotionEnable {
                joint,
                enable: false,
            },
            Register::SetState => Self::SetState(StateRequest::Stop),
            Register::GetState => Self::GetState,
            Register::Buffered => Self::Buffered,
            Register::Fault => Self::GetFault,
            Register::CleanError => Self::CleanError,
            Register::CleanWarning => Self::CleanWarning,
            Register::Brake => Self::Brake {
                joint,
                release: false,
            },
            Register::SetMode => Self::SetMode(Mode::default()),
            Register::MoveJoint => Self::MoveJoint {
                target: zero,
                speed_rad_s: 0.0,
                acceleration_rad_s2: 0.0,
                checked: None,
            },
            Register::MoveHome => Self::MoveHome {
                speed_rad_s: 0.0,
                acceleration_rad_s2: 0.0,
                checked: None,
            },
            Register::ServoJoint => Self::ServoJoint(zero),
            Register::JointJerk => Self::JointJerk(0.0),
            Register::JointAcceleration => Self::JointAcceleration(0.0),
            Register::TcpOffset => Self::TcpOffset(TcpPose::default()),
            Register::TcpLoad => Self::TcpLoad {
                mass_kg: 0.0,
                centre_m: [0.0; 3],
            },
            Register::CollisionSensitivity => Self::CollisionSensitivity(0),
            Register::TeachSensitivity => Self::TeachSensitivity(0),
            Register::TcpPose => Self::TcpPose,
            Register::JointPosition => Self::JointPosition(JointQuery::Commanded),
            Register::ForwardKinematics => Self::ForwardKinematics(zero),
            Register::JointLimitTest => Self::JointLimitTest(zero),
            Register::JointVelocity => Self::JointVelocity {
                velocity: zero,
                synchronised: false,
                duration_s: None,
            },
            Register::DigitalInputs => Self::DigitalInputs,
            Register::SetParameter => Self::SetSpeedLimitFactor(0.0),
            Register::GetParameter => Self::GetSpeedLimitFactor,
            Register::FeedbackCheck => Self::FeedbackCheck,
            Register::FeedbackMask => Self::FeedbackMask(0),
            _ => return None,
        })
    }

    /// The parameters. RT-safe.
    pub(in crate::xarm) fn fields(&mut self, wire: &mut impl Fields) {
        match self {
            Self::Version
            | Self::SerialNumbers
            | Self::GetState
            | Self::Buffered
            | Self::GetFault
            | Self::CleanError
            | Self::CleanWarning
            | Self::TcpPose
            | Self::DigitalInputs
            | Self::FeedbackCheck => {}
            Self::MotionEnable {
                joint,
                enable: flag,
            }
            | Self::Brake {
                joint,
                release: flag,
            } => {
                wire.u8(joint);
                wire.flag(flag);
            }
            Self::SetState(state) => {
                let mut code = state.code();
                wire.u8(&mut code);
                *state = StateRequest::from_code(code).unwrap_or(*state);
            }
            Self::SetMode(mode) => {
                let mut code = mode.code();
                wire.u8(&mut code);
                *mode = Mode::from_code(code);
            }
            Self::CollisionSensitivity(byte)
            | Self::TeachSensitivity(byte)
            | Self::FeedbackMask(byte) => wire.u8(byte),
            Self::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => {
                wire.joints(target);
                move_fields(wire, speed_rad_s, acceleration_rad_s2, checked);
            }
            Self::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                checked,
            } => move_fields(wire, speed_rad_s, acceleration_rad_s2, checked),
            Self::ServoJoint(target) => {
                wire.joints(target);
                // Speed, acceleration and time, which the controller ignores.
                if wire.has(true, 12) {
                    wire.array(&mut [0; 12]);
                }
            }
            Self::JointJerk(value) | Self::JointAcceleration(value) => wire.f32_le(value),
            Self::TcpOffset(pose) => pose.fields(wire),
            Self::TcpLoad { mass_kg, centre_m } => {
                wire.f32_le(mass_kg);
                wire.lengths(centre_m);
            }
            Self::JointPosition(query) => {
                let mut byte = query.byte();
                optional(wire, &mut byte, 1, Fields::u8);
                *query = JointQuery::of_byte(byte);
            }
            Self::ForwardKinematics(q) | Self::JointLimitTest(q) => wire.joints(q),
            Self::JointVelocity {
                velocity,
                synchronised,
                duration_s,
            } => {
                wire.joints(velocity);
                wire.flag(synchronised);
                optional(wire, duration_s, 4, Fields::f32_le);
            }
            Self::SetSpeedLimitFactor(factor) => {
                wire.u8(&mut { SPEED_FACTOR });
                wire.f32_le(factor);
            }
            Self::GetSpeedLimitFactor => wire.u8(&mut { SPEED_FACTOR }),
        }
    }
    /// Whether every number is finite and every choice one that exists.
    #[must_use]
    pub fn is_well_formed(&self) -> bool {
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        match self {
            Self::MotionEnable { joint, .. } | Self::Brake { joint, .. } => {
                (1..=Self::ALL_JOINTS).contains(joint)
            }
            Self::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                ..
            } => target.is_finite() && finite(&[*speed_rad_s, *acceleration_rad_s2]),
            Self::MoveHome {
                speed_rad_s,
                acceleration_rad_s2,
                ..
            } => finite(&[*speed_rad_s, *acceleration_rad_s2]),
            Self::ServoJoint(q) | Self::ForwardKinematics(q) | Self::JointLimitTest(q) => {
                q.is_finite()
            }
            Self::JointJerk(v) | Self::JointAcceleration(v) | Self::SetSpeedLimitFactor(v) => {
                v.is_finite() && *v > 0.0
            }
            Self::TcpOffset(pose) => pose.is_finite(),
            Self::TcpLoad { mass_kg, centre_m } => {
                mass_kg.is_finite() && *mass_kg >= 0.0 && finite(centre_m)
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

fn move_fields(
    wire: &mut impl Fields,
    speed_rad_s: &mut f64,
    acceleration_rad_s2: &mut f64,
    checked: &mut Option<u8>,
) {
    wire.f32_le(speed_rad_s);
    wire.f32_le(acceleration_rad_s2);
    // The time, which the controller ignores.
    wire.f32_le(&mut 0.0);
    optional(wire, checked, 1, Fields::u8);
}

/// A last field of `len` bytes that may be left out.
fn optional<W: Fields, T: Default>(
    wire: &mut W,
    value: &mut Option<T>,
    len: usize,
    field: fn(&mut W, &mut T),
) {
    if wire.has(value.is_some(), len) {
        field(wire, value.get_or_insert_default());
    }
}
