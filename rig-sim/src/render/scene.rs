//! Drawing one frame: the moving things over the room, both eyes side by side.

use super::appearance::Appearance;
use super::backdrop::Room;
use super::bodies::{RopeShape, ScenePose, Spell, spells};
use super::colour::Ycc;
use super::eye::{Eye, Vignette};
use super::layer::{RowLayer, composite};
use super::sensor::{Sensor, pack_yuyv};
use super::shutter::RowTimes;
use arm_model::Cell;
use nalgebra::Vector3;
use shared_types::StereoCamera;

/// Motion in the picture that one sub-frame may skip (px).
const SUB_FRAME_STEP_PX: f64 = 1.0;
/// Most sub-frames averaged over a row's exposure.
const MAX_SUB_FRAMES: usize = 12;

/// Draws frames of one camera looking at one rig.
#[derive(Debug)]
pub struct Renderer {
    eyes: [EyeCanvas; 2],
    cell: Cell,
    rope: RopeShape,
    appearance: Appearance,
    sensor: Sensor,
    rows: RowTimes,
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
    arm: RowLayer,
    target: RowLayer,
    rope: RowLayer,
    sum: Vec<Ycc>,
}

impl Renderer {
    /// Prepares both eyes; casting the room takes about a second.
    /// `noise_levels` is the luma noise's standard deviation in levels of 255.
    #[must_use]
    pub fn new(
        camera: &StereoCamera,
        cell: &Cell,
        rope: RopeShape,
        appearance: Appearance,
        noise_levels: f32,
        seed: u64,
    ) -> Self {
        let room = Room::new(appearance.wall_rgb, cell);
        let eyes = [Eye::left(camera), Eye::right(camera)].map(|eye| EyeCanvas::new(eye, &room));
        let size_px = eyes[0].eye.size_px();
        Self {
            eyes,
            cell: *cell,
            rope,
            appearance,
            sensor: Sensor::new(noise_levels, size_px.0 * 4, seed),
            rows: RowTimes::of(camera),
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

    /// Sub-frames that show the motion from `start` to `end` of a frame, from the first
    /// row's opening to the last row's end, without gaps: about one per pixel of the
    /// fastest node, at least one.
    #[must_use]
    pub fn sub_frames(&self, start: &ScenePose, end: &ScenePose) -> usize {
        let eye = &self.eyes[0].eye;
        let moved = start.nodes.iter().zip(&end.nodes).filter_map(|(a, b)| {
            let (a, b) = (eye.project(a)?, eye.project(b)?);
            Some((a[0] - b[0]).hypot(a[1] - b[1]))
        });
        let most_px = moved.fold(0.0, f64::max);
        let most = (MAX_SUB_FRAMES as f64 * self.rows.exposures()).ceil() as usize;
        ((most_px / SUB_FRAME_STEP_PX).ceil() as usize).clamp(1, most)
    }

    /// Draws frame `sequence` as YUYV (left eye, then right, in each row): in each row
    /// the mean of those of `poses` that its exposure meets. They lie evenly over the
    /// time from the first row's opening to the last row's end.
    ///
    /// `out` must hold [`Renderer::frame_bytes`] bytes; only that many are drawn.
    pub fn render(&mut self, poses: &[ScenePose], sequence: u64, out: &mut [u8]) {
        let (width, height) = self.size_px;
        let row_bytes = width * 4;
        for (side, canvas) in self.eyes.iter_mut().enumerate() {
            let spells = spells(
                &canvas.eye,
                poses,
                &self.cell,
                self.rope,
                &self.appearance,
                self.target_m,
            );
            let rows = out.chunks_exact_mut(row_bytes).take(height).enumerate();
            for (v, row) in rows {
                canvas.draw_row(
                    v,
                    &spells,
                    |i| self.rows.weight(v, i, poses.len()),
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
            arm: RowLayer::new(width),
            target: RowLayer::new(width),
            rope: RowLayer::new(width),
            sum: vec![[0.0; 3]; width],
        }
    }

    /// Draws row `v` of this eye: the room, and over it the mean of the sub-frames,
    /// each with its weight in this row, where any of them has something.
    fn draw_row(
        &mut self,
        v: usize,
        spells: &[Spell],
        weight_of: impl Fn(usize) -> f32,
        out: &mut [u8],
    ) {
        let width = self.eye.size_px().0;
        out.copy_from_slice(&self.room_yuyv[v * width * 2..(v + 1) * width * 2]);
        let (mut from, mut to) = (width, 0);
        let mut total = 0.0;
        for spell in spells {
            let weights = spell.first..spell.first + spell.ropes.len();
            let still: f32 = weights.clone().map(&weight_of).sum();
            if still <= 0.0 {
                continue;
            }
            total += still;
            spell.arm.draw_row(v, &mut self.arm);
            spell.target.draw_row(v, &mut self.target);
            // What stands still counts once, with the weight of the whole spell;
            for (low, high) in apart(self.arm.used(), self.target.used()) {
                self.add_still(v, (low, high), still);
                (from, to) = (from.min(low), to.max(high));
            }
            // each rope adds only what it changes.
            for (rope, weight) in spell.ropes.iter().zip(weights.map(&weight_of)) {
                if weight > 0.0 {
                    rope.draw_row(v, &mut self.rope);
                    let (low, high) = self.rope.used();
                    self.add_rope(v, (low, high), weight);
                    (from, to) = (from.min(low), to.max(high));
                }
            }
        }
        if from >= to {
            return;
        }
        // Chroma belongs to pairs of pixels.
        let (from, to) = (from & !1, ((to + 1) & !1).min(width));
        let room = &self.room[v * width..(v + 1) * width];
        let share = 1.0 / total;
        for u in from..to {
            // Light was gathered before the lens dims it; the room's is dimmed.
            let dim = self.vignette.at(u as f32, v as f32) * share;
            for i in 0..3 {
                self.sum[u][i] = room[u][i] + self.sum[u][i] * dim;
            }
        }
        pack_yuyv(&self.sum[from..to], &mut out[from * 2..to * 2]);
        self.sum[from..to].fill([0.0; 3]);
    }

    /// The room's colour at a pixel before the lens dims it.
    fn behind(&self, u: usize, v: usize) -> Ycc {
        let dim = self.vignette.at(u as f32, v as f32);
        self.room[v * self.arm.width() + u].map(|c| c / dim)
    }

    /// Adds what arm and target change against the room, `weight` times.
    fn add_still(&mut self, v: usize, (low, high): (usize, usize), weight: f32) {
        for u in low..high {
            let behind = self.behind(u, v);
            let seen = composite([&self.arm, &self.target], u, behind);
            for i in 0..3 {
                self.sum[u][i] += (seen[i] - behind[i]) * weight;
            }
        }
    }

    /// Adds what the rope changes against arm, target and room, `weight` times.
    fn add_rope(&mut self, v: usize, (low, high): (usize, usize), weight: f32) {
        for u in low..high {
            if self.rope.cell(u).cover > 0.0 {
                let behind = self.behind(u, v);
                let without = composite([&self.arm, &self.target], u, behind);
                let with = composite([&self.arm, &self.target, &self.rope], u, behind);
                for i in 0..3 {
                    self.sum[u][i] += (with[i] - without[i]) * weight;
                }
            }
        }
    }
}

/// Two spans as spans that do not overlap, empty ones left out.
fn apart(a: (usize, usize), b: (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    let overlap = a.0 < b.1 && b.0 < a.1;
    let spans = if overlap {
        [(a.0.min(b.0), a.1.max(b.1)), (0, 0)]
    } else {
        [a, b]
    };
    spans.into_iter().filter(|(low, high)| low < high)
}
