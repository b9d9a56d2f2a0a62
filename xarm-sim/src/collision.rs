//! What the arm may run into: itself, and obstacles of the rig.
//!
//! Links are the capsules of [`arm_model::capsules`]. Link pairs closer than two apart
//! always touch and are left out.

use arm_model::capsules::{self, ArmCapsules};
use arm_model::{JOINTS, JointVector, kinematics};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Links that can reach an obstacle: the base and link 1 stay where they are.
const FIRST_REACHING_LINK: u8 = 2;

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

/// Smallest gap between links two or more apart, negative when they touch (m).
#[must_use]
pub fn self_clearance_m(q: &JointVector) -> f64 {
    capsules::self_clearance_m(&ArmCapsules::at(q).links)
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
    let moving = ArmCapsules::at(q)
        .links
        .into_iter()
        .filter(|(link, _)| *link >= FIRST_REACHING_LINK)
        .map(|(_, link)| ([link.a_m, link.b_m], link.radius_m))
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

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Limits;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

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
