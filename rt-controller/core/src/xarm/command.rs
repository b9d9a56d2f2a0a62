//! Typed requests: what a client may ask, in SI units.

use super::bytes::{ByteWriter, EmitError};
use super::pose::TcpPose;
use super::register::Register;
use super::status::Mode;
use arm_model::JointVector;

mod parse;

pub use parse::CommandError;

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

    /// Whether it is one of a stream of setpoints, whose spacing matters.
    #[must_use]
    pub const fn is_setpoint(&self) -> bool {
        matches!(self, Self::ServoJoint(_) | Self::JointVelocity { .. })
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

#[cfg(test)]
mod tests;
