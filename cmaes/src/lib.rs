//! CMA-ES: covariance matrix adaptation evolution strategy, ask and tell.
//!
//! Rank-one, rank-µ and active (negative-weight) covariance update with
//! cumulative step-size adaptation, after N. Hansen, "The CMA Evolution Strategy:
//! A Tutorial" (arXiv:1604.00772); equation numbers below are of that text.
//! The strategy does not depend on what it optimises: the caller draws candidates
//! with [`CmaEs::ask`], values them and gives the values back with
//! [`CmaEs::tell`]. All random numbers come from one seed.

mod constants;
mod stop;
mod update;

#[cfg(test)]
mod tests;

pub use constants::StrategyConstants;
pub use stop::{StopReason, StopRules};

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;

/// Where and how widely a search starts.
#[derive(Debug, Clone, PartialEq)]
pub struct CmaOptions {
    /// Mean of the first generation.
    pub mean: Vec<f64>,
    /// Standard deviation of the first generation, per coordinate.
    pub std_dev: Vec<f64>,
    /// Lower bounds; minus infinity where there is none.
    pub lower: Vec<f64>,
    /// Upper bounds; infinity where there is none.
    pub upper: Vec<f64>,
    /// Candidates per generation λ, at least 4.
    pub population: usize,
    /// Draws of one candidate before it is pulled towards a feasible point.
    pub draws_max: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// When to stop.
    pub stop: StopRules,
}

impl CmaOptions {
    /// An unbounded search with default stop rules and the tutorial's default
    /// population `4 + 3 ln n`.
    #[must_use]
    pub fn unbounded(mean: Vec<f64>, std_dev: f64, seed: u64) -> Self {
        let n = mean.len();
        Self {
            std_dev: vec![std_dev; n],
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
            population: 4 + (3.0 * (n.max(1) as f64).ln()) as usize,
            draws_max: 100,
            mean,
            seed,
            stop: StopRules::default(),
        }
    }
}

/// Why a search cannot start or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct CmaError(String);

/// Best candidate seen so far.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Its coordinates.
    pub x: Vec<f64>,
    /// Its fitness.
    pub fitness: f64,
}

/// State of a search. Deterministic for a seed and a sequence of `tell`s.
#[derive(Debug, Clone)]
pub struct CmaEs {
    options: CmaOptions,
    constants: StrategyConstants,
    rng: ChaCha12Rng,
    /// Mean in units of the initial deviations.
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    /// Eigenvectors B of the covariance.
    axes: DMatrix<f64>,
    /// Square roots D of its eigenvalues.
    axis_lengths: DVector<f64>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    generation: usize,
    /// Steps `y = (x - m) / sigma` of the candidates asked last.
    steps: Vec<DVector<f64>>,
    requested: Vec<Vec<f64>>,
    best: Option<Best>,
    best_of_generations: Vec<f64>,
    last_spread: f64,
    draws: usize,
    resampled: usize,
}

impl CmaEs {
    /// A search at its start.
    ///
    /// # Errors
    /// Options that contradict each other, by field or coordinate.
    pub fn new(options: CmaOptions) -> Result<Self, CmaError> {
        let n = options.mean.len();
        for (field, found) in [
            ("mean", n.max(1)),
            ("std_dev", options.std_dev.len()),
            ("lower", options.lower.len()),
            ("upper", options.upper.len()),
        ] {
            if found != n || n == 0 {
                return Err(CmaError(format!(
                    "search options: `{field}` has {found} entries, `mean` has {n} (at least 1)"
                )));
            }
        }
        for i in 0..n {
            let (m, s) = (options.mean[i], options.std_dev[i]);
            let inside = m >= options.lower[i] && m <= options.upper[i];
            if !(m.is_finite() && inside && s.is_finite() && s > 0.0)
                || options.lower[i] >= options.upper[i]
            {
                return Err(CmaError(format!(
                    "search options: coordinate {i} needs a finite mean inside its bounds and a positive deviation"
                )));
            }
        }
        if options.population < 4 {
            return Err(CmaError(format!(
                "search options: a population of {} is too small, use 4 or more",
                options.population
            )));
        }
        let scaled = options
            .mean
            .iter()
            .zip(&options.std_dev)
            .map(|(m, s)| m / s);
        let mean = DVector::from_iterator(n, scaled);
        Ok(Self {
            constants: StrategyConstants::new(n, options.population),
            rng: ChaCha12Rng::seed_from_u64(options.seed),
            mean,
            sigma: 1.0,
            covariance: DMatrix::identity(n, n),
            axes: DMatrix::identity(n, n),
            axis_lengths: DVector::repeat(n, 1.0),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            generation: 0,
            steps: Vec::new(),
            requested: Vec::new(),
            best: None,
            best_of_generations: Vec::new(),
            last_spread: f64::INFINITY,
            draws: 0,
            resampled: 0,
            options,
        })
    }

    /// Draws a generation. Each candidate lies inside the bounds (reflected at
    /// them) and satisfies `feasible`; one that does not is drawn again, at most
    /// `draws_max` times, and is then pulled back towards the mean or the best
    /// candidate until it does.
    ///
    /// # Errors
    /// No feasible point even there.
    pub fn ask(
        &mut self,
        feasible: &mut dyn FnMut(&[f64]) -> bool,
    ) -> Result<Vec<Vec<f64>>, CmaError> {
        self.steps.clear();
        self.requested.clear();
        self.draws = 0;
        for _ in 0..self.options.population {
            let (step, x) = self.draw_feasible(feasible)?;
            self.steps.push(step);
            self.requested.push(x);
        }
        Ok(self.requested.clone())
    }

    fn draw_feasible(
        &mut self,
        feasible: &mut dyn FnMut(&[f64]) -> bool,
    ) -> Result<(DVector<f64>, Vec<f64>), CmaError> {
        let n = self.mean.len();
        let mut step = DVector::zeros(n);
        for draw in 0..self.options.draws_max.max(1) {
            let z = DVector::from_fn(n, |_, _| self.rng.sample::<f64, _>(StandardNormal));
            step = &self.axes * z.component_mul(&self.axis_lengths);
            self.draws += 1;
            self.resampled += usize::from(draw > 0);
            let x = self.point(&step);
            if feasible(&x) {
                return Ok((step, x));
            }
        }
        // Pull back: first towards the mean, then towards the best candidate.
        let mut anchors = vec![DVector::zeros(n)];
        if let Some(best) = &self.best {
            let scaled = best.x.iter().zip(&self.options.std_dev).map(|(x, s)| x / s);
            anchors.push((DVector::from_iterator(n, scaled) - &self.mean) / self.sigma);
        }
        for anchor in anchors {
            let mut part = 0.5;
            for _ in 0..12 {
                let pulled = &anchor + (&step - &anchor) * part;
                let x = self.point(&pulled);
                if feasible(&x) {
                    return Ok((pulled, x));
                }
                part *= 0.5;
            }
        }
        Err(CmaError(format!(
            "no feasible candidate after {} draws: start from a feasible mean or with a smaller deviation",
            self.draws
        )))
    }

    /// Fitness of the candidates of the last [`CmaEs::ask`], in their order;
    /// smaller is better. A value that is not finite counts as the worst.
    ///
    /// # Errors
    /// Another number of values than candidates.
    pub fn tell(&mut self, fitness: &[f64]) -> Result<(), CmaError> {
        if fitness.len() != self.requested.len() || fitness.is_empty() {
            return Err(CmaError(format!(
                "{} fitness values for {} candidates: tell each generation once",
                fitness.len(),
                self.requested.len()
            )));
        }
        let finite = |f: &f64| if f.is_finite() { *f } else { f64::MAX };
        let value = |i: usize| finite(&fitness[i]);
        let mut order: Vec<usize> = (0..fitness.len()).collect();
        order.sort_by(|&a, &b| value(a).total_cmp(&value(b)));
        let first = value(order[0]);
        self.last_spread = value(order[order.len() / 2]) - first;
        self.best_of_generations.push(first);
        if self.best.as_ref().is_none_or(|b| first < b.fitness) {
            self.best = Some(Best {
                x: self.requested[order[0]].clone(),
                fitness: first,
            });
        }
        self.update(&order);
        self.requested.clear();
        self.generation += 1;
        Ok(())
    }

    /// Why the search should end, if it should.
    #[must_use]
    pub fn stop(&self) -> Option<StopReason> {
        self.options.stop.check(self)
    }

    /// Best candidate so far; `None` before the first generation was told.
    #[must_use]
    pub fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    /// Generations told.
    #[must_use]
    pub fn generation(&self) -> usize {
        self.generation
    }

    /// Candidates drawn again because they were not feasible.
    #[must_use]
    pub fn resampled(&self) -> usize {
        self.resampled
    }

    /// Candidate at a step from the mean, in the caller's coordinates.
    fn point(&self, step: &DVector<f64>) -> Vec<f64> {
        (0..self.mean.len())
            .map(|i| {
                let x = (self.mean[i] + self.sigma * step[i]) * self.options.std_dev[i];
                reflect(x, self.options.lower[i], self.options.upper[i])
            })
            .collect()
    }
}

/// `x` reflected at `lower` and `upper` until it lies between them; a one-sided
/// bound reflects once.
fn reflect(x: f64, lower: f64, upper: f64) -> f64 {
    let width = upper - lower;
    if width.is_finite() {
        let t = (x - lower).rem_euclid(2.0 * width);
        let folded = if t <= width {
            lower + t
        } else {
            upper - (t - width)
        };
        folded.clamp(lower, upper)
    } else if x < lower {
        2.0 * lower - x
    } else if x > upper {
        2.0 * upper - x
    } else {
        x
    }
}
