//! Why the controller process ends.

use crate::config::ConfigError;
use shared_types::ipc::IpcError;

/// Why the controller cannot run, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// The configuration is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The shadow controller's motion is refused.
    #[error("the motion of the shadow controller is refused, which is a defect: {0}")]
    CacheWarmUp(#[from] arm_model::TrajectoryError),
    /// Shared memory does not work.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// A full shared memory would end this process without a word, later.
    #[error(
        "shared memory (/dev/shm) has {free_mb} MB free, but the controller takes {needed_mb} MB: end other programs, remove what killed ones left there, or mount it larger"
    )]
    SharedMemoryFull {
        /// Free (MB).
        free_mb: u64,
        /// Needed (MB).
        needed_mb: u64,
    },
    /// Real-time properties are required but cannot be had.
    #[error("a real arm needs real-time properties that cannot be had: {} (`simulated = true` is for `wag rig`)", .0.join("; "))]
    NotRealTime(Vec<String>),
    /// The system has no more threads.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// The control loop ended by itself; the arm was asked to stop.
    #[error("the control loop ended unexpectedly; the arm was asked to stop. This is a defect")]
    LoopEnded,
    /// The control loop ended before it was set up.
    #[error("the control loop ended while it was set up; this is a defect")]
    LoopNotSetUp,
    /// A histogram could not be made.
    #[error("cannot make a latency histogram: {0}")]
    Histogram(#[from] hdrhistogram::CreationError),
}

impl ControllerError {
    /// Reports the real-time properties that could not be had; a refusal where they
    /// are `required`.
    ///
    /// # Errors
    /// [`Self::NotRealTime`].
    pub(crate) fn unless_real_time(
        required: bool,
        warnings: Vec<String>,
    ) -> Result<Vec<String>, Self> {
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        if required && !warnings.is_empty() {
            return Err(Self::NotRealTime(warnings));
        }
        Ok(warnings)
    }
}
