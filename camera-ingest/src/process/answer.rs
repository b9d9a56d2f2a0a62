//! Answers to callers.

use shared_types::ipc::message::{CameraEvent, CameraRpc};
use shared_types::ipc::rpc::Call;

pub(super) fn failed(message: impl ToString) -> CameraEvent {
    CameraEvent::Failed {
        message: message.to_string(),
    }
}

/// Answers; a caller that is gone is no failure of this process.
pub(super) fn answer(call: &Call<CameraRpc>, event: &CameraEvent) {
    if let Err(e) = call.send(event) {
        tracing::warn!("an answer was not delivered: {e}");
    }
}
