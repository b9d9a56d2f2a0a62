//! Pose of the tool centre point as the arm writes it.

use super::bytes::Fields;
use arm_model::kinematics;
use nalgebra::{Matrix3, Vector3};

/// A pose in the arm's base frame: position and fixed-axis roll, pitch, yaw
/// (`R = Rz Ry Rx`).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TcpPose {
    /// Position (m).
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw (rad).
    pub rpy_rad: [f64; 3],
}

impl TcpPose {
    /// From an origin (m) and an attitude.
    #[must_use]
    pub fn from_frame(origin_m: &Vector3<f64>, attitude: &Matrix3<f64>) -> Self {
        Self {
            position_m: [origin_m.x, origin_m.y, origin_m.z],
            rpy_rad: kinematics::roll_pitch_yaw(attitude),
        }
    }

    /// Position as a vector (m).
    #[must_use]
    pub fn position(&self) -> Vector3<f64> {
        Vector3::from(self.position_m)
    }

    /// Attitude as a rotation matrix.
    #[must_use]
    pub fn attitude(&self) -> Matrix3<f64> {
        let [roll, pitch, yaw] = self.rpy_rad;
        *nalgebra::Rotation3::from_euler_angles(roll, pitch, yaw).matrix()
    }

    /// Whether no number is NaN or infinite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.position_m.iter().all(|v| v.is_finite()) && self.rpy_rad.iter().all(|v| v.is_finite())
    }

    pub(super) fn fields(&mut self, wire: &mut impl Fields) {
        wire.lengths(&mut self.position_m);
        wire.f32s_le(&mut self.rpy_rad);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attitude_inverts_roll_pitch_yaw() {
        let pose = TcpPose {
            position_m: [0.1, 0.2, 0.3],
            rpy_rad: [-3.0, 0.17, -0.7],
        };
        let back = TcpPose::from_frame(&pose.position(), &pose.attitude());
        for (a, b) in back.rpy_rad.iter().zip(pose.rpy_rad) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}
