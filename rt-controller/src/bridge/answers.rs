//! Answers to open calls, in words.

use crate::xarm::ErrorCode;
use shared_types::FaultCode;
use shared_types::ipc::message::{ControllerEvent, ControllerRpc};
use shared_types::ipc::rpc::Call;

/// An open call of the controller's service.
pub(super) type ControllerCall = Call<ControllerRpc>;

/// Sends an event; a caller that has gone is no concern of the controller.
pub(super) fn answer(call: &ControllerCall, event: &ControllerEvent) {
    if let Err(reason) = call.send(event) {
        tracing::debug!(%reason, "a caller did not wait for its answer");
    }
}

/// Refuses a call with the fault's own words and `detail`.
pub(super) fn refuse(call: &ControllerCall, fault: FaultCode, detail: &str) {
    let message = if detail.is_empty() {
        fault.explain().to_owned()
    } else {
        detail.to_owned()
    };
    tracing::info!(?fault, message, "refused");
    answer(call, &ControllerEvent::Refused { fault, message });
}

/// What stopped a motion, with the arm's own error where there is one.
pub(super) fn stopped(fault: FaultCode, cycle: u64, error: ErrorCode) -> ControllerEvent {
    let message = if error.is_none() {
        fault.explain().to_owned()
    } else {
        format!("{} ({error})", fault.explain())
    };
    ControllerEvent::Stopped {
        fault,
        cycle,
        arm_error: error.0,
        message,
    }
}
