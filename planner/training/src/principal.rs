//! Principal components of the motion: the directions in which films of different
//! ropes differ most.
//!
//! They are taken over the keypoints' places in metres, where tracking errors are of
//! one size everywhere, from films without errors, and scaled by what films with errors
//! show. What remains of the noise in such a number is that of hundreds of frames
//! together; a network that sees it need not learn first to average.

use nalgebra::{DMatrix, DVector};
use planner::features::FeatureDefinition;
use serde::{Deserialize, Serialize};

/// Numbers kept.
pub(crate) const PRINCIPAL: usize = 64;
/// Frames averaged before: an eighth of a second at 60 Hz.
pub(crate) const POOL: usize = 8;

/// A matrix from pooled standardised motion to principal components; without numbers,
/// every component is 0.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Principal {
    /// Row-major: frame group by frame group, channel by channel, then component.
    pub(crate) matrix: Vec<f32>,
}

impl Principal {
    /// Measures standardised films with errors and without; `scale` is that of the
    /// channels.
    pub(crate) fn measure(
        films: &[Vec<f32>],
        clean: &[Vec<f32>],
        scale: &[f32],
        definition: &FeatureDefinition,
    ) -> Self {
        let channels = definition.channels();
        let places = 2 * definition.keypoints;
        let numbers = definition.frames / POOL * channels;
        // Places in metres; angles follow from them.
        let metres = |film: &Vec<f32>| {
            let pooled = pooled(film, channels);
            let value = |i: usize| {
                let channel = i % channels;
                if channel < places {
                    f64::from(pooled[i]) / f64::from(scale[channel])
                } else {
                    0.0
                }
            };
            DVector::from_iterator(numbers, (0..numbers).map(value))
        };
        let clean: Vec<DVector<f64>> = clean.iter().map(metres).collect();
        if clean.is_empty() {
            return Self {
                matrix: vec![0.0; numbers * PRINCIPAL],
            };
        }
        let films: Vec<DVector<f64>> = films.iter().map(metres).collect();
        let rows = DMatrix::from_columns(&clean);
        // Films are fewer than numbers: the products of films with films have the same
        // axes.
        let products = (rows.transpose() * &rows).symmetric_eigen();
        let mut order: Vec<usize> = (0..clean.len()).collect();
        order.sort_by(|a, b| products.eigenvalues[*b].total_cmp(&products.eigenvalues[*a]));
        let largest = products.eigenvalues[order[0]];
        let mut matrix = vec![0.0; numbers * PRINCIPAL];
        for (component, which) in order.into_iter().take(PRINCIPAL).enumerate() {
            // Below, an axis is made of rounding errors.
            if products.eigenvalues[which] <= 1e-9 * largest {
                break;
            }
            let axis = (&rows * products.eigenvectors.column(which)).normalize();
            let count = films.len().max(1) as f64;
            let square = films.iter().map(|f| f.dot(&axis).powi(2)).sum::<f64>() / count;
            let deviation = square.sqrt().max(1e-6);
            for i in 0..numbers {
                let per_metre = f64::from(scale[i % channels]);
                matrix[i * PRINCIPAL + component] = (axis[i] / per_metre / deviation) as f32;
            }
        }
        Self { matrix }
    }

    /// Components of standardised motion.
    pub(crate) fn of(&self, motion: &[f32], channels: usize) -> [f32; PRINCIPAL] {
        let mut out = [0.0; PRINCIPAL];
        let rows = self.matrix.chunks(PRINCIPAL);
        for (x, row) in pooled(motion, channels).iter().zip(rows) {
            for (sum, weight) in out.iter_mut().zip(row) {
                *sum += x * weight;
            }
        }
        out
    }
}

/// Means of each [`POOL`] frames; frames left over at the end are left out.
fn pooled(motion: &[f32], channels: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(motion.len() / POOL);
    for group in motion.chunks_exact(POOL * channels) {
        for channel in 0..channels {
            let sum: f32 = group[channel..].iter().step_by(channels).sum();
            out.push(sum / POOL as f32);
        }
    }
    out
}
