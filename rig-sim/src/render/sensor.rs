//! The image sensor: packing to YUYV and seeded noise.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Entries of the noise table rows are cut from.
const TABLE: usize = 1 << 17;
/// Chroma noise relative to luma noise.
const CHROMA_NOISE: f32 = 0.6;

/// Noise of the sensor, the same for the same seed and frame number.
#[derive(Debug)]
pub(super) struct Sensor {
    table: Vec<i8>,
    seed: u64,
}

impl Sensor {
    /// A sensor whose luma has a standard deviation of `noise_levels` (of 255)
    /// and whose frames are at most `row_bytes` wide.
    pub(super) fn new(noise_levels: f32, row_bytes: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x006e_6f69_7365);
        // A standard deviation that is not finite and positive means no noise.
        let normal = Normal::new(0.0_f32, noise_levels.max(0.0)).ok();
        let table = (0..TABLE + row_bytes)
            .map(|i| {
                let scale = if i % 2 == 0 { 1.0 } else { CHROMA_NOISE };
                let value = normal.as_ref().map_or(0.0, |n| n.sample(&mut rng)) * scale;
                value.round() as i8
            })
            .collect();
        Self { table, seed }
    }

    /// Adds the noise of frame `sequence` to a frame of rows of `row_bytes`.
    pub(super) fn expose(&self, frame: &mut [u8], row_bytes: usize, sequence: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(sequence);
        for row in frame.chunks_exact_mut(row_bytes) {
            // Even offsets keep luma noise on luma.
            let from = (rng.next_u32() as usize % TABLE) & !1;
            for (value, noise) in row.iter_mut().zip(&self.table[from..]) {
                *value = value.saturating_add_signed(*noise);
            }
        }
    }
}

/// Makes a row of YUYV brighter or darker.
pub(super) fn brighten(row: &mut [u8], gain: f32) {
    let table = |centre: f32| -> [u8; 256] {
        core::array::from_fn(|v| (centre + (v as f32 - centre) * gain + 0.5) as u8)
    };
    let (luma, chroma) = (table(0.0), table(128.0));
    for [y, c] in row.as_chunks_mut::<2>().0 {
        *y = luma[usize::from(*y)];
        *c = chroma[usize::from(*c)];
    }
}

/// Packs pixel pairs into `Y0 Cb Y1 Cr`; `out` holds two bytes a pixel.
pub(super) fn pack_yuyv(pixels: &[[f32; 3]], out: &mut [u8]) {
    let level = |v: f32| (v + 0.5) as u8;
    for (pair, out) in pixels.chunks_exact(2).zip(out.chunks_exact_mut(4)) {
        let chroma = |i: usize| level((pair[0][i] + pair[1][i]) / 2.0 + 128.0);
        out.copy_from_slice(&[level(pair[0][0]), chroma(1), level(pair[1][0]), chroma(2)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_asked_spread_and_repeats_by_frame() {
        let sensor = Sensor::new(2.0, 400, 7);
        let shoot = |sequence| {
            let mut frame = vec![128_u8; 400 * 100];
            sensor.expose(&mut frame, 400, sequence);
            frame
        };
        let frame = shoot(3);
        assert_eq!(frame, shoot(3));
        assert_ne!(frame, shoot(4));
        let luma: Vec<f64> = frame
            .iter()
            .step_by(2)
            .map(|v| f64::from(*v) - 128.0)
            .collect();
        let variance = luma.iter().map(|v| v * v).sum::<f64>() / luma.len() as f64;
        assert!((variance.sqrt() - 2.0).abs() < 0.1, "{variance}");
    }
}
