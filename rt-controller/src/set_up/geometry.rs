//! The arm's own geometry beside the model that plans are made with: where it puts its tool in
//! some poses, by its own kinematics. Nothing moves for it.

use super::{SetUp, SetUpError, refuse};
use crate::session::ArmSession;
use crate::xarm::{Command, ReplyData, TcpPose};
use arm_model::{JointVector, kinematics};
use nalgebra::Vector3;
use shared_types::FaultCode;

/// Poses asked for (rad): every length and every joint's zero shows in one of them.
const POSES: [JointVector; 3] = [
    JointVector([0.0, -0.5, 0.0, 0.5, 0.0, 1.0, 0.0]),
    JointVector([0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.7]),
    JointVector([-0.8, 0.5, 1.0, 1.5, -1.2, 0.9, 2.0]),
];
/// A tool that is further from the model's is not that of this arm (m).
const REFUSED_M: f64 = 0.01;
/// One that is further is an arm with a calibration of its own, which plans do not know (m).
const WARNED_M: f64 = 0.001;

/// Distance of the tool in pose `q` from the model's (m), whether the arm means its tool centre
/// point, `tool_m` from the flange, or the flange; infinite for what is no number.
fn off_model_m(q: &JointVector, told: &TcpPose, tool_m: [f64; 3]) -> f64 {
    if !told.is_finite() {
        return f64::INFINITY;
    }
    let (flange_m, attitude) = kinematics::flange_pose(q);
    let tool_m = flange_m + attitude * Vector3::from(tool_m);
    let off_m = |model_m: Vector3<f64>| (model_m - told.position()).norm();
    off_m(tool_m).min(off_m(flange_m))
}

impl SetUp<'_> {
    /// Compares where the arm and the model put the tool; a warning is added where that is not
    /// the same, but may be a calibration.
    pub(super) fn match_geometry(
        &self,
        session: &mut ArmSession,
        warnings: &mut Vec<String>,
    ) -> Result<String, SetUpError> {
        let mut worst_m = 0.0_f64;
        for q in POSES {
            let ReplyData::Pose(told) = session.ask(&Command::ForwardKinematics(q))? else {
                return Ok("the arm does not say".to_owned());
            };
            worst_m = worst_m.max(off_model_m(&q, &told, self.limits.tcp_offset_m));
        }
        let told = format!(
            "tool {:.2} mm from where plans have it, in the worst of {} poses",
            1e3 * worst_m,
            POSES.len()
        );
        if worst_m > REFUSED_M {
            let message = format!(
                "{told}: this is not the geometry of an xArm 7 with this tool; compare model and tool centre point in the vendor's tool"
            );
            return refuse(FaultCode::ArmDiffers, message);
        }
        if worst_m > WARNED_M {
            warnings.push(format!(
                "{told}: the arm has a calibration of its own, which throws miss their target by"
            ));
        }
        Ok(told)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::kinematics::flange_pose;

    fn at(position_mm: [f64; 3]) -> TcpPose {
        TcpPose {
            position_m: position_mm.map(|mm| 1e-3 * mm),
            rpy_rad: [0.0; 3],
        }
    }

    #[test]
    fn the_vendors_own_poses_fit_and_another_geometry_does_not() {
        // Measured with the vendor's kinematics, without a tool.
        let vendor = [
            (POSES[0], [311.679, 0.0, 332.462]),
            (POSES[1], [302.8656, 119.2651, 225.5813]),
        ];
        let tool_m = [0.0, 0.0, 0.172];
        for (q, position_mm) in vendor {
            for tool_m in [[0.0; 3], tool_m] {
                let off_m = off_model_m(&q, &at(position_mm), tool_m);
                assert!(off_m < 1e-6, "{off_m}");
            }
            let longer = at([position_mm[0], position_mm[1], position_mm[2] + 12.0]);
            assert!(off_model_m(&q, &longer, tool_m) > REFUSED_M);
        }
        let q = POSES[2];
        let (flange_m, attitude) = flange_pose(&q);
        let tcp = flange_m + attitude * Vector3::from(tool_m);
        let told = TcpPose::from_frame(&tcp, &attitude);
        assert!(off_model_m(&q, &told, tool_m) < 1e-12);
        // A joint's zero that is off by half a degree.
        for j in 0..6 {
            let mut off = q;
            off[j] += 0.5_f64.to_radians();
            let (flange_m, attitude) = flange_pose(&off);
            let tcp = flange_m + attitude * Vector3::from(tool_m);
            let told = TcpPose::from_frame(&tcp, &attitude);
            assert!(off_model_m(&q, &told, tool_m) > WARNED_M, "joint {j}");
        }
        let mut nowhere = told;
        nowhere.position_m[1] = f64::NAN;
        assert_eq!(off_model_m(&q, &nowhere, tool_m), f64::INFINITY);
    }
}
