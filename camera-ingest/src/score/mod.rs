//! How near a throw's tip came to the target, from stereo frames.
//!
//! Blobs of the tip's colour are found against the median background in both
//! eyes, paired by epipolar and size checks, triangulated, timed by the row they
//! were seen in and fitted over frames; the distance to the target is minimised
//! in continuous time.

mod blob;
mod path;
mod scene;
#[cfg(test)]
mod tests;

use blob::chroma_of_rgb;
use nalgebra::Vector3;
use path::{LocalPath, Sighting};
use scene::{Scene, Target};
use serde::Serialize;
use shared_types::StereoCamera;

use crate::source::{FrameSource, SourceError};

/// What a caller may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreOptions {
    /// Frames for the median background.
    pub background_frames: usize,
    /// Largest distance of the two eyes' rays, in pixels of the image.
    pub epipolar_px: f64,
    /// Largest ratio of the blob's areas in the two eyes.
    pub area_ratio: f64,
    /// Nearest and farthest depth looked at (m).
    pub depth_m: [f64; 2],
}

impl Default for ScoreOptions {
    fn default() -> Self {
        Self {
            background_frames: 31,
            epipolar_px: 1.5,
            area_ratio: 1.33,
            depth_m: [0.25, 5.0],
        }
    }
}

/// Result of one throw.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Least distance between the centres of tip and target (m).
    pub closest_m: f64,
    /// Two standard errors below and above (m).
    pub interval_m: [f64; 2],
    /// When it was, from the first frame's start of exposure (s).
    pub time_s: f64,
    /// Centre of the target in the world (m).
    pub target_m: [f64; 3],
    /// Smoothed tip centre per frame it was seen in: (s, world m).
    pub tip_path: Vec<(f64, [f64; 3])>,
}

/// Why a throw cannot be scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// A frame cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Too few frames.
    #[error("score: the video has {found} frames, at least {least} are needed")]
    TooShort {
        /// Frames found.
        found: usize,
        /// Frames needed.
        least: usize,
    },
    /// Frames differ from the camera's size.
    #[error(
        "score: the video is {found:?} px per eye, the camera's mode gives {expected:?}; is the \
         `mode` in camera.toml the one recorded?"
    )]
    Size {
        /// Size of the video.
        found: [usize; 2],
        /// The camera's.
        expected: [usize; 2],
    },
    /// A colour too grey to be found by chroma.
    #[error(
        "score: the {what}'s colour {rgb:?} is nearly grey; give the colour of a saturated marker"
    )]
    Grey {
        /// `tip` or `target`.
        what: &'static str,
        /// Colour given.
        rgb: [u8; 3],
    },
    /// Not found in enough frames.
    #[error(
        "score: the {what} was seen by both eyes in {seen} frames, at least {least} are needed; \
         check its colour and the light"
    )]
    NotSeen {
        /// `tip` or `target`.
        what: &'static str,
        /// Frames it was seen in.
        seen: usize,
        /// Frames needed.
        least: usize,
    },
}

/// Sightings of the tip needed.
const LEAST_SIGHTINGS: usize = 6;
/// Chroma below which a colour counts as grey.
const LEAST_CHROMA: f64 = 25.0;
/// Times looked at between two frames.
const STEPS_PER_FRAME: i32 = 64;

/// Scores a throw: see the module. The target must stand still.
///
/// # Errors
/// Unreadable frames, colours without chroma, or tip or target not seen.
pub fn score(
    source: &mut dyn FrameSource,
    camera: &StereoCamera,
    tip_rgb: [u8; 3],
    target_rgb: [u8; 3],
    options: &ScoreOptions,
) -> Result<Score, ScoreError> {
    let frames = source.len();
    if frames < LEAST_SIGHTINGS {
        return Err(ScoreError::TooShort {
            found: frames,
            least: LEAST_SIGHTINGS,
        });
    }
    for (what, rgb) in [("tip", tip_rgb), ("target", target_rgb)] {
        let [cb, cr] = chroma_of_rgb(rgb);
        if cb.hypot(cr) < LEAST_CHROMA {
            return Err(ScoreError::Grey { what, rgb });
        }
    }
    let scene = Scene::learn(source, camera, options)?;
    let target = scene.target(target_rgb)?;
    let mut sightings = Vec::new();
    let mut start_ns = 0;
    for index in 0..frames {
        let frame = source.read(index)?;
        if index == 0 {
            start_ns = frame.0.stamp_ns;
        }
        let since_s = frame.0.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
        let near = sightings.last().copied();
        if let Some(pair) = scene.tip([&frame.left(), &frame.right()], tip_rgb, near, since_s) {
            sightings.push(pair);
        }
    }
    if sightings.len() < LEAST_SIGHTINGS {
        return Err(ScoreError::NotSeen {
            what: "tip",
            seen: sightings.len(),
            least: LEAST_SIGHTINGS,
        });
    }
    Ok(closest(&sightings, &target, camera))
}

/// Minimises the distance over continuous time.
fn closest(sightings: &[Sighting], target: &Target, camera: &StereoCamera) -> Score {
    let to_world = |p: Vector3<f64>| camera.p_w_cam_m + camera.r_w_cam * p;
    let mut tip_path = Vec::new();
    let mut best: Option<(f64, f64, LocalPath)> = None;
    for index in 0..sightings.len() {
        let Some(path) = LocalPath::around(sightings, index) else {
            continue;
        };
        tip_path.push((path.t_s, to_world(path.at(path.t_s)).into()));
        // Each path speaks for the time up to half way to its neighbours.
        let half_way =
            |other: Option<&Sighting>| other.map_or(path.t_s, |o| f64::midpoint(o.t_s, path.t_s));
        let from = half_way(index.checked_sub(1).and_then(|i| sightings.get(i)));
        let to = half_way(sightings.get(index + 1));
        for step in 0..=STEPS_PER_FRAME {
            let t = from + (to - from) * f64::from(step) / f64::from(STEPS_PER_FRAME);
            let distance = (path.at(t) - target.point_c).norm();
            if best.as_ref().is_none_or(|(least, _, _)| distance < *least) {
                best = Some((distance, t, path.clone()));
            }
        }
    }
    let (closest_m, time_s, error_m) = best.map_or((f64::INFINITY, 0.0, 0.0), |(d, t, path)| {
        let tip = path.at(t);
        let tip_depth_error = tip.z * tip.z * path.inverse_depth_error;
        // Only the part of the depth error along the line tip-target counts to
        // first order; a small floor stands for the sideways error.
        let along = ((tip - target.point_c).z / d.max(1e-6)).abs().max(0.3);
        (
            d,
            t,
            along * tip_depth_error.hypot(target.depth_error_m) + 0.002,
        )
    });
    Score {
        closest_m,
        interval_m: [
            (closest_m - 2.0 * error_m).max(0.0),
            closest_m + 2.0 * error_m,
        ],
        time_s,
        target_m: to_world(target.point_c).into(),
        tip_path,
    }
}
