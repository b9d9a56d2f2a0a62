//! Errors of a recording, and their random draws (the paper's domain
//! randomisation).

use crate::OutOfRange;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

/// Errors of one recording. [`FilmNoise::default`] has none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FilmNoise {
    /// Where the camera really stands, minus where it is said to (world, m).
    pub camera_shift_m: Vector3<f64>,
    /// The same for the point it looks at (world, m).
    pub lookat_shift_m: Vector3<f64>,
    /// Standard deviation of a keypoint along the rope in the picture (px).
    pub longitudinal_px: f64,
    /// Standard deviation of a keypoint across the rope (px).
    pub lateral_px: f64,
    /// Correlation of a keypoint's error with that of the frame before (0 to 1).
    pub correlation: f64,
    /// Frames at the start in which the motion has not begun yet.
    pub padding_frames: u32,
    /// Offset of the camera's clock: camera time = motion time + offset (s).
    pub clock_offset_s: f64,
    /// Error of the rope's width in the picture (px).
    pub rope_width_px: f64,
    /// Error of the lead's width in the picture (px).
    pub lead_width_px: f64,
    /// Seed of the frame-by-frame noise.
    pub seed: u64,
}

impl FilmNoise {
    /// Independent errors of `px` on both image axes of every keypoint, and no
    /// other.
    #[must_use]
    pub fn white(px: f64, seed: u64) -> Self {
        Self {
            longitudinal_px: px,
            lateral_px: px,
            seed,
            ..Self::default()
        }
    }
}

/// Ranges from which [`FilmNoise`] is drawn. The default is the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Randomisation {
    /// Standard deviation of the camera's position, each axis (m).
    pub camera_position_m: f64,
    /// Standard deviation of the point it looks at, each axis (m).
    pub camera_lookat_m: f64,
    /// Least and largest standard deviation of a keypoint along the rope (px).
    pub tracking_px: [f64; 2],
    /// Deviation across the rope as a part of that along it: trackers slip along
    /// a rope more easily than off it.
    #[serde(alias = "lateral_part")]
    pub lateral_fraction: f64,
    /// Correlation of a keypoint's error with that of the frame before.
    pub correlation: f64,
    /// Fewest and most frames before the motion begins.
    pub padding_frames: [u32; 2],
    /// Largest offset between the clocks of arm and camera, either way (s).
    pub clock_offset_s: f64,
    /// Standard deviation of the widths seen of rope and lead (px).
    pub width_px: f64,
}

impl Default for Randomisation {
    fn default() -> Self {
        Self {
            camera_position_m: 0.02,
            camera_lookat_m: 0.02,
            tracking_px: [0.0, 3.0],
            lateral_fraction: 0.5,
            correlation: 0.8,
            padding_frames: [0, 20],
            clock_offset_s: 0.02,
            width_px: 0.5,
        }
    }
}

impl Randomisation {
    /// Refuses the first value that cannot be drawn from.
    pub fn check(&self) -> Result<(), OutOfRange> {
        const SMALL: &str = "0 to 0.5";
        const COUNT_ORDER: &str = "the smaller count first";
        let [px_min, px_max] = self.tracking_px;
        let [pad_min, pad_max] = self.padding_frames.map(f64::from);
        let rules = [
            ("camera_position_m", self.camera_position_m, 0.5, SMALL),
            ("camera_lookat_m", self.camera_lookat_m, 0.5, SMALL),
            ("tracking_px", px_max, 50.0, "two numbers from 0 to 50"),
            ("tracking_px", px_min, px_max, "the smaller number first"),
            ("lateral_fraction", self.lateral_fraction, 10.0, "0 to 10"),
            ("correlation", self.correlation, 0.999, "0 to 0.999"),
            ("padding_frames", pad_max, 200.0, "two counts up to 200"),
            ("padding_frames", pad_min, pad_max, COUNT_ORDER),
            ("clock_offset_s", self.clock_offset_s, 0.5, SMALL),
            ("width_px", self.width_px, 20.0, "0 to 20"),
        ];
        OutOfRange::check(rules.map(|(key, value, max, expected)| {
            (key, value, value >= 0.0 && value <= max, expected)
        }))
    }

    /// The errors of recording `index` under `seed`: the same whenever and
    /// wherever it is drawn.
    #[must_use]
    pub fn draw(&self, seed: u64, index: u64) -> FilmNoise {
        let mut rng = ChaCha12Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let rng = &mut rng;
        let longitudinal_px = uniform(rng, self.tracking_px);
        let [pad_min, pad_max] = self.padding_frames;
        FilmNoise {
            camera_shift_m: gaussian3(rng, self.camera_position_m),
            lookat_shift_m: gaussian3(rng, self.camera_lookat_m),
            longitudinal_px,
            lateral_px: longitudinal_px * self.lateral_fraction,
            correlation: self.correlation,
            padding_frames: rng.random_range(pad_min..=pad_max.max(pad_min)),
            clock_offset_s: uniform(rng, [-self.clock_offset_s, self.clock_offset_s]),
            rope_width_px: self.width_px * rng.sample::<f64, _>(StandardNormal),
            lead_width_px: self.width_px * rng.sample::<f64, _>(StandardNormal),
            seed: rng.random(),
        }
    }
}

fn uniform(rng: &mut ChaCha12Rng, [min, max]: [f64; 2]) -> f64 {
    min + (max - min) * rng.random::<f64>()
}

fn gaussian3(rng: &mut ChaCha12Rng, deviation: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| deviation * rng.sample::<f64, _>(StandardNormal))
}

/// The frame-by-frame errors of the keypoints: along and across the rope.
pub(super) struct TrackingNoise {
    rng: ChaCha12Rng,
    deviation_px: [f64; 2],
    /// Weights of the error before and of the fresh one.
    carried: f64,
    fresh: f64,
    /// Error of each keypoint in units of the deviation, and of one more: which random
    /// numbers a film gets of a seed must not change.
    states: Vec<[f64; 2]>,
}

impl TrackingNoise {
    pub(super) fn new(noise: &FilmNoise, keypoints: usize) -> Self {
        let mut rng = ChaCha12Rng::seed_from_u64(noise.seed);
        let mut draw = || [rng.sample(StandardNormal), rng.sample(StandardNormal)];
        let states = (0..=keypoints).map(|_| draw()).collect();
        Self {
            deviation_px: [noise.longitudinal_px, noise.lateral_px],
            carried: noise.correlation,
            fresh: (1.0 - noise.correlation * noise.correlation)
                .max(0.0)
                .sqrt(),
            states,
            rng,
        }
    }

    /// Error of a keypoint in the present frame: along and across the rope (px).
    pub(super) fn error_px(&self, keypoint: usize) -> [f64; 2] {
        core::array::from_fn(|axis| self.states[keypoint][axis] * self.deviation_px[axis])
    }

    /// Goes on to the next frame.
    pub(super) fn advance(&mut self) {
        for error in self.states.iter_mut().flatten() {
            let fresh: f64 = self.rng.sample(StandardNormal);
            *error = self.carried * *error + self.fresh * fresh;
        }
    }
}
