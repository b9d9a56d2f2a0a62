//! The tip's way through space from single sightings.
//!
//! Along the image the sightings are good (a few mm), in depth they are not
//! (65 mm a pixel at 1.7 m). So the image path is a cubic over 5 frames, the
//! inverse depth - proportional to disparity - a quadratic over 11 frames with
//! Cauchy weights against half-hidden leads.

use nalgebra::{DMatrix, DVector, Vector3};

/// One stereo sighting in the left optical frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    /// Middle of the exposure of the row it was seen in (s).
    pub(super) t_s: f64,
    /// `x/z`, `y/z`.
    pub(super) ray: [f64; 2],
    /// `1/z` (1/m).
    pub(super) inverse_depth: f64,
}

/// Frames for the image path and for the depth.
const IMAGE_FRAMES: usize = 5;
const DEPTH_FRAMES: usize = 11;

/// Smooth path around one sighting.
#[derive(Debug, Clone)]
pub(super) struct LocalPath {
    /// Time about which the polynomials are written (s).
    pub(super) t_s: f64,
    ray: [Vec<f64>; 2],
    inverse_depth: Vec<f64>,
    /// Standard error of the inverse depth (1/m).
    pub(super) inverse_depth_error: f64,
}

impl LocalPath {
    /// Fits around sighting `index`; `None` with fewer than four sightings.
    pub(super) fn around(sightings: &[Sighting], index: usize) -> Option<Self> {
        if sightings.len() < 4 {
            return None;
        }
        let t_s = sightings[index].t_s;
        let near = |count: usize| {
            let count = count.min(sightings.len());
            let from = index.saturating_sub(count / 2).min(sightings.len() - count);
            &sightings[from..from + count]
        };
        let axis = |k: usize| -> Option<Vec<f64>> {
            let points: Vec<(f64, f64)> = near(IMAGE_FRAMES)
                .iter()
                .map(|s| (s.t_s - t_s, s.ray[k]))
                .collect();
            Some(fit(&points, 3, 1e-3)?.0)
        };
        let points: Vec<(f64, f64)> = near(DEPTH_FRAMES)
            .iter()
            .map(|s| (s.t_s - t_s, s.inverse_depth))
            .collect();
        let (inverse_depth, spread) = fit(&points, 2, 0.004)?;
        Some(Self {
            t_s,
            ray: [axis(0)?, axis(1)?],
            inverse_depth,
            // Three coefficients from so many frames.
            inverse_depth_error: spread * (3.0 / points.len() as f64).sqrt(),
        })
    }

    /// Point in the left optical frame (m).
    pub(super) fn at(&self, t_s: f64) -> Vector3<f64> {
        let dt = t_s - self.t_s;
        let value = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * dt + c);
        let z = 1.0 / value(&self.inverse_depth).max(1e-3);
        Vector3::new(value(&self.ray[0]) * z, value(&self.ray[1]) * z, z)
    }
}

/// Polynomial with Cauchy weights; coefficients from the constant up, and the
/// weighted standard deviation of the residuals. `least_scale` keeps the
/// weights sane when the fit is perfect.
fn fit(points: &[(f64, f64)], degree: usize, least_scale: f64) -> Option<(Vec<f64>, f64)> {
    let degree = degree.min(points.len().checked_sub(2)?);
    // Time in units of the window, for the sake of the matrix.
    let unit = points.iter().map(|p| p.0.abs()).fold(1e-6, f64::max);
    let mut weights = vec![1.0; points.len()];
    let mut result = None;
    for _ in 0..12 {
        let a = DMatrix::from_fn(points.len(), degree + 1, |r, c| {
            weights[r] * (points[r].0 / unit).powi(i32::try_from(c).unwrap_or(0))
        });
        let b = DVector::from_fn(points.len(), |r, _| weights[r] * points[r].1);
        let x = a.svd(true, true).solve(&b, 1e-12).ok()?;
        let residual: Vec<f64> = points
            .iter()
            .map(|(t, y)| y - x.iter().rev().fold(0.0, |s, c| s * t / unit + c))
            .collect();
        let mut sorted: Vec<f64> = residual.iter().map(|r| r.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let scale = (1.4826 * sorted[sorted.len() / 2]).max(least_scale);
        for (w, r) in weights.iter_mut().zip(&residual) {
            *w = (1.0 / (1.0 + (r / (2.0 * scale)).powi(2))).sqrt();
        }
        let total: f64 = weights.iter().map(|w| w * w).sum();
        let square: f64 = weights
            .iter()
            .zip(&residual)
            .map(|(w, r)| (w * r).powi(2))
            .sum();
        let coefficients = x
            .iter()
            .zip(0..)
            .map(|(c, power)| c / unit.powi(power))
            .collect();
        result = Some((coefficients, (square / total).sqrt()));
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_of_a_parabola_survives_an_outlier() {
        let truth = |t: f64| {
            (
                0.1 + 2.0 * t,
                0.2 - 1.5 * t + 4.0 * t * t,
                0.6 + 0.3 * t - t * t,
            )
        };
        let mut sightings: Vec<Sighting> = (0..15)
            .map(|i| {
                let t_s = f64::from(i) / 60.0;
                let (x, y, inverse_depth) = truth(t_s);
                Sighting {
                    t_s,
                    ray: [x, y],
                    inverse_depth,
                }
            })
            .collect();
        sightings[6].inverse_depth += 0.08;
        let path = LocalPath::around(&sightings, 7).unwrap();
        let (x, y, w) = truth(0.12);
        let p = path.at(0.12);
        assert!(
            (p - Vector3::new(x / w, y / w, 1.0 / w)).norm() < 0.004,
            "{p}"
        );
        assert!(LocalPath::around(&sightings[..3], 1).is_none());
    }
}
