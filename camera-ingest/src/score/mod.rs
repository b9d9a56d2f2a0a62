//! How near a throw's tip came to the target, from stereo frames.
//!
//! Blobs of the tip's colour are found against the median background in both
//! images, paired by epipolar and size checks, triangulated, timed by the row they
//! were seen in and fitted over frames; the distance to the target is minimised
//! in continuous time.

mod blob;
mod error;
mod path;
mod rest;
mod scene;
#[cfg(test)]
mod tests;

use blob::chroma_of_rgb;
use nalgebra::Vector3;
use path::{Detection, LocalPath, mark_small};
use scene::{Scene, Target, blob_error, read_sized};
use serde::Serialize;
use shared_types::StereoCamera;
use shared_types::ipc::message::ScoreResult;
use std::fmt;

use crate::calib::extrinsics::Correspondence;
use crate::source::StereoSource;
pub use error::ScoreError;
pub use rest::look;

/// Result of one throw.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Least distance between the centres of tip and target (m).
    pub closest_m: f64,
    /// What two standard errors of tip and target allow, least and most (m).
    pub interval_m: [f64; 2],
    /// Tip minus target then, in the world (m).
    pub miss_m: [f64; 3],
    /// When it was, from the first frame's start of exposure (s).
    pub time_s: f64,
    /// Centre of the target in the world (m).
    pub target_m: [f64; 3],
    /// Smoothed tip centre per frame it was seen in: (s, world m).
    pub tip_path: Vec<(f64, [f64; 3])>,
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [closest, least, most] =
            [self.closest_m, self.interval_m[0], self.interval_m[1]].map(|m| 1e3 * m);
        let [x, y, z] = self.miss_m;
        write!(
            f,
            "closest approach {closest:.1} mm ({least:.1} to {most:.1}) at {:.4} s; miss {x:.4},{y:.4},{z:.4} m (tip minus target)",
            self.time_s
        )
    }
}

impl From<&Score> for ScoreResult {
    fn from(score: &Score) -> Self {
        Self {
            closest_m: score.closest_m,
            interval_m: score.interval_m,
            miss_m: score.miss_m,
            time_s: score.time_s,
            target_m: score.target_m,
        }
    }
}

/// Detections of the tip needed.
const MIN_DETECTIONS: usize = 6;
/// Chroma below which a colour counts as grey.
const MIN_CHROMA: f64 = 25.0;
/// Times looked at between two frames.
const STEPS_PER_FRAME: i32 = 64;

/// Scores a throw: see the module. The target must stand still.
///
/// # Errors
/// Unreadable frames, colours without chroma, or tip or target not seen.
pub fn score(
    source: &mut dyn StereoSource,
    camera: &StereoCamera,
    tip_rgb: [u8; 3],
    target_rgb: [u8; 3],
) -> Result<Score, ScoreError> {
    let frames = source.len();
    if frames < MIN_DETECTIONS {
        return Err(ScoreError::Input(format!(
            "the video has {frames} frames, at least {MIN_DETECTIONS} are needed"
        )));
    }
    check_colour("tip", tip_rgb)?;
    check_colour("target", target_rgb)?;
    let scene = Scene::learn(source, camera)?;
    let target = scene.target(target_rgb)?;
    let mut detections = Vec::new();
    let (mut start_ns, mut end_s) = (0, 0.0);
    for index in 0..frames {
        let frame = read_sized(source, index, camera)?;
        if index == 0 {
            start_ns = frame.0.stamp_ns;
        }
        let since_s = frame.0.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
        end_s = since_s;
        let near = detections.last().copied();
        let images = [&frame.left(), &frame.right()];
        if let Some(tip) = scene.tip(images, tip_rgb, Some(&target), near, since_s) {
            detections.push(tip);
        }
    }
    if detections.len() < MIN_DETECTIONS {
        return Err(ScoreError::NotSeen {
            what: "tip",
            seen: detections.len(),
            least: MIN_DETECTIONS,
        });
    }
    mark_small(&mut detections);
    Ok(closest(&detections, end_s, &target, camera))
}

/// A colour that chroma can find.
fn check_colour(what: &str, rgb: [u8; 3]) -> Result<(), ScoreError> {
    let [cb, cr] = chroma_of_rgb(rgb);
    if cb.hypot(cr) < MIN_CHROMA {
        return Err(ScoreError::Input(format!(
            "the {what}'s colour {rgb:?} is nearly grey; give the colour of a saturated marker"
        )));
    }
    Ok(())
}

/// Where both images see a coloured lead that the arm shows at known places:
/// `(frame, place in the world in m)`. Frames in which it is not seen are left
/// out. The camera's place does not matter.
///
/// # Errors
/// Unreadable frames, a frame that does not exist, or a colour without chroma.
pub fn sight_lead(
    source: &mut dyn StereoSource,
    camera: &StereoCamera,
    rgb: [u8; 3],
    shown: &[(usize, Vector3<f64>)],
) -> Result<Vec<Correspondence>, ScoreError> {
    check_colour("lead", rgb)?;
    let scene = Scene::learn(source, camera)?;
    let mut sighted = Vec::new();
    for &(frame, p_w_m) in shown {
        let both = read_sized(source, frame, camera)?;
        if let Some(pixels) = scene.largest([&both.left(), &both.right()], rgb) {
            sighted.push(Correspondence { p_w_m, pixels });
        }
    }
    Ok(sighted)
}

/// Minimises the distance over continuous time; the last frame began at `end_s`.
fn closest(detections: &[Detection], end_s: f64, target: &Target, camera: &StereoCamera) -> Score {
    let to_world = |p: Vector3<f64>| camera.p_w_cam_m + camera.r_w_cam * p;
    let mut tip_path = Vec::new();
    let mut best: Option<(f64, f64, LocalPath)> = None;
    for index in 0..detections.len() {
        let Some(path) = LocalPath::around(detections, index, blob_error(camera)) else {
            continue;
        };
        tip_path.push((path.t_s, to_world(path.at(path.t_s)).into()));
        // Each path speaks for the time up to half way to its neighbours.
        let half_way =
            |other: Option<&Detection>| other.map_or(path.t_s, |o| f64::midpoint(o.t_s, path.t_s));
        let from = half_way(index.checked_sub(1).and_then(|i| detections.get(i)));
        let to = half_way(detections.get(index + 1));
        for step in 0..=STEPS_PER_FRAME {
            let t = from + (to - from) * f64::from(step) / f64::from(STEPS_PER_FRAME);
            let distance = (path.at(t) - target.point_c).norm();
            if best.as_ref().is_none_or(|(least, _, _)| distance < *least) {
                best = Some((distance, t, path.clone()));
            }
        }
    }
    let nowhere = (f64::INFINITY, [f64::INFINITY; 3], 0.0, [0.0, f64::INFINITY]);
    let (closest_m, miss_m, time_s, interval_m) = best.map_or(nowhere, |(d, t, path)| {
        let [low_m, high_m] = interval(&path, t, target);
        let nearer_m = path.speed_at(t) * unseen_s(detections, t, end_s, camera);
        let miss = camera.r_w_cam * (path.at(t) - target.point_c);
        (d, miss.into(), t, [(low_m - nearer_m).max(0.0), high_m])
    });
    Score {
        closest_m,
        interval_m,
        miss_m,
        time_s,
        target_m: to_world(target.point_c).into(),
        tip_path,
    }
}

/// How long the film goes on without the tip where it was nearest when it was first or
/// last seen (s): it may have come nearer unseen. Zero where the way goes on.
fn unseen_s(detections: &[Detection], nearest_s: f64, end_s: f64, camera: &StereoCamera) -> f64 {
    let bottom = f64::from(camera.height_px);
    match detections {
        [first, ..] if nearest_s <= first.t_s => (first.t_s - camera.row_time_s(bottom)).max(0.0),
        [.., last] if nearest_s >= last.t_s => (end_s - last.t_s).max(0.0),
        _ => 0.0,
    }
}

/// Least and largest distance of any two places within two standard errors of tip and
/// target (m). The errors are large along the line of sight and small across it.
fn interval(path: &LocalPath, t_s: f64, target: &Target) -> [f64; 2] {
    /// What the calibration leaves across the line of sight (m).
    const ACROSS_M: f64 = 0.002;
    /// Part of its radius by which light from one side shifts a ball's centre.
    const SHADED: f64 = 0.1;
    let tip = path.at(t_s);
    let error = path.error_at(t_s);
    let sight = tip.normalize();
    let along_error_m = (tip.z * tip.norm() * error.inverse_depth).hypot(target.depth_error_m);
    let across_error_m = (error.across * tip.z)
        .hypot(ACROSS_M)
        .hypot(SHADED * path.radius_m);
    let between = tip - target.point_c;
    let along_m = between.dot(&sight).abs();
    let across_m = (between.norm_squared() - along_m * along_m).max(0.0).sqrt();
    let at = |sign: f64| {
        (along_m + sign * 2.0 * along_error_m)
            .max(0.0)
            .hypot((across_m + sign * 2.0 * across_error_m).max(0.0))
    };
    [at(-1.0), at(1.0)]
}
