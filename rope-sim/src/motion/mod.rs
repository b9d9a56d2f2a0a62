//! Motions of the attach frame: from filmed or given poses, from a planned joint
//! trajectory, from measured joints.
//!
//! The rope feels the attach frame through its acceleration, so every motion here
//! has continuous accelerations that are the derivatives of its own poses; none
//! comes from differences of neighbouring samples.

mod measured;
mod planned;
mod pose_track;

pub use measured::MeasuredArm;
pub use planned::PlannedArm;
pub use pose_track::{PoseRow, PoseTrack};

use arm_model::kinematics::FrameMotion;
use arm_model::{JointState, Pole};

/// Motion of the attach frame A in the world: pose and its exact first two
/// derivatives. The rope at rest leaves A along its -z axis. A function of time (s) is
/// one that never ends and whose acceleration never jumps.
pub trait AttachMotion: Sync {
    /// Pose, velocity and acceleration at `t_s`; any time gives an answer.
    fn at(&self, t_s: f64) -> FrameMotion;

    /// Time at which the described motion ends (s); it starts at 0.
    fn duration_s(&self) -> f64 {
        f64::INFINITY
    }

    /// Times at which the acceleration jumps (ends of clamped splines); the
    /// integrator puts step boundaries there and restarts.
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Whether the frame is known to hold still after [`AttachMotion::duration_s`].
    /// Where it is not, simulating beyond that time is refused.
    fn holds_after_end(&self) -> bool {
        true
    }

    /// State of the arm's joints that, with the [`AttachMotion::pole`], puts the attach
    /// frame where [`AttachMotion::at`] says, where there is an arm: many instants of it
    /// are evaluated side by side then.
    fn joints_at(&self, _t_s: f64) -> Option<JointState> {
        None
    }

    /// The pole on that arm.
    fn pole(&self) -> Option<Pole> {
        None
    }
}

impl<F: Fn(f64) -> FrameMotion + Sync> AttachMotion for F {
    fn at(&self, t_s: f64) -> FrameMotion {
        self(t_s)
    }
}

impl core::fmt::Debug for dyn AttachMotion + '_ {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("AttachMotion")
    }
}

/// Why a motion cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// Too few samples to say anything about acceleration.
    #[error("a motion needs at least {needed} samples, found {found}")]
    TooFewSamples {
        /// Samples given.
        found: usize,
        /// Samples needed.
        needed: usize,
    },
    /// As many times as samples are needed.
    #[error("`times_s` has {times} entries but `q` has {samples}")]
    LengthMismatch {
        /// Entries in `times_s`.
        times: usize,
        /// Entries in `q`.
        samples: usize,
    },
    /// A number is NaN or infinite.
    #[error("sample {index} holds a number that is not finite")]
    NotFinite {
        /// Index of the sample, from 0.
        index: usize,
    },
    /// Times must increase.
    #[error("time {time_s} s of sample {index} is not after {before_s} s of the one before")]
    TimeOrder {
        /// Index of the sample, from 0.
        index: usize,
        /// Its time (s).
        time_s: f64,
        /// Time of the sample before (s).
        before_s: f64,
    },
    /// An attitude is not a unit quaternion, not even nearly.
    #[error("quaternion of sample {index} has length {norm}; it must be 1 within 1 %")]
    NotAnAttitude {
        /// Index of the sample, from 0.
        index: usize,
        /// Length found.
        norm: f64,
    },
    /// The samples span more time than a motion may.
    #[error("the samples span {span_s} s; at most {max_s} s are accepted")]
    TooLong {
        /// Time from first to last sample (s).
        span_s: f64,
        /// Longest accepted (s).
        max_s: f64,
    },
}

/// Checks that times are finite and increase.
fn check_times(times_s: impl IntoIterator<Item = f64>) -> Result<(), MotionError> {
    let mut before_s = f64::NEG_INFINITY;
    for (index, time_s) in times_s.into_iter().enumerate() {
        if !time_s.is_finite() {
            return Err(MotionError::NotFinite { index });
        }
        if time_s <= before_s {
            return Err(MotionError::TimeOrder {
                index,
                time_s,
                before_s,
            });
        }
        before_s = time_s;
    }
    Ok(())
}
