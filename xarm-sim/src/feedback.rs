//! Feedback pushes: the controller tells a client when its moves begin and end
//! (firmware 2.0.102, after register 254 with a mask).

use super::reference::Task;
use rt_controller::xarm::frame::FEEDBACK_REGISTER;
use rt_controller::xarm::{EmitError, Protocol, Reply, Status};

/// What is told, with its bit in the mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FeedbackKind {
    Started,
    Ended,
    Discarded,
}

impl FeedbackKind {
    const fn code(self) -> u8 {
        match self {
            Self::Started => 1,
            Self::Ended | Self::Discarded => 2,
        }
    }
}

/// News about a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feedback {
    pub(super) task: Task,
    pub(super) kind: FeedbackKind,
    /// Reading of the controller's clock (µs).
    pub(super) time_us: u64,
}

impl Feedback {
    /// Whether a client with this mask wants to know.
    pub(super) fn is_wanted(&self, mask: u8) -> bool {
        mask & self.kind.code() != 0
    }

    /// The frame for the client of transaction `transaction`.
    pub(super) fn emit(
        &self,
        out: &mut [u8],
        transaction: u16,
        protocol: Protocol,
        status: Status,
    ) -> Result<usize, EmitError> {
        let outcome = match self.kind {
            FeedbackKind::Discarded => 2,
            FeedbackKind::Started | FeedbackKind::Ended => 0,
        };
        let mut data = [0; 13];
        data[0] = self.kind.code();
        data[1] = self.task.register.code();
        data[2..4].copy_from_slice(&self.task.number.to_be_bytes());
        data[4] = outcome;
        data[5..13].copy_from_slice(&self.time_us.to_be_bytes());
        Reply {
            transaction,
            protocol,
            register: FEEDBACK_REGISTER,
            status,
            data: &data,
        }
        .emit(out)
    }
}
