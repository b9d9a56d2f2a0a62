//! The arm and the pole as capsules, placed by joint angles.
//!
//! The one shape of the arm for planner, preflight, simulated arm and renderer.

use crate::cell::Pole;
use crate::geometry::Capsule;
use crate::joint::{JOINTS, JointVector};
use crate::kinematics::link_poses;
use nalgebra::{Matrix3, Vector3};

/// Link (0 = base), axis ends in the link's frame (m) and radius (m).
type LinkCapsule = (u8, [f64; 3], [f64; 3], f64);

/// Number of capsules of base and links.
pub const LINK_CAPSULES: usize = 12;

/// The smallest capsules around the vendor's collision meshes of the 1305 model.
const LINKS: [LinkCapsule; LINK_CAPSULES] = [
    (0, [0.0, 0.0, 0.014], [0.0, 0.0, 0.104], 0.067),
    (1, [0.0, 0.009, 0.0], [0.0, 0.0, -0.070], 0.069),
    (2, [0.0, -0.096, 0.007], [0.0, -0.161, 0.0], 0.050),
    (2, [0.0, -0.143, 0.064], [0.0, 0.0, 0.083], 0.054),
    (3, [0.004, -0.003, -0.065], [0.053, 0.003, 0.0], 0.067),
    (4, [0.077, -0.081, 0.008], [0.076, -0.143, 0.0], 0.051),
    (4, [0.010, -0.005, 0.071], [0.089, -0.121, 0.057], 0.061),
    (5, [0.0, 0.0, -0.163], [0.0, 0.048, -0.101], 0.049),
    (5, [0.0, 0.059, -0.039], [0.0, 0.042, 0.0], 0.048),
    (6, [-0.003, -0.002, 0.017], [0.074, -0.011, 0.007], 0.048),
    (6, [0.011, 0.031, 0.014], [0.077, 0.050, 0.0], 0.042),
    (7, [0.0, 0.0, -0.018], [0.0, -0.016, -0.018], 0.041),
];

/// Places of the frames of links 1 to 7.
type LinkPoses = [(Vector3<f64>, Matrix3<f64>); JOINTS];

fn placed_links(poses: &LinkPoses) -> [(u8, Capsule); LINK_CAPSULES] {
    LINKS.map(|(link, a, b, radius_m)| {
        let place = |p: [f64; 3]| {
            let p = Vector3::from(p);
            link.checked_sub(1).map_or(p, |joint| {
                let (origin, attitude) = &poses[usize::from(joint)];
                origin + attitude * p
            })
        };
        let capsule = Capsule {
            a_m: place(a),
            b_m: place(b),
            radius_m,
        };
        (link, capsule)
    })
}

/// Base and links in the pose `q` (rad), from the base to the flange, each with its link
/// (0 = base); in the world frame.
#[must_use]
pub fn links_at(q: &JointVector) -> [(u8, Capsule); LINK_CAPSULES] {
    placed_links(&link_poses(q))
}

/// The same, then the pole, flange end first; in the world frame.
#[must_use]
pub fn arm_at(q: &JointVector, pole: &Pole) -> ([(u8, Capsule); LINK_CAPSULES], Capsule) {
    let poses = link_poses(q);
    let (flange, attitude) = &poses[JOINTS - 1];
    let pole = Capsule {
        a_m: flange + attitude * Vector3::from(pole.offset_m),
        b_m: flange + attitude * pole.end_m(),
        radius_m: pole.radius_m,
    };
    (placed_links(&poses), pole)
}

/// Smallest gap between links two or more apart in the pose `q` (rad), negative when they
/// overlap (m). Nearer links always touch; the pole, which the arm's controller does not
/// know of, does not count.
#[must_use]
pub fn self_clearance_m(q: &JointVector) -> f64 {
    let links = links_at(q);
    let pairs = links.iter().enumerate().flat_map(|(i, (a, one))| {
        let rest = links[i + 1..].iter();
        rest.filter(move |(b, _)| *b >= a + 2)
            .map(move |(_, other)| one.distance_to_m(other))
    });
    pairs.fold(f64::INFINITY, f64::min)
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    /// The vendor's zero pose is free, its smallest gap 11 mm.
    #[test]
    fn the_zero_pose_is_free_by_eleven_millimetres() {
        let gap_m = self_clearance_m(&JointVector::ZERO);
        assert!((gap_m - 0.011).abs() < 0.002, "{gap_m}");
    }

    #[test]
    fn the_pole_ends_where_the_rope_is_attached() {
        let q = JointVector([0.3, 0.5, -0.2, 1.9, 0.4, 1.2, 0.1]);
        let pole = Pole::default();
        let attach_m = pole.attach_pose(&q).0;
        assert!((arm_at(&q, &pole).1.b_m - attach_m).norm() < 1e-12);
    }
}
