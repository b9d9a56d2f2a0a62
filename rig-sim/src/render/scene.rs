//! Drawing one frame: the moving things over the room, both eyes side by side.

use super::appearance::Appearance;
use super::bodies::{Cast, RopeLook, RopeShape, ScenePose, target_solids};
use super::canvas::ImageCanvas;
use super::environment::View;
use super::image_view::ImageView;
use super::lamp_view::LampView;
use super::sensor::{Sensor, brighten};
use super::shadows::Shadows;
use super::shutter::RowTimes;
use super::task_bodies::TaskBodies;
use crate::room::bystander::Bystanders;
use crate::room::{Picture, Room};
use arm_model::Cell;
use nalgebra::Vector3;
use shared_types::StereoCamera;

/// Motion in the picture that one sub-frame may skip (px).
const SUB_FRAME_STEP_PX: f64 = 1.0;
/// Most sub-frames averaged over a row's exposure.
const MAX_SUB_FRAMES: usize = 12;
/// Rows of a rolling shutter that share their shadows.
const BAND_ROWS: usize = 64;

/// Draws frames of one camera looking at one rig.
#[derive(Debug)]
pub struct Renderer {
    images: [ImageCanvas; 2],
    cell: Cell,
    rope: RopeLook,
    appearance: Appearance,
    sensor: Sensor,
    rows: RowTimes,
    target_m: Option<Vector3<f64>>,
    bodies: Option<TaskBodies>,
    /// Tilt of their domino (rad).
    tilt_rad: f64,
    shadows: Shadows,
    /// What moves in a drawn room by itself.
    bystanders: Bystanders,
    /// What the camera adds to a drawn room, and how many frames it takes a second.
    picture: Option<(Picture, f64)>,
    drawn_px: usize,
}

impl Renderer {
    /// Prepares both eyes before the plain room; casting it takes about a second.
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
        let look = RopeLook::plain(rope, &appearance);
        let view = |image: &ImageView| View::plain(image, &appearance, cell);
        let noise = (noise_levels, seed);
        Self::of(camera, cell, look, appearance, noise, Vec::new(), view)
    }

    /// Prepares both eyes in a drawn room, which has a surface for the rope and noise of
    /// its own; casting it takes a few seconds.
    pub(crate) fn in_room(
        camera: &StereoCamera,
        cell: &Cell,
        shape: RopeShape,
        room: &Room,
        (target_rgb, frame_rate_hz): ([u8; 3], f64),
        seed: u64,
    ) -> Self {
        let lamps = room.still.lamps.iter();
        let lamps: Vec<_> = lamps
            .map(|lamp| LampView::of(lamp, room.still.wall_y_m))
            .collect();
        let appearance = room.appearance(target_rgb);
        let look = RopeLook {
            shape,
            cord: room.rope.cord,
            lead: room.rope.lead,
        };
        let views = lamps.clone();
        let view = |image: &ImageView| View::of(image, room, &views);
        let noise = (room.picture.noise_levels, seed);
        Self {
            bystanders: room.bystanders.clone(),
            picture: Some((room.picture, frame_rate_hz)),
            ..Self::of(camera, cell, look, appearance, noise, lamps, view)
        }
    }

    /// Prepares both eyes, each with its view of what stands still; nothing else lives.
    fn of(
        camera: &StereoCamera,
        cell: &Cell,
        rope: RopeLook,
        appearance: Appearance,
        (noise_levels, seed): (f32, u64),
        lamps: Vec<LampView>,
        view: impl Fn(&ImageView) -> View,
    ) -> Self {
        let images = [ImageView::left(camera), ImageView::right(camera)]
            .map(|image| ImageCanvas::new(image, view(&image)));
        let row_bytes = images[0].image.size_px().0 * 4;
        Self {
            images,
            cell: *cell,
            rope,
            appearance,
            sensor: Sensor::new(noise_levels, row_bytes, seed),
            rows: RowTimes::of(camera),
            target_m: None,
            bodies: None,
            tilt_rad: 0.0,
            shadows: Shadows::of(lamps),
            bystanders: Bystanders::default(),
            picture: None,
            drawn_px: 0,
        }
    }

    /// Bytes of one frame: both eyes side by side, two bytes a pixel.
    #[must_use]
    pub fn frame_bytes(&self) -> usize {
        let (width, height) = self.images[0].image.size_px();
        width * height * 4
    }

    /// Pixels of the last frame that were not copied from the room as it stands: what a
    /// frame costs.
    #[must_use]
    pub fn drawn_px(&self) -> usize {
        self.drawn_px
    }

    /// Puts the target ball at a place in the world (m), or takes it away.
    pub fn place_target(&mut self, target_m: Option<Vector3<f64>>) {
        self.target_m = target_m;
    }

    /// Puts the bodies of a task into the scene, or takes them away.
    pub fn place_bodies(&mut self, bodies: Option<TaskBodies>) {
        self.bodies = bodies;
    }

    /// Leans their domino (rad).
    pub fn lean_domino(&mut self, tilt_rad: f64) {
        self.tilt_rad = tilt_rad;
    }

    /// Sub-frames that show the motion from `start` to `end` of a frame, from the first
    /// row's opening to the last row's end, without gaps: about one per pixel of the
    /// fastest node, at least one.
    #[must_use]
    pub fn sub_frames(&self, start: &ScenePose, end: &ScenePose) -> usize {
        let image = &self.images[0].image;
        let moved = start.nodes.iter().zip(&end.nodes).filter_map(|(a, b)| {
            let (a, b) = (image.project(a)?, image.project(b)?);
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
        let (width, height) = self.images[0].image.size_px();
        let row_bytes = width * 4;
        let begins_s = self.picture.map_or(0.0, |(_, hz)| sequence as f64 / hz);
        let mut others = self.bystanders.at(begins_s);
        if let Some(at) = &self.target_m {
            others.extend(target_solids(&self.cell, at, &self.appearance));
        }
        if let Some(bodies) = &self.bodies {
            others.extend(bodies.solids(self.tilt_rad));
        }
        let cast = Cast {
            cell: &self.cell,
            rope: &self.rope,
            others: &others,
        };
        let spells = self
            .images
            .each_ref()
            .map(|canvas| cast.spells(&canvas.image, &canvas.view.light, poses));
        let weight_of = |v: usize, i: usize| self.rows.weight(v, i, poses.len());
        // All rows of a global shutter share their shadows.
        let together = if self.rows.exposures() > 1.0 {
            BAND_ROWS
        } else {
            height
        };
        self.drawn_px = 0;
        self.shadows.begin(&cast, poses);
        let bands = out[..height * row_bytes].chunks_mut(together * row_bytes);
        for (first, band) in (0..height).step_by(together).zip(bands) {
            let middle = (first + together / 2).min(height - 1);
            self.shadows.cast(&cast, poses, |i| weight_of(middle, i));
            for (v, row) in (first..).zip(band.chunks_exact_mut(row_bytes)) {
                let halves = row.chunks_exact_mut(width * 2);
                for ((canvas, spells), half) in self.images.iter_mut().zip(&spells).zip(halves) {
                    let covers = &self.shadows.covers;
                    self.drawn_px += canvas.draw_row(v, spells, covers, |i| weight_of(v, i), half);
                }
            }
        }
        if let Some((picture, _)) = self.picture {
            let row_s = |v: usize| begins_s + self.rows.opens_s(v);
            for (v, row) in out.chunks_exact_mut(row_bytes).take(height).enumerate() {
                brighten(row, picture.gain(row_s(v)) as f32);
            }
        }
        self.sensor.expose(out, row_bytes, sequence);
    }
}
