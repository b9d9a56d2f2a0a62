//! A flight drawn from a formula, and what cannot be scored.

use super::*;
use crate::frame::{StereoFrame, ycc_from_rgb};
use nalgebra::Matrix3;
use shared_types::{Intrinsics, Shutter};

const TIP_RGB: [u8; 3] = [255, 107, 13];
const TARGET_RGB: [u8; 3] = [26, 191, 64];
const TARGET: [f64; 3] = [0.1, 0.0, 0.45];
const FPS: f64 = 60.0;

fn camera() -> StereoCamera {
    let image = Intrinsics {
        fx: 350.0,
        fy: 350.0,
        cx: 160.0,
        cy: 120.0,
        distortion: [0.0; 5],
    };
    StereoCamera {
        width_px: 320,
        height_px: 240,
        left: image,
        right: image,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(0.063, 0.0, 0.0),
        r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.0, -0.9, 0.5),
        shutter: Shutter::Global,
        exposure_s: 0.002,
        line_time_s: 0.0,
    }
}

/// Straight flight past the target: nearest 50 mm above it at 0.25 s.
fn tip(t_s: f64) -> Vector3<f64> {
    Vector3::new(TARGET[0] + 1.1 * (t_s - 0.25), 0.0, TARGET[2] + 0.05)
}

/// Balls of 20 mm radius over grey, in both images.
fn frame(index: usize, balls: &[(Vector3<f64>, [u8; 3])]) -> StereoFrame {
    let camera = camera();
    let (width, height) = (2 * camera.width_px as usize, camera.height_px as usize);
    let mut yuyv = [120_u8, 128, 120, 128].repeat(width * height / 2);
    for (p, rgb) in balls {
        let ycc = ycc_from_rgb(*rgb);
        let radius = 0.02 * 350.0 / camera.to_left(p).z;
        let images = [
            camera.project_left(p).unwrap(),
            camera.project_right(p).unwrap(),
        ];
        for (image, [u0, v0]) in images.into_iter().enumerate() {
            for pair in 0..width / 4 {
                for v in 0..height {
                    let away = (2.0 * pair as f64 + 0.5 - u0).hypot(v as f64 - v0);
                    let a = (radius + 0.5 - away).clamp(0.0, 1.0) as f32;
                    let at = 4 * (v * width / 2 + image * width / 4 + pair);
                    for (k, c) in [(0, 0), (1, 1), (2, 0), (3, 2)] {
                        let old = f32::from(yuyv[at + k]);
                        yuyv[at + k] = (old + a * (ycc[c] - old)).round() as u8;
                    }
                }
            }
        }
    }
    let stamp_ns = 5_000_000_000 + (index as f64 / FPS * 1e9) as u64;
    StereoFrame::from_yuyv(&yuyv, [width, height], stamp_ns, index as u64).unwrap()
}

fn throw(target: [f64; 3]) -> Vec<StereoFrame> {
    let camera = camera();
    (0..30)
        .map(|i| {
            let seen_s = i as f64 / FPS + camera.row_time_s(0.0);
            frame(i, &[(target.into(), TARGET_RGB), (tip(seen_s), TIP_RGB)])
        })
        .collect()
}

#[test]
fn a_straight_flight_is_measured_between_frames() {
    let mut frames = throw(TARGET);
    let score = score(&mut frames, &camera(), TIP_RGB, TARGET_RGB).unwrap();
    assert!(
        (score.closest_m - 0.05).abs() < 0.002,
        "{}",
        score.closest_m
    );
    assert!((score.time_s - 0.25).abs() < 0.003, "{}", score.time_s);
    assert!((Vector3::from(score.target_m) - Vector3::from(TARGET)).norm() < 0.005);
    assert!(score.interval_m[0] < 0.05 && 0.05 < score.interval_m[1]);
    // Above the target, in the world's axes.
    let miss = Vector3::from(score.miss_m);
    assert!(
        (miss - Vector3::new(0.0, 0.0, 0.05)).norm() < 0.004,
        "{miss}"
    );
    assert!((miss.norm() - score.closest_m).abs() < 1e-12, "{miss}");
    assert!(score.tip_path.len() >= 25);
}

#[test]
fn a_thing_of_the_opposite_hue_that_goes_away_is_no_tip() {
    /// Its chroma points away from the tip's, as a blue rope's from an orange lead's.
    const ROPE_RGB: [u8; 3] = [20, 120, 220];
    let camera = camera();
    let rope = (0..20).map(|i| {
        let at = Vector3::new(-0.25, 0.0, 0.3 + 0.02 * f64::from(i));
        (at, ROPE_RGB)
    });
    let mut frames: Vec<StereoFrame> = (0..30)
        .map(|i| {
            let seen_s = i as f64 / FPS + camera.row_time_s(0.0);
            let mut balls = vec![(TARGET.into(), TARGET_RGB), (tip(seen_s), TIP_RGB)];
            // It hangs there most of the time, so that it counts as the scene behind.
            if !(10..20).contains(&i) {
                balls.extend(rope.clone());
            }
            frame(i, &balls)
        })
        .collect();
    let score = score(&mut frames, &camera, TIP_RGB, TARGET_RGB).unwrap();
    assert!((score.closest_m - 0.05).abs() < 0.002, "{score:?}");
    assert!((score.time_s - 0.25).abs() < 0.003, "{score:?}");
}

#[test]
fn a_tip_lost_on_its_way_to_the_target_may_have_come_nearer() {
    let mut frames = throw(TARGET);
    let seen = frames.len() * 2 / 5;
    for (index, hidden) in frames.iter_mut().enumerate().skip(seen) {
        *hidden = frame(index, &[(TARGET.into(), TARGET_RGB)]);
    }
    let score = score(&mut frames, &camera(), TIP_RGB, TARGET_RGB).unwrap();
    assert!(score.closest_m > 0.06, "{score:?}");
    assert!(score.interval_m[0] < 0.05, "{score:?}");
}

#[test]
fn what_cannot_be_scored_says_why() {
    let run = |frames: &mut Vec<StereoFrame>, tip, target| -> String {
        let result = score(frames, &camera(), tip, target);
        result.unwrap_err().to_string()
    };
    let mut frames = throw(TARGET);
    let grey = run(&mut frames, [90, 92, 90], TARGET_RGB);
    assert!(grey.contains("tip") && grey.contains("grey"), "{grey}");
    let no_target = run(&mut frames, TIP_RGB, [20, 40, 250]);
    assert!(no_target.contains("target was detected"), "{no_target}");
    let no_tip = run(&mut frames, [20, 40, 250], TARGET_RGB);
    assert!(no_tip.contains("tip was detected"), "{no_tip}");
    frames.truncate(3);
    assert!(run(&mut frames, TIP_RGB, TARGET_RGB).contains("3 frames"));
}
