//! A gentle wiggle, drawn from formulas: the rope stands still for a good part
//! of the recording, the clamp moves little, arm and pole move with it.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

use camera_ingest::frame::ycc_from_rgb;
use camera_ingest::track::{ClampSample, TrackOptions};
use camera_ingest::{ClampPath, EyeFrame, TrackResult, track};
use nalgebra::{Matrix3, Vector3};
use shared_types::keypoints::TrackedFrame;
use shared_types::{Intrinsics, Shutter, StereoCamera};
use std::ops::Range;

const LENGTH_M: f64 = 0.5;
/// Radii of rope and lead (m) where a test does not choose others.
const RADII_M: [f64; 2] = [0.006, 0.02];
const RED_AND_BLUE: [[f64; 3]; 2] = [[190.0, 60.0, 40.0], [40.0, 60.0, 170.0]];
const GREEN: [f64; 3] = [60.0, 110.0, 60.0];
const WIDTH: usize = 672;
const HEIGHT: usize = 376;
const NODES: usize = 41;

fn camera() -> StereoCamera {
    let eye = Intrinsics {
        fx: 350.0,
        fy: 350.0,
        cx: 335.5,
        cy: 187.5,
        distortion: [-0.17, 0.027, 0.0, 0.0, 0.0],
    };
    StereoCamera {
        width_px: WIDTH as u32,
        height_px: HEIGHT as u32,
        left: eye,
        right: eye,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(0.063, 0.0, 0.0),
        r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.0, -0.95, 0.55),
        shutter: Shutter::Global,
        exposure_s: 0.004,
        line_time_s: 0.0,
    }
}

/// How a recording moves.
struct Motion {
    still_s: f64,
    clamp_m: f64,
    tip_rad: f64,
}

impl Motion {
    fn swing(&self, t_s: f64, lag: f64) -> f64 {
        let since = (t_s - self.still_s).max(0.0);
        (std::f64::consts::TAU * 0.8 * since - lag).sin() * (since / 0.6).min(1.0)
            + lag.sin() * (since / 0.6).min(1.0) * (-since * 3.0).exp()
    }

    fn clamp(&self, t_s: f64) -> ClampSample {
        let x = self.clamp_m * self.swing(t_s, 0.0);
        ClampSample {
            t_s,
            p_w_m: Vector3::new(x, 0.0, 0.85),
            pole_w: Vector3::new(x, 0.0, 1.0).normalize(),
        }
    }

    /// The rope's nodes: its angle grows along it.
    fn rope(&self, t_s: f64) -> Vec<Vector3<f64>> {
        let step = LENGTH_M / (NODES - 1) as f64;
        let mut p = self.clamp(t_s).p_w_m;
        let mut nodes = vec![p];
        for i in 1..NODES {
            let part = (i as f64 - 0.5) / (NODES - 1) as f64;
            let angle = self.tip_rad * part * self.swing(t_s, 1.1 * part);
            p += Vector3::new(angle.sin(), 0.0, -angle.cos()) * step;
            nodes.push(p);
        }
        nodes
    }
}

fn hash(mut x: u64) -> f64 {
    x = (x ^ (x >> 31)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((x ^ (x >> 32)) & 0xFFFF) as f64 / 65535.0
}

/// Draws thick polylines over a textured wall and floor, then adds noise.
struct Canvas {
    colour: Vec<[f64; 3]>,
}

impl Canvas {
    fn wall() -> Self {
        let colour = (0..WIDTH * HEIGHT)
            .map(|i| {
                let (u, v) = (i % WIDTH, i / WIDTH);
                let blotch = 14.0 * ((u as f64 / 31.0).sin() * (v as f64 / 23.0).cos());
                let grain = 6.0 * (hash((u / 3 + 977 * (v / 3)) as u64) - 0.5);
                let floor = if v > 310 { -45.0 } else { 0.0 };
                let level = 150.0 + blotch + grain + floor;
                [level, level - floor * 0.2, level - floor * 0.4]
            })
            .collect();
        Self { colour }
    }

    fn stroke(&mut self, pixels: &[[f64; 2]], radius_px: f64, rgb: [f64; 3]) {
        for pair in pixels.windows(2) {
            let reach = radius_px + 2.0;
            let low = |k: usize| (pair[0][k].min(pair[1][k]) - reach).max(0.0) as usize;
            let high = |k: usize, n: usize| {
                ((pair[0][k].max(pair[1][k]) + reach).max(0.0) as usize).min(n - 1)
            };
            for v in low(1)..=high(1, HEIGHT) {
                for u in low(0)..=high(0, WIDTH) {
                    let d = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
                    let e = [u as f64 - pair[0][0], v as f64 - pair[0][1]];
                    let part = ((d[0] * e[0] + d[1] * e[1])
                        / (d[0] * d[0] + d[1] * d[1]).max(1e-9))
                    .clamp(0.0, 1.0);
                    let away = (e[0] - part * d[0]).hypot(e[1] - part * d[1]);
                    let cover = (radius_px + 0.5 - away).clamp(0.0, 1.0);
                    let pixel = &mut self.colour[v * WIDTH + u];
                    for k in 0..3 {
                        // Joints of the polyline must not be covered twice: paint, don't add.
                        if cover > 0.999 {
                            pixel[k] = rgb[k];
                        } else if (pixel[k] - rgb[k]).abs() > 1.0 {
                            pixel[k] += cover * 0.7 * (rgb[k] - pixel[k]);
                        }
                    }
                }
            }
        }
    }

    fn frame(&self, index: usize) -> EyeFrame {
        let (mut luma, mut cb, mut cr) = (Vec::new(), Vec::new(), Vec::new());
        for (i, c) in self.colour.iter().enumerate() {
            let noise =
                |k: u64| 5.0 * (hash((i as u64 * 4 + k) ^ ((index as u64 + 1) << 40)) - 0.5);
            let noisy =
                core::array::from_fn(|k| (c[k] + noise(k as u64)).round().clamp(0.0, 255.0) as u8);
            let [y, b, r] = ycc_from_rgb(noisy).map(|x| x.round().clamp(0.0, 255.0) as u8);
            luma.push(y);
            if i % 2 == 0 {
                cb.push(b);
                cr.push(r);
            }
        }
        EyeFrame {
            stamp_ns: 1_000_000_000 + index as u64 * 16_666_667,
            sequence: index as u64,
            width_px: WIDTH,
            height_px: HEIGHT,
            luma,
            cb,
            cr,
        }
    }
}

/// A drawn recording with its truth.
struct Recording {
    frames: Vec<EyeFrame>,
    /// Node pixels per frame.
    truth: Vec<Vec<[f64; 2]>>,
    clamp: ClampPath,
}

/// What is drawn.
struct Scene {
    motion: Motion,
    count: usize,
    /// Colours and radii of rope and lead.
    colours: [[f64; 3]; 2],
    radii_m: [f64; 2],
    /// Radius of a knot a third down the rope.
    knot_m: f64,
    /// Frames in which the rope is hidden.
    hidden: Range<usize>,
}

impl Scene {
    /// `count` frames of a rope without a knot that is never hidden.
    fn new(motion: Motion, count: usize, colours: [[f64; 3]; 2], radii_m: [f64; 2]) -> Self {
        Self {
            motion,
            count,
            colours,
            radii_m,
            knot_m: radii_m[0],
            hidden: 0..0,
        }
    }

    /// The rope looks as it was drawn, and is followed closely in all frames.
    fn assert_followed(&self) {
        let recording = record(self);
        let result = follow(&recording);
        assert_looks(&result, self.radii_m);
        assert_small(errors(&recording, &result, 0..self.count));
    }
}

fn record(scene: &Scene) -> Recording {
    let Scene {
        motion,
        count,
        colours,
        radii_m,
        knot_m,
        hidden,
    } = scene;
    let camera = camera();
    let pixels = |nodes: &[Vector3<f64>]| -> Vec<[f64; 2]> {
        let project = |p| camera.project_left(p).unwrap();
        nodes.iter().map(project).collect()
    };
    let px_per_m = 350.0 / 0.95;
    let (mut frames, mut truth, mut clamp) = (Vec::new(), Vec::new(), Vec::new());
    for index in 0..*count {
        let t_s = index as f64 * 16_666_667e-9;
        let seen_s = t_s + camera.row_time_s(0.0);
        let (hold, nodes) = (motion.clamp(seen_s), motion.rope(seen_s));
        let up = |d: f64| hold.p_w_m + hold.pole_w * d;
        let mut canvas = Canvas::wall();
        let arm = pixels(&[up(0.2), up(0.45)]);
        canvas.stroke(&arm, 0.045 * px_per_m, [225.0, 228.0, 230.0]);
        let pole = pixels(&[up(0.0), up(0.2)]);
        canvas.stroke(&pole, 0.01 * px_per_m, [60.0, 62.0, 66.0]);
        let rope = pixels(&nodes);
        if !hidden.contains(&index) {
            canvas.stroke(&rope, radii_m[0] * px_per_m, colours[0]);
            canvas.stroke(&[rope[NODES / 3]; 2], knot_m * px_per_m, colours[0]);
            canvas.stroke(&[rope[NODES - 1]; 2], radii_m[1] * px_per_m, colours[1]);
        }
        frames.push(canvas.frame(index));
        truth.push(rope);
        clamp.push(motion.clamp(t_s));
    }
    // A little more of the arm's motion than the video shows.
    clamp.push(motion.clamp(*count as f64 * 16_666_667e-9));
    Recording {
        frames,
        truth,
        clamp: ClampPath::new(clamp).unwrap(),
    }
}

fn follow(recording: &Recording) -> TrackResult {
    let options = TrackOptions {
        keypoints: 21,
        ..TrackOptions::default()
    };
    track(&recording.frames, &camera(), &recording.clamp, &options).unwrap()
}

/// Median, 95th percentile and maximum of the keypoints' error over some frames (px).
fn errors(recording: &Recording, result: &TrackResult, frames: Range<usize>) -> [f64; 3] {
    let mut all: Vec<f64> = Vec::new();
    for index in frames {
        let nodes = recording.truth[index].iter().step_by(2);
        for (p, t) in result.track.frames[index].points.iter().zip(nodes) {
            all.push((p[0] - t[0]).hypot(p[1] - t[1]));
        }
    }
    all.sort_by(f64::total_cmp);
    [0.5, 0.95, 1.0].map(|q| all[((all.len() - 1) as f64 * q) as usize])
}

fn assert_small([median, p95, max]: [f64; 3]) {
    println!("median {median:.2}, p95 {p95:.2}, max {max:.2} px");
    assert!(
        median < 1.0 && p95 < 2.0 && max < 6.0,
        "{median} {p95} {max}"
    );
}

fn assert_looks(result: &TrackResult, radii_m: [f64; 2]) {
    let seen = &result.appearance;
    assert!((seen.length_m - LENGTH_M).abs() < 0.005, "{seen:?}");
    let found = [seen.rope_radius_m, seen.lead_radius_m];
    for (found, truth) in found.into_iter().zip(radii_m) {
        assert!((found - truth).abs() < 1e-3, "{truth}: {seen:?}");
    }
}

#[test]
fn a_red_rope_that_sways_gently_and_is_hidden_for_a_while() {
    let motion = Motion {
        still_s: 0.5,
        clamp_m: 0.012,
        tip_rad: 0.35,
    };
    let hidden = 80..86;
    let scene = Scene {
        hidden: hidden.clone(),
        ..Scene::new(motion, 150, RED_AND_BLUE, RADII_M)
    };
    let recording = record(&scene);
    let result = follow(&recording);
    assert_looks(&result, RADII_M);
    assert_small(errors(&recording, &result, 0..hidden.start));
    assert_small(errors(&recording, &result, hidden.end + 2..150));
    for (index, frame) in result.track.frames.iter().enumerate() {
        assert_eq!(frame.lost, hidden.contains(&index), "frame {index}");
    }
}

#[test]
fn a_rope_that_is_still_for_most_of_the_recording() {
    let motion = Motion {
        still_s: 1.5,
        clamp_m: 0.006,
        tip_rad: 0.4,
    };
    let colours = [GREEN, [230.0, 140.0, 30.0]];
    Scene::new(motion, 150, colours, RADII_M).assert_followed();
}

#[test]
fn a_rope_thinner_than_two_pixels_is_not_taken_for_a_hidden_one() {
    let motion = Motion {
        still_s: 0.3,
        clamp_m: 0.06,
        tip_rad: 1.0,
    };
    let colours = [[60.0, 90.0, 160.0], [235.0, 140.0, 40.0]];
    let recording = record(&Scene::new(motion, 150, colours, [0.0015, 0.035]));
    let result = follow(&recording);
    assert_small(errors(&recording, &result, 0..150));
    let lost = result.track.frames.iter().filter(|f| f.lost).count();
    let doubted = |f: &&TrackedFrame| f.confidence.iter().all(|c| *c <= 0.5);
    let doubtful = result.track.frames.iter().filter(doubted).count();
    assert_eq!((lost, doubtful), (0, 0));
}

/// Moves a fat rope by more than its width, too.
const SWAY: Motion = Motion {
    still_s: 0.3,
    clamp_m: 0.035,
    tip_rad: 0.5,
};

#[test]
fn a_lead_hardly_fatter_than_the_rope_is_known_by_its_colour() {
    let colours = [[44.0, 82.0, 160.0], [240.0, 150.0, 30.0]];
    let scene = Scene {
        // A knot near the clamp is the fattest place.
        knot_m: 0.0145,
        ..Scene::new(SWAY, 100, colours, [0.011, 0.0125])
    };
    scene.assert_followed();
}

/// Without a width to go by, either, the lead is the free end.
#[test]
fn a_lead_of_the_ropes_colour_is_known_by_its_width_or_is_the_free_end() {
    for radii_m in [[0.006, 0.017], [0.011, 0.011]] {
        Scene::new(SWAY, 100, [GREEN; 2], radii_m).assert_followed();
    }
}

/// The same path, reported `late_s` later and `aside_m` further to the right.
fn moved(path: &ClampPath, late_s: f64, aside_m: f64) -> ClampPath {
    let samples = path.samples().iter().map(|s| ClampSample {
        t_s: s.t_s + late_s,
        p_w_m: s.p_w_m + Vector3::new(aside_m, 0.0, 0.0),
        ..*s
    });
    ClampPath::new(samples.collect()).unwrap()
}

#[test]
fn a_clock_and_a_clamp_that_are_off_are_reported() {
    let mut recording = record(&Scene::new(SWAY, 150, RED_AND_BLUE, RADII_M));
    let path = recording.clamp.clone();
    for (late_s, aside_m) in [(0.0, 0.0), (0.008, 0.002), (-0.012, -0.002)] {
        recording.clamp = moved(&path, late_s, aside_m);
        let found = follow(&recording).clamp.unwrap();
        println!("{late_s} s, {aside_m} m: {found:?}");
        // A path reported late makes the film early.
        let off_s = (found.time_offset_s + late_s).abs();
        let off_m = (found.aside_m + aside_m).abs();
        assert!(off_s < 2.0 * found.time_std_s + 5e-4, "{found:?}");
        assert!(off_m < 2.0 * found.aside_std_m + 5e-4, "{found:?}");
        assert!(
            found.time_std_s < 3e-3 && found.aside_std_m < 2e-3,
            "{found:?}"
        );
        assert!(found.frames > 100, "{found:?}");
    }
}

#[test]
fn no_rope_is_an_error_that_says_so() {
    let motion = Motion {
        still_s: 0.1,
        clamp_m: 0.03,
        tip_rad: 0.4,
    };
    let recording = record(&Scene {
        hidden: 0..30,
        ..Scene::new(motion, 30, [[0.0; 3]; 2], RADII_M)
    });
    let options = TrackOptions::default();
    let error = track(&recording.frames, &camera(), &recording.clamp, &options).unwrap_err();
    assert!(
        error.to_string().contains("nothing long enough hangs"),
        "{error}"
    );
}
