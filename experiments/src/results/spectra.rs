//! How alike two motions of a rope are: their Fourier spectra and the distance of their points.

use experiments::trials::mean;
use nalgebra::Vector3;

/// Frequencies compared: harmonics of one over the duration.
const HARMONICS: u32 = 40;

/// Points of a rope in one frame (m).
pub(super) type Points = Vec<Vector3<f64>>;

/// Mean distance of two ropes' points per frame (m).
pub(super) fn mean_distance_m(a: &[Points], b: &[Points]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    mean(pairs.map(|(a, b)| (a - b).norm()))
}

/// Sizes of the first harmonics of every point and axis, the mean left out.
fn spectra(paths: &[Points]) -> Vec<f64> {
    let frames = paths.len() as f64;
    let points = paths.first().map_or(0, Vec::len);
    let mut out = Vec::new();
    for point in 0..points {
        for axis in 0..3 {
            for harmonic in 1..=HARMONICS {
                let turn = core::f64::consts::TAU * f64::from(harmonic) / frames;
                let (mut re, mut im) = (0.0, 0.0);
                for (i, frame) in paths.iter().enumerate() {
                    let (sin, cos) = (turn * i as f64).sin_cos();
                    re += frame[point][axis] * cos;
                    im += frame[point][axis] * sin;
                }
                out.push(re.hypot(im));
            }
        }
    }
    out
}

/// Pearson correlation of two motions' spectra.
pub(super) fn spectra_correlation(a: &[Points], b: &[Points]) -> f64 {
    let (a, b) = (spectra(a), spectra(b));
    let (ma, mb) = (mean(a.iter().copied()), mean(b.iter().copied()));
    let pairs = || a.iter().zip(&b).map(|(x, y)| (x - ma, y - mb));
    let product: f64 = pairs().map(|(x, y)| x * y).sum();
    let squares = |f: fn((f64, f64)) -> f64| pairs().map(f).map(|v| v * v).sum::<f64>();
    product / (squares(|p| p.0) * squares(|p| p.1)).sqrt().max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(amplitude: f64, frequency_hz: f64) -> Vec<Points> {
        (0..150)
            .map(|i| {
                let phase = core::f64::consts::TAU * frequency_hz * f64::from(i) / 60.0;
                vec![Vector3::new(amplitude * phase.sin(), 0.0, 1.0)]
            })
            .collect()
    }

    #[test]
    fn spectra_agree_in_frequency_not_in_size() {
        let a = swing(1.0, 1.2);
        assert!((spectra_correlation(&a, &swing(2.0, 1.2)) - 1.0).abs() < 1e-9);
        assert!(spectra_correlation(&a, &swing(1.0, 2.4)) < 0.3);
        assert!((mean_distance_m(&a, &a)).abs() < 1e-12);
        assert!(mean_distance_m(&a, &swing(1.5, 1.2)) > 0.2);
    }
}
