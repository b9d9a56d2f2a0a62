//! The noise of tracked keypoints, estimated from what a fit leaves over.
//!
//! A tracker errs more along the rope than across it, slowly in time, and alike at
//! neighbouring keypoints. Both axes get a size and two lag-one correlations; a
//! correlation in time and one along the rope make a separable noise whose residuals
//! are whitened by one difference in each direction.

use super::coordinates::FREE;
use super::film::Grid;
use shared_types::rope::KeypointNoise;

/// Slopes of a pixel over the coordinates, then its residual, in one axis.
pub(super) type Row = [f64; FREE + 1];
/// Rows along and across the rope of every cell of a [`Grid`].
pub(super) type Rows = Vec<Option<[Row; 2]>>;

/// Column of the residual in a [`Row`].
pub(super) const RESIDUAL: usize = FREE;
/// Correlations above this are taken to be this: beyond, whitening is a difference.
const CORRELATION_MAX: f64 = 0.97;
/// Least noise (px): a perfect track still has rounding and the step error of the
/// simulation in it.
const SIGMA_MIN_PX: f64 = 0.05;
/// Residuals beyond so many deviations do not count for the estimate.
const CLIP: f64 = 3.0;

/// Noise along and across the rope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    pub(super) axes: [KeypointNoise; 2],
}

impl Noise {
    /// Independent noise of one size.
    pub(super) fn white(sigma_px: f64) -> Self {
        let axis = KeypointNoise {
            sigma_px: sigma_px.max(SIGMA_MIN_PX),
            ..KeypointNoise::default()
        };
        Self { axes: [axis; 2] }
    }

    /// The noise that residuals show.
    pub(super) fn estimate(grid: &Grid, rows: &Rows) -> Self {
        Self {
            axes: [0, 1].map(|axis| estimate_axis(grid, rows, axis)),
        }
    }

    /// The same, at least of this size: what lasts through a film (a tracker's edge a
    /// little off, a lens not quite as calibrated) hides in the fit, not in residuals.
    pub(super) fn at_least(mut self, sigma_px: f64) -> Self {
        for axis in &mut self.axes {
            axis.sigma_px = axis.sigma_px.max(sigma_px);
        }
        self
    }

    /// Divides by the noise and takes the correlations out, in place, of the slopes over
    /// the first `fitted` coordinates and of the residual. What is left of a detection
    /// counts as much as the least certain of those it was compared with. Weighting before
    /// would make changing weights look like motion.
    pub(super) fn whiten(&self, grid: &Grid, rows: &mut Rows, fitted: usize) {
        let k = grid.keypoints;
        for (axis, noise) in self.axes.iter().enumerate() {
            for cell in rows.iter_mut().flatten() {
                for column in (0..fitted).chain([RESIDUAL]) {
                    cell[axis][column] /= noise.sigma_px;
                }
            }
            // From the end, so that every difference is taken with the original.
            for index in (k..rows.len()).rev() {
                if grid.follows[index / k] {
                    subtract(rows, [index, index - k], (axis, fitted), noise.in_time);
                }
            }
            for index in (1..rows.len()).rev() {
                if index % k != 0 {
                    subtract(rows, [index, index - 1], (axis, fitted), noise.along_rope);
                }
            }
        }
        for (index, row) in rows.iter_mut().enumerate() {
            let scale = grid.least_weight(index).sqrt();
            for axis in row.iter_mut().flatten() {
                for column in (0..fitted).chain([RESIDUAL]) {
                    axis[column] *= scale;
                }
            }
        }
    }
}

/// `(row - ρ before) / sqrt(1 - ρ²)`: what is new at `index`.
fn subtract(
    rows: &mut Rows,
    [index, before]: [usize; 2],
    (axis, fitted): (usize, usize),
    correlation: f64,
) {
    let (head, tail) = rows.split_at_mut(index);
    let (Some(Some(before)), Some(Some(row))) = (head.get(before), tail.first_mut()) else {
        return;
    };
    let scale = 1.0 / (1.0 - correlation * correlation).sqrt();
    for column in (0..fitted).chain([RESIDUAL]) {
        row[axis][column] = (row[axis][column] - correlation * before[axis][column]) * scale;
    }
}

/// The noise that residuals show in one axis. Its size is that of a detection with weight 1; its
/// correlations are of residuals as they are, because weights that change would look like motion.
fn estimate_axis(grid: &Grid, rows: &Rows, axis: usize) -> KeypointNoise {
    // Divided by what is expected of its weight, and the weight.
    let residual = |i: usize| {
        let (row, cell) = (rows[i].as_ref()?, grid.cells[i]?);
        Some((cell.weight.sqrt() * row[axis][RESIDUAL], cell.weight))
    };
    let mut sizes: Vec<f64> = (0..rows.len())
        .filter_map(|i| Some(residual(i)?.0.abs()))
        .collect();
    if sizes.is_empty() {
        return Noise::white(1.0).axes[axis];
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of a normal variable's size is 0.6745 deviations.
    let limit = CLIP * (*median / 0.6745).max(SIGMA_MIN_PX);
    let clipped = |i: usize| residual(i).map(|(r, weight)| (r.clamp(-limit, limit), weight));
    let squares: f64 = (0..rows.len())
        .filter_map(clipped)
        .map(|(r, _)| r * r)
        .sum();
    let sigma = (squares / sizes.len() as f64).sqrt();
    let k = grid.keypoints;
    let lag = |step: usize, linked: &dyn Fn(usize) -> bool| {
        let (mut products, mut squares) = (0.0, 0.0);
        for i in step..rows.len() {
            if linked(i)
                && let (Some((a, weight_a)), Some((b, weight_b))) = (clipped(i), clipped(i - step))
                && weight_a > 0.0
                && weight_b > 0.0
            {
                let (a, b) = (a / weight_a.sqrt(), b / weight_b.sqrt());
                let weight = weight_a.min(weight_b);
                products += weight * a * b;
                squares += weight * f64::midpoint(a * a, b * b);
            }
        }
        if squares > 0.0 {
            (products / squares).clamp(0.0, CORRELATION_MAX)
        } else {
            0.0
        }
    };
    KeypointNoise {
        sigma_px: sigma.max(SIGMA_MIN_PX),
        in_time: lag(k, &|i| grid.follows[i / k]),
        along_rope: lag(1, &|i| !i.is_multiple_of(k)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::film::Detection;
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha12Rng;
    use rand_distr::StandardNormal;

    /// One keypoint in as many frames as there are weights.
    fn grid(weights: &[f64]) -> Grid {
        let cell = |weight: &f64| {
            Some(Detection {
                time_s: 0.0,
                along: 0.5,
                pixel: [0.0; 2],
                weight: *weight,
            })
        };
        Grid {
            keypoints: 1,
            cells: weights.iter().map(cell).collect(),
            follows: (0..weights.len()).map(|i| i > 0).collect(),
        }
    }

    /// A displacement that lasts is no motion, whatever the tracker's confidence does meanwhile.
    #[test]
    fn confidence_that_comes_and_goes_does_not_look_like_motion() {
        const FRAMES: usize = 6;
        let weights = [0.98, 0.5, 0.98, 0.92, 0.98, 0.6];
        let grid = grid(&weights);
        let mut row = [0.0; FREE + 1];
        row[RESIDUAL] = 0.3;
        let mut rows: Rows = vec![Some([row; 2]); FRAMES];
        let slow = KeypointNoise {
            sigma_px: 0.2,
            in_time: 0.96,
            along_rope: 0.0,
        };
        Noise { axes: [slow; 2] }.whiten(&grid, &mut rows, 0);
        let alone = 0.3 / 0.2 * (1.0 - 0.96) / (1.0 - 0.96_f64.powi(2)).sqrt();
        for (i, row) in rows.iter().enumerate().skip(1) {
            let expected = alone * weights[i].min(weights[i - 1]).sqrt();
            assert!((row.unwrap()[0][RESIDUAL] - expected).abs() < 1e-12, "{i}");
        }
    }

    /// Nor does it lower the correlation that residuals have.
    #[test]
    fn correlations_do_not_depend_on_confidence() {
        const FRAMES: usize = 4000;
        const IN_TIME: f64 = 0.8;
        let mut rng = ChaCha12Rng::seed_from_u64(1);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let mut residual = normal();
        let mut row = [0.0; FREE + 1];
        let rows: Rows = (0..FRAMES)
            .map(|_| {
                residual = IN_TIME * residual + (1.0 - IN_TIME * IN_TIME).sqrt() * normal();
                row[RESIDUAL] = 0.3 * residual;
                Some([row; 2])
            })
            .collect();
        let changing: Vec<f64> = (0..FRAMES)
            .map(|i| if i % 3 == 0 { 0.09 } else { 0.9 })
            .collect();
        for weights in [vec![0.9; FRAMES], changing] {
            let found = Noise::estimate(&grid(&weights), &rows).axes[0];
            assert!((found.in_time - IN_TIME).abs() < 0.05, "{found:?}");
        }
    }

    #[test]
    fn a_least_noise_raises_the_smaller_axis_alone() {
        let mut noise = Noise::white(1.5);
        noise.axes[0].sigma_px = 0.06;
        noise.axes[0].in_time = 0.9;
        let raised = noise.at_least(0.2);
        assert_eq!(raised.axes[0].sigma_px, 0.2);
        assert_eq!(raised.axes[0].in_time, 0.9);
        assert_eq!(raised.axes[1], noise.axes[1]);
    }
}
