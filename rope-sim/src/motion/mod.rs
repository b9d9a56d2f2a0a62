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

/// Why a motion cannot be built: which of its samples are unusable, and what they must be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct MotionError(String);

/// Checks that a motion has enough samples, at times that are finite and increase.
fn check_times(
    needed: usize,
    times_s: impl ExactSizeIterator<Item = f64>,
) -> Result<(), MotionError> {
    let found = times_s.len();
    if found < needed {
        return Err(MotionError(format!(
            "a motion needs at least {needed} samples, found {found}"
        )));
    }
    let mut before_s = f64::NEG_INFINITY;
    for (index, time_s) in times_s.enumerate() {
        if !time_s.is_finite() {
            return Err(not_finite(index));
        }
        if time_s <= before_s {
            return Err(MotionError(format!(
                "time {time_s} s of sample {index} is not after {before_s} s of the one before"
            )));
        }
        before_s = time_s;
    }
    Ok(())
}

fn not_finite(index: usize) -> MotionError {
    MotionError(format!("sample {index} holds a number that is not finite"))
}
