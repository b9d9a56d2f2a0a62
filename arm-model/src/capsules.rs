//! The arm and the pole as capsules, placed by joint angles; distances between segments,
//! points and boxes.
//!
//! The one shape of the arm for planner, preflight, simulated arm and renderer.

use crate::cell::{POLE_LENGTH_M, POLE_RADIUS_M};
use crate::joint::JointVector;
use crate::kinematics::link_poses;
use nalgebra::Vector3;

/// Link (0 = base), axis ends in the link's frame (m) and radius (m).
type LinkCapsule = (u8, [f64; 3], [f64; 3], f64);

/// The link that ends in the flange.
const FLANGE: u8 = 7;

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

/// All points within `radius_m` of the segment from `a_m` to `b_m`.
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
    pub fn distance_to_point_m(&self, p: &Vector3<f64>) -> f64 {
        let axis = self.b_m - self.a_m;
        let t = (p - self.a_m).dot(&axis) / axis.norm_squared().max(1e-18);
        (p - self.a_m - axis * t.clamp(0.0, 1.0)).norm() - self.radius_m
    }

    /// Distance between two surfaces, negative when they overlap (m).
    #[must_use]
    pub fn distance_to_m(&self, other: &Self) -> f64 {
        segment_distance_m(&self.a_m, &self.b_m, &other.a_m, &other.b_m)
            - self.radius_m
            - other.radius_m
    }

    /// Whether the axis-aligned box around this capsule, grown by `margin_m`,
    /// meets the box from `low` to `high`.
    #[must_use]
    pub fn near_box(&self, low: &Vector3<f64>, high: &Vector3<f64>, margin_m: f64) -> bool {
        let grow = self.radius_m + margin_m;
        (0..3).all(|i| {
            self.a_m[i].min(self.b_m[i]) - grow <= high[i]
                && self.a_m[i].max(self.b_m[i]) + grow >= low[i]
        })
    }
}

/// Arm and pole in one pose, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmCapsules {
    /// Base and links, from the base to the flange, each with its link (0 = base).
    pub links: [(u8, Capsule); LINK_CAPSULES],
    /// The pole, flange end first.
    pub pole: Capsule,
}

impl ArmCapsules {
    /// The capsules for the joint angles `q` (rad).
    #[must_use]
    pub fn at(q: &JointVector) -> Self {
        let poses = link_poses(q);
        let place = |link: u8, p: [f64; 3]| {
            let p = Vector3::from(p);
            link.checked_sub(1).map_or(p, |joint| {
                let (origin, attitude) = &poses[usize::from(joint)];
                origin + attitude * p
            })
        };
        let capsule = |link, a, b, radius_m| Capsule {
            a_m: place(link, a),
            b_m: place(link, b),
            radius_m,
        };
        Self {
            links: LINKS.map(|(link, a, b, radius_m)| (link, capsule(link, a, b, radius_m))),
            pole: capsule(FLANGE, [0.0; 3], [0.0, 0.0, POLE_LENGTH_M], POLE_RADIUS_M),
        }
    }
}

/// Smallest gap between links two or more apart, negative when they overlap (m). Nearer
/// links always touch.
#[must_use]
pub fn self_clearance_m(links: &[(u8, Capsule)]) -> f64 {
    let pairs = links.iter().enumerate().flat_map(|(i, (a, one))| {
        let rest = links[i + 1..].iter();
        rest.filter(move |(b, _)| *b >= a + 2)
            .map(move |(_, other)| one.distance_to_m(other))
    });
    pairs.fold(f64::INFINITY, f64::min)
}

/// Smallest distance between segments `p0 p1` and `q0 q1` (m). After C. Ericson,
/// "Real-Time Collision Detection", section 5.1.9.
fn segment_distance_m(
    p0: &Vector3<f64>,
    p1: &Vector3<f64>,
    q0: &Vector3<f64>,
    q1: &Vector3<f64>,
) -> f64 {
    let (d1, d2, r) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (b, c) = (d1.dot(&d2), d1.dot(&r));
    let (a, e) = (a.max(1e-18), e.max(1e-18));
    let det = a * e - b * b;
    let s = if det > 1e-12 * a * e {
        ((b * f - c * e) / det).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = (b * s + f) / e;
    let (s, t) = if t < 0.0 {
        ((-c / a).clamp(0.0, 1.0), 0.0)
    } else if t > 1.0 {
        (((b - c) / a).clamp(0.0, 1.0), 1.0)
    } else {
        (s, t)
    };
    (r + d1 * s - d2 * t).norm()
}

/// Distance from a point to an axis-aligned box, 0 inside (m).
#[must_use]
pub fn box_distance_m(p: &Vector3<f64>, low: &Vector3<f64>, high: &Vector3<f64>) -> f64 {
    Vector3::from_fn(|i, _| (low[i] - p[i]).max(p[i] - high[i]).max(0.0)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0f64..1.0).prop_map(Vector3::from)
    }

    proptest! {
        /// Against the smallest distance over a fine grid of both segments.
        #[test]
        fn segment_distance_is_the_grid_minimum(
            p0 in point(), p1 in point(), q0 in point(), q1 in point()
        ) {
            let exact = segment_distance_m(&p0, &p1, &q0, &q1);
            let mut grid = f64::INFINITY;
            for i in 0..=60 {
                for k in 0..=60 {
                    let (s, t) = (f64::from(i) / 60.0, f64::from(k) / 60.0);
                    grid = grid.min((p0.lerp(&p1, s) - q0.lerp(&q1, t)).norm());
                }
            }
            prop_assert!(exact <= grid + 1e-12 && exact > grid - 0.05);
        }
    }

    #[test]
    fn distances_to_points_and_boxes() {
        let c = Capsule {
            a_m: Vector3::zeros(),
            b_m: Vector3::new(1.0, 0.0, 0.0),
            radius_m: 0.1,
        };
        let at = |x, y| c.distance_to_point_m(&Vector3::new(x, y, 0.0));
        assert!((at(0.5, 0.3) - 0.2).abs() < 1e-12 && (at(1.3, 0.4) - 0.4).abs() < 1e-12);
        assert!(at(0.2, 0.05) < 0.0);
        let (low, high) = (Vector3::repeat(-1.0), Vector3::repeat(1.0));
        assert_eq!(
            box_distance_m(&Vector3::new(0.5, -0.2, 0.9), &low, &high),
            0.0
        );
        assert!((box_distance_m(&Vector3::new(4.0, 5.0, 0.0), &low, &high) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn crossing_parallel_and_end_to_end_segments() {
        let v = Vector3::new;
        let (a, b) = (v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0));
        let cases = [
            (v(0.0, -1.0, 0.5), v(0.0, 1.0, 0.5), 0.5),
            (v(-1.0, 0.0, 2.0), v(1.0, 0.0, 2.0), 2.0),
            (v(3.0, 0.0, 0.0), v(5.0, 0.0, 0.0), 2.0),
        ];
        for (p, q, want) in cases {
            assert!((segment_distance_m(&a, &b, &p, &q) - want).abs() < 1e-12);
        }
    }

    /// The vendor's zero pose is free, its smallest gap 11 mm.
    #[test]
    fn the_zero_pose_is_free_by_eleven_millimetres() {
        let gap_m = self_clearance_m(&ArmCapsules::at(&JointVector::ZERO).links);
        assert!((gap_m - 0.011).abs() < 0.002, "{gap_m}");
    }

    #[test]
    fn the_pole_ends_where_the_rope_is_attached() {
        let q = JointVector([0.3, 0.5, -0.2, 1.9, 0.4, 1.2, 0.1]);
        let attach_m = crate::kinematics::attach_pose(&q).0;
        assert!((ArmCapsules::at(&q).pole.b_m - attach_m).norm() < 1e-12);
    }
}
