//! A controller that this command did not start, or that has stopped.

use shared_types::FaultCode;
use shared_types::ipc::IpcError;

/// Why a controller that has stopped does not bring the arm up, and what to do.
#[must_use]
pub fn has_stopped(fault: FaultCode) -> String {
    format!(
        "the controller has stopped ({fault:?}), in the run before or at its end. Look at the arm and at why (`wag explain` of that run), then add --acknowledge; of this fault the manual says: {}",
        fault.explain()
    )
}

/// What to do when the controller that ended was not this command's own.
pub fn of_service(by_service: bool, error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref() {
        Some(IpcError::Gone { .. }) if by_service => error.context(
            "the controller that runs as a service ended; an arm that moved is stopped by its guardian, whose log says so: look at the arm, and start both again",
        ),
        _ => error,
    }
}
