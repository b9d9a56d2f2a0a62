//! What the arm may run into: itself, and obstacles of the rig.
//!
//! Links are capsules around the vendor's collision meshes (1305 arms, link
//! frames, m). Link pairs closer than two apart always touch and are left out.

use arm_model::{JOINTS, JointVector, kinematics};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A rounded stick in a link's frame; link 0 is the base.
struct Capsule {
    link: usize,
    ends_m: [[f64; 3]; 2],
    radius_m: f64,
}

const fn capsule(link: usize, a: [f64; 3], b: [f64; 3], radius_m: f64) -> Capsule {
    Capsule {
        link,
        ends_m: [a, b],
        radius_m,
    }
}

const CAPSULES: [Capsule; 12] = [
    capsule(0, [0.0, 0.0, 0.014], [0.0, 0.0, 0.104], 0.067),
    capsule(1, [0.0, 0.009, 0.0], [0.0, 0.0, -0.070], 0.069),
    capsule(2, [0.0, -0.096, 0.007], [0.0, -0.161, 0.0], 0.050),
    capsule(2, [0.0, -0.143, 0.064], [0.0, 0.0, 0.083], 0.054),
    capsule(3, [0.004, -0.003, -0.065], [0.053, 0.003, 0.0], 0.067),
    capsule(4, [0.077, -0.081, 0.008], [0.076, -0.143, 0.0], 0.051),
    capsule(4, [0.010, -0.005, 0.071], [0.089, -0.121, 0.057], 0.061),
    capsule(5, [0.0, 0.0, -0.163], [0.0, 0.048, -0.101], 0.049),
    capsule(5, [0.0, 0.059, -0.039], [0.0, 0.042, 0.0], 0.048),
    capsule(6, [-0.003, -0.002, 0.017], [0.074, -0.011, 0.007], 0.048),
    capsule(6, [0.011, 0.031, 0.014], [0.077, 0.050, 0.0], 0.042),
    capsule(7, [0.0, 0.0, -0.018], [0.0, -0.016, -0.018], 0.041),
];

/// Links that can reach an obstacle: the base and link 1 stay where they are.
const FIRST_REACHING_LINK: usize = 2;

/// Something solid in the arm's way, in the base frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Obstacle {
    /// Everything behind a plane.
    Plane {
        /// A point of the plane (m).
        point_m: [f64; 3],
        /// Out of the solid side; any length above zero.
        normal: [f64; 3],
    },
    /// An upright box.
    Box {
        /// Smallest coordinates (m).
        min_m: [f64; 3],
        /// Largest coordinates (m).
        max_m: [f64; 3],
    },
}

impl Obstacle {
    /// Whether the numbers make a body.
    #[must_use]
    pub fn is_well_formed(&self) -> bool {
        match self {
            Self::Plane { point_m, normal } => {
                let length = Vector3::from(*normal).norm();
                point_m.iter().all(|v| v.is_finite()) && length.is_finite() && length > 0.0
            }
            Self::Box { min_m, max_m } => (0..3).all(|i| min_m[i] < max_m[i]),
        }
    }

    /// How deep a ball reaches in, negative when it does not (m).
    fn depth_m(&self, centre: &Vector3<f64>, radius_m: f64) -> f64 {
        match self {
            Self::Plane { point_m, normal } => {
                let normal = Vector3::from(*normal).normalize();
                radius_m - normal.dot(&(centre - Vector3::from(*point_m)))
            }
            Self::Box { min_m, max_m } => {
                let (min, max) = (Vector3::from(*min_m), Vector3::from(*max_m));
                let nearest = centre.sup(&min).inf(&max);
                let outside = (centre - nearest).norm();
                if outside > 0.0 {
                    return radius_m - outside;
                }
                let to_face = (centre - min).inf(&(max - centre)).min();
                radius_m + to_face
            }
        }
    }
}

type Segment = [Vector3<f64>; 2];

/// The capsules in the base frame.
fn placed(q: &JointVector) -> [(usize, Segment, f64); CAPSULES.len()] {
    let links = kinematics::link_poses(q);
    core::array::from_fn(|i| {
        let Capsule {
            link,
            ends_m,
            radius_m,
        } = &CAPSULES[i];
        let ends = ends_m.map(|end| match link.checked_sub(1) {
            Some(joint) => links[joint].0 + links[joint].1 * Vector3::from(end),
            None => Vector3::from(end),
        });
        (*link, ends, *radius_m)
    })
}

/// Smallest gap between links two or more apart, negative when they touch (m).
#[must_use]
pub fn self_clearance_m(q: &JointVector) -> f64 {
    let placed = placed(q);
    let mut gap_m = f64::INFINITY;
    for (i, (link_a, a, radius_a)) in placed.iter().enumerate() {
        for (link_b, b, radius_b) in &placed[i + 1..] {
            if link_b - link_a >= 2 {
                gap_m = gap_m.min(segment_distance(a, b) - radius_a - radius_b);
            }
        }
    }
    gap_m
}

/// How deep arm and tool reach into obstacles, negative when they do not (m).
/// The tool is a straight stick from the flange to `tcp_offset_m`.
#[must_use]
pub fn obstacle_depth_m(q: &JointVector, tcp_offset_m: &Vector3<f64>, all: &[Obstacle]) -> f64 {
    /// Balls along a stick.
    const BALLS: u8 = 4;
    const TOOL_RADIUS_M: f64 = 0.01;
    let (flange, attitude) = kinematics::link_poses(q)[JOINTS - 1];
    let tool = [flange, flange + attitude * tcp_offset_m];
    let moving = placed(q)
        .into_iter()
        .filter(|(link, ..)| *link >= FIRST_REACHING_LINK)
        .map(|(_, ends, radius_m)| (ends, radius_m))
        .chain([(tool, TOOL_RADIUS_M)]);
    let mut depth_m = f64::NEG_INFINITY;
    for ([a, b], radius_m) in moving {
        for k in 0..=BALLS {
            let centre = a + (b - a) * (f64::from(k) / f64::from(BALLS));
            for obstacle in all {
                depth_m = depth_m.max(obstacle.depth_m(&centre, radius_m));
            }
        }
    }
    depth_m
}

/// Distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
fn segment_distance([p1, q1]: &Segment, [p2, q2]: &Segment) -> f64 {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (b, c) = (d1.dot(&d2), d1.dot(&r));
    let denominator = a * e - b * b;
    let mut s = if denominator > 1e-12 {
        ((b * f - c * e) / denominator).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = (b * s + f) / e;
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = ((b * t - c) / a).clamp(0.0, 1.0);
    }
    (p1 + d1 * s - (p2 + d2 * t)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Limits;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The vendor's zero pose is free, its smallest gap 11 mm.
    #[test]
    fn zero_pose_is_free_by_eleven_millimetres() {
        let gap_m = self_clearance_m(&JointVector::ZERO);
        assert!((gap_m - 0.011).abs() < 0.002, "{gap_m}");
    }

    /// The wrist folded back onto the shoulder; and of random poses in range
    /// about one in nine collides, as the source of the capsules found.
    #[test]
    fn a_folded_arm_touches_itself_and_one_in_nine_poses_does() {
        let mut q = JointVector::ZERO;
        q[5] = 3.1;
        assert!((self_clearance_m(&q) + 0.060).abs() < 0.001);
        let limits = Limits::default();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut random = || {
            let (min, max) = (&limits.position_min_rad, &limits.position_max_rad);
            JointVector(core::array::from_fn(|j| rng.random_range(min[j]..max[j])))
        };
        let hits = (0..20_000)
            .filter(|_| self_clearance_m(&random()) < 0.0)
            .count();
        assert!((1900..2500).contains(&hits), "{hits}");
    }

    #[test]
    fn crossing_parallel_and_end_to_end_segments() {
        let v = Vector3::new;
        let x = [v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0)];
        let cases = [
            ([v(0.0, -1.0, 0.5), v(0.0, 1.0, 0.5)], 0.5),
            ([v(-1.0, 0.0, 2.0), v(1.0, 0.0, 2.0)], 2.0),
            ([v(3.0, 0.0, 0.0), v(5.0, 0.0, 0.0)], 2.0),
        ];
        for (other, want) in cases {
            assert!((segment_distance(&x, &other) - want).abs() < 1e-12);
        }
    }

    /// In the zero pose the flange is 120.5 mm above the table, looking down.
    #[test]
    fn depth_in_planes_and_boxes_is_the_geometric_one() {
        let q = JointVector::ZERO;
        let tool = Vector3::new(0.0, 0.0, 0.1);
        let table = Obstacle::Plane {
            point_m: [0.0; 3],
            normal: [0.0, 0.0, 2.0],
        };
        let depth_m = obstacle_depth_m(&q, &tool, &[table]);
        assert!((depth_m - (0.01 - 0.0205)).abs() < 1e-9, "{depth_m}");
        let block = Obstacle::Box {
            min_m: [0.1, -0.1, -0.1],
            max_m: [0.3, 0.1, 0.03],
        };
        let depth_m = obstacle_depth_m(&q, &tool, &[table, block]);
        assert!((depth_m - (0.01 + 0.0095)).abs() < 1e-9, "{depth_m}");
        assert!(block.is_well_formed() && table.is_well_formed());
    }
}
