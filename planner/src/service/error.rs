//! Why the planner's service ended, or a request failed.

use crate::identify::IdentifyError;
use crate::plan::PlanError;
use crate::settle::SettleError;
use shared_types::ipc::IpcError;

/// Why the process ended, or a request failed.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// Shared memory failed.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The requested keypoints never came.
    #[error(
        "{found} of {wanted} keypoint frames are here, the first stamped {first_stamp_ns} ns; track the recording first"
    )]
    MissingKeypoints {
        /// Frames found.
        found: usize,
        /// Frames requested.
        wanted: usize,
        /// Stamp requested (CLOCK_MONOTONIC, ns).
        first_stamp_ns: u64,
    },
    /// Measured joints are missing or wrong.
    #[error("measured joints: {0}")]
    Joints(#[from] rope_sim::MotionError),
    /// Identification failed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Planning a throw failed.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Planning a settling move failed.
    #[error(transparent)]
    Settle(#[from] SettleError),
}
