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

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;

    #[test]
    fn derivatives_are_those_of_the_pose() {
        let waypoints = [
            JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
            JointVector([0.3, -0.2, 0.4, 0.7, -0.5, 1.1, 0.6]),
            JointVector([0.1, -0.5, 0.2, 1.0, 0.3, 1.6, -0.4]),
        ];
        let arm = PlannedArm::new(
            JointTrajectory::new(&[0.0, 0.5, 1.1], &waypoints).unwrap(),
            Pole::default(),
        );
        let d = 1e-5;
        for t in [0.1, 0.33, 0.7, 1.0] {
            let (before, now, after) = (arm.at(t - d), arm.at(t), arm.at(t + d));
            let v = (after.p_m - before.p_m) / (2.0 * d);
            let a = (after.v_m_s - before.v_m_s) / (2.0 * d);
            let alpha = (after.w_rad_s - before.w_rad_s) / (2.0 * d);
            assert!((v - now.v_m_s).norm() < 1e-6);
            assert!((a - now.a_m_s2).norm() < 1e-4);
            assert!((alpha - now.alpha_rad_s2).norm() < 1e-4);
        }
        assert_eq!(arm.at(-1.0).v_m_s.norm(), 0.0);
        assert_eq!(arm.at(9.0).p_m, arm.at(1.1 + 1e-9).p_m);
    }
}
