//! Replies to requests.

use rt_controller::xarm::{EmitError, Reply, ReplyData, Request, Status};

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
