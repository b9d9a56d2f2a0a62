//! The arm's own geometry beside the model that plans are made with: how far its tool is from
//! pose to pose, by its own kinematics. Nothing moves for it, and where the arm has its base
//! frame does not matter.

use super::{SetUp, SetUpError, refuse};
use crate::session::ArmSession;
use crate::xarm::{Command, ReplyData, TcpPose};
use arm_model::{JointVector, kinematics};
use nalgebra::Vector3;
use shared_types::FaultCode;

/// Poses asked for (rad): every length and the zero of joints 2 to 6 shows in them.
const POSES: [JointVector; 4] = [
    JointVector::ZERO,
    JointVector([0.0, -0.5, 0.0, 0.5, 0.0, 1.0, 0.0]),
    JointVector([0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.7]),
    JointVector([-0.8, 0.5, 1.0, 1.5, -1.2, 0.9, 2.0]),
];
/// An arm that is further from the model is another one (m).
const REFUSED_M: f64 = 0.01;
/// One that is further has a calibration of its own, which plans do not know (m).
const WARNED_M: f64 = 0.001;

/// Where the model puts a point in the flange frame (m) in each pose.
fn by_model(offset_m: &Vector3<f64>) -> [Vector3<f64>; POSES.len()] {
    POSES.map(|q| {
        let (flange_m, attitude) = kinematics::flange_pose(&q);
        flange_m + attitude * offset_m
    })
}

/// Largest difference of a distance between two poses from the model's (m), whether the arm means
/// its tool centre point or the flange; infinite for what is no number.
fn off_model_m(told_m: &[Vector3<f64>; POSES.len()], tool_m: [f64; 3]) -> f64 {
    let worst_m = |model_m: [Vector3<f64>; POSES.len()]| {
        let pairs = (0..POSES.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let off_m = pairs.map(|(a, b)| {
            let off_m = (told_m[a] - told_m[b]).norm() - (model_m[a] - model_m[b]).norm();
            if off_m.is_finite() {
                off_m.abs()
            } else {
                f64::INFINITY
            }
        });
        off_m.fold(0.0, f64::max)
    };
    worst_m(by_model(&tool_m.into())).min(worst_m(by_model(&Vector3::zeros())))
}

impl SetUp<'_> {
    /// Compares the geometry that the arm calculates with and that of the model; a warning is
    /// added where they differ, but by no more than a calibration may.
    pub(super) fn match_geometry(
        &self,
        session: &mut ArmSession,
        warnings: &mut Vec<String>,
    ) -> Result<String, SetUpError> {
        let mut told_m = [Vector3::zeros(); POSES.len()];
        for (told_m, q) in told_m.iter_mut().zip(POSES) {
            match session.ask(&Command::ForwardKinematics(q))? {
                ReplyData::Pose(TcpPose { position_m, .. }) => *told_m = position_m.into(),
                _ => return Ok("the arm does not say".to_owned()),
            }
        }
        let off_m = off_model_m(&told_m, self.limits.tcp_offset_m);
        let told = format!(
            "between {} poses the tool moves as in the model to {:.2} mm",
            POSES.len(),
            1e3 * off_m
        );
        if off_m > REFUSED_M {
            let message = format!(
                "{told}: this is not the geometry of an xArm 7 with this tool; compare model and tool centre point in the vendor's tool"
            );
            return refuse(FaultCode::ArmDiffers, message);
        }
        if off_m > WARNED_M {
            warnings.push(format!(
                "{told}: the arm has a calibration of its own, by which throws may miss"
            ));
        }
        Ok(told)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::kinematics::flange_pose;

    const TOOL_M: [f64; 3] = [0.0, 0.0, 0.172];

    /// The vendor's kinematics without a tool, in the first three poses; the fourth is the model's.
    fn vendor() -> [Vector3<f64>; POSES.len()] {
        let mut told_m = by_model(&Vector3::zeros());
        let vendor_mm = [
            [206.0, 0.0, 120.5],
            [311.679, 0.0, 332.462],
            [302.8656, 119.2651, 225.5813],
        ];
        for (told_m, mm) in told_m.iter_mut().zip(vendor_mm) {
            *told_m = Vector3::from(mm) * 1e-3;
        }
        told_m
    }

    #[test]
    fn the_vendors_own_poses_fit_with_any_tool_and_base() {
        for tool_m in [[0.0; 3], TOOL_M] {
            assert!(off_model_m(&vendor(), tool_m) < 1e-6);
            let lifted = vendor().map(|p| p + Vector3::new(0.3, -0.1, 0.8));
            assert!(off_model_m(&lifted, tool_m) < 1e-6);
            assert!(off_model_m(&by_model(&tool_m.into()), tool_m) < 1e-12);
        }
    }

    #[test]
    fn another_length_another_zero_and_no_number_show() {
        // Joints 2 to 6 off by one degree.
        for j in 1..6 {
            let told_m = POSES.map(|mut q| {
                q[j] += 1_f64.to_radians();
                let (flange_m, attitude) = flange_pose(&q);
                flange_m + attitude * Vector3::from(TOOL_M)
            });
            let off_m = off_model_m(&told_m, TOOL_M);
            assert!(off_m > WARNED_M && off_m < REFUSED_M, "joint {j}: {off_m}");
        }
        let another_tool = by_model(&Vector3::new(0.03, 0.0, 0.10));
        assert!(off_model_m(&another_tool, TOOL_M) > REFUSED_M);
        let mut nowhere = vendor();
        nowhere[1].y = f64::NAN;
        assert_eq!(off_model_m(&nowhere, TOOL_M), f64::INFINITY);
    }
}
