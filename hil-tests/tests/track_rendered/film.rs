//! Films of the rig's wiggle in memory, with the arm's report and the truth.

use arm_model::Pole;
use camera_ingest::{Film, ImageFrame, StereoFrame, TrackError, TrackResult, track};
use rig_sim::CameraConfig;
use rig_sim::wiggle_film::{WiggleFilm, joints};
use rope_sim::MeasuredArm;
use shared_types::StereoCamera;

/// Time between joint reports (s).
const REPORT_S: f64 = 4e-3;

/// What is filmed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Take {
    /// The rope and its colours.
    pub(crate) seed: u64,
    /// Other radii of rope and lead than the seed's (m).
    pub(crate) radii_m: Option<[f64; 2]>,
    /// Frames filmed before the wiggle; between whole ones, every film meets the wiggle at
    /// another phase.
    pub(crate) still: f64,
    /// How far joint 6 pushed the rope just before (rad).
    pub(crate) push_rad: f64,
    /// Frames filmed, those included that do not arrive.
    pub(crate) frames: usize,
}

/// A film as a tracker looks at it.
pub(crate) struct RenderedFilm {
    /// Left images.
    pub(crate) frames: Vec<ImageFrame>,
    /// Right images of some of them.
    right: Vec<ImageFrame>,
    /// Pixels of the rope's nodes in each frame.
    pub(crate) truth: Vec<Vec<[f64; 2]>>,
    pub(crate) camera: StereoCamera,
    /// The rope's length from clamp to lead (m).
    pub(crate) length_m: f64,
    /// Time of the first frame (s); the wiggle begins at 0.
    first_s: f64,
    until_s: f64,
}

impl RenderedFilm {
    /// Films a wiggle; `keep` says which frames arrive after the first one.
    pub(crate) fn of(
        config: &CameraConfig,
        take: Take,
        mut keep: impl FnMut(usize) -> bool,
    ) -> Self {
        let camera = config.stereo_camera();
        let size = [2 * camera.width_px as usize, camera.height_px as usize];
        let first_s = -take.still / config.frame_rate_hz;
        let film = WiggleFilm::new(config, take.seed, take.radii_m, first_s).unwrap();
        let film = if take.push_rad == 0.0 {
            film
        } else {
            film.swinging(take.push_rad)
        };
        let length_m = film.rope.length_m;
        let (mut frames, mut right, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for (index, frame) in film.take(take.frames).enumerate() {
            if index > 0 && !keep(index) {
                continue;
            }
            let stamp_ns = 1_000_000_000 + ((frame.start_s - first_s) * 1e9).round() as u64;
            let stereo = StereoFrame::from_yuyv(&frame.yuyv, size, stamp_ns, index as u64).unwrap();
            if Film::needs_right(frames.len(), take.frames) {
                right.push(stereo.right());
            }
            frames.push(stereo.left());
            let pixels = frame.nodes.iter().map(|p| camera.project_left(p).unwrap());
            truth.push(pixels.collect());
        }
        Self {
            frames,
            right,
            truth,
            camera,
            length_m,
            first_s,
            until_s: take.frames as f64 / config.frame_rate_hz + 0.1,
        }
    }

    /// The arm as it reports its joints, `late_s` late; time 0 is the first frame's.
    pub(crate) fn arm(&self, late_s: f64) -> MeasuredArm {
        let count = (self.until_s / REPORT_S) as usize;
        let at_s: Vec<f64> = (0..count).map(|i| i as f64 * REPORT_S).collect();
        let q: Vec<_> = at_s.iter().map(|t| joints(t + self.first_s)).collect();
        let reported_s: Vec<f64> = at_s.iter().map(|t| t + late_s).collect();
        MeasuredArm::new(&reported_s, &q, Pole::default()).unwrap()
    }

    /// Tracks it with a keypoint for every node.
    pub(crate) fn track(&self, arm: &MeasuredArm) -> Result<TrackResult, TrackError> {
        let film = Film {
            left: &self.frames,
            right: &self.right,
        };
        track(film, &self.camera, arm, self.truth[0].len())
    }

    /// What is behind the rope, but for where it hardly moves: the median over the motion.
    pub(crate) fn scene(&self) -> ImageFrame {
        let moving: Vec<&ImageFrame> = self.frames.iter().skip(60).step_by(4).collect();
        let plane = |pick: fn(&ImageFrame) -> &Vec<u8>| -> Vec<u8> {
            let at = |at: usize| {
                let mut values: Vec<u8> = moving.iter().map(|f| pick(f)[at]).collect();
                values.sort_unstable();
                values[values.len() / 2]
            };
            (0..pick(moving[0]).len()).map(at).collect()
        };
        ImageFrame {
            luma: plane(|f| &f.luma),
            cb: plane(|f| &f.cb),
            cr: plane(|f| &f.cr),
            ..moving[0].clone()
        }
    }

    /// Distances of a frame's keypoints from its nodes (px).
    pub(crate) fn errors_px(&self, found: &TrackResult, frame: usize) -> Vec<f64> {
        let pairs = found.track.frames[frame]
            .points
            .iter()
            .zip(&self.truth[frame]);
        pairs
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .collect()
    }
}
