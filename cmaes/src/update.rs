//! The update of mean, paths, step size and covariance after a generation.

use super::CmaEs;
use nalgebra::{DMatrix, DVector};

impl CmaEs {
    /// Moves the distribution towards the better steps; `order` ranks them.
    pub(super) fn update(&mut self, order: &[usize]) {
        let n = self.mean.len();
        let nf = n as f64;
        let k = self.constants.clone();

        let mut mean_step = DVector::zeros(n);
        for (rank, &i) in order.iter().take(k.parents).enumerate() {
            mean_step.axpy(k.weights[rank], &self.steps[i], 1.0);
        }
        self.mean.axpy(self.sigma, &mean_step, 1.0);

        // Equation 43: step-size path in the isotropic frame.
        let whitened = self.whiten(&mean_step);
        let gain = (k.c_sigma * (2.0 - k.c_sigma) * k.mu_eff).sqrt();
        self.path_sigma = &self.path_sigma * (1.0 - k.c_sigma) + whitened * gain;
        let path_length = self.path_sigma.norm();
        let age = 2 * (self.generation as i32 + 1);
        let expected = (1.0 - (1.0 - k.c_sigma).powi(age)).sqrt() * k.chi_n;
        let short = path_length < (1.4 + 2.0 / (nf + 1.0)) * expected;

        // Equation 45: covariance path, stalled while the step size grows fast.
        let gain_c = if short {
            (k.c_c * (2.0 - k.c_c) * k.mu_eff).sqrt()
        } else {
            0.0
        };
        self.path_c = &self.path_c * (1.0 - k.c_c) + &mean_step * gain_c;

        // Equation 47: rank-one and rank-µ update with negative weights.
        let stall = if short {
            0.0
        } else {
            k.c_1 * k.c_c * (2.0 - k.c_c)
        };
        let total: f64 = k.weights.iter().sum();
        self.covariance *= 1.0 + stall - k.c_1 - k.c_mu * total;
        self.covariance.ger(k.c_1, &self.path_c, &self.path_c, 1.0);
        for (rank, &i) in order.iter().enumerate() {
            let weight = k.weights[rank];
            let scaled = if weight >= 0.0 {
                weight
            } else {
                weight * nf / self.whiten(&self.steps[i]).norm_squared().max(1e-12)
            };
            self.covariance
                .ger(k.c_mu * scaled, &self.steps[i], &self.steps[i], 1.0);
        }

        // Equation 44, the change limited to a factor of e per generation.
        let growth = k.c_sigma / k.d_sigma * (path_length / k.chi_n - 1.0);
        self.sigma *= growth.min(1.0).exp();
        self.decompose();
        self.keep_within_bounds();
    }

    /// `C^(-1/2) y`.
    fn whiten(&self, y: &DVector<f64>) -> DVector<f64> {
        &self.axes * self.axes.tr_mul(y).component_div(&self.axis_lengths)
    }

    /// Refreshes axes and their lengths; a rounding-negative eigenvalue is
    /// lifted, so that the covariance stays positive definite.
    fn decompose(&mut self) {
        self.covariance = (&self.covariance + self.covariance.transpose()) * 0.5;
        let eigen = self.covariance.clone().symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let floor = largest * 1e-16;
        let values = eigen.eigenvalues.map(|v| v.max(floor));
        if eigen.eigenvalues.min() < floor {
            self.covariance = &eigen.eigenvectors
                * DMatrix::from_diagonal(&values)
                * eigen.eigenvectors.transpose();
        }
        self.axis_lengths = values.map(f64::sqrt);
        self.axes = eigen.eigenvectors;
    }

    /// Keeps the deviation of every bounded coordinate below half the width of
    /// its box: wider, reflection would make the search a uniform one.
    fn keep_within_bounds(&mut self) {
        for i in 0..self.mean.len() {
            let width = self.options.upper[i] - self.options.lower[i];
            let deviation = self.sigma * self.covariance[(i, i)].sqrt() * self.options.std_dev[i];
            if deviation > width / 2.0 {
                self.sigma *= width / 2.0 / deviation;
            }
        }
    }
}
