//! The arm from the moment the rope hung still to the end of a move: measured
//! joints, a hold, then the move.

use super::request::{SettleError, SettleRequest};
use crate::OutOfRange;
use arm_model::kinematics::FrameMotion;
use arm_model::{Cell, JointState, JointTrajectory, JointVector};
use rope_sim::{AttachMotion, MeasuredArm};

/// Largest distance of a joint from the commanded start pose (rad): above what
/// gravity and encoders leave, below what matters to the rope.
const START_TOLERANCE_RAD: f64 = 0.02;

/// Latest start of a move (s): all before it is simulated again and again.
const START_MAX_S: f64 = 1800.0;

/// What happened before the move.
#[derive(Debug)]
pub(super) struct Prelude {
    measured: MeasuredArm,
    pub(super) cell: Cell,
    /// When the move begins (s).
    pub(super) start_s: f64,
    /// Measured minus commanded pose at rest (rad). The arm is taken to stand as
    /// far from its command after the move as before it.
    pub(super) standing_error: JointVector,
}

impl Prelude {
    pub(super) fn new(request: &SettleRequest) -> Result<Self, SettleError> {
        let measured = MeasuredArm::new(&request.times_s, &request.q, request.cell.pole)?;
        let last_s = measured.duration_s();
        let start_s = request.start_s;
        if !(start_s >= last_s && start_s > 0.0 && start_s.is_finite()) {
            return Err(SettleError::Start(format!(
                "the settling move would begin {start_s:.3} s after the rope hung still, but the joints were measured until {last_s:.3} s; begin it later"
            )));
        }
        let expected = "at most half an hour (1800 s)";
        OutOfRange::check([("start_s", start_s, start_s <= START_MAX_S, expected)])?;
        let standing_error = measured.joints_at(start_s).q - request.start_q;
        for (joint, off_rad) in (1..).zip(standing_error.iter()) {
            if off_rad.is_nan() || off_rad.abs() > START_TOLERANCE_RAD {
                return Err(SettleError::Start(format!(
                    "joint {joint} stands {off_rad:.4} rad away from the start of the settling move; hold the start pose first"
                )));
            }
        }
        Ok(Self {
            measured,
            cell: request.cell,
            start_s,
            standing_error,
        })
    }

    /// The arm that makes this move after all that was.
    pub(super) fn then<'a>(&'a self, trajectory: &'a JointTrajectory) -> ChainedArm<'a> {
        ChainedArm {
            prelude: self,
            trajectory,
        }
    }
}

/// Attach frame of an arm that did what was measured, held, and then follows a
/// planned move.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainedArm<'a> {
    prelude: &'a Prelude,
    trajectory: &'a JointTrajectory,
}

impl AttachMotion for ChainedArm<'_> {
    fn at(&self, t_s: f64) -> FrameMotion {
        let since_start_s = t_s - self.prelude.start_s;
        let state = if since_start_s <= 0.0 {
            self.prelude.measured.joints_at(t_s)
        } else {
            let commanded = self.trajectory.state_at(since_start_s);
            JointState {
                q: commanded.q + self.prelude.standing_error,
                ..commanded
            }
        };
        self.prelude.cell.pole.attach_motion(&state)
    }

    fn duration_s(&self) -> f64 {
        self.prelude.start_s + self.trajectory.duration_s()
    }

    /// Both ends of the move: a clamped spline starts and stops with an
    /// acceleration.
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![self.prelude.start_s, self.duration_s()]
    }
}
