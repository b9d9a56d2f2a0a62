//! Kinematics of the xArm 7: poses of links and flange, velocities and accelerations from
//! joint motion.
//!
//! Joint origins are the URDF form of the modified Denavit-Hartenberg table of
//! the vendor (UFACTORY xArm 7 manual); each joint turns about the z axis of
//! its own frame. The flange is frame 7, its z axis points out of the tool side.

use crate::exact;
use crate::joint::{JOINTS, JointState, JointVector};
use nalgebra::{Matrix3, Vector3};

/// Origin of each joint in its parent's frame (m).
pub const JOINT_ORIGIN_M: [[f64; 3]; JOINTS] = [
    [0.0, 0.0, 0.267],
    [0.0, 0.0, 0.0],
    [0.0, -0.293, 0.0],
    [0.0525, 0.0, 0.0],
    [0.0775, -0.3425, 0.0],
    [0.0, 0.0, 0.0],
    [0.076, 0.097, 0.0],
];

/// Quarter turns about the parent's x axis before each joint's own turn.
pub const JOINT_QUARTER_TURNS_X: [i8; JOINTS] = [0, -1, 1, 1, 1, 1, -1];

/// Fixed rotation of joint `i`'s frame in its parent at zero angle.
fn rest_rotation(joint: usize) -> Matrix3<f64> {
    match JOINT_QUARTER_TURNS_X[joint] {
        1 => Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
        -1 => Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        _ => Matrix3::identity(),
    }
}

fn turn_z(angle_rad: f64) -> Matrix3<f64> {
    let (s, c) = libm::sincos(angle_rad);
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// Rigid motion of a frame expressed in the world: pose and its first two time
/// derivatives. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameMotion {
    /// Origin (m).
    pub p_m: Vector3<f64>,
    /// Attitude, frame to world; columns are the frame's axes.
    pub r: Matrix3<f64>,
    /// Velocity of the origin (m/s).
    pub v_m_s: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub w_rad_s: Vector3<f64>,
    /// Acceleration of the origin (m/s²).
    pub a_m_s2: Vector3<f64>,
    /// Angular acceleration (rad/s²).
    pub alpha_rad_s2: Vector3<f64>,
}

impl FrameMotion {
    /// The world frame, at rest.
    #[must_use]
    pub fn world() -> Self {
        Self {
            p_m: Vector3::zeros(),
            r: Matrix3::identity(),
            v_m_s: Vector3::zeros(),
            w_rad_s: Vector3::zeros(),
            a_m_s2: Vector3::zeros(),
            alpha_rad_s2: Vector3::zeros(),
        }
    }

    /// The point fixed in this frame at `offset_m`, with the frame's attitude.
    #[must_use]
    pub fn at_offset(&self, offset_m: &Vector3<f64>) -> Self {
        let arm = self.r * offset_m;
        Self {
            p_m: self.p_m + arm,
            v_m_s: self.v_m_s + self.w_rad_s.cross(&arm),
            a_m_s2: self.a_m_s2
                + self.alpha_rad_s2.cross(&arm)
                + self.w_rad_s.cross(&self.w_rad_s.cross(&arm)),
            ..*self
        }
    }
}

/// Motion of every link frame 1..=7 for a joint motion. RT-safe (no allocation,
/// bounded).
#[must_use]
pub fn link_motions(state: &JointState) -> [FrameMotion; JOINTS] {
    let mut frame = FrameMotion::world();
    core::array::from_fn(|i| {
        let at_joint = frame.at_offset(&Vector3::from(JOINT_ORIGIN_M[i]));
        let parent_r = frame.r * rest_rotation(i);
        let axis: Vector3<f64> = parent_r.column(2).into();
        let spin = axis * state.qd[i];
        frame = FrameMotion {
            r: parent_r * turn_z(state.q[i]),
            w_rad_s: frame.w_rad_s + spin,
            alpha_rad_s2: frame.alpha_rad_s2 + axis * state.qdd[i] + frame.w_rad_s.cross(&spin),
            ..at_joint
        };
        frame
    })
}

/// Poses of the link frames 1..=7 as (origin, attitude). RT-safe.
#[must_use]
pub fn link_poses(q: &JointVector) -> [(Vector3<f64>, Matrix3<f64>); JOINTS] {
    let mut p = Vector3::zeros();
    let mut r = Matrix3::identity();
    core::array::from_fn(|i| {
        p += r * Vector3::from(JOINT_ORIGIN_M[i]);
        r = r * rest_rotation(i) * turn_z(q[i]);
        (p, r)
    })
}

/// Flange pose as (origin in m, attitude). RT-safe.
#[must_use]
pub fn flange_pose(q: &JointVector) -> (Vector3<f64>, Matrix3<f64>) {
    link_poses(q)[JOINTS - 1]
}

/// Flange motion. RT-safe.
#[must_use]
pub fn flange_motion(state: &JointState) -> FrameMotion {
    link_motions(state)[JOINTS - 1]
}

/// Fixed-axis roll, pitch, yaw (`Rz Ry Rx`) of an attitude, as the arm reports it.
#[must_use]
pub fn roll_pitch_yaw(r: &Matrix3<f64>) -> [f64; 3] {
    let across = exact::sqrt(r[(0, 0)] * r[(0, 0)] + r[(1, 0)] * r[(1, 0)]);
    let pitch = libm::atan2(-r[(2, 0)], across);
    [
        libm::atan2(r[(2, 1)], r[(2, 2)]),
        pitch,
        libm::atan2(r[(1, 0)], r[(0, 0)]),
    ]
}

/// Speed of a point at `offset_m` in the flange frame (m/s). RT-safe.
#[must_use]
pub fn tool_speed_m_s(q: &JointVector, qd: &JointVector, offset_m: &Vector3<f64>) -> f64 {
    let state = JointState {
        q: *q,
        qd: *qd,
        qdd: JointVector::ZERO,
    };
    flange_motion(&state).at_offset(offset_m).v_m_s.norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(q: [f64; 7], p_mm: [f64; 3], rpy: Option<[f64; 3]>) {
        let (p, r) = flange_pose(&JointVector(q));
        for i in 0..3 {
            assert!((p[i] * 1e3 - p_mm[i]).abs() < 5e-4, "{p} against {p_mm:?}");
        }
        if let Some(want) = rpy {
            let got = roll_pitch_yaw(&r);
            for i in 0..3 {
                let d = (got[i] - want[i]).rem_euclid(core::f64::consts::TAU);
                assert!(
                    d.min(core::f64::consts::TAU - d) < 1e-6,
                    "{got:?} against {want:?}"
                );
            }
        }
    }

    #[test]
    fn vendor_check_values() {
        check(
            [0.0; 7],
            [206.0, 0.0, 120.5],
            Some([core::f64::consts::PI, 0.0, 0.0]),
        );
        check(
            [0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.7],
            [302.8656, 119.2651, 225.5813],
            Some([-3.001_299, 0.171_399, -0.708_722]),
        );
        check(
            [0.0, -0.5, 0.0, 0.5, 0.0, 1.0, 0.0],
            [311.679, 0.0, 332.462],
            None,
        );
    }
}
