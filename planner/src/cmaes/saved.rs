//! A search between two generations, to be written down and gone on with.

use super::{Best, CmaError, CmaEs, CmaOptions};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Everything a search has learnt. With the options it was started with it goes on as if
/// it had never stopped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedSearch {
    seed: u64,
    population: usize,
    /// Random words drawn, high and low half.
    words: [u64; 2],
    mean: Vec<f64>,
    sigma: f64,
    /// Column by column, as the axes.
    covariance: Vec<f64>,
    axes: Vec<f64>,
    axis_lengths: Vec<f64>,
    path_sigma: Vec<f64>,
    path_c: Vec<f64>,
    generation: usize,
    best: Option<Best>,
    best_of_generations: Vec<f64>,
    /// `None` before the first generation.
    last_spread: Option<f64>,
    resampled: usize,
}

impl CmaEs {
    /// What the search has learnt; to be called after [`CmaEs::tell`].
    #[must_use]
    pub fn save(&self) -> SavedSearch {
        let words = self.rng.get_word_pos();
        let words = [(words >> 64) as u64, words as u64];
        SavedSearch {
            seed: self.options.seed,
            population: self.options.population,
            words,
            mean: self.mean.as_slice().to_vec(),
            sigma: self.sigma,
            covariance: self.covariance.as_slice().to_vec(),
            axes: self.axes.as_slice().to_vec(),
            axis_lengths: self.axis_lengths.as_slice().to_vec(),
            path_sigma: self.path_sigma.as_slice().to_vec(),
            path_c: self.path_c.as_slice().to_vec(),
            generation: self.generation,
            best: self.best.clone(),
            best_of_generations: self.best_of_generations.clone(),
            last_spread: Some(self.last_spread).filter(|s| s.is_finite()),
            resampled: self.resampled,
        }
    }

    /// Goes on with a saved search.
    ///
    /// # Errors
    /// As [`CmaEs::new`], and options of another dimension, seed or population.
    pub fn resume(options: CmaOptions, saved: &SavedSearch) -> Result<Self, CmaError> {
        let mut search = Self::new(options)?;
        let n = search.mean.len();
        let differ = |field, found: u64, expected: u64| {
            if found == expected {
                Ok(())
            } else {
                Err(CmaError::Saved {
                    field,
                    found,
                    expected,
                })
            }
        };
        differ("seed", saved.seed, search.options.seed)?;
        let population = search.options.population as u64;
        differ("population", saved.population as u64, population)?;
        for (vector, length) in [
            (&saved.mean, n),
            (&saved.axis_lengths, n),
            (&saved.path_sigma, n),
            (&saved.path_c, n),
            (&saved.covariance, n * n),
            (&saved.axes, n * n),
        ] {
            differ("numbers", vector.len() as u64, length as u64)?;
        }
        let words = (u128::from(saved.words[0]) << 64) | u128::from(saved.words[1]);
        search.rng.set_word_pos(words);
        let vector = |v: &[f64]| DVector::from_column_slice(v);
        search.mean = vector(&saved.mean);
        search.sigma = saved.sigma;
        search.covariance = DMatrix::from_column_slice(n, n, &saved.covariance);
        search.axes = DMatrix::from_column_slice(n, n, &saved.axes);
        search.axis_lengths = vector(&saved.axis_lengths);
        search.path_sigma = vector(&saved.path_sigma);
        search.path_c = vector(&saved.path_c);
        search.generation = saved.generation;
        search.best.clone_from(&saved.best);
        search
            .best_of_generations
            .clone_from(&saved.best_of_generations);
        search.last_spread = saved.last_spread.unwrap_or(f64::INFINITY);
        search.resampled = saved.resampled;
        Ok(search)
    }
}
