//! Typed requests: what a client may ask, in SI units.

use super::pose::TcpPose;
use super::register::Register;
use super::status::Mode;
use arm_model::JointVector;

mod parameters;

pub use parameters::CommandError;

/// State to go to (register 12), by its number on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum StateRequest {
    /// Ready; also clears the error code.
    Ready = 0,
    /// Pause.
    Pause = 3,
    /// Stop.
    Stop = 4,
    /// Decelerated stop.
    DeceleratedStop = 6,
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

    /// The parameter, which the first query has none of.
    const fn byte(self) -> Option<u8> {
        match self {
            Self::Commanded => None,
            Self::Quantities {
                quantities,
                targets,
            } => Some((quantities & 0x0F) | if targets { 0x10 } else { 0 }),
        }
    }

    fn of_byte(byte: Option<u8>) -> Self {
        byte.map_or(Self::Commanded, |byte| Self::Quantities {
            quantities: byte & 0x0F,
            targets: byte & 0xF0 != 0,
        })
    }
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
    /// Asks for the digital inputs of the control box.
    DigitalInputs,
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
            Self::DigitalInputs => Register::DigitalInputs,
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
}

impl StateRequest {
    const fn code(self) -> u8 {
        self as u8
    }

    fn from_code(code: u8) -> Option<Self> {
        [Self::Ready, Self::Pause, Self::Stop, Self::DeceleratedStop]
            .into_iter()
            .find(|state| state.code() == code)
    }
}

#[cfg(test)]
mod tests;
