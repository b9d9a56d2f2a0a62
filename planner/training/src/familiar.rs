//! How far an embedding is from those of known ropes.

use crate::error::{Result, TrainingError};
use crate::network::EMBEDDING;
use crate::trainer::Predicted;
use nalgebra::{DMatrix, DVector};

/// How embeddings of known ropes are distributed.
pub(crate) struct Familiar {
    pub(crate) mean: Vec<f32>,
    /// Takes a deviation from the mean to numbers of mean square 1, row-major.
    pub(crate) whiten: Vec<f32>,
    /// Out-of-distribution score that one in a hundred exceeds.
    pub(crate) limit: f64,
}

impl Familiar {
    /// Measures the embeddings of known ropes, and the scores of `others` of the
    /// same kind beside them.
    pub(crate) fn measure(known: &[Predicted], others: &[Predicted]) -> Result<Self> {
        let wrong = |found: &str| {
            TrainingError::Input(format!(
                "ropes for the out-of-distribution score: {found}, but 2 or more with finite embeddings are needed"
            ))
        };
        let count = known.len();
        if count < 2 || others.is_empty() {
            return Err(wrong(&format!("{count} known, {} others", others.len())));
        }
        let row = |p: &Predicted| {
            DVector::from_iterator(EMBEDDING, p.embedding.iter().map(|x| f64::from(*x)))
        };
        let rows: Vec<DVector<f64>> = known.iter().map(row).collect();
        let mean: DVector<f64> = rows.iter().sum::<DVector<f64>>() / count as f64;
        let mut covariance = DMatrix::zeros(EMBEDDING, EMBEDDING);
        for row in &rows {
            let d = row - &mean;
            covariance.ger(1.0 / count as f64, &d, &d, 1.0);
        }
        // Directions in which known ropes hardly differ count as if they differed
        // by a hundredth of the others: a score, not a sentence.
        let floor = 1e-4 * covariance.trace() / EMBEDDING as f64 + 1e-12;
        covariance += DMatrix::identity(EMBEDDING, EMBEDDING) * floor;
        let inverse = covariance.cholesky().and_then(|c| c.l().try_inverse());
        let inverse = inverse.ok_or_else(|| wrong("embeddings without spread"))?;
        let score = |p: &Predicted| (&inverse * (row(p) - &mean)).norm_squared() / EMBEDDING as f64;
        let mut scores: Vec<f64> = others.iter().map(score).collect();
        scores.sort_by(f64::total_cmp);
        let count = scores.len();
        Ok(Self {
            mean: mean.iter().map(|x| *x as f32).collect(),
            // A row vector times this is the same as the inverse times a column.
            whiten: inverse.iter().map(|x| *x as f32).collect(),
            limit: scores[(count * 99 / 100).min(count - 1)],
        })
    }
}
