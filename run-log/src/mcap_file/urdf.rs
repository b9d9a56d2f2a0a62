//! The arm as URDF, from the kinematics this program computes with.

use arm_model::kinematics::{JOINT_ORIGIN_M, JOINT_QUARTER_TURNS_X};
use arm_model::{JOINTS, Limits, Pole};
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;

/// Frame of the arm's base, the world.
pub(super) const BASE: &str = "base";
/// Frame at the pole's end.
pub(super) const POLE_END: &str = "pole_end";

/// Name of joint `i` (0-based).
pub(super) fn joint_name(i: usize) -> String {
    format!("joint{}", i + 1)
}

/// Name of the link that joint `i` (0-based) turns.
pub(super) fn link_name(i: usize) -> String {
    format!("link{}", i + 1)
}

/// Links, joints and limits; without meshes, which belong to the arm's maker.
pub(super) fn urdf(limits: &Limits, pole: &Pole) -> String {
    let mut text =
        format!("<?xml version=\"1.0\"?>\n<robot name=\"xarm7\">\n  <link name=\"{BASE}\"/>\n");
    let mut parent = BASE.to_owned();
    for i in 0..JOINTS {
        let ([x, y, z], link) = (JOINT_ORIGIN_M[i], link_name(i));
        let roll = f64::from(JOINT_QUARTER_TURNS_X[i]) * FRAC_PI_2;
        // Writing to a string does not fail.
        let _ = write!(
            text,
            "  <link name=\"{link}\"/>\n  <joint name=\"{}\" type=\"revolute\">\n    \
             <parent link=\"{parent}\"/>\n    <child link=\"{link}\"/>\n    \
             <origin xyz=\"{x} {y} {z}\" rpy=\"{roll} 0 0\"/>\n    <axis xyz=\"0 0 1\"/>\n    \
             <limit lower=\"{}\" upper=\"{}\" velocity=\"{}\" effort=\"0\"/>\n  </joint>\n",
            joint_name(i),
            limits.position_min_rad[i],
            limits.position_max_rad[i],
            limits.velocity_max_rad_s[i],
        );
        parent = link;
    }
    let [x, y, z] = pole.end_m().into();
    let _ = write!(
        text,
        "  <link name=\"{POLE_END}\"/>\n  <joint name=\"pole\" type=\"fixed\">\n    \
         <parent link=\"{parent}\"/>\n    <child link=\"{POLE_END}\"/>\n    \
         <origin xyz=\"{x} {y} {z}\" rpy=\"{} 0 0\"/>\n  </joint>\n</robot>\n",
        std::f64::consts::PI,
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

    fn numbers(text: &str, key: &str) -> Vec<f64> {
        let after = text.split(&format!("{key}=\"")).nth(1).unwrap();
        let inside = after.split('"').next().unwrap();
        inside.split(' ').map(|n| n.parse().unwrap()).collect()
    }

    /// Reads the text as a viewer would and walks down the chain.
    #[test]
    fn a_reader_of_the_text_gets_the_same_pole_end() {
        let pole = Pole {
            offset_m: [0.01, -0.02, 0.03],
            ..Pole::default()
        };
        let text = urdf(&Limits::default(), &pole);
        for q in [
            [0.0; 7],
            [0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.7],
            [-1.0, 0.8, 2.0, 2.4, -0.7, 1.6, 3.0],
        ] {
            let mut pose = Isometry3::identity();
            for (i, joint) in text.split("<joint ").skip(1).enumerate() {
                let (xyz, rpy) = (numbers(joint, "origin xyz"), numbers(joint, "rpy"));
                pose *= Isometry3::from_parts(
                    Translation3::new(xyz[0], xyz[1], xyz[2]),
                    UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]),
                );
                if let Some(angle) = q.get(i) {
                    assert_eq!(numbers(joint, "axis xyz"), [0.0, 0.0, 1.0]);
                    pose *= Isometry3::rotation(Vector3::z() * *angle);
                }
            }
            let (p, r) = pole.attach_pose(&JointVector(q));
            assert!((pose.translation.vector - p).norm() < 1e-12);
            let turned = pose.rotation.to_rotation_matrix();
            assert!((turned.matrix() - r).norm() < 1e-12);
        }
    }
}
