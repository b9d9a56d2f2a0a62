//! Tip and target in single stereo frames.

use nalgebra::Vector3;
use shared_types::StereoCamera;

use super::blob::{Behind, Blob, BlobMap, Chroma, chroma_of_rgb};
use super::error::ScoreError;
use super::path::{Detection, PathError};
use crate::frame::{ImageFrame, StereoFrame};
use crate::source::StereoSource;

/// Frames for the median background.
const BACKGROUND_FRAMES: usize = 31;
/// Largest distance of the two images' rays, in pixels of the image.
const MAX_EPIPOLAR_PX: f64 = 1.5;
/// Largest ratio of a blob's areas in the two images.
const MAX_AREA_RATIO: f64 = 1.33;
/// Nearest and farthest depth looked at (m).
const DEPTH_M: [f64; 2] = [0.25, 5.0];

/// The still scene of both images.
pub(super) struct Scene<'a> {
    camera: &'a StereoCamera,
    pub(super) images: [ImageFrame; 2],
    /// What most of each image's scene looks like.
    pub(super) middles: [Chroma; 2],
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
pub(super) struct Target {
    pub(super) point_c: Vector3<f64>,
    pub(super) depth_error_m: f64,
    /// Its image in both images.
    blobs: [Blob; 2],
}

impl Target {
    /// The tip's image touches the target's: one may cover a part of the other.
    fn touches(&self, tip: &Pair) -> bool {
        /// The chroma that two pixels share.
        const RIM_PX: f64 = 1.0;
        [tip.left, tip.right].iter().zip(&self.blobs).any(|(a, b)| {
            let apart = [a.centre[0] - b.centre[0], a.centre[1] - b.centre[1]];
            let reach_px = a.reach_px(apart) + b.reach_px(apart);
            apart[0].hypot(apart[1]) < reach_px + RIM_PX
        })
    }
}

/// Standard errors of a clear blob's place: its centre is good to a tenth of a pixel or
/// two in each image.
pub(super) fn blob_error(camera: &StereoCamera) -> PathError {
    /// What both images share: light, lens, blur (px).
    const TOGETHER_PX: f64 = 0.2;
    /// What each image has of its own: noise (px).
    const APART_PX: f64 = 0.1;
    let baseline_m = camera.t_right_left_m.x.abs();
    PathError {
        across: TOGETHER_PX / camera.left.fx,
        inverse_depth: APART_PX * std::f64::consts::SQRT_2 / (camera.left.fx * baseline_m),
    }
}

/// One frame, of the camera's size.
pub(super) fn read_sized(
    source: &mut dyn StereoSource,
    index: usize,
    camera: &StereoCamera,
) -> Result<StereoFrame, ScoreError> {
    let frame = source.read(index)?;
    let found = [frame.0.width_px / 2, frame.0.height_px];
    let expected = [camera.width_px as usize, camera.height_px as usize];
    if found == expected {
        return Ok(frame);
    }
    Err(ScoreError::Input(format!(
        "frame {index} is {found:?} px per image, the camera's mode gives {expected:?}; is the `mode` \
         in camera.toml the one recorded?"
    )))
}

impl<'a> Scene<'a> {
    pub(super) fn learn(
        source: &mut dyn StereoSource,
        camera: &'a StereoCamera,
    ) -> Result<Self, ScoreError> {
        let chosen = crate::track::spread(source.len(), BACKGROUND_FRAMES);
        Self::of_frames(source, camera, &chosen)
    }

    /// The scene as the median of these frames.
    pub(super) fn of_frames(
        source: &mut dyn StereoSource,
        camera: &'a StereoCamera,
        chosen: &[usize],
    ) -> Result<Self, ScoreError> {
        let (mut left, mut right) = (Vec::new(), Vec::new());
        for &index in chosen {
            let frame = read_sized(source, index, camera)?;
            left.push(frame.left());
            right.push(frame.right());
        }
        let images = [left, right].map(|frames| crate::track::median_frame(&frames));
        Ok(Self {
            camera,
            middles: [0, 1].map(|k: usize| middle_chroma(&images[k])),
            images,
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
                if ratio <= MAX_AREA_RATIO
                    && gap_px <= MAX_EPIPOLAR_PX
                    && (DEPTH_M[0]..=DEPTH_M[1]).contains(&point_c.z)
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
    pub(super) fn target(&self, rgb: [u8; 3]) -> Result<Target, ScoreError> {
        let blobs = |k: usize| -> Vec<Blob> {
            let behind = Behind::Flat(self.middles[k]);
            let mut blobs = BlobMap::new(&self.images[k], chroma_of_rgb(rgb), behind).blobs();
            blobs.retain(|b| b.stretch < 1.5);
            blobs
        };
        let (left, right) = (blobs(0), blobs(1));
        let best = self
            .pairs(&left, &right)
            .into_iter()
            .max_by(|a, b| a.left.area_px.total_cmp(&b.left.area_px));
        let pair = best.ok_or(ScoreError::NotSeen {
            what: "target",
            seen: 0,
            least: 1,
        })?;
        Ok(Target {
            point_c: pair.point_c,
            depth_error_m: pair.point_c.z.powi(2) * blob_error(self.camera).inverse_depth,
            blobs: [pair.left, pair.right],
        })
    }

    /// Raw pixels of the largest blob of a colour that both images see.
    pub(super) fn largest(&self, images: [&ImageFrame; 2], rgb: [u8; 3]) -> Option<[[f64; 2]; 2]> {
        let pairs = self.pairs_in(images, rgb).into_iter();
        let largest = pairs.max_by(|a, b| a.left.area_px.total_cmp(&b.left.area_px))?;
        Some([largest.left.centre, largest.right.centre])
    }

    fn pairs_in(&self, images: [&ImageFrame; 2], rgb: [u8; 3]) -> Vec<Pair> {
        let blobs = |k: usize| {
            let behind = Behind::Scene {
                scene: &self.images[k],
                middle: self.middles[k],
            };
            BlobMap::new(images[k], chroma_of_rgb(rgb), behind).blobs()
        };
        self.pairs(&blobs(0), &blobs(1))
    }

    /// The tip in one frame, nearest to where it was if there is a choice.
    pub(super) fn tip(
        &self,
        images: [&ImageFrame; 2],
        rgb: [u8; 3],
        target: Option<&Target>,
        before: Option<Detection>,
        since_s: f64,
    ) -> Option<Detection> {
        let pairs = self.pairs_in(images, rgb);
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
        let m_per_px = pair.point_c.z / self.camera.left.fx;
        let mut detection = Detection {
            t_s: since_s + self.camera.row_time_s(row),
            ray: self.camera.left.undistort(pair.left.centre),
            inverse_depth: 1.0 / pair.point_c.z,
            area_m2: pair.left.area_px * m_per_px * m_per_px,
            radius_px: (pair.left.area_px / std::f64::consts::PI).sqrt(),
            spread: 1.0,
        };
        if target.is_some_and(|target| target.touches(&pair)) {
            detection.cut();
        }
        Some(detection)
    }
}

/// Median chroma of an image: what most of the scene looks like.
fn middle_chroma(image: &ImageFrame) -> Chroma {
    let median = |plane: &[u8]| -> f64 {
        let mut values: Vec<u8> = plane.iter().step_by(31).copied().collect();
        let middle = values.len() / 2;
        f64::from(*values.select_nth_unstable(middle).1) - 128.0
    };
    [median(&image.cb), median(&image.cr)]
}
