//! The live preview on rendered films: a rope that is found while the arm wiggles and
//! followed while it goes on to move otherwise.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

use std::f64::consts::TAU;
use std::time::Instant;

use arm_model::joint::START_POSE;
use arm_model::kinematics::FrameMotion;
use arm_model::{Cell, JointVector, Pole};
use camera_ingest::StereoFrame;
use camera_ingest::preview::Preview;
use hil_tests::quantile;
use nalgebra::Vector3;
use rig_sim::CameraConfig;
use rig_sim::hidden::hidden_rope;
use rig_sim::render::{Appearance, Renderer, RopeShape, ScenePose};
use rig_sim::wiggle_film::attach_of;
use rope_sim::LiveRope;
use shared_types::StereoCamera;
use shared_types::ipc::{PreviewFrame, PreviewState};

const RATE_HZ: f64 = 30.0;
/// The arm stands for so long at first (s).
const REST_S: f64 = 0.8;
/// Pause between two joint reports, and from a report to its arrival (s).
const REPORT_S: f64 = 0.004;
const LATE_S: f64 = 0.003;
const KEYPOINTS: usize = 21;
const SEED: u64 = 4;

/// A wiggle of joint 6 that grows, with a slower turn of joint 1 from the sixth second on.
fn joints(t_s: f64) -> JointVector {
    let since_s = (t_s - REST_S).max(0.0);
    let rise = |s: f64| (s / 2.0).clamp(0.0, 1.0).powi(3);
    let mut q = START_POSE;
    q[5] += 0.2 * rise(since_s) * (TAU * 1.2 * since_s).sin();
    q[0] += 0.15 * rise(since_s - 6.0) * (TAU * 0.5 * (since_s - 6.0)).sin();
    q
}

fn attach(t_s: f64) -> FrameMotion {
    attach_of(joints, t_s)
}

/// The rig's rope, filmed, and a preview that is told what the arm does.
struct Stage {
    preview: Preview,
    camera: StereoCamera,
    renderer: Renderer,
    live: LiveRope,
    /// Frames filmed, reports made.
    frames: u64,
    reports: u64,
}

impl Stage {
    fn new(config: &CameraConfig) -> Self {
        let camera = config.stereo_camera();
        let rope = hidden_rope(SEED);
        Self {
            preview: Preview::new(camera.clone(), Pole::default(), KEYPOINTS).unwrap(),
            renderer: Renderer::new(
                &camera,
                &Cell::default(),
                RopeShape::from(&rope),
                Appearance::from_seed(SEED),
                config.noise_levels,
                SEED,
            ),
            live: LiveRope::new(&rope, &attach(0.0), 2e-4).unwrap(),
            camera,
            frames: 0,
            reports: 0,
        }
    }

    /// Films the next frame; the keypoints' errors, where there are any (px), and the time
    /// it took the preview (ms).
    fn step(&mut self) -> (PreviewFrame, Vec<f64>, f64) {
        let start_s = self.frames as f64 / RATE_HZ;
        let (t_s, frame_s) = (start_s, self.camera.frame_time_s());
        // Few poses are enough for the eye; the middle row's is the truth.
        let poses: Vec<ScenePose> = (0..9)
            .map(|i| t_s + frame_s * (f64::from(i) + 0.5) / 9.0)
            .map(|t_s| {
                self.live.advance(&attach, t_s);
                ScenePose {
                    q: joints(t_s),
                    nodes: self.live.nodes().to_vec(),
                }
            })
            .collect();
        let mut yuyv = vec![0; self.renderer.frame_bytes()];
        self.renderer.render(&poses, self.frames, &mut yuyv);
        let size = [2 * self.camera.width_px, self.camera.height_px].map(|px| px as usize);
        let stamp_ns = 1_000_000_000 + (start_s * 1e9) as u64;
        let frame = StereoFrame::from_yuyv(&yuyv, size, stamp_ns, self.frames).unwrap();
        self.frames += 1;
        while (self.reports as f64) * REPORT_S < start_s + self.camera.exposure_s - LATE_S {
            let t_s = self.reports as f64 * REPORT_S;
            let stamp_ns = 1_000_000_000 + (t_s * 1e9) as u64;
            self.preview.report(stamp_ns, &joints(t_s));
            self.reports += 1;
        }
        let left = frame.left();
        let began = Instant::now();
        let reported = self.preview.see(left);
        let took_ms = began.elapsed().as_secs_f64() * 1e3;
        (reported, self.errors_px(&reported, &poses), took_ms)
    }

    fn errors_px(&self, reported: &PreviewFrame, poses: &[ScenePose]) -> Vec<f64> {
        let frame_s = self.camera.frame_time_s();
        let seen = |node: usize| -> [f64; 2] {
            let at = |pose: &ScenePose| self.camera.project_left(&pose.nodes[node]).unwrap();
            let row = at(&poses[4])[1];
            let place = self.camera.row_time_s(row) / frame_s * 9.0;
            at(&poses[(place as usize).min(8)])
        };
        let line: Vec<[f64; 2]> = (0..poses[0].nodes.len()).map(seen).collect();
        let points = reported.rope.points().iter();
        points.map(|p| off_px(p.map(f64::from), &line)).collect()
    }
}

/// Distance of a point from a polyline.
fn off_px(p: [f64; 2], line: &[[f64; 2]]) -> f64 {
    let p = Vector3::new(p[0], p[1], 0.0);
    let from = |w: &[[f64; 2]]| {
        let [a, b] = [w[0], w[1]].map(|p| Vector3::new(p[0], p[1], 0.0));
        let along = (p - a).dot(&(b - a)) / (b - a).norm_squared().max(1e-9);
        (p - a - (b - a) * along.clamp(0.0, 1.0)).norm()
    };
    line.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

/// Films until a search is due and runs it; frames go on while it would.
fn find(stage: &mut Stage) {
    let search = loop {
        let (reported, ..) = stage.step();
        assert_eq!(reported.state(), PreviewState::Looking);
        if let Some(search) = stage.preview.search() {
            break search;
        }
        assert!(stage.frames < 10 * RATE_HZ as u64, "nothing to look for");
    };
    println!("looked for after {} frames", stage.frames);
    let began = Instant::now();
    let answer = search.run();
    println!("found in {:.1} s", began.elapsed().as_secs_f64());
    for _ in 0..20 {
        assert_eq!(stage.step().0.state(), PreviewState::Looking);
        assert!(stage.preview.search().is_none(), "one search");
    }
    stage.preview.take(answer);
}

/// Follows for some frames and says how well.
fn assert_follows(stage: &mut Stage, frames: usize) {
    let (mut errors, mut tip, mut times) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..frames {
        let (reported, off, took_ms) = stage.step();
        assert_eq!(reported.state(), PreviewState::Following);
        assert_eq!(
            (reported.rope.count as usize, reported.rope.lost),
            (KEYPOINTS, 0)
        );
        tip.push(off[KEYPOINTS - 1]);
        errors.extend(off);
        times.push(took_ms);
    }
    let [half, most] = [0.5, 0.95].map(|part| quantile(&errors, part));
    let tip = quantile(&tip, 0.95);
    let [usual_ms, most_ms] = [0.5, 0.99].map(|part| quantile(&times, part));
    let reported = format!(
        "median {half:.2}, p95 {most:.2}, tip's p95 {tip:.2} px; {usual_ms:.2} ms a frame, \
         p99 {most_ms:.2} ms, first {:.1} ms",
        times[0]
    );
    println!("{reported}");
    assert!(half < 0.25 && most < 1.5, "{reported}");
}

#[test]
fn a_rope_is_looked_for_found_followed_and_looked_for_again() {
    let mut stage = Stage::new(&CameraConfig::default());
    find(&mut stage);
    assert_follows(&mut stage, 120);
    // Another turn of the arm than any path allows.
    let stamp_ns = 1_000_000_000 + ((stage.reports as f64) * REPORT_S * 1e9) as u64;
    let mut elsewhere = joints(0.0);
    elsewhere[0] += 1.0;
    stage.preview.report(stamp_ns, &elsewhere);
    stage.reports += 1;
    let (reported, ..) = stage.step();
    assert_eq!(
        (reported.state(), reported.restarts),
        (PreviewState::Looking, 1)
    );
}

#[test]
fn with_rolling_rows_it_is_followed_and_a_camera_that_restarts_ends_that() {
    let config = CameraConfig {
        line_time_s: 26.1e-6,
        ..CameraConfig::default()
    };
    let mut stage = Stage::new(&config);
    find(&mut stage);
    assert_follows(&mut stage, 60);
    let stamp_ns = 1_000_000_000 + (stage.frames as f64 / RATE_HZ * 1e9) as u64;
    let grey = vec![128; stage.renderer.frame_bytes()];
    let again = StereoFrame::from_yuyv(&grey, [1344, 376], stamp_ns, 0).unwrap();
    let reported = stage.preview.see(again.left());
    assert_eq!(
        (reported.state(), reported.restarts),
        (PreviewState::Looking, 1)
    );
}
