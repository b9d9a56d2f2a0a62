//! Why the rig does not start or go on.

use rope_sim::SimulateError;
use shared_types::ipc::IpcError;
use xarm_sim::ArmStartError;

/// Why the rig did not start or did not go on.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// A number of the set-up makes no rig.
    #[error("`{key}` is {value}, but must lie between {min} and {max}")]
    Config {
        /// Key.
        key: String,
        /// Value found.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Another rig answers in this domain.
    #[error("domain `{domain}` is in use by another rig; end that one or name another domain")]
    DomainInUse {
        /// The domain.
        domain: String,
    },
    /// The arm did not start.
    #[error(transparent)]
    Arm(#[from] ArmStartError),
    /// The rope could not be simulated.
    #[error("the rope cannot be simulated")]
    Rope(#[from] SimulateError),
    /// The rope's motion became infinite.
    #[error("the simulated rope diverged; choose a rope within the documented ranges")]
    RopeDiverged,
    /// The machine lost the thread of the arm's motion.
    #[error(
        "the simulation lost {gap_s:.2} s of the arm's motion; the machine is too busy, stop other programs"
    )]
    FellBehind {
        /// Missing time (s).
        gap_s: f64,
    },
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
    /// A part of the rig ended by a bug.
    #[error("the rig's thread `{name}` panicked; see the messages above")]
    Panicked {
        /// Which one.
        name: &'static str,
    },
}
