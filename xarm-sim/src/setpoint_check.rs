//! What the controller checks a setpoint against.

use arm_model::capsules::self_clearance_m;
use arm_model::{JOINTS, JointVector, Limits, kinematics};
use nalgebra::Vector3;
use rt_controller::xarm::ErrorCode;

/// Part of a limit that rounding to the wire's f32 may exceed it by.
const ROUNDING: f64 = 1e-3;

/// How far outside its range a setpoint is still taken (rad): 0.1 deg, as in the
/// SDK's own test. The joint goes to the end of the range then.
const RANGE_TOLERANCE_RAD: f64 = core::f64::consts::PI / 1800.0;

/// What a setpoint is checked against.
#[derive(Debug, Clone, Copy)]
pub(super) struct SetpointLimits<'a> {
    pub(super) joints: &'a Limits,
    /// Tool centre point in the flange frame (m).
    pub(super) tcp_offset: Vector3<f64>,
    /// Largest speed of that point (m/s).
    pub(super) tcp_speed_max_m_s: f64,
    /// What a faster setpoint raises: C60, on old firmware C24.
    pub(super) tcp_speed_code: ErrorCode,
    /// Whether self collision is looked for.
    pub(super) self_collision: bool,
    /// Box that the point must stay in: smallest, largest coordinates (m).
    pub(super) fence_m: Option<[Vector3<f64>; 2]>,
}

impl SetpointLimits<'_> {
    /// The position inside the joint range that a setpoint asks for.
    ///
    /// # Errors
    /// C23 further outside than is tolerated.
    pub(super) fn in_range(&self, q: &JointVector) -> Result<JointVector, ErrorCode> {
        let (min, max) = (&self.joints.position_min_rad, &self.joints.position_max_rad);
        let inside = JointVector(core::array::from_fn(|j| q[j].clamp(min[j], max[j])));
        if (*q - inside).max_abs() > RANGE_TOLERANCE_RAD {
            return Err(ErrorCode::JOINT_LIMIT);
        }
        Ok(inside)
    }

    /// Whether a pose is one that the arm must not take.
    ///
    /// # Errors
    /// C22 for self collision, C35 outside the safety boundary.
    pub(super) fn check_pose(&self, q: &JointVector) -> Result<(), ErrorCode> {
        if self.self_collision && self_clearance_m(q) < 0.0 {
            return Err(ErrorCode::SELF_COLLISION);
        }
        let Some([min, max]) = self.fence_m else {
            return Ok(());
        };
        let tool = tool_position(q, &self.tcp_offset);
        if tool.sup(&min).inf(&max) == tool {
            Ok(())
        } else {
            Err(SAFETY_BOUNDARY)
        }
    }
}

/// C35: safety boundary.
const SAFETY_BOUNDARY: ErrorCode = ErrorCode(35);

/// What a setpoint's speed is measured by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// The setpoint before (rad).
    pub(super) from: JointVector,
    /// Time that the way from there counts for (s).
    pub(super) interval_s: f64,
}

impl Step {
    /// The speed of the joints on the way to `q` (rad/s).
    ///
    /// # Errors
    /// C24 too fast for a joint, C60 for the tool.
    pub(super) fn speed(
        &self,
        q: &JointVector,
        limits: &SetpointLimits<'_>,
    ) -> Result<JointVector, ErrorCode> {
        let Self { from, interval_s } = *self;
        let qd = (*q - from) * (1.0 / interval_s);
        let allowed = 1.0 + ROUNDING;
        if (0..JOINTS).any(|j| qd[j].abs() > limits.joints.velocity_max_rad_s[j] * allowed) {
            return Err(ErrorCode::SPEED_LIMIT);
        }
        let way = tool_position(q, &limits.tcp_offset) - tool_position(&from, &limits.tcp_offset);
        if way.norm() > limits.tcp_speed_max_m_s * allowed * interval_s {
            return Err(limits.tcp_speed_code);
        }
        Ok(qd)
    }
}

fn tool_position(q: &JointVector, offset: &Vector3<f64>) -> Vector3<f64> {
    let (p, r) = kinematics::flange_pose(q);
    p + r * offset
}

#[cfg(test)]
impl<'a> SetpointLimits<'a> {
    /// Joints, and 1.2 m/s of the bare flange; neither self collision nor a boundary.
    pub(super) fn of_joints(joints: &'a Limits) -> Self {
        Self {
            joints,
            tcp_offset: Vector3::zeros(),
            tcp_speed_max_m_s: 1.2,
            tcp_speed_code: ErrorCode::TCP_SPEED_LIMIT,
            self_collision: false,
            fence_m: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_that_collide_or_leave_the_boundary_are_refused() {
        let limits = Limits::default();
        let mut folded = JointVector::ZERO;
        folded[5] = 3.1;
        let mut checks = SetpointLimits::of_joints(&limits);
        assert_eq!(checks.check_pose(&folded), Ok(()));
        checks.self_collision = true;
        assert_eq!(checks.check_pose(&folded), Err(ErrorCode::SELF_COLLISION));
        // The zero pose has its flange at 206, 0, 120.5 mm.
        let box_up_to = |z: f64| Some([Vector3::repeat(-1.0), Vector3::new(1.0, 1.0, z)]);
        checks.fence_m = box_up_to(0.13);
        assert_eq!(checks.check_pose(&JointVector::ZERO), Ok(()));
        checks.fence_m = box_up_to(0.11);
        assert_eq!(checks.check_pose(&JointVector::ZERO), Err(ErrorCode(35)));
    }
}
