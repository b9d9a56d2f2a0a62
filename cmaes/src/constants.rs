//! Strategy constants that follow from dimension and population.
//!
//! Learning rates of the covariance and weights are those of the tutorial, table 1. The
//! step size follows the package `cma` 4: its path is never forgotten faster than by half
//! in a generation, and the damping grows further with the parents, without which a large
//! population steps past the basins of a rugged landscape.

/// Weights and learning rates (tutorial, table 1).
#[derive(Debug, Clone, PartialEq)]
pub struct StrategyConstants {
    /// Recombination weights of all ranks, best first; the worse half is
    /// negative (active update). Positive ones add up to 1.
    pub weights: Vec<f64>,
    /// Number of positive weights µ.
    pub parents: usize,
    /// Variance-effective selection mass of the parents.
    pub mu_eff: f64,
    /// Learning rate of the step-size path.
    pub c_sigma: f64,
    /// Damping of the step size.
    pub d_sigma: f64,
    /// Learning rate of the covariance path.
    pub c_c: f64,
    /// Learning rate of the rank-one update.
    pub c_1: f64,
    /// Learning rate of the rank-µ update.
    pub c_mu: f64,
    /// Expected length of a standard normal vector.
    pub chi_n: f64,
}

impl StrategyConstants {
    /// Largest learning rate of the step-size path.
    const C_SIGMA_MAX: f64 = 0.5;
    /// Damping by the number of parents in many dimensions; it falls to half of this in
    /// nine, to at least 1.
    const PARENT_DAMPING: f64 = 3.0;

    /// Constants for `n` coordinates and `population` candidates (at least 4).
    #[must_use]
    pub fn new(n: usize, population: usize) -> Self {
        let (nf, lambda) = (n as f64, population as f64);
        let raw: Vec<f64> = (1..=population)
            .map(|i| ((lambda + 1.0) / 2.0).ln() - (i as f64).ln())
            .collect();
        let parents = population / 2;
        let mass = |w: &[f64]| {
            let (sum, squares) = w.iter().fold((0.0, 0.0), |(a, b), w| (a + w, b + w * w));
            (sum, sum * sum / squares)
        };
        let (sum_positive, mu_eff) = mass(&raw[..parents]);
        let negative: Vec<f64> = raw.iter().copied().filter(|w| *w < 0.0).collect();
        let (sum_negative, mu_eff_negative) = mass(&negative);

        let c_c = (4.0 + mu_eff / nf) / (nf + 4.0 + 2.0 * mu_eff / nf);
        let c_1 = (lambda / 6.0).min(1.0) * 2.0 / ((nf + 1.3).powi(2) + mu_eff);
        let c_mu = (1.0 - c_1)
            .min(2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((nf + 2.0).powi(2) + mu_eff));
        // Scale of the negative weights, equations 50 to 53.
        let alpha_mu = 1.0 + c_1 / c_mu;
        let alpha_mu_eff = 1.0 + 2.0 * mu_eff_negative / (mu_eff + 2.0);
        let alpha_pos_def = (1.0 - c_1 - c_mu) / (nf * c_mu);
        let alpha = alpha_mu.min(alpha_mu_eff).min(alpha_pos_def).max(0.0);
        let weights = raw
            .iter()
            .enumerate()
            .map(|(i, w)| match () {
                () if i < parents => w / sum_positive,
                () if *w < 0.0 => alpha * w / sum_negative.abs(),
                () => 0.0,
            })
            .collect();

        let c_sigma = ((mu_eff + 2.0) / (nf + mu_eff + 3.0)).min(Self::C_SIGMA_MAX);
        let inner = (Self::PARENT_DAMPING * (1.0 - 0.5f64.powf(nf / 9.0))).max(1.0);
        let crowd = inner * ((mu_eff - 1.0) / (nf + 1.0)).sqrt();
        let d_sigma = 1.0 + 2.0 * (crowd - 1.0).max(0.0) + c_sigma;
        Self {
            weights,
            parents,
            mu_eff,
            c_sigma,
            d_sigma,
            c_c,
            c_1,
            c_mu,
            chi_n: nf.sqrt() * (1.0 - 1.0 / (4.0 * nf) + 1.0 / (21.0 * nf * nf)),
        }
    }
}
