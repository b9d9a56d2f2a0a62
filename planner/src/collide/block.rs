//! Contacts of the arm with blocks: boards, walls, stands.

use super::arm::{ArmShape, Part};
use arm_model::geometry::{Capsule, box_distance_m};
use nalgebra::Isometry3;
use rope_sim::{Obstacle, Shape};

/// Distance below which arm and block count as touching: what an arm's pose and a
/// scene are not known to (m).
const GAP_M: f64 = 0.01;
/// Steps of the search along a capsule's axis; each takes 0.62 of what is left.
const STEPS: usize = 24;

/// A box in the world that arm and pole must not touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Its middle and axes.
    pub pose: Isometry3<f64>,
    /// Half its edges (m).
    pub half_m: [f64; 3],
}

impl Block {
    /// The box around a body of a scene; none around a half space, which is the floor.
    #[must_use]
    pub fn around(obstacle: &Obstacle) -> Option<Self> {
        let half_m = match obstacle.shape {
            Shape::HalfSpace => return None,
            Shape::Box { half_m } => half_m,
            Shape::Cylinder {
                half_length_m,
                radius_m,
            } => [radius_m, radius_m, half_length_m],
        };
        Some(Self {
            pose: obstacle.pose,
            half_m,
        })
    }

    /// Gap between the block and a capsule (m); negative when they overlap.
    #[must_use]
    pub fn gap_m(&self, capsule: &Capsule) -> f64 {
        let half = nalgebra::Vector3::from(self.half_m);
        let (a, b) = [capsule.a_m, capsule.b_m]
            .map(|p| self.pose.inverse_transform_point(&p.into()).coords)
            .into();
        let distance = |t: f64| box_distance_m(&a.lerp(&b, t), &-half, &half);
        // The distance to a convex body is convex along a line.
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..STEPS {
            let (l, h) = (high - golden * (high - low), low + golden * (high - low));
            if distance(l) < distance(h) {
                high = h;
            } else {
                low = l;
            }
        }
        let middle = distance(0.5 * (low + high));
        middle.min(distance(0.0)).min(distance(1.0)) - capsule.radius_m
    }
}

/// Parts of the arm beyond link 1, and the pole, that touch a block.
#[must_use]
pub fn block_contacts(arm: &ArmShape, blocks: &[Block]) -> u32 {
    let moving = |part: Part| !part.in_base_region();
    let touching = blocks.iter().flat_map(|block| {
        let reach = nalgebra::Vector3::from(block.half_m).norm() + GAP_M;
        arm.capsules.iter().filter(move |(part, capsule)| {
            let far = capsule.distance_to_point_m(&block.pose.translation.vector) > reach;
            moving(*part) && !far && block.gap_m(capsule) < GAP_M
        })
    });
    u32::try_from(touching.count()).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Pole;
    use arm_model::joint::START_POSE;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn the_gap_is_the_smallest_over_the_axis() {
        let block = Block {
            pose: Isometry3::from_parts(
                Vector3::new(0.4, -0.2, 0.3).into(),
                UnitQuaternion::from_euler_angles(0.0, 0.0, 0.7),
            ),
            half_m: [0.1, 0.3, 0.02],
        };
        let half = Vector3::from(block.half_m);
        for i in 0..40 {
            let x = f64::from(i);
            let capsule = Capsule {
                a_m: Vector3::new((x * 0.7).sin(), (x * 1.3).cos(), (x * 0.4).sin()),
                b_m: Vector3::new((x * 2.1).cos(), (x * 0.9).sin(), (x * 1.7).cos()),
                radius_m: 0.05,
            };
            let fine = (0..=4000)
                .map(|k| {
                    let p = capsule.a_m.lerp(&capsule.b_m, f64::from(k) / 4000.0);
                    let local = block.pose.inverse_transform_point(&p.into()).coords;
                    box_distance_m(&local, &-half, &half)
                })
                .fold(f64::INFINITY, f64::min);
            assert!((block.gap_m(&capsule) - (fine - 0.05)).abs() < 1e-3);
        }
    }

    #[test]
    fn a_block_at_the_pole_is_touched_and_one_beside_it_is_not() {
        let pole = Pole::default();
        let arm = ArmShape::at(&START_POSE, &pole);
        let end = pole.attach_pose(&START_POSE).0;
        let at = |x: f64| Block {
            pose: Isometry3::translation(end.x + x, end.y, end.z),
            half_m: [0.01, 0.3, 0.05],
        };
        assert_eq!(block_contacts(&arm, &[at(0.0)]), 1);
        assert_eq!(block_contacts(&arm, &[at(0.1)]), 0);
        // The gap counts as touching.
        assert_eq!(block_contacts(&arm, &[at(0.025)]), 1);
    }
}
