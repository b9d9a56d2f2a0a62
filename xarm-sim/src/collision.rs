//! What the arm may run into: obstacles of the rig, floor and column of its cell.
//!
//! Links and pole are the capsules of [`arm_model::capsules`].

use arm_model::capsules::{arm_at, links_at};
use arm_model::geometry::Capsule;
use arm_model::{Cell, JointVector, kinematics};
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
    /// The floor and the column of a cell.
    #[must_use]
    pub fn of_cell(cell: &Cell) -> [Self; 2] {
        let half = cell.column_half_width_m;
        [
            Self::Plane {
                point_m: [0.0, 0.0, cell.floor_z_m],
                normal: [0.0, 0.0, 1.0],
            },
            Self::Box {
                min_m: [-half, -half, cell.floor_z_m],
                max_m: [half, half, 0.0],
            },
        ]
    }

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

/// How deep the arm and what it carries reach into obstacles and into what stands in its
/// cell, negative when they do not (m). It carries the cell's pole and a tool, a straight
/// stick from the flange to `tcp_offset_m`; an arm without a cell stands free.
#[must_use]
pub fn obstacle_depth_m(
    q: &JointVector,
    tcp_offset_m: &Vector3<f64>,
    cell: Option<&Cell>,
    obstacles: &[Obstacle],
) -> f64 {
    /// Largest gap between the centres of balls along a stick, in its radii.
    const GAP_MAX_RADII: f64 = 6.5;
    /// The same for a stick as thin as a wire (m).
    const WIRE_GAP_MAX_M: f64 = 0.02;
    /// Fewest gaps along a stick, and most.
    const GAPS: (u32, u32) = (4, 1000);
    const TOOL_RADIUS_M: f64 = 0.01;
    let (flange, attitude) = kinematics::flange_pose(q);
    let tool = Capsule {
        a_m: flange,
        b_m: flange + attitude * tcp_offset_m,
        radius_m: TOOL_RADIUS_M,
    };
    let reaching = links_at(q).into_iter();
    let moving = reaching
        .filter_map(|(link, capsule)| (link >= FIRST_REACHING_LINK).then_some(capsule))
        .chain([tool])
        .chain(cell.map(|cell| arm_at(q, &cell.pole).1));
    let standing = cell.map(Obstacle::of_cell);
    let mut depth_m = f64::NEG_INFINITY;
    for Capsule {
        a_m: a,
        b_m: b,
        radius_m,
    } in moving
    {
        let gap_m = (GAP_MAX_RADII * radius_m).max(WIRE_GAP_MAX_M);
        let gaps = ((b - a).norm() / gap_m).ceil() as u32;
        let gaps = gaps.clamp(GAPS.0, GAPS.1);
        for k in 0..=gaps {
            let centre = a + (b - a) * (f64::from(k) / f64::from(gaps));
            for obstacle in obstacles.iter().chain(standing.iter().flatten()) {
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
    use arm_model::capsules::self_clearance_m;
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
        let depth_m = obstacle_depth_m(&q, &tool, None, &[table]);
        assert!((depth_m - (0.01 - 0.0205)).abs() < 1e-9, "{depth_m}");
        let block = Obstacle::Box {
            min_m: [0.1, -0.1, -0.1],
            max_m: [0.3, 0.1, 0.03],
        };
        let depth_m = obstacle_depth_m(&q, &tool, None, &[table, block]);
        assert!((depth_m - (0.01 + 0.0095)).abs() < 1e-9, "{depth_m}");
        assert!(block.is_well_formed() && table.is_well_formed());
        // The pole of a cell reaches further down, to a floor that may be anywhere.
        let mut cell = Cell::default();
        let pole = cell.pole;
        cell.floor_z_m = 0.0505 - pole.length_m;
        let depth_m = obstacle_depth_m(&q, &Vector3::zeros(), Some(&cell), &[]);
        assert!((depth_m - (pole.radius_m - 0.07)).abs() < 1e-9, "{depth_m}");
        cell.pole.length_m += 0.1;
        let depth_m = obstacle_depth_m(&q, &Vector3::zeros(), Some(&cell), &[]);
        assert!((depth_m - (pole.radius_m + 0.03)).abs() < 1e-9, "{depth_m}");
    }

    #[test]
    fn a_long_pole_meets_a_thin_shelf_anywhere_along_it() {
        let mut cell = Cell::default();
        cell.pole.length_m = 1.0;
        cell.floor_z_m = -2.0;
        for top_m in [-0.02, -0.2, -0.45, -0.7] {
            let shelf = Obstacle::Box {
                min_m: [0.1, -0.1, top_m - 0.06],
                max_m: [0.3, 0.1, top_m],
            };
            let depth_m =
                obstacle_depth_m(&JointVector::ZERO, &Vector3::zeros(), Some(&cell), &[shelf]);
            assert!(depth_m > cell.pole.radius_m, "{top_m}: {depth_m}");
        }
    }
}
