//! Drawing one frame: the moving things over the room, both eyes side by side.

use super::appearance::Appearance;
use super::backdrop::Room;
use super::colour::{Ycc, ycc};
use super::eye::{Eye, Vignette};
use super::layer::{RowLayer, composite};
use super::sensor::{Sensor, pack_yuyv};
use super::stroke::{Material, Stroke};
use crate::rig::body::{ArmBody, FLOOR_Z_M};
use nalgebra::Vector3;
use shared_types::{JointVector, RopeParams, StereoCamera};

/// Radius of the target ball (m).
const TARGET_RADIUS_M: f64 = 0.02;
/// Radius of the rod under it (m).
const STAND_RADIUS_M: f64 = 0.003;
/// Pieces of centreline drawn per link.
const PIECES_PER_LINK: usize = 3;
/// Motion in the picture that one sub-frame may skip (px).
const SUB_FRAME_STEP_PX: f64 = 1.0;
/// Most sub-frames averaged over one exposure.
const MAX_SUB_FRAMES: usize = 12;

/// Layers a pixel may be covered by: arm, rope, target.
const LAYERS: usize = 3;

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

/// Draws frames of one camera looking at one rig.
#[derive(Debug)]
pub struct Renderer {
    eyes: [EyeCanvas; 2],
    rope: RopeShape,
    appearance: Appearance,
    sensor: Sensor,
    target_m: Option<Vector3<f64>>,
    size_px: (usize, usize),
}

/// What one eye keeps between frames.
#[derive(Debug)]
struct EyeCanvas {
    eye: Eye,
    vignette: Vignette,
    room: Vec<Ycc>,
    room_yuyv: Vec<u8>,
    layers: [RowLayer; LAYERS],
    sum: Vec<Ycc>,
}

impl Renderer {
    /// Prepares both eyes; casting the room takes about a second.
    /// `noise_levels` is the luma noise's standard deviation in levels of 255.
    #[must_use]
    pub fn new(
        camera: &StereoCamera,
        rope: RopeShape,
        appearance: Appearance,
        noise_levels: f32,
        seed: u64,
    ) -> Self {
        let room = Room::new(appearance.wall_rgb);
        let eyes = [Eye::left(camera), Eye::right(camera)].map(|eye| EyeCanvas::new(eye, &room));
        let size_px = eyes[0].eye.size_px();
        Self {
            eyes,
            rope,
            appearance,
            sensor: Sensor::new(noise_levels, size_px.0 * 4, seed),
            target_m: None,
            size_px,
        }
    }

    /// Bytes of one frame: both eyes side by side, two bytes a pixel.
    #[must_use]
    pub fn frame_bytes(&self) -> usize {
        self.size_px.0 * self.size_px.1 * 4
    }

    /// Puts the target ball at a place in the world (m), or takes it away.
    pub fn place_target(&mut self, target_m: Option<Vector3<f64>>) {
        self.target_m = target_m;
    }

    /// Sub-frames that show the motion from `start` to `end` of an exposure
    /// without gaps: about one per pixel of the fastest node, at least one.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates, then clamped"
    )]
    pub fn sub_frames(&self, start: &ScenePose, end: &ScenePose) -> usize {
        let eye = &self.eyes[0].eye;
        let moved = start.nodes.iter().zip(&end.nodes).filter_map(|(a, b)| {
            let (a, b) = (eye.project(a)?, eye.project(b)?);
            Some((a[0] - b[0]).hypot(a[1] - b[1]))
        });
        let most_px = moved.fold(0.0, f64::max);
        ((most_px / SUB_FRAME_STEP_PX).ceil() as usize).clamp(1, MAX_SUB_FRAMES)
    }

    /// Draws frame `sequence` as YUYV (left eye, then right, in each row): the
    /// mean of `poses`, which lie evenly over the exposure.
    ///
    /// `out` must hold [`Renderer::frame_bytes`] bytes; only that many are drawn.
    pub fn render(&mut self, poses: &[ScenePose], sequence: u64, out: &mut [u8]) {
        let (width, height) = self.size_px;
        let row_bytes = width * 4;
        for (side, canvas) in self.eyes.iter_mut().enumerate() {
            let frames: Vec<_> = poses
                .iter()
                .map(|pose| {
                    strokes(
                        &canvas.eye,
                        pose,
                        self.rope,
                        &self.appearance,
                        self.target_m,
                    )
                })
                .collect();
            let rows = out.chunks_exact_mut(row_bytes).take(height).enumerate();
            for (v, row) in rows {
                canvas.draw_row(
                    v,
                    &frames,
                    &mut row[side * width * 2..(side + 1) * width * 2],
                );
            }
        }
        self.sensor.expose(out, row_bytes, sequence);
    }
}

impl EyeCanvas {
    fn new(eye: Eye, room: &Room) -> Self {
        let vignette = Vignette::of(&eye);
        let room = room.cast(&eye, &vignette);
        let mut room_yuyv = vec![0; room.len() * 2];
        pack_yuyv(&room, &mut room_yuyv);
        let width = eye.size_px().0;
        Self {
            eye,
            vignette,
            room,
            room_yuyv,
            layers: core::array::from_fn(|_| RowLayer::new(width)),
            sum: vec![[0.0; 3]; width],
        }
    }

    /// Draws row `v` of this eye: the room, and over it the mean of the
    /// sub-frames where any of them has something.
    #[allow(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    fn draw_row(&mut self, v: usize, frames: &[SubFrame], out: &mut [u8]) {
        let (width, height) = self.eye.size_px();
        let room = &self.room[v * width..(v + 1) * width];
        out.copy_from_slice(&self.room_yuyv[v * width * 2..(v + 1) * width * 2]);
        let (mut from, mut to) = (width, 0);
        for frame in frames {
            for (layer, strokes) in self.layers.iter_mut().zip(frame) {
                layer.clear();
                for stroke in strokes {
                    let (top, bottom) = stroke.rows(height);
                    if (top..bottom).contains(&v) {
                        stroke.draw_row(v, width, layer);
                    }
                }
            }
            let used = self.layers.iter().map(RowLayer::used);
            let (low, high) = used.fold((width, 0), |a, b| (a.0.min(b.0), a.1.max(b.1)));
            for u in low..high {
                // The room has its vignetting already; what is laid over it has not.
                let dim = self.vignette.at(u as f32, v as f32);
                let behind = room[u].map(|c| c / dim);
                let seen = composite(&self.layers, u, behind);
                for i in 0..3 {
                    // Sums are kept as differences from the room.
                    self.sum[u][i] += seen[i] * dim - room[u][i];
                }
            }
            (from, to) = (from.min(low), to.max(high));
        }
        if from >= to {
            return;
        }
        // Chroma belongs to pairs of pixels.
        let (from, to) = (from & !1, ((to + 1) & !1).min(width));
        let share = 1.0 / frames.len() as f32;
        for u in from..to {
            for i in 0..3 {
                self.sum[u][i] = room[u][i] + self.sum[u][i] * share;
            }
        }
        pack_yuyv(&self.sum[from..to], &mut out[from * 2..to * 2]);
        self.sum[from..to].fill([0.0; 3]);
    }
}

/// What one eye has to draw in one sub-frame, layer by layer.
type SubFrame = [Vec<Stroke>; LAYERS];

fn strokes(
    eye: &Eye,
    pose: &ScenePose,
    rope: RopeShape,
    appearance: &Appearance,
    target_m: Option<Vector3<f64>>,
) -> SubFrame {
    [
        arm_strokes(eye, &pose.q),
        rope_strokes(eye, &pose.nodes, rope, appearance),
        target_m.map_or_else(Vec::new, |at| target_strokes(eye, &at, appearance)),
    ]
}

fn material(rgb: [u8; 3], gloss: f32) -> Material {
    Material {
        colour: ycc(rgb.map(f32::from)),
        gloss,
    }
}

/// Links in white with grey joints, a black flange, a carbon pole.
fn arm_strokes(eye: &Eye, q: &JointVector) -> Vec<Stroke> {
    const WHITE: [u8; 3] = [226, 228, 230];
    const GREY: [u8; 3] = [148, 151, 156];
    const DARK: [u8; 3] = [58, 60, 64];
    const BASE: [u8; 3] = [66, 68, 72];
    const PAINT: [[u8; 3]; 12] = [
        BASE, WHITE, GREY, WHITE, WHITE, GREY, WHITE, WHITE, GREY, WHITE, GREY, DARK,
    ];
    let body = ArmBody::at(q);
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
) -> Vec<Stroke> {
    let Some(lead_at) = nodes.last() else {
        return Vec::new();
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
#[allow(clippy::cast_precision_loss, reason = "piece counts are small")]
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
fn target_strokes(eye: &Eye, at: &Vector3<f64>, appearance: &Appearance) -> Vec<Stroke> {
    /// The lens bends long straight things; short pieces follow it.
    const ROD_PIECES: i32 = 12;
    let rod = material([96, 98, 102], 40.0);
    let foot = Vector3::new(at.x, at.y, FLOOR_Z_M + 0.01);
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
