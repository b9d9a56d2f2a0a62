//! How near a throw's tip came to the target, from stereo frames.
//!
//! Blobs of the tip's colour are found against the median background in both
//! eyes, paired by epipolar and size checks, triangulated, timed by the row they
//! were seen in and fitted over frames; the distance to the target is minimised
//! in continuous time.

mod blob;
mod path;

use blob::{Behind, Blob, BlobMap, chroma_of_rgb};
use nalgebra::Vector3;
use path::{LocalPath, Sighting};
use serde::Serialize;
use shared_types::StereoCamera;

use crate::frame::EyeFrame;
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

/// The still scene of both eyes.
struct Scene<'a> {
    camera: &'a StereoCamera,
    options: &'a ScoreOptions,
    eyes: [EyeFrame; 2],
}

/// A pair of blobs that can be one thing.
#[derive(Debug, Clone, Copy)]
struct Pair {
    left: Blob,
    right: Blob,
    /// Point in the left optical frame (m).
    point_c: Vector3<f64>,
}

/// The target: place in the left optical frame and standard error of its depth (m).
struct Target {
    point_c: Vector3<f64>,
    depth_error_m: f64,
}

impl<'a> Scene<'a> {
    fn learn(
        source: &mut dyn FrameSource,
        camera: &'a StereoCamera,
        options: &'a ScoreOptions,
    ) -> Result<Self, ScoreError> {
        let chosen = crate::track::spread(source.len(), options.background_frames.max(3));
        let (mut left, mut right) = (Vec::new(), Vec::new());
        for &index in &chosen {
            let frame = source.read(index)?;
            left.push(frame.left());
            right.push(frame.right());
        }
        let found = [left[0].width_px, left[0].height_px];
        let expected = [camera.width_px as usize, camera.height_px as usize];
        if found != expected {
            return Err(ScoreError::Size { found, expected });
        }
        let median = |frames: &[EyeFrame]| crate::track::median_frame(frames);
        Ok(Self {
            camera,
            options,
            eyes: [median(&left), median(&right)],
        })
    }

    /// All pairs of blobs that pass the epipolar, size and depth checks.
    fn pairs(&self, left: &[Blob], right: &[Blob]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for &l in left {
            for &r in right {
                let ratio = (l.area_px / r.area_px).max(r.area_px / l.area_px);
                let Some(found) = self.camera.triangulate(l.centre, r.centre) else {
                    continue;
                };
                let point_c = self.camera.to_left(&found.p_w_m);
                let gap_px = found.gap_m * self.camera.left.fx / point_c.z.max(0.1);
                if ratio <= self.options.area_ratio
                    && gap_px <= self.options.epipolar_px
                    && (self.options.depth_m[0]..=self.options.depth_m[1]).contains(&point_c.z)
                {
                    pairs.push(Pair {
                        left: l,
                        right: r,
                        point_c,
                    });
                }
            }
        }
        pairs
    }

    /// The target in the still scene: the largest round blob of its colour.
    fn target(&self, rgb: [u8; 3]) -> Result<Target, ScoreError> {
        let blobs = |eye: &EyeFrame| -> Vec<Blob> {
            let behind = Behind::Flat(middle_chroma(eye));
            let mut blobs = BlobMap::new(eye, chroma_of_rgb(rgb), behind).blobs();
            blobs.retain(|b| b.stretch < 1.5);
            blobs
        };
        let (left, right) = (blobs(&self.eyes[0]), blobs(&self.eyes[1]));
        let best = self
            .pairs(&left, &right)
            .into_iter()
            .max_by(|a, b| a.left.area_px.total_cmp(&b.left.area_px));
        let pair = best.ok_or(ScoreError::NotSeen {
            what: "target",
            seen: 0,
            least: 1,
        })?;
        let z = pair.point_c.z;
        // A still blob's centre is good to a tenth of a pixel in each eye.
        let disparity_error_px = 0.1 * std::f64::consts::SQRT_2;
        let px_m = self.camera.left.fx * self.camera.t_right_left_m.x.abs();
        Ok(Target {
            point_c: pair.point_c,
            depth_error_m: z * z / px_m * disparity_error_px,
        })
    }

    /// The tip in one frame, nearest to where it was if there is a choice.
    fn tip(
        &self,
        eyes: [&EyeFrame; 2],
        rgb: [u8; 3],
        before: Option<Sighting>,
        since_s: f64,
    ) -> Option<Sighting> {
        let blobs = |k: usize| {
            BlobMap::new(eyes[k], chroma_of_rgb(rgb), Behind::Scene(&self.eyes[k])).blobs()
        };
        let pairs = self.pairs(&blobs(0), &blobs(1));
        let away = |p: &Pair| match before {
            // Large and near: a stray pixel far off must not win.
            Some(b) => {
                let ray = [p.point_c.x / p.point_c.z, p.point_c.y / p.point_c.z];
                (ray[0] - b.ray[0]).hypot(ray[1] - b.ray[1]) - 1e-3 * p.left.area_px
            }
            None => -p.left.area_px,
        };
        let pair = pairs
            .into_iter()
            .min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let row = f64::midpoint(pair.left.centre[1], pair.right.centre[1]);
        Some(Sighting {
            t_s: since_s + self.camera.row_time_s(row),
            ray: self.camera.left.undistort(pair.left.centre),
            inverse_depth: 1.0 / pair.point_c.z,
        })
    }
}

/// Median chroma of an image: what most of the scene looks like.
fn middle_chroma(eye: &EyeFrame) -> [f64; 2] {
    let median = |plane: &[u8]| -> f64 {
        let mut values: Vec<u8> = plane.iter().step_by(31).copied().collect();
        let middle = values.len() / 2;
        f64::from(*values.select_nth_unstable(middle).1) - 128.0
    };
    [median(&eye.cb), median(&eye.cr)]
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
