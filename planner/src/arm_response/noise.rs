//! How far off reports are: a part of the encoder, and a part that grows with
//! speed because the time of a report is uncertain.

/// Smallest standard deviation assumed (rad): f32 on the wire near pi.
const FLOOR_RAD: f64 = 1e-7;
/// Residuals beyond this many standard deviations count less (Huber).
const HUBER: f64 = 1.5;
/// Standard deviation over median absolute deviation, normal distribution.
const SIGMA_PER_MAD: f64 = 1.4826;
/// Rounds of weighing and fitting again.
const ROUNDS: usize = 12;

/// Variance of a report as `position² + (time * speed)²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    pub(super) position_rad: f64,
    pub(super) time_s: f64,
}

impl Noise {
    /// One number for all reports, from the middle of the residuals: blind to
    /// up to half of them being wild.
    pub(super) fn even(residuals: &[f64]) -> Self {
        Self {
            position_rad: (SIGMA_PER_MAD * median_abs(residuals)).max(FLOOR_RAD),
            time_s: 0.0,
        }
    }

    /// Both parts, from residuals (rad) and speeds (rad/s): a straight line
    /// through squared residuals over squared speed, each weighed by what it
    /// says itself, wild ones cut.
    pub(super) fn from_residuals(residuals: &[f64], speeds: &[f64]) -> Self {
        let mut noise = Self::even(residuals);
        for _ in 0..ROUNDS {
            let mut sums = [0.0; 5];
            for (r, v) in residuals.iter().zip(speeds) {
                let variance = noise.variance(*v);
                let square = (r * r).min(9.0 * variance);
                let weight = variance.powi(-2);
                let x = v * v;
                let terms = [1.0, x, x * x, square, x * square];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += weight * term;
                }
            }
            let [n, x, xx, y, xy] = sums;
            let det = n * xx - x * x;
            let (mut a, mut b) = if det > 1e-12 * n * xx {
                ((xx * y - x * xy) / det, (n * xy - x * y) / det)
            } else {
                (y / n, 0.0)
            };
            // Neither part is negative: the other one explains it all then.
            if b < 0.0 {
                (a, b) = (y / n, 0.0);
            } else if a < 0.0 {
                (a, b) = (0.0, xy / xx);
            }
            noise = Self {
                position_rad: a.sqrt().max(FLOOR_RAD),
                time_s: b.sqrt(),
            };
        }
        noise
    }

    /// Variance of a report at a speed (rad²).
    pub(super) fn variance(&self, speed_rad_s: f64) -> f64 {
        self.position_rad.powi(2) + (self.time_s * speed_rad_s).powi(2)
    }

    /// What a residual counts for (1/rad²).
    pub(super) fn weight(&self, residual: f64, speed_rad_s: f64) -> f64 {
        let variance = self.variance(speed_rad_s);
        let deviations = residual.abs() / variance.sqrt();
        if deviations > HUBER {
            HUBER / deviations / variance
        } else {
            1.0 / variance
        }
    }

    /// Huber's cost of a residual, half its square in standard deviations while
    /// small.
    pub(super) fn cost(&self, residual: f64, speed_rad_s: f64) -> f64 {
        let deviations = residual.abs() / self.variance(speed_rad_s).sqrt();
        if deviations > HUBER {
            HUBER * (deviations - 0.5 * HUBER)
        } else {
            0.5 * deviations * deviations
        }
    }
}

fn median_abs(residuals: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return 0.0;
    }
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn both_parts_are_found_under_one_in_fifty_wild_residuals() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let speeds: Vec<f64> = (0..8000).map(|k| (f64::from(k) * 0.01).sin()).collect();
        let residuals: Vec<f64> = speeds
            .iter()
            .enumerate()
            .map(|(k, v)| {
                let wild = if k % 50 == 0 { 30.0 } else { 1.0 };
                // Two uniform numbers of known spread.
                let mut uniform = || rng.random_range(-1.0..1.0) * 3.0_f64.sqrt();
                wild * (2e-5 * uniform() + 3e-4 * v * uniform())
            })
            .collect();
        let noise = Noise::from_residuals(&residuals, &speeds);
        assert!((noise.position_rad / 2e-5 - 1.0).abs() < 0.3, "{noise:?}");
        assert!((noise.time_s / 3e-4 - 1.0).abs() < 0.2, "{noise:?}");
    }
}
