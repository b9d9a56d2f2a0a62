//! A wiggle filmed in a drawn room: frames, the truth in their pixels, and what arm and
//! calibration say about it, which is a little wrong.
//!
//! Seeds below 1 000 000 are for tuning. Even seeds from 1 000 000 on are reserved for
//! judging: nobody looks at them before.

mod camera;
mod swing;

use crate::exposure::{as_seen, draw, poses};
use crate::hidden::hidden_rope;
use crate::render::{Appearance, Renderer, RopeShape, ScenePose, centreline};
use crate::room::{Kind, Room};
use crate::wiggle_film::joints;
use arm_model::{Cell, JointVector};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rope_sim::SimulateError;
use shared_types::{RopeParams, StereoCamera};
use swing::Swing;

/// Keeps the draws of films apart from other draws of the same seed.
const STREAM: u64 = 0x6669_6c6d_7300;
/// Frames of a film.
pub const FRAMES: usize = 400;
/// Frames per second.
pub const FRAME_RATE_HZ: f64 = 60.0;
/// Time between two reported joints (s).
const REPORT_S: f64 = 0.004;
/// Time by which the simulation goes on after the last frame begins (s).
const AFTER_S: f64 = 0.05;
/// Time between the places for which the camera must see the rope (s).
const LOOK_S: f64 = 0.05;

/// Stamp of the first frame (ns), and how uneven the others are (s).
const FIRST_STAMP_NS: u64 = 5_000_000_000;
const STAMP_STD_S: f64 = 3e-5;

/// Start of a frame (s) from the first one's.
fn start_s(frame: usize) -> f64 {
    frame as f64 / FRAME_RATE_HZ
}

/// What is drawn for a film besides its room.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The rope, with physics beyond its nine parameters.
    pub rope: RopeParams,
    /// The camera that films.
    pub camera: StereoCamera,
    /// What a calibration says about it.
    pub calibrated: StereoCamera,
    /// How late the film's frames are on the arm's clock, against what the film says (s).
    pub film_late_s: f64,
    /// How late the reported joints are (s).
    pub joints_late_s: f64,
    /// Standard deviation of the reported joints (rad).
    pub joints_std_rad: f64,
}

impl Setting {
    /// The setting of a seed, and the rope's motion in it.
    fn draw(seed: u64, kind: Kind) -> Result<(Self, Swing), SimulateError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ STREAM);
        rng.set_stream(kind as u64);
        let mut rope = hidden_rope(rng.random());
        // Tip weights as people tie them on, many hardly thicker than the rope.
        let times = if rng.random_bool(0.4) {
            1.05..1.6
        } else {
            1.6..4.0
        };
        rope.lead_radius_m = (rope.radius_m * rng.random_range(times)).min(0.03);
        let rope = rope.with_extras(swing::extras(&mut rng));
        let film_s = FRAMES as f64 / FRAME_RATE_HZ;
        let swing = Swing::of(&rope, film_s + AFTER_S)?;
        let looks = (film_s / LOOK_S) as usize;
        let swept: Vec<_> = (0..looks)
            .flat_map(|i| swing.at(i as f64 * LOOK_S))
            .collect();
        let camera = camera::draw(&mut rng, &swept);
        let setting = Self {
            calibrated: camera::calibrated(&mut rng, &camera),
            camera,
            rope,
            film_late_s: rng.random_range(-0.005..=0.005),
            joints_late_s: rng.random_range(0.0..=0.008),
            joints_std_rad: rng.random_range(5e-5..4e-4),
        };
        Ok((setting, swing))
    }

    fn reported_joints(&self, seed: u64) -> Vec<(f64, JointVector)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ STREAM);
        rng.set_stream(17);
        let noise = Normal::new(0.0, self.joints_std_rad).ok();
        let rows = ((FRAMES as f64 / FRAME_RATE_HZ + AFTER_S) / REPORT_S) as usize;
        (0..rows)
            .map(|i| {
                let t_s = i as f64 * REPORT_S;
                let true_q = joints((t_s - self.joints_late_s).max(0.0));
                let mut off = || noise.map_or(0.0, |n| n.sample(&mut rng));
                (t_s, JointVector(true_q.0.map(|q| q + off())))
            })
            .collect()
    }
}

/// One frame of the film.
#[derive(Debug)]
pub struct Frame {
    /// Both eyes side by side, packed YUYV.
    pub yuyv: Vec<u8>,
    /// Points of the rope from the clamp to the centre of the tip weight, as the left eye
    /// shows them (raw px): in the middle of the exposure of their row.
    pub truth_px: Vec<[f64; 2]>,
}

/// A film being rendered; its frames come in order.
#[derive(Debug)]
pub struct RoomFilm {
    /// Its room.
    pub room: Room,
    /// What else was drawn for it.
    pub setting: Setting,
    seed: u64,
    swing: Swing,
    renderer: Renderer,
    next: usize,
}

impl RoomFilm {
    /// The film of a seed.
    ///
    /// # Errors
    /// The rope cannot be simulated.
    pub fn draw(seed: u64, kind: Kind) -> Result<Self, SimulateError> {
        let room = Room::draw(seed, kind);
        Self::in_room(seed, room)
    }

    /// The film of a seed in another room, or in its own with something changed.
    ///
    /// # Errors
    /// The rope cannot be simulated.
    pub fn in_room(seed: u64, room: Room) -> Result<Self, SimulateError> {
        let (setting, swing) = Setting::draw(seed, room.kind)?;
        let renderer = Renderer::in_room(
            &setting.camera,
            &Cell::default(),
            RopeShape::from(&setting.rope),
            &room,
            (Appearance::from_seed(seed).target_rgb, FRAME_RATE_HZ),
            seed,
        );
        Ok(Self {
            room,
            setting,
            seed,
            swing,
            renderer,
            next: 0,
        })
    }

    /// The joints as the arm reports them, from t = 0, where by the film's clock its
    /// first frame begins.
    #[must_use]
    pub fn reported_joints(&self) -> Vec<(f64, JointVector)> {
        self.setting.reported_joints(self.seed)
    }

    /// When each frame began by the film's own clock (ns), a little uneven.
    #[must_use]
    pub fn stamps_ns(&self) -> Vec<u64> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ STREAM);
        rng.set_stream(18);
        let uneven = Normal::new(0.0, STAMP_STD_S).ok();
        (0..FRAMES)
            .map(|i| {
                let late_s = uneven.map_or(0.0, |n| n.sample(&mut rng));
                let since_s = if i == 0 { 0.0 } else { start_s(i) + late_s };
                FIRST_STAMP_NS + (since_s * 1e9).round() as u64
            })
            .collect()
    }

    fn pose(&self, t_s: f64) -> ScenePose {
        ScenePose {
            q: joints(t_s.max(0.0)),
            nodes: self.swing.at(t_s),
        }
    }

    /// Draws frame `i`, whatever was drawn before.
    pub fn frame(&mut self, i: usize) -> Frame {
        let camera = &self.setting.camera;
        let start_s = start_s(i) + self.setting.film_late_s;
        let all = poses(camera, start_s, |t_s| self.pose(t_s));
        let lines: Vec<Vec<Vector3<f64>>> = all.iter().map(|p| centreline(&p.nodes)).collect();
        let truth = (0..lines[0].len()).filter_map(|point| {
            let places_m: Vec<_> = lines.iter().map(|line| line[point]).collect();
            camera.project_left(&as_seen(camera, &places_m))
        });
        let truth_px = truth.collect();
        let yuyv = draw(&mut self.renderer, &all, i as u64);
        Frame { yuyv, truth_px }
    }
}

impl Iterator for RoomFilm {
    type Item = Frame;

    fn next(&mut self) -> Option<Frame> {
        let i = self.next;
        self.next += 1;
        (i < FRAMES).then(|| self.frame(i))
    }
}

#[cfg(test)]
mod tests;
