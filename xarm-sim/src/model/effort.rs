//! Plausible torques and currents. Neither the inertia seen by a joint nor the
//! torque per ampere is published; these give the right order of size, so that
//! a reader of reports sees them move with the arm.

use super::ArmModel;
use arm_model::JointVector;

/// Inertia seen by each joint (kg m²).
const INERTIA_KG_M2: JointVector = JointVector([1.5, 1.5, 0.6, 0.6, 0.2, 0.15, 0.05]);
/// Damping of each joint in the vendor's URDF (Nms/rad).
const DAMPING_NMS_RAD: JointVector = JointVector([10.0, 10.0, 5.0, 5.0, 5.0, 2.0, 2.0]);
/// Torque per current (Nm/A).
const TORQUE_PER_CURRENT_NM_A: f64 = 8.0;
/// Current of a joint that hits something (A).
const COLLISION_CURRENT_A: f64 = 12.0;

impl ArmModel {
    /// Torque of each joint (Nm).
    #[must_use]
    pub fn effort_nm(&self) -> JointVector {
        let motion = self.true_motion();
        let inertial = motion.qdd.zip_with(INERTIA_KG_M2, |a, i| a * i);
        inertial + motion.qd.zip_with(DAMPING_NMS_RAD, |v, d| v * d)
    }

    /// Motor current of each joint (A).
    #[must_use]
    pub fn current_a(&self) -> JointVector {
        if self.time < self.spike_until {
            return JointVector::splat(COLLISION_CURRENT_A);
        }
        self.effort_nm() * (1.0 / TORQUE_PER_CURRENT_NM_A)
    }
}
