//! The arm following a planned joint trajectory exactly.

use super::AttachMotion;
use arm_model::kinematics::FrameMotion;
use arm_model::{JointState, JointTrajectory, Pole};

/// Attach frame at the pole's end of an arm that follows a trajectory exactly. It
/// holds still before the start and after the end.
#[derive(Debug, Clone)]
pub struct PlannedArm {
    trajectory: JointTrajectory,
    pole: Pole,
}

impl PlannedArm {
    /// The arm on `trajectory`, with this pole on its flange.
    #[must_use]
    pub fn new(trajectory: JointTrajectory, pole: Pole) -> Self {
        Self { trajectory, pole }
    }

    /// The trajectory it follows.
    #[must_use]
    pub fn trajectory(&self) -> &JointTrajectory {
        &self.trajectory
    }
}

impl AttachMotion for PlannedArm {
    fn at(&self, t_s: f64) -> FrameMotion {
        self.pole.attach_motion(&self.trajectory.state_at(t_s))
    }

    fn joints_at(&self, t_s: f64) -> Option<JointState> {
        Some(self.trajectory.state_at(t_s))
    }

    fn pole(&self) -> Option<Pole> {
        Some(self.pole)
    }

    fn duration_s(&self) -> f64 {
        self.trajectory.duration_s()
    }

    /// Both ends: a clamped spline starts and stops with an acceleration.
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![0.0, self.trajectory.duration_s()]
    }
}
