//! Typed data of replies, in SI units.

use super::bytes::{ByteReader, EmitError, Fields};
use super::command::{Command, JointQuery};
use super::frame::{Reply, Request, emit_frame};
use super::pose::TcpPose;
use super::status::ArmState;
use arm_model::JointVector;

/// Bytes of a version or serial number text on the wire.
pub const TEXT_LEN: usize = 40;

/// NUL-padded text of at most 39 characters, as versions are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Text([u8; TEXT_LEN]);

impl Text {
    /// From `text`; what does not fit in 39 bytes is cut off.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut bytes = [0; TEXT_LEN];
        for (to, from) in bytes
            .iter_mut()
            .take(TEXT_LEN.saturating_sub(1))
            .zip(text.bytes())
        {
            *to = from;
        }
        Self(bytes)
    }

    /// The text before the first NUL; empty when it is not UTF-8.
    #[must_use]
    pub fn as_str(&self) -> &str {
        self.0
            .split(|b| *b == 0)
            .next()
            .and_then(|text| core::str::from_utf8(text).ok())
            .unwrap_or_default()
    }
}

/// Data of a reply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplyData {
    /// Nothing beyond the status byte.
    None,
    /// Version text, or the raw 40 bytes of the serial numbers.
    Text(Text),
    /// State of the arm.
    State(ArmState),
    /// Commands in the buffer.
    Buffered(u16),
    /// Digital inputs of the control box: bit `i` is the level of input `i` (CI0 to CI7,
    /// then DI0 to DI7).
    DigitalInputs(u16),
    /// Error and warning code; 0 is none.
    Fault {
        /// See [`super::ErrorCode`].
        error: u8,
        /// Warning code.
        warning: u8,
    },
    /// TCP pose.
    Pose(TcpPose),
    /// Joint angles (rad).
    Joints(JointVector),
    /// Joint position (rad), velocity (rad/s) and effort (Nm); those not asked
    /// for are zero.
    JointMotion {
        /// How many of the three the reply holds.
        quantities: u8,
        /// Position (rad).
        position: JointVector,
        /// Velocity (rad/s).
        velocity: JointVector,
        /// Effort (Nm).
        effort: JointVector,
    },
    /// Whether joint angles are outside the range.
    OutsideLimits(bool),
    /// Linear speed limit in servo mode as a factor of 1 m/s.
    SpeedLimitFactor(f64),
    /// Answer to a checked move: buffer count and the check's result.
    CheckedMove {
        /// Commands in the buffer.
        buffered: u16,
        /// 0 when the move is possible.
        result: u8,
    },
}

/// Why a reply is not the answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ReplyError {
    /// Another register than asked for.
    #[error("reply is for register {got:#04x}, asked was {requested:#04x}")]
    Register {
        /// Register in the reply.
        got: u8,
        /// Register of the request.
        requested: u8,
    },
    /// The controller says that the result for this register means nothing.
    #[error("the controller could not answer register {0:#04x}")]
    Invalid(u8),
    /// Fewer data than the register has.
    #[error("reply to register {register:#04x} has {given} data bytes: too few")]
    TooShort {
        /// Register of the request.
        register: u8,
        /// Data bytes found.
        given: usize,
    },
}

impl ReplyData {
    /// Types the data of the reply to `command`. RT-safe.
    ///
    /// # Errors
    /// [`ReplyError`]; never panics, whatever the bytes.
    pub fn parse(command: &Command, reply: &Reply<'_>) -> Result<Self, ReplyError> {
        let requested = command.register().code();
        if reply.register != requested {
            return Err(ReplyError::Register {
                got: reply.register,
                requested,
            });
        }
        if reply.status.is_invalid() {
            return Err(ReplyError::Invalid(requested));
        }
        let mut data = Self::blank(command);
        let mut bytes = ByteReader::new(reply.data);
        data.fields(&mut bytes);
        let too_short = ReplyError::TooShort {
            register: requested,
            given: reply.data.len(),
        };
        bytes.found_all().then_some(data).ok_or(too_short)
    }

    /// What the reply to `command` holds, its values not known yet.
    fn blank(command: &Command) -> Self {
        match command {
            Command::Version | Command::SerialNumbers => Self::Text(Text([0; TEXT_LEN])),
            Command::GetState => Self::State(ArmState::default()),
            Command::GetFault => Self::Fault {
                error: 0,
                warning: 0,
            },
            Command::MoveJoint {
                checked: Some(_), ..
            }
            | Command::MoveHome {
                checked: Some(_), ..
            } => Self::CheckedMove {
                buffered: 0,
                result: 0,
            },
            Command::Buffered
            | Command::MoveJoint { .. }
            | Command::MoveHome { .. }
            | Command::JointJerk(_)
            | Command::JointAcceleration(_) => Self::Buffered(0),
            Command::DigitalInputs => Self::DigitalInputs(0),
            Command::TcpPose | Command::ForwardKinematics(_) => Self::Pose(TcpPose::default()),
            Command::JointPosition(JointQuery::Commanded) => Self::Joints(JointVector::ZERO),
            Command::JointPosition(JointQuery::Quantities { quantities, .. }) => {
                Self::JointMotion {
                    quantities: *quantities,
                    position: JointVector::ZERO,
                    velocity: JointVector::ZERO,
                    effort: JointVector::ZERO,
                }
            }
            Command::JointLimitTest(_) => Self::OutsideLimits(false),
            Command::GetSpeedLimitFactor => Self::SpeedLimitFactor(0.0),
            _ => Self::None,
        }
    }

    fn fields(&mut self, wire: &mut impl Fields) {
        match self {
            Self::None => {}
            Self::Text(text) => wire.array(&mut text.0),
            Self::State(state) => {
                let mut code = state.code();
                wire.u8(&mut code);
                *state = ArmState::from_code(code);
            }
            Self::Buffered(word) | Self::DigitalInputs(word) => wire.u16_be(word),
            Self::Fault { error, warning } => {
                wire.u8(error);
                wire.u8(warning);
            }
            Self::Pose(pose) => pose.fields(wire),
            Self::Joints(q) => wire.joints(q),
            Self::JointMotion {
                quantities,
                position,
                velocity,
                effort,
            } => [position, velocity, effort]
                .into_iter()
                .take(usize::from(*quantities))
                .for_each(|v| wire.joints(v)),
            Self::OutsideLimits(outside) => wire.flag(outside),
            Self::SpeedLimitFactor(factor) => wire.f32_le(factor),
            Self::CheckedMove { buffered, result } => {
                wire.u16_be(buffered);
                wire.u8(result);
            }
        }
    }

    /// Writes the whole reply frame to the front of `out` and returns its
    /// length; [`MAX_FRAME_LEN`](super::frame::MAX_FRAME_LEN) bytes are always enough.
    pub fn emit(
        &self,
        out: &mut [u8],
        request: &Request<'_>,
        status: super::Status,
    ) -> Result<usize, EmitError> {
        emit_frame(out, request.transaction, request.protocol, |body| {
            body.bytes(&[request.register, status.0]);
            let mut data = *self;
            data.fields(body);
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xarm::frame::Protocol;
    use crate::xarm::status::Status;

    #[test]
    fn a_reply_that_lacks_data_is_refused() {
        let register = Command::GetFault.register().code();
        let reply = Reply {
            transaction: 9,
            protocol: Protocol::Private,
            register,
            status: Status(0),
            data: &[2],
        };
        let parsed = ReplyData::parse(&Command::GetFault, &reply);
        assert_eq!(parsed, Err(ReplyError::TooShort { register, given: 1 }));
    }

    #[test]
    fn text_is_cut_and_terminated() {
        let long = "x".repeat(60);
        assert_eq!(Text::new(&long).as_str().len(), TEXT_LEN - 1);
    }
}
