//! The arm as capsules, and contacts of its tool side with its base side.

use super::ContactCounts;
use arm_model::capsules::{LINK_CAPSULES, arm_at};
use arm_model::geometry::Capsule;
use arm_model::{Cell, JointVector, Pole};

/// Added to every capsule of a link: faces of L-shaped links lie up to this far
/// outside the two capsules that wrap their vertices (m).
const WRAP_MARGIN_M: f64 = 0.005;

/// Number of capsules of arm and pole.
const CAPSULES: usize = LINK_CAPSULES + 1;

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

/// Arm and pole at one instant, capsules in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmShape {
    /// The capsules with what they belong to; the pole is last.
    pub capsules: [(Part, Capsule); CAPSULES],
}

impl ArmShape {
    /// The arm in the pose `q` (rad), with this pole on its flange.
    #[must_use]
    pub fn at(q: &JointVector, pole: &Pole) -> Self {
        let (links, pole) = arm_at(q, pole);
        let capsules = core::array::from_fn(|i| {
            links.get(i).map_or((Part::Pole, pole), |&(link, bare)| {
                let radius_m = bare.radius_m + WRAP_MARGIN_M;
                (Part::Link(link), Capsule { radius_m, ..bare })
            })
        });
        Self { capsules }
    }
}

/// Contacts of the tool side (links 6, 7 and pole) with the rest of the arm
/// (links at least two apart), column and floor.
#[must_use]
pub fn tool_contacts(arm: &ArmShape, cell: &Cell) -> ContactCounts {
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
            .any(|p| cell.touches(p, capsule.radius_m))
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
        let cell = Cell::default();
        tool_contacts(&ArmShape::at(&JointVector(q), &cell.pole), &cell)
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
            let cell = Cell::default();
            let end = cell.pole.attach_pose(&JointVector(q)).0;
            if cell.column_distance_m(&end) == 0.0 {
                inside += 1;
                assert!(contacts(q).base_region > 0, "{q:?}");
            }
        }
        assert!(inside > 5, "{inside}");
    }
}
