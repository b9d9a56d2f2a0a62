//! Why a simulation is refused.

use crate::lanes::Kernel;
use crate::scene::SceneError;
use crate::unusable::Unusable;
use shared_types::rope::RopeError;

/// Why [`crate::roll_out`] gave nothing.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// A field of [`crate::SimOptions`] has an unusable value.
    #[error("simulation option {0}")]
    Option(Unusable),
    /// The kernel asked for needs instructions that this processor lacks.
    #[error("this processor cannot run the kernel {0:?}")]
    KernelUnavailable(Kernel),
    /// A frame lies outside the simulated time.
    #[error(
        "frames from {first_s} s to {last_s} s do not fit into the simulated 0 s to {horizon_s} s"
    )]
    FramesOutsideHorizon {
        /// Time of the first frame (s).
        first_s: f64,
        /// Time of the last frame (s).
        last_s: f64,
        /// End of the simulation (s).
        horizon_s: f64,
    },
    /// A rope is not physical.
    #[error("candidate {candidate}: {source}")]
    Rope {
        /// Index of the candidate, from 0.
        candidate: usize,
        /// Which parameter, and its limits.
        source: RopeError,
    },
    /// A field of [`crate::RopeExtras`] or [`crate::AirDrag`] is unusable.
    #[error("candidate {candidate}: {unusable}")]
    Extras {
        /// Index of the candidate, from 0.
        candidate: usize,
        /// The number.
        unusable: Unusable,
    },
    /// The scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A motion ends before the simulation does and is not known to hold.
    #[error(
        "candidate {candidate}: its motion ends at {ends_s} s, before the horizon of {horizon_s} s"
    )]
    MotionTooShort {
        /// Index of the candidate, from 0.
        candidate: usize,
        /// End of the motion (s).
        ends_s: f64,
        /// End of the simulation (s).
        horizon_s: f64,
    },
    /// A motion gave NaN or infinity.
    #[error("candidate {candidate}: its attach motion is not finite at {time_s} s")]
    MotionNotFinite {
        /// Index of the candidate, from 0.
        candidate: usize,
        /// When (s).
        time_s: f64,
    },
    /// A worker thread ended without a result: a fault of this program.
    #[error("a simulation thread ended without a result; this is a fault of the program")]
    WorkerPanicked,
}

impl SimulateError {
    /// Index of the candidate at fault, if one is.
    #[must_use]
    pub fn candidate(mut self) -> Option<usize> {
        self.candidate_mut().copied()
    }

    /// The same with another index for the candidate at fault.
    pub(crate) fn of_candidate(mut self, index: usize) -> Self {
        if let Some(candidate) = self.candidate_mut() {
            *candidate = index;
        }
        self
    }

    fn candidate_mut(&mut self) -> Option<&mut usize> {
        match self {
            Self::Rope { candidate, .. }
            | Self::Extras { candidate, .. }
            | Self::MotionTooShort { candidate, .. }
            | Self::MotionNotFinite { candidate, .. }
            | Self::Scene(SceneError::StartsInside { candidate, .. }) => Some(candidate),
            _ => None,
        }
    }
}
