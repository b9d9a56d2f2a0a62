//! The arm as capsules, and contacts of its tool side with its base side.

use super::ContactCounts;
use super::capsule::{Capsule, box_distance_m};
use arm_model::JointVector;
use arm_model::kinematics::{self, POLE_LENGTH_M};
use nalgebra::Vector3;

/// Radius of the pole (m).
const POLE_RADIUS_M: f64 = 0.008;
/// Added to every capsule of a link: faces of L-shaped links lie up to this far
/// outside the two capsules that wrap their vertices (m).
const WRAP_MARGIN_M: f64 = 0.005;

/// Link (0 = base), axis ends in the link's frame (m) and radius (m).
type LinkCapsule = (u8, [f64; 3], [f64; 3], f64);

/// Capsules around the collision meshes of the 1305 model.
const LINK_CAPSULES: [LinkCapsule; 12] = [
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

/// Number of capsules of arm and pole.
const CAPSULES: usize = LINK_CAPSULES.len() + 1;

/// What a capsule belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Base (0) or link 1 to 7.
    Link(u8),
    /// The pole on the flange.
    Pole,
}

impl Part {
    /// Whether a contact with this part counts as one of the base region.
    #[must_use]
    pub fn in_base_region(self) -> bool {
        matches!(self, Self::Link(0 | 1))
    }

    /// Position along the arm; the pole moves with link 7.
    fn order(self) -> u8 {
        match self {
            Self::Link(link) => link,
            Self::Pole => 7,
        }
    }
}

/// The surroundings of the arm: a square column under it, and the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// Half width of the column, whose top is at z = 0 (m).
    pub column_half_width_m: f64,
    /// Height of the floor (m).
    pub floor_z_m: f64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            column_half_width_m: 0.09,
            floor_z_m: -0.75,
        }
    }
}

impl Scene {
    /// Distance of a point to the column (m), 0 inside.
    #[must_use]
    pub fn column_distance_m(&self, p: &Vector3<f64>) -> f64 {
        let w = self.column_half_width_m;
        let low = Vector3::new(-w, -w, self.floor_z_m);
        box_distance_m(p, &low, &Vector3::new(w, w, 0.0))
    }

    /// Whether a sphere touches column or floor.
    #[must_use]
    pub fn touches(&self, p: &Vector3<f64>, radius_m: f64) -> bool {
        p.z - radius_m < self.floor_z_m || self.column_distance_m(p) < radius_m
    }
}

/// Arm and pole at one instant, capsules in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmShape {
    /// The capsules with what they belong to; the pole is last.
    pub capsules: [(Part, Capsule); CAPSULES],
}

impl ArmShape {
    /// The arm in the pose `q` (rad).
    #[must_use]
    pub fn at(q: &JointVector) -> Self {
        let poses = kinematics::link_poses(q);
        let place = |link: u8, p: [f64; 3]| {
            let p = Vector3::from(p);
            match link {
                0 => p,
                _ => {
                    let (origin, r) = &poses[usize::from(link) - 1];
                    origin + r * p
                }
            }
        };
        let pole = (
            Part::Pole,
            Capsule {
                a_m: place(7, [0.0, 0.0, 0.0]),
                b_m: place(7, [0.0, 0.0, POLE_LENGTH_M]),
                radius_m: POLE_RADIUS_M,
            },
        );
        let capsules = core::array::from_fn(|i| {
            LINK_CAPSULES.get(i).map_or(pole, |&(link, a, b, radius)| {
                let capsule = Capsule {
                    a_m: place(link, a),
                    b_m: place(link, b),
                    radius_m: radius + WRAP_MARGIN_M,
                };
                (Part::Link(link), capsule)
            })
        });
        Self { capsules }
    }

    /// Smallest gap between links two or more apart, negative when they overlap (m): the
    /// bare capsules, without the pole, which the arm does not know of.
    #[must_use]
    pub fn self_clearance_m(&self) -> f64 {
        let links = &self.capsules[..LINK_CAPSULES.len()];
        let pairs = links.iter().enumerate().flat_map(|(i, (a, one))| {
            let rest = links[i + 1..].iter();
            rest.filter(move |(b, _)| b.order() >= a.order() + 2)
                .map(move |(_, other)| one.distance_to_m(other))
        });
        pairs.fold(f64::INFINITY, f64::min) + 2.0 * WRAP_MARGIN_M
    }
}

/// Contacts of the tool side (links 6, 7 and pole) with the rest of the arm
/// (links at least two apart), column and floor.
#[must_use]
pub fn tool_contacts(arm: &ArmShape, scene: &Scene) -> ContactCounts {
    let mut out = ContactCounts::default();
    for (part, capsule) in arm.capsules.iter().filter(|(p, _)| p.order() >= 6) {
        for (other_part, other) in &arm.capsules {
            // Link 7 turns close above link 5 by design; the pole may not.
            let apart = if *part == Part::Pole { 2 } else { 3 };
            if other_part.order() + apart > part.order() {
                continue;
            }
            if capsule.distance_to_m(other) < 0.0 {
                out.pole_robot += 1;
                out.base_region += u32::from(other_part.in_base_region());
            }
        }
        let ends = [&capsule.a_m, &capsule.b_m];
        let middle = capsule.a_m.lerp(&capsule.b_m, 0.5);
        if ends
            .into_iter()
            .chain([&middle])
            .any(|p| scene.touches(p, capsule.radius_m))
        {
            out.base_region += 1;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    fn contacts(q: [f64; 7]) -> ContactCounts {
        tool_contacts(&ArmShape::at(&JointVector(q)), &Scene::default())
    }

    #[test]
    fn zero_and_start_pose_are_free() {
        assert!(contacts([0.0; 7]).pole_robot == 0);
        assert!(contacts(START_POSE.0).none());
    }

    #[test]
    fn the_pole_in_the_upper_arm_is_seen() {
        // Elbow folded, joint 6 at its upper end: the pole points back up.
        let folded = contacts([0.0, 0.0, 0.0, 0.3, 0.0, 3.1, 0.0]);
        assert!(folded.pole_robot > 0, "{folded:?}");
    }

    /// Over a grid of poses of joints 2, 4 and 6.
    #[test]
    fn a_pole_that_ends_in_the_column_is_always_seen() {
        let grid = |i: i32, low: f64, high: f64| low + (high - low) * f64::from(i) / 29.0;
        let mut inside = 0;
        for (a, b, c) in (0..27_000).map(|i| (i / 900, i / 30 % 30, i % 30)) {
            let q = [
                0.0,
                grid(a, -2.0, 2.0),
                0.0,
                grid(b, -0.1, 3.9),
                0.0,
                grid(c, -1.6, 3.1),
                0.0,
            ];
            let end = kinematics::attach_pose(&JointVector(q)).0;
            if Scene::default().column_distance_m(&end) == 0.0 {
                inside += 1;
                assert!(contacts(q).base_region > 0, "{q:?}");
            }
        }
        assert!(inside > 5, "{inside}");
    }

    /// The vendor's zero pose is free, its smallest gap 11 mm.
    #[test]
    fn the_zero_pose_is_free_by_eleven_millimetres() {
        let gap_m = ArmShape::at(&JointVector::ZERO).self_clearance_m();
        assert!((gap_m - 0.011).abs() < 0.002, "{gap_m}");
        let folded = ArmShape::at(&JointVector([0.0, 0.0, 0.0, 0.0, 0.0, 3.1, 0.0]));
        assert!(folded.self_clearance_m() < 0.0);
    }

    #[test]
    fn the_pole_ends_where_the_rope_is_attached() {
        let q = JointVector([0.3, 0.5, -0.2, 1.9, 0.4, 1.2, 0.1]);
        let pole = ArmShape::at(&q).capsules[CAPSULES - 1].1;
        assert!((pole.b_m - kinematics::attach_pose(&q).0).norm() < 1e-12);
    }
}
