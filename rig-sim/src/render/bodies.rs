//! The moving things as strokes: arm and pole, rope and lead, target ball.

use super::appearance::Appearance;
use super::image_view::ImageView;
use super::lighting::Lighting;
use super::solid::{Material, Solid};
use super::stroke::Strokes;
use arm_model::capsules::arm_at;
use arm_model::{Cell, JointVector};
use nalgebra::Vector3;
use shared_types::RopeParams;

/// Radius of the target ball (m).
const TARGET_RADIUS_M: f64 = 0.02;
/// Radius of the rod under it (m).
const STAND_RADIUS_M: f64 = 0.003;
/// Pieces of centreline drawn per link.
const PIECES_PER_LINK: usize = 3;

/// Sizes of the rope as the camera sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RopeShape {
    /// Radius of the rope (m).
    pub radius_m: f64,
    /// Radius of the lead (m).
    pub lead_radius_m: f64,
}

impl From<&RopeParams> for RopeShape {
    fn from(rope: &RopeParams) -> Self {
        Self {
            radius_m: rope.radius_m,
            lead_radius_m: rope.lead_radius_m,
        }
    }
}

/// Arm and rope at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePose {
    /// Joints (rad).
    pub q: JointVector,
    /// Rope nodes in the world (m), clamp first, centre of the lead last.
    pub nodes: Vec<Vector3<f64>>,
}

/// Motion of the pole's end in the picture during which the arm is drawn once (px).
const ARM_STEP_PX: f64 = 1.0;

/// Part of an exposure in which the arm as good as stands still, and the rope's
/// sub-frames in it.
#[derive(Debug)]
pub(super) struct Spell {
    /// Sub-frames before it.
    pub(super) first: usize,
    pub(super) arm: Strokes,
    /// What else stands or moves there.
    pub(super) others: Strokes,
    pub(super) ropes: Vec<Strokes>,
}

/// What is drawn anew in each frame.
#[derive(Debug)]
pub(super) struct Cast<'a> {
    pub(super) cell: &'a Cell,
    pub(super) rope: &'a RopeLook,
    /// All but arm and rope.
    pub(super) others: &'a [Solid],
}

impl Cast<'_> {
    /// What one eye has to draw for the sub-frames `poses`, in order.
    pub(super) fn spells(
        &self,
        image: &ImageView,
        light: &Lighting,
        poses: &[ScenePose],
    ) -> Vec<Spell> {
        // A pole's end out of view does not move in the picture.
        let pole_end = |pose: &ScenePose| {
            let end = self.cell.pole.attach_pose(&pose.q).0;
            image.project(&end).unwrap_or_default()
        };
        let mut began = poses.first().map(pole_end).unwrap_or_default();
        let together = |_: &ScenePose, next: &ScenePose| {
            let now = pole_end(next);
            let near = (now[0] - began[0]).hypot(now[1] - began[1]) < ARM_STEP_PX;
            if !near {
                began = now;
            }
            near
        };
        let mut next = 0;
        let mut first_of = |spell: &[ScenePose]| {
            next += spell.len();
            next - spell.len()
        };
        poses
            .chunk_by(together)
            .map(|spell| Spell {
                first: first_of(spell),
                arm: Strokes::of(image, light, self.arm(&spell[spell.len() / 2].q)),
                others: Strokes::of(image, light, self.others.iter().copied()),
                ropes: spell
                    .iter()
                    .map(|pose| Strokes::of(image, light, self.rope.solids(&pose.nodes)))
                    .collect(),
            })
            .collect()
    }

    /// Links in white with grey joints, a black flange, a carbon pole, and at its end a collar
    /// out of which the rope hangs.
    pub(super) fn arm(&self, q: &JointVector) -> Vec<Solid> {
        const WHITE: [u8; 3] = [226, 228, 230];
        const GREY: [u8; 3] = [148, 151, 156];
        const DARK: [u8; 3] = [58, 60, 64];
        const BASE: [u8; 3] = [66, 68, 72];
        const PAINT: [[u8; 3]; 12] = [
            BASE, WHITE, GREY, WHITE, WHITE, GREY, WHITE, WHITE, GREY, WHITE, GREY, DARK,
        ];
        let (links, pole) = arm_at(q, &self.cell.pole);
        let links = links.iter().zip(PAINT);
        // The rope's first joint is where it leaves the collar: the round end of a capsule lies
        // inside the rope.
        let rope_radius_m = self.rope.shape.radius_m;
        let collar_radius_m = f64::max(0.011, rope_radius_m + 0.002);
        let upwards = (pole.a_m - pole.b_m).normalize();
        let bottom = pole.b_m + upwards * (collar_radius_m.powi(2) - rope_radius_m.powi(2)).sqrt();
        let top = bottom + upwards * 0.012;
        let foot = |x: f64| Vector3::new(x, 0.0, 0.012);
        links
            .map(|((_, c), rgb)| {
                // The base's capsule reaches into the column it stands on.
                let sunk = Vector3::z() * (c.radius_m - c.a_m.z).max(0.0);
                let a = if rgb == BASE { c.a_m + sunk } else { c.a_m };
                Solid::new(&a, &c.b_m, c.radius_m, Material::plain(rgb, 46.0))
            })
            .chain([
                Solid::new(
                    &foot(-0.07),
                    &foot(0.07),
                    0.012,
                    Material::plain(GREY, 46.0),
                ),
                Solid::new(
                    &pole.a_m,
                    &bottom,
                    pole.radius_m,
                    Material::plain(DARK, 60.0),
                ),
                Solid::new(&top, &bottom, collar_radius_m, Material::plain(GREY, 70.0)),
            ])
            .collect()
    }
}

/// Sizes and surfaces of the rope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RopeLook {
    pub(crate) shape: RopeShape,
    pub(crate) cord: Material,
    pub(crate) lead: Material,
}

impl RopeLook {
    /// A rope of one colour, a little glossy.
    pub(super) fn plain(shape: RopeShape, appearance: &Appearance) -> Self {
        Self {
            shape,
            cord: Material::plain(appearance.rope_rgb, 10.0),
            lead: Material::plain(appearance.lead_rgb, 55.0),
        }
    }

    /// The rope along a smooth curve through its nodes, and the lead at its end.
    pub(super) fn solids(&self, nodes: &[Vector3<f64>]) -> Vec<Solid> {
        self.coarse_solids(&centreline(nodes))
    }

    /// As [`RopeLook::solids`], straight from node to node: enough for a shadow.
    pub(super) fn coarse_solids(&self, nodes: &[Vector3<f64>]) -> Vec<Solid> {
        let lead = nodes
            .last()
            .map(|at| Solid::new(at, at, self.shape.lead_radius_m, self.lead));
        Solid::chain(nodes, self.shape.radius_m, self.cord)
            .chain(lead)
            .collect()
    }
}

/// Catmull-Rom curve through the nodes, sampled finely: what is drawn of a rope.
pub(crate) fn centreline(nodes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let n = nodes.len();
    let mut line = Vec::with_capacity(n * PIECES_PER_LINK);
    for i in 1..n {
        let (p1, p2) = (nodes[i - 1], nodes[i]);
        let p0 = if i >= 2 { nodes[i - 2] } else { p1 * 2.0 - p2 };
        let p3 = if i + 1 < n {
            nodes[i + 1]
        } else {
            p2 * 2.0 - p1
        };
        for piece in 0..PIECES_PER_LINK {
            let t = piece as f64 / PIECES_PER_LINK as f64;
            let (m1, m2) = ((p2 - p0) / 2.0, (p3 - p1) / 2.0);
            let (t2, t3) = (t * t, t * t * t);
            line.push(
                p1 * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + m1 * (t3 - 2.0 * t2 + t)
                    + p2 * (3.0 * t2 - 2.0 * t3)
                    + m2 * (t3 - t2),
            );
        }
    }
    line.extend(nodes.last());
    line
}

/// The ball, its rod down to the floor, and a foot.
pub(super) fn target_solids(cell: &Cell, at: &Vector3<f64>, appearance: &Appearance) -> Vec<Solid> {
    /// The lens bends long straight things; short pieces follow it.
    const ROD_PIECES: i32 = 12;
    let rod = Material::plain([96, 98, 102], 40.0);
    let foot = Vector3::new(at.x, at.y, cell.floor_z_m + 0.01);
    let point = |i: i32| at + (foot - at) * (f64::from(i) / f64::from(ROD_PIECES));
    let foot_end = |dx: f64| foot + Vector3::new(dx, 0.0, 0.0);
    let ball = Material::plain(appearance.target_rgb, 55.0);
    (0..ROD_PIECES)
        .map(|i| Solid::new(&point(i), &point(i + 1), STAND_RADIUS_M, rod))
        .chain([
            Solid::new(&foot_end(-0.06), &foot_end(0.06), 0.010, rod),
            Solid::new(at, at, TARGET_RADIUS_M, ball),
        ])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What can be seen of the rope begins where its first joint is: there, its surface and
    /// the collar's meet.
    #[test]
    fn the_rope_comes_out_of_the_collar_where_it_is_held() {
        let cell = Cell::default();
        let q = JointVector::from([0.1, 0.4, 0.0, 2.0, 0.2, 1.4, 0.0]);
        let (held_m, attitude) = cell.pole.attach_pose(&q);
        for radius_m in [0.003, 0.015] {
            let shape = RopeShape {
                radius_m,
                lead_radius_m: 0.02,
            };
            let appearance = Appearance::from_seed(1);
            let cast = Cast {
                cell: &cell,
                rope: &RopeLook::plain(shape, &appearance),
                others: &[],
            };
            let solids = cast.arm(&q);
            let collar = solids.last().unwrap();
            let edge_m = held_m + attitude.column(0) * radius_m;
            let from_m = (edge_m - collar.b_m).norm() - collar.radius_m;
            assert!(from_m.abs() < 1e-9, "{from_m}");
            assert!(collar.radius_m > radius_m);
        }
    }
}
