//! A controller that this command did not start.

use shared_types::ipc::IpcError;

/// What to do when the controller that ended was not this command's own.
pub fn of_service(by_service: bool, error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref() {
        Some(IpcError::Gone { .. }) if by_service => error.context(
            "the controller that runs as a service ended; an arm that moved is stopped by its guardian, whose log says so: look at the arm, and start both again",
        ),
        _ => error,
    }
}
