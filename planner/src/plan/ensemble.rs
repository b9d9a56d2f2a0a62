//! Ropes drawn from what identification left open.

use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use shared_types::rope::{LINK_COUNTS, RANGES, ROPE_PARAMETERS, RopePosterior};

/// Ropes that a robust plan is optimised over, and others that its error is forecast with.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PosteriorEnsemble {
    /// Those that the plan is optimised over; none for a plain plan.
    pub optimised: Vec<RopeParams>,
    /// Those its error is forecast with; none for no forecast.
    pub forecast: Vec<RopeParams>,
}

impl PosteriorEnsemble {
    /// `optimised` and `forecast` ropes of a posterior around the rope planned for.
    ///
    /// Parameters are taken for lognormal with the posterior's means and covariance, because
    /// what a film leaves open is a common factor of stiffness, damping and masses: ratios
    /// stay as sharp as they were identified. The link count follows its probabilities.
    #[must_use]
    pub fn drawn(
        rope: &RopeParams,
        posterior: &RopePosterior,
        optimised: usize,
        forecast: usize,
        seed: u64,
    ) -> Self {
        const N: usize = ROPE_PARAMETERS - 1;
        let mean = |i: usize| posterior.mean[i + 1].max(1e-9);
        let logs = SMatrix::<f64, N, N>::from_fn(|i, k| {
            let relative = posterior.covariance[i + 1][k + 1] / (mean(i) * mean(k));
            relative.max(-0.9).ln_1p()
        });
        // Rounding and moments of no lognormal may leave it slightly indefinite.
        let eigen = logs.symmetric_eigen();
        let lengths = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
        let mut rng = ChaCha12Rng::seed_from_u64(seed ^ 0xbe11_ef00);
        let mut ropes: Vec<RopeParams> = (0..optimised + forecast)
            .map(|_| {
                let z = SVector::<f64, N>::from_fn(|i, _| {
                    lengths[i] * rng.sample::<f64, _>(StandardNormal)
                });
                let shift = eigen.eigenvectors * z;
                let mut values = rope.to_array();
                values[0] = links(posterior, rope, rng.random());
                for i in 0..N {
                    values[i + 1] = (mean(i).ln() - logs[(i, i)] / 2.0 + shift[i]).exp();
                }
                let drawn = RopeParams {
                    extras: rope.extras,
                    ..RopeParams::from_array(values)
                };
                if drawn.validate().is_ok() {
                    drawn
                } else {
                    *rope
                }
            })
            .collect();
        let forecast = ropes.split_off(optimised);
        Self {
            optimised: ropes,
            forecast,
        }
    }
}

/// The link count at a part of the cumulated probability.
fn links(posterior: &RopePosterior, rope: &RopeParams, part: f64) -> f64 {
    let mut left = part;
    for (i, p) in (0u32..).zip(posterior.links_probability.iter().take(LINK_COUNTS)) {
        left -= p;
        if left < 0.0 {
            return RANGES[0].min + f64::from(i);
        }
    }
    f64::from(rope.links)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A common factor known to 30 %, ratios to 1 %: drawn ropes have just that.
    #[test]
    fn drawn_ropes_have_the_moments_and_keep_the_ratios() {
        let rope = RopeParams::from_array([23.0, 0.55, 0.01, 0.2, 0.006, 0.05, 0.05, 0.03, 0.9]);
        let mean = rope.to_array();
        let common = [2usize, 3, 5, 6];
        let covariance = core::array::from_fn(|i| {
            core::array::from_fn(|k| {
                let both = common.contains(&i) && common.contains(&k);
                let own = if i == k { 1e-4 } else { 0.0 };
                mean[i] * mean[k] * (own + if both { 0.09 } else { 0.0 })
            })
        });
        let posterior = RopePosterior {
            mean,
            covariance,
            interval_90: [[0.0; 2]; ROPE_PARAMETERS],
            links_probability: [0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0],
            ambiguities: Vec::new(),
            inflation: 1.0,
        };
        let drawn = PosteriorEnsemble::drawn(&rope, &posterior, 3995, 5, 1);
        let drawn = [drawn.optimised, drawn.forecast].concat();
        let moments = |of: &dyn Fn(&RopeParams) -> f64| {
            let m = drawn.iter().map(of).sum::<f64>() / 4000.0;
            let v = drawn.iter().map(|r| (of(r) - m).powi(2)).sum::<f64>() / 4000.0;
            (m, v.sqrt())
        };
        let (m, s) = moments(&|r| r.lead_mass_kg);
        assert!(
            (m / 0.05 - 1.0).abs() < 0.02 && (s / m - 0.3).abs() < 0.02,
            "{m} {s}"
        );
        let (m, s) = moments(&|r| r.lead_mass_kg / r.mass_per_length_kg_per_m);
        assert!((m - 1.0).abs() < 0.02 && s < 0.02, "{m} {s}");
        let (m, _) = moments(&|r| f64::from(r.links));
        assert!((m - 22.5).abs() < 0.05, "{m}");
        let few = PosteriorEnsemble::drawn(&rope, &posterior, 5, 0, 1);
        assert_eq!(drawn[..5], few.optimised);
    }
}
