//! A wiggle as the rig's camera sees it, rendered without processes, threads and clocks:
//! the same film whatever else the machine does.

use crate::CameraConfig;
use crate::exposure::{as_seen, draw, poses};
use crate::hidden::hidden_rope;
use crate::render::{Appearance, Renderer, RopeShape, ScenePose};
use arm_model::joint::START_POSE;
use arm_model::kinematics::FrameMotion;
use arm_model::{Cell, JointState, JointVector, Pole};
use nalgebra::Vector3;
use rope_sim::{LiveRope, SimulateError};
use shared_types::{RopeParams, StereoCamera};

const AMPLITUDE_RAD: f64 = 0.288;
const FREQUENCY_HZ: f64 = 1.3;
const DURATION_S: f64 = 5.6;
const RAMP_S: f64 = 2.8;
const PHYSICS_STEP_S: f64 = 1e-4;
/// Time of the push after which a rope swings (s).
const PUSH_S: f64 = 0.8;
/// Where the target hangs (m).
const TARGET_M: [f64; 3] = [1.10, 0.0, 0.45];

/// Quintic step from 0 to 1, flat at both ends.
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

/// Joints of the shipped wiggle (rad) at a time (s): a sine of joint 6, faded in and out,
/// from t = 0 with the rope hanging still.
#[must_use]
pub fn joints(t_s: f64) -> JointVector {
    let fade = smooth_step(t_s / RAMP_S) * smooth_step((DURATION_S - t_s) / RAMP_S);
    let swing = (core::f64::consts::TAU * FREQUENCY_HZ * t_s).sin();
    let mut q = START_POSE;
    q[5] += AMPLITUDE_RAD * swing * fade;
    q
}

/// The attach frame of the shipped wiggle at a time (s).
pub(crate) fn attach(t_s: f64) -> FrameMotion {
    attach_of(joints, t_s)
}

/// The attach frame of a motion of the joints (rad) at a time (s), with velocities and
/// accelerations by central differences.
#[must_use]
pub fn attach_of(joints: impl Fn(f64) -> JointVector, t_s: f64) -> FrameMotion {
    const H: f64 = 1e-3;
    let (before, now, after) = (joints(t_s - H), joints(t_s), joints(t_s + H));
    Pole::default().attach_motion(&JointState {
        q: now,
        qd: (after - before).map(|d| d / (2.0 * H)),
        qdd: (after + before - now - now).map(|d| d / (H * H)),
    })
}

/// One frame of the film.
#[derive(Debug)]
pub struct Frame {
    /// Start of exposure (s).
    pub start_s: f64,
    /// Both eyes side by side, packed YUYV.
    pub yuyv: Vec<u8>,
    /// Nodes of the rope in the middle of the exposure of the row that shows them (world,
    /// m), clamp first.
    pub nodes: Vec<Vector3<f64>>,
}

/// A film being rendered; its frames come in order.
#[derive(Debug)]
pub struct WiggleFilm {
    /// The rope in it.
    pub rope: RopeParams,
    /// Its colours.
    pub appearance: Appearance,
    camera: StereoCamera,
    frame_rate_hz: f64,
    late_s: f64,
    /// How long it was pushed before the first frame (s).
    pushed_s: f64,
    renderer: Renderer,
    live: LiveRope,
    next: u64,
}

impl WiggleFilm {
    /// Rope and colours are the seed's; two radii replace the rope's and its lead's (m).
    /// The first frame's exposure begins `late_s` after the wiggle does (earlier: negative);
    /// the rope hangs still in it.
    ///
    /// # Errors
    /// The rope cannot be simulated.
    pub fn new(
        config: &CameraConfig,
        seed: u64,
        radii_m: Option<[f64; 2]>,
        late_s: f64,
    ) -> Result<Self, SimulateError> {
        let camera = config.stereo_camera();
        let (mut rope, appearance) = (hidden_rope(seed), Appearance::from_seed(seed));
        if let Some([radius_m, lead_radius_m]) = radii_m {
            (rope.radius_m, rope.lead_radius_m) = (radius_m, lead_radius_m);
        }
        let shape = RopeShape::from(&rope);
        let mut renderer = Renderer::new(
            &camera,
            &Cell::default(),
            shape,
            appearance,
            config.noise_levels,
            seed,
        );
        renderer.place_target(Some(TARGET_M.into()));
        Ok(Self {
            live: LiveRope::new(&rope, &attach(late_s), PHYSICS_STEP_S)?,
            rope,
            appearance,
            camera,
            frame_rate_hz: config.frame_rate_hz,
            late_s,
            pushed_s: 0.0,
            renderer,
            next: 0,
        })
    }

    /// The same, with a rope that swings in its first frame: joint 6 went forth by `push_rad`
    /// and back just before.
    #[must_use]
    pub fn swinging(mut self, push_rad: f64) -> Self {
        let start = joints(self.late_s);
        let pushed = |t_s: f64| {
            let part = 2.0 * t_s / PUSH_S;
            let mut q = start;
            q[5] += push_rad * smooth_step(part) * smooth_step(2.0 - part);
            q
        };
        self.live.advance(&|t_s| attach_of(pushed, t_s), PUSH_S);
        self.pushed_s = PUSH_S;
        self
    }

    fn pose(&mut self, t_s: f64) -> ScenePose {
        // The simulation counts from the first frame on, or from a push before it.
        let first_s = self.late_s - self.pushed_s;
        let clamp = |since_s: f64| attach(first_s + since_s);
        self.live.advance(&clamp, t_s - first_s);
        ScenePose {
            q: joints(t_s),
            nodes: self.live.nodes().to_vec(),
        }
    }
}

impl Iterator for WiggleFilm {
    type Item = Frame;

    /// The next frame; there is always one.
    fn next(&mut self) -> Option<Frame> {
        let start_s = self.late_s + self.next as f64 / self.frame_rate_hz;
        let camera = self.camera.clone();
        let all = poses(&camera, start_s, |t_s| self.pose(t_s));
        let yuyv = draw(&mut self.renderer, &all, self.next);
        self.next += 1;
        let nodes = (0..all[0].nodes.len()).map(|node| {
            let places_m: Vec<_> = all.iter().map(|pose| pose.nodes[node]).collect();
            as_seen(&camera, &places_m)
        });
        Some(Frame {
            start_s,
            yuyv,
            nodes: nodes.collect(),
        })
    }
}
