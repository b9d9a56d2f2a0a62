//! Why the rig does not start or go on.

use rope_sim::SimulateError;
use shared_types::ipc::IpcError;
use xarm_sim::ArmStartError;

/// Why the rig did not start or did not go on.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// A bad set-up, a rope that diverged, a machine that is too slow, a part that
    /// panicked: in a sentence.
    #[error("{0}")]
    Failed(String),
    /// The arm did not start.
    #[error(transparent)]
    Arm(#[from] ArmStartError),
    /// The rope could not be simulated.
    #[error("the rope cannot be simulated")]
    Rope(#[from] SimulateError),
    /// Shared memory failed.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// A thread could not be started.
    #[error("cannot start the thread `{name}`")]
    Thread {
        /// Which one.
        name: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
}
