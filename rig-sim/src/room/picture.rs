//! What a camera adds to a room: noise, dim corners, drift, flicker and glare.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// What a camera adds to a room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    /// Standard deviation of the luma noise, in levels of 255.
    pub noise_levels: f32,
    /// Quality of the film's JPEGs, 1 to 100.
    pub jpeg_quality: u8,
    /// Light lost in the corners.
    pub(crate) corner_loss: f32,
    /// Slow change of the exposure: its part and its period (s).
    pub(crate) drift: [f64; 2],
    /// The lamps' flicker: its part, and how often a second.
    pub(crate) flicker: [f64; 2],
    /// Light scattered in the lens: around what place (m), how much (levels of 255), and
    /// how wide (px).
    pub(crate) glare: Option<(Vector3<f64>, f32, f32)>,
}

impl Picture {
    pub(crate) fn draw(rng: &mut impl Rng) -> Self {
        Self {
            noise_levels: rng.random_range(0.7..2.6),
            jpeg_quality: rng.random_range(40..=82),
            corner_loss: rng.random_range(0.10..0.34),
            drift: [rng.random_range(0.0..0.06), rng.random_range(2.0..9.0)],
            flicker: [
                if rng.random_bool(0.4) {
                    rng.random_range(0.005..0.04)
                } else {
                    0.0
                },
                if rng.random() { 100.0 } else { 120.0 },
            ],
            glare: None,
        }
    }

    /// Brightness at a time (s), 1 on average.
    pub(crate) fn gain(&self, t_s: f64) -> f64 {
        let wave = |[part, hz]: [f64; 2]| part * (core::f64::consts::TAU * hz * t_s).sin();
        let [part, period_s] = self.drift;
        1.0 + wave([part, 1.0 / period_s]) + wave(self.flicker)
    }
}
