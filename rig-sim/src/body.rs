//! The rig's solid bodies: arm and pole as capsules, the column under the arm.

use arm_model::JointVector;
use arm_model::kinematics::{POLE_LENGTH_M, link_poses};
use nalgebra::{Matrix3, Vector3};

/// Radius of the pole on the flange (m).
pub const POLE_RADIUS_M: f64 = 0.008;
/// Half width of the square column whose top carries the arm at z = 0 (m).
pub const COLUMN_HALF_WIDTH_M: f64 = 0.09;
/// Height of the floor (m).
pub const FLOOR_Z_M: f64 = -0.75;

/// Number of capsules of base and links.
pub const LINK_CAPSULES: usize = 12;

/// Part of the rope, measured from the clamp, that lies against the pole's end
/// by construction (m).
const CLAMPED_M: f64 = 0.05;

/// Link (0 = base), axis ends in the link's frame (m), radius (m): the smallest
/// capsules around the vendor's collision meshes of the 1305 arm.
const SHAPE: [(usize, [f64; 3], [f64; 3], f64); LINK_CAPSULES] = [
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

/// All points within `radius_m` of the segment from `a_m` to `b_m`, world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the axis (m).
    pub a_m: Vector3<f64>,
    /// Other end of the axis (m).
    pub b_m: Vector3<f64>,
    /// Radius (m).
    pub radius_m: f64,
}

impl Capsule {
    /// Distance from a point to the surface, negative inside (m).
    #[must_use]
    pub fn distance_m(&self, p: &Vector3<f64>) -> f64 {
        let axis = self.b_m - self.a_m;
        let t = (p - self.a_m).dot(&axis) / axis.norm_squared().max(1e-18);
        (p - self.a_m - axis * t.clamp(0.0, 1.0)).norm() - self.radius_m
    }
}

/// Arm and pole in one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmBody {
    /// Base and links, from the base to the flange.
    pub links: [Capsule; LINK_CAPSULES],
    /// The pole, flange end first.
    pub pole: Capsule,
}

impl ArmBody {
    /// Bodies for the joint angles `q` (rad), in the world.
    #[must_use]
    pub fn at(q: &JointVector) -> Self {
        let poses = link_poses(q);
        let pose = |link: usize| match link {
            0 => (Vector3::zeros(), Matrix3::identity()),
            _ => poses[link - 1],
        };
        let (flange_p, flange_r) = pose(7);
        let along_pole: Vector3<f64> = flange_r.column(2).into();
        Self {
            links: SHAPE.map(|(link, a, b, radius_m)| {
                let (p, r) = pose(link);
                Capsule {
                    a_m: p + r * Vector3::from(a),
                    b_m: p + r * Vector3::from(b),
                    radius_m,
                }
            }),
            pole: Capsule {
                a_m: flange_p,
                b_m: flange_p + along_pole * POLE_LENGTH_M,
                radius_m: POLE_RADIUS_M,
            },
        }
    }

    /// Whether a rope touches arm, pole or column. `nodes` are world positions
    /// (m), clamp first, lead last; middles of links are looked at as well. The
    /// first 5 cm lie against the pole by construction and do not count.
    #[must_use]
    pub fn is_touched_by(
        &self,
        nodes: &[Vector3<f64>],
        rope_radius_m: f64,
        lead_radius_m: f64,
    ) -> bool {
        let hits = |p: &Vector3<f64>, radius_m: f64| {
            self.links.iter().any(|c| c.distance_m(p) < radius_m)
                || self.pole.distance_m(p) < radius_m
                || column_distance_m(p) < radius_m
        };
        let mut arc_m = 0.0;
        let last = nodes.len().saturating_sub(1);
        nodes.windows(2).enumerate().any(|(i, link)| {
            let middle = (link[0] + link[1]) / 2.0;
            let length_m = (link[1] - link[0]).norm();
            arc_m += length_m;
            let end_radius_m = if i + 1 == last {
                lead_radius_m
            } else {
                rope_radius_m
            };
            (arc_m - length_m / 2.0 > CLAMPED_M && hits(&middle, rope_radius_m))
                || (arc_m > CLAMPED_M && hits(&link[1], end_radius_m))
        })
    }
}

/// Distance from a point to the column, 0 inside (m).
fn column_distance_m(p: &Vector3<f64>) -> f64 {
    let outside = |v: f64| (v.abs() - COLUMN_HALF_WIDTH_M).max(0.0);
    let above = p.z.max(FLOOR_Z_M - p.z).max(0.0);
    Vector3::new(outside(p.x), outside(p.y), above).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;
    use arm_model::kinematics::attach_pose;

    fn straight(from: Vector3<f64>, to: Vector3<f64>) -> Vec<Vector3<f64>> {
        (0..=20)
            .map(|i| from + (to - from) * f64::from(i) / 20.0)
            .collect()
    }

    #[test]
    fn a_hanging_rope_is_free_and_one_through_the_column_is_not() {
        let body = ArmBody::at(&START_POSE);
        let (clamp, _) = attach_pose(&START_POSE);
        assert!((body.pole.b_m - clamp).norm() < 1e-12);
        let hanging = straight(clamp, clamp - Vector3::z() * 0.65);
        assert!(!body.is_touched_by(&hanging, 0.01, 0.045));
        let at_column = straight(clamp, Vector3::new(0.09 + 0.044, 0.0, -0.1));
        assert!(body.is_touched_by(&at_column, 0.01, 0.045));
        let beside = straight(clamp, Vector3::new(0.09 + 0.046, 0.0, -0.1));
        assert!(!body.is_touched_by(&beside, 0.003, 0.045));
        let up_at_link_4 = straight(clamp, body.links[5].a_m);
        assert!(body.is_touched_by(&up_at_link_4, 0.003, 0.02));
    }
}
