//! The moving things as strokes: arm and pole, rope and lead, target ball.

use super::appearance::Appearance;
use super::colour::ycc;
use super::eye::Eye;
use super::stroke::{Material, Stroke, Strokes};
use crate::body::ArmBody;
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
    pub(super) target: Strokes,
    pub(super) ropes: Vec<Strokes>,
}

/// What one eye has to draw for the sub-frames `poses`, in order.
pub(super) fn spells(
    eye: &Eye,
    poses: &[ScenePose],
    cell: &Cell,
    rope: RopeShape,
    appearance: &Appearance,
    target_m: Option<Vector3<f64>>,
) -> Vec<Spell> {
    // A pole's end out of view does not move in the picture.
    let pole_end = |pose: &ScenePose| {
        let end = cell.pole.attach_pose(&pose.q).0;
        eye.project(&end).unwrap_or_default()
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
            arm: arm_strokes(eye, cell, &spell[spell.len() / 2].q),
            target: target_m
                .into_iter()
                .flat_map(|at| target_strokes(eye, cell, &at, appearance))
                .collect(),
            ropes: spell
                .iter()
                .map(|pose| rope_strokes(eye, &pose.nodes, rope, appearance))
                .collect(),
        })
        .collect()
}

fn material(rgb: [u8; 3], gloss: f32) -> Material {
    Material {
        colour: ycc(rgb.map(f32::from)),
        gloss,
    }
}

/// Links in white with grey joints, a black flange, a carbon pole.
fn arm_strokes(eye: &Eye, cell: &Cell, q: &JointVector) -> Strokes {
    const WHITE: [u8; 3] = [226, 228, 230];
    const GREY: [u8; 3] = [148, 151, 156];
    const DARK: [u8; 3] = [58, 60, 64];
    const BASE: [u8; 3] = [66, 68, 72];
    const PAINT: [[u8; 3]; 12] = [
        BASE, WHITE, GREY, WHITE, WHITE, GREY, WHITE, WHITE, GREY, WHITE, GREY, DARK,
    ];
    let body = ArmBody::at(q, cell);
    let links = body.links.iter().zip(PAINT);
    let pole = body.pole;
    let collar = pole.b_m + (pole.a_m - pole.b_m).normalize() * 0.012;
    let foot = |x: f64| Vector3::new(x, 0.0, 0.012);
    links
        .filter_map(|(c, rgb)| {
            // The base's capsule reaches into the column it stands on.
            let sunk = Vector3::z() * (c.radius_m - c.a_m.z).max(0.0);
            let a = if rgb == BASE { c.a_m + sunk } else { c.a_m };
            Stroke::new(eye, &a, &c.b_m, c.radius_m, material(rgb, 46.0))
        })
        .chain(Stroke::new(
            eye,
            &foot(-0.07),
            &foot(0.07),
            0.012,
            material(GREY, 46.0),
        ))
        .chain(Stroke::new(
            eye,
            &pole.a_m,
            &pole.b_m,
            pole.radius_m,
            material(DARK, 60.0),
        ))
        .chain(Stroke::new(
            eye,
            &collar,
            &pole.b_m,
            0.011,
            material(GREY, 70.0),
        ))
        .collect()
}

/// The rope along a smooth curve through its nodes, and the lead at its end.
fn rope_strokes(
    eye: &Eye,
    nodes: &[Vector3<f64>],
    rope: RopeShape,
    appearance: &Appearance,
) -> Strokes {
    let Some(lead_at) = nodes.last() else {
        return Strokes::from_iter([]);
    };
    let cord = material(appearance.rope_rgb, 10.0);
    let lead = material(appearance.lead_rgb, 55.0);
    let line = centreline(nodes);
    line.windows(2)
        .filter_map(|p| Stroke::new(eye, &p[0], &p[1], rope.radius_m, cord))
        .chain(Stroke::new(eye, lead_at, lead_at, rope.lead_radius_m, lead))
        .collect()
}

/// Catmull-Rom curve through the nodes, sampled finely.
fn centreline(nodes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
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
fn target_strokes(
    eye: &Eye,
    cell: &Cell,
    at: &Vector3<f64>,
    appearance: &Appearance,
) -> Vec<Stroke> {
    /// The lens bends long straight things; short pieces follow it.
    const ROD_PIECES: i32 = 12;
    let rod = material([96, 98, 102], 40.0);
    let foot = Vector3::new(at.x, at.y, cell.floor_z_m + 0.01);
    let point = |i: i32| at + (foot - at) * (f64::from(i) / f64::from(ROD_PIECES));
    let foot_end = |dx: f64| foot + Vector3::new(dx, 0.0, 0.0);
    (0..ROD_PIECES)
        .filter_map(|i| Stroke::new(eye, &point(i), &point(i + 1), STAND_RADIUS_M, rod))
        .chain(Stroke::new(
            eye,
            &foot_end(-0.06),
            &foot_end(0.06),
            0.010,
            rod,
        ))
        .chain(Stroke::new(
            eye,
            at,
            at,
            TARGET_RADIUS_M,
            material(appearance.target_rgb, 55.0),
        ))
        .collect()
}
