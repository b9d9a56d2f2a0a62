//! A film of keypoint paths through a camera that errs.

use super::camera::misplaced;
use super::noise::{FilmNoise, TrackingNoise};
use super::record::RopeFilm;
use crate::observation::Appearance;
use nalgebra::Vector2;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};

/// How many frames a film has, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmTiming {
    /// Frames.
    pub frames: usize,
    /// Frames per second (Hz).
    pub rate_hz: f64,
}

impl Default for FilmTiming {
    /// The paper's 400 frames, 60 a second.
    fn default() -> Self {
        Self {
            frames: 400,
            rate_hz: 60.0,
        }
    }
}

impl FilmTiming {
    /// Time from the first frame to the end of the last (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.frames as f64 / self.rate_hz
    }
}

/// What the tracker gives of a film.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntheticFilm {
    /// Keypoints in raw pixels of the camera's left eye. Points behind the camera
    /// have confidence 0.
    pub track: KeypointTrack,
    /// Widths seen, in metres as if the rope were where the camera's calibration
    /// says it is.
    pub appearance: Appearance,
}

/// Films the paths through `camera`, which stands where it is said to but for
/// `noise`.
#[must_use]
pub fn project(
    film: &RopeFilm,
    camera: &StereoCamera,
    timing: &FilmTiming,
    noise: &FilmNoise,
) -> SyntheticFilm {
    let keypoints = film.keypoints;
    let middle = film.position(0.0, keypoints / 2);
    let depth_m = camera.to_left(&middle).z.max(0.1);
    let real = misplaced(camera, depth_m, noise.camera_shift_m, noise.lookat_shift_m);
    let padding_s = f64::from(noise.padding_frames) / timing.rate_hz;
    let behind_s = noise.clock_offset_s + padding_s;
    let mut errors = TrackingNoise::new(noise, keypoints);
    let mut rows = vec![f64::from(camera.height_px) / 2.0; keypoints];
    let mut seen = vec![None; keypoints];
    let mut frames = Vec::with_capacity(timing.frames);
    for i in 0..timing.frames {
        let t_s = i as f64 / timing.rate_hz;
        for (k, (row, seen)) in rows.iter_mut().zip(&mut seen).enumerate() {
            // The row decides when a point is exposed, and that where it is. The
            // row of the frame before is a start so good that two rounds do.
            for _ in 0..2 {
                let exposed_s = t_s + real.row_time_s(*row) - behind_s;
                *seen = real.project_left(&film.position(exposed_s, k));
                *row = seen.map_or(*row, |p| p[1]);
            }
        }
        let (points, confidence) = (0..keypoints).map(|k| disturbed(&seen, k, &errors)).unzip();
        frames.push(TrackedFrame {
            t_s,
            points,
            confidence,
            lost: false,
        });
        errors.advance();
    }
    SyntheticFilm {
        track: KeypointTrack {
            keypoints,
            frames,
            unconfirmed: Vec::new(),
        },
        appearance: appearance(film, camera, &real, depth_m, noise),
    }
}

/// Pixel and confidence of keypoint `k` with its tracking error.
fn disturbed(seen: &[Option<[f64; 2]>], k: usize, errors: &TrackingNoise) -> ([f64; 2], f64) {
    let at = |k: usize| seen[k].map(Vector2::from);
    let Some(point) = at(k) else {
        return ([0.0; 2], 0.0);
    };
    let ends = (
        at(k.saturating_sub(1)).unwrap_or(point),
        at((k + 1).min(seen.len() - 1)).unwrap_or(point),
    );
    let along = (ends.1 - ends.0)
        .try_normalize(1e-9)
        .unwrap_or_else(Vector2::y);
    let across = Vector2::new(-along.y, along.x);
    let [longitudinal, lateral] = errors.error_px(k);
    (
        (point + along * longitudinal + across * lateral).into(),
        1.0,
    )
}

/// Widths as read off the first frame: true sizes at the true distance, taken
/// for sizes at the distance the calibration gives.
fn appearance(
    film: &RopeFilm,
    camera: &StereoCamera,
    real: &StereoCamera,
    depth_m: f64,
    noise: &FilmNoise,
) -> Appearance {
    let focal_px = (camera.left.fx * camera.left.fy).sqrt();
    let last = film.keypoints - 1;
    let seen = |radius_m: f64, keypoint: usize, width_error_px: f64| {
        let true_depth_m = real.to_left(&film.position(0.0, keypoint)).z.max(0.1);
        let half_width_px = radius_m * focal_px / true_depth_m + width_error_px / 2.0;
        let seen_m = half_width_px * depth_m / focal_px;
        (seen_m > 0.0).then_some(seen_m)
    };
    let rope = &film.rope;
    Appearance {
        rope_radius_m: seen(rope.radius_m, last / 2, noise.rope_width_px),
        lead_radius_m: seen(rope.lead_radius_m, last, noise.lead_width_px),
    }
}
