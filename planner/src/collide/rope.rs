//! Contacts and clearance of the rope.

use super::ContactCounts;
use super::arm::{ArmShape, Part};
use arm_model::Cell;
use arm_model::cell::CLAMPED_M;
use nalgebra::Vector3;
use shared_types::RopeParams;

/// Sizes of the rope that matter for contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RopeShape {
    /// Radius of the rope (m).
    pub radius_m: f64,
    /// Radius of the lead around the last node (m).
    pub lead_radius_m: f64,
    /// Rope length from node to node (m).
    pub link_length_m: f64,
}

impl From<&RopeParams> for RopeShape {
    fn from(rope: &RopeParams) -> Self {
        Self {
            radius_m: rope.radius_m,
            lead_radius_m: rope.lead_radius_m,
            link_length_m: rope.link_length_m(),
        }
    }
}

/// Spheres along the rope: nodes and middles of links, the lead last; with
/// radius and arc length from the clamp.
fn spheres<'a>(
    shape: &'a RopeShape,
    nodes: &'a [Vector3<f64>],
) -> impl Iterator<Item = (Vector3<f64>, f64, f64)> + 'a {
    let last = nodes.len().saturating_sub(1);
    (1..nodes.len()).flat_map(move |i| {
        let arc = i as f64 * shape.link_length_m;
        let middle = (nodes[i - 1] + nodes[i]) / 2.0;
        let radius = if i == last {
            shape.lead_radius_m
        } else {
            shape.radius_m
        };
        [
            (middle, shape.radius_m, arc - shape.link_length_m / 2.0),
            (nodes[i], radius, arc),
        ]
    })
}

fn bounding_box(nodes: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let none = (
        Vector3::repeat(f64::INFINITY),
        Vector3::repeat(f64::NEG_INFINITY),
    );
    nodes
        .iter()
        .fold(none, |(low, high), p| (low.inf(p), high.sup(p)))
}

/// Parts of arm, column and floor that the rope touches. `nodes` are world
/// positions (m), clamp first, lead last.
#[must_use]
pub fn rope_contacts(
    arm: &ArmShape,
    cell: &Cell,
    shape: &RopeShape,
    nodes: &[Vector3<f64>],
) -> ContactCounts {
    let mut out = ContactCounts::default();
    let (low, high) = bounding_box(nodes);
    let largest = shape.radius_m.max(shape.lead_radius_m);
    let mut last_part = None;
    for (part, capsule) in &arm.capsules {
        if last_part == Some(*part) || !capsule.near_box(&low, &high, largest) {
            continue;
        }
        let touches = spheres(shape, nodes).any(|(p, radius, arc_m)| {
            (*part != Part::Pole || arc_m > CLAMPED_M) && capsule.distance_to_point_m(&p) < radius
        });
        if touches {
            out.rope_robot += 1;
            out.base_region += u32::from(part.in_base_region());
            last_part = Some(*part);
        }
    }
    let w = cell.column_half_width_m + largest;
    let near_column = low.z < largest && low.x < w && high.x > -w && low.y < w && high.y > -w;
    let near_floor = low.z - largest < cell.floor_z_m;
    if (near_column || near_floor)
        && spheres(shape, nodes).any(|(p, radius, _)| cell.touches(&p, radius))
    {
        out.base_region += 1;
    }
    out
}

/// Smallest gap between the rope's surface and column or arm (m), the pole and
/// the wrist that carries it (links 6, 7) left out; negative when they overlap.
#[must_use]
pub fn rope_clearance_m(
    arm: &ArmShape,
    cell: &Cell,
    shape: &RopeShape,
    nodes: &[Vector3<f64>],
) -> f64 {
    spheres(shape, nodes)
        .map(|(p, radius, _)| {
            let to_arm = arm
                .capsules
                .iter()
                .filter(|(part, _)| !matches!(part, Part::Pole | Part::Link(6 | 7)))
                .map(|(_, capsule)| capsule.distance_to_point_m(&p))
                .fold(f64::INFINITY, f64::min);
            to_arm.min(cell.column_distance_m(&p)) - radius
        })
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    fn straight(from: Vector3<f64>, direction: Vector3<f64>) -> Vec<Vector3<f64>> {
        (0..=20)
            .map(|i| from + direction * (0.03 * f64::from(i)))
            .collect()
    }

    const SHAPE: RopeShape = RopeShape {
        radius_m: 0.005,
        lead_radius_m: 0.03,
        link_length_m: 0.03,
    };

    #[test]
    fn a_hanging_rope_is_free_and_its_clearance_is_that_of_the_column() {
        let cell = Cell::default();
        let arm = ArmShape::at(&START_POSE, &cell.pole);
        let clamp = cell.pole.attach_pose(&START_POSE).0;
        let nodes = straight(clamp, -Vector3::z());
        assert!(rope_contacts(&arm, &cell, &SHAPE, &nodes).none());
        assert!(rope_clearance_m(&arm, &cell, &SHAPE, &nodes) > 0.2);
        let near = straight(Vector3::new(0.25, 0.0, -0.05), -Vector3::z());
        let gap = rope_clearance_m(&arm, &cell, &SHAPE, &near);
        assert!((gap - (0.25 - 0.09 - 0.03)).abs() < 1e-9, "{gap}");
    }

    #[test]
    fn contacts_with_arm_column_and_floor_are_told_apart() {
        let cell = Cell::default();
        let arm = ArmShape::at(&START_POSE, &cell.pole);
        let count = |from: [f64; 3], direction: Vector3<f64>| {
            rope_contacts(
                &arm,
                &cell,
                &SHAPE,
                &straight(Vector3::from(from), direction),
            )
        };
        let column = count([0.6, 0.0, -0.2], -Vector3::x());
        assert_eq!((column.rope_robot, column.base_region), (0, 1));
        let floor = count([0.6, 0.0, -0.3], -Vector3::z());
        assert_eq!((floor.rope_robot, floor.base_region), (0, 1));
        let base = count([0.5, 0.0, 0.08], -Vector3::x());
        assert!(base.rope_robot >= 1 && base.base_region >= 1, "{base:?}");
    }
}
