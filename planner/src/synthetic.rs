//! Keypoints of a known rope, as a camera would see them: for trials of the
//! identification whose truth is known.

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Precision, SimOptions, SimulateError, Start, Watch,
    roll_out,
};
use shared_types::keypoints::TrackedFrame;
use shared_types::{Intrinsics, KeypointTrack, RopeParams, Shutter, StereoCamera};

/// How a synthetic film is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmOptions {
    /// Frames.
    pub frames: usize,
    /// Frames per second (Hz).
    pub rate_hz: f64,
    /// Keypoints per frame.
    pub keypoints: usize,
    /// Standard deviation of each pixel coordinate (px).
    pub noise_px: f64,
    /// Part of the noise that all keypoints of a frame share (0 to 1).
    pub shared_noise: f64,
    /// Offset of the camera's clock: camera time = motion time + offset (s).
    pub clock_offset_s: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for FilmOptions {
    /// The paper's 400 frames at 60 frames a second, 1 px of noise.
    fn default() -> Self {
        Self {
            frames: 400,
            rate_hz: 60.0,
            keypoints: 25,
            noise_px: 1.0,
            shared_noise: 0.0,
            clock_offset_s: 0.0,
            seed: 0,
        }
    }
}

/// A rolling-shutter camera of 672 x 376 px beside the wiggle, looking across
/// its plane from 1 m.
#[must_use]
pub fn side_camera() -> StereoCamera {
    let eye = Intrinsics {
        fx: 350.0,
        fy: 350.0,
        cx: 335.5,
        cy: 187.5,
        distortion: [-0.17, 0.03, 0.0, 0.0, 0.0],
    };
    StereoCamera {
        width_px: 672,
        height_px: 376,
        left: eye,
        right: eye,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(0.063, 0.0, 0.0),
        r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.66, -1.0, -0.05),
        shutter: Shutter::Rolling,
        exposure_s: 0.004,
        line_time_s: 26e-6,
    }
}

/// Films `rope` on `motion`. Points behind the camera get confidence 0.
///
/// # Errors
/// What the rope simulator refuses.
pub fn film(
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    camera: &StereoCamera,
    options: &FilmOptions,
) -> Result<KeypointTrack, SimulateError> {
    // Fine enough that the nearest sample is the exposure to a fraction of a
    // millimetre even in a fast swing.
    const SAMPLE_S: f64 = 1e-3;
    #[allow(clippy::cast_precision_loss, reason = "frame counts are small")]
    let frame_time = |i: usize| i as f64 / options.rate_hz;
    let horizon_s = frame_time(options.frames) + options.clock_offset_s.abs() + 0.05;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive count of some thousand"
    )]
    let count = (horizon_s / SAMPLE_S) as usize;
    let rollouts = roll_out(
        &[Candidate::new(rope, motion)],
        &SimOptions {
            step_s: 5e-4,
            precision: Precision::F64,
            start: Start::Equilibrium,
            frames: FrameTimes {
                first_s: 0.0,
                period_s: SAMPLE_S,
                count,
            },
            watch: Watch::NOTHING,
            horizon_s,
            threads: 1,
        },
    )?;
    let nodes = &rollouts[0].nodes;
    let position = |t_s: f64, along: f64| {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "clamped to the recorded samples and nodes"
        )]
        let (sample, node, part) = {
            let place = along * (nodes.nodes() - 1) as f64;
            let node = (place as usize).min(nodes.nodes() - 2);
            let sample = (t_s / SAMPLE_S).round().clamp(0.0, (count - 1) as f64);
            (sample as usize, node, place - node as f64)
        };
        nodes
            .position(sample, node)
            .lerp(&nodes.position(sample, node + 1), part)
    };
    let mut rng = ChaCha12Rng::seed_from_u64(options.seed);
    let own = (1.0 - options.shared_noise.powi(2)).max(0.0).sqrt();
    let mut frames = Vec::with_capacity(options.frames);
    for i in 0..options.frames {
        let mut draw = || options.noise_px * rng.sample::<f64, _>(StandardNormal);
        let shared = [draw(), draw()].map(|n| n * options.shared_noise);
        let t_s = frame_time(i);
        let (mut points, mut confidence) = (Vec::new(), Vec::new());
        for k in 0..options.keypoints {
            #[allow(clippy::cast_precision_loss, reason = "keypoint counts are small")]
            let along = k as f64 / (options.keypoints - 1) as f64;
            let mut row = f64::from(camera.height_px) / 2.0;
            let mut seen = None;
            // The row decides when a point is exposed, and that where it is.
            for _ in 0..3 {
                let exposed_s = t_s + camera.row_time_s(row) - options.clock_offset_s;
                seen = camera.project_left(&position(exposed_s, along));
                row = seen.map_or(row, |p| p[1]);
            }
            let [u, v] = seen.unwrap_or([0.0, 0.0]);
            points.push([u + shared[0] + own * draw(), v + shared[1] + own * draw()]);
            confidence.push(if seen.is_some() { 1.0 } else { 0.0 });
        }
        frames.push(TrackedFrame {
            t_s,
            points,
            confidence,
            lost: false,
        });
    }
    Ok(KeypointTrack {
        keypoints: options.keypoints,
        frames,
    })
}
