//! Errors of a tracker that last through a film: an edge that is a little beside the rope's, a lens
//! that is not quite as calibrated. They hide in the fit, not in what it leaves over.
//!
//! Each keypoint, along and across the rope, may be off by the same all through the film. The slopes
//! are those of an offset that neighbours share, and what each keypoint's adds is taken to be
//! independent: less than independent offsets of that size would, or ones as alike as the noise.
//! The size was found with these slopes.

use super::coordinates::{Point, Square};
use super::film::{Fidelity, Film};
use super::linear::influence;
use super::noise::{Noise, RESIDUAL, Row, Rows};
use super::options::OFFSET_STD_PX;

/// Column of the offset's slope in rows whose other slopes do not matter.
const OFFSET: usize = 0;

/// Whitened slopes over the offsets, and whitened residuals.
fn slopes(rows: &Rows, film: &Film<'_>, noise: &Noise) -> Rows {
    let mut slopes = rows.clone();
    for axis in slopes.iter_mut().flatten().flatten() {
        axis[OFFSET] = 1.0;
    }
    noise.whiten(film.grid(Fidelity::Fine), &mut slopes, OFFSET + 1);
    slopes
}

/// By how much the cost falls where keypoints have offsets: those of an edge beside the rope's
/// look like a rope that curls.
pub(super) fn gain(rows: &Rows, film: &Film<'_>, noise: &Noise) -> f64 {
    let keypoints = film.grid(Fidelity::Fine).keypoints;
    let slopes = slopes(rows, film, noise);
    let of_keypoint = |keypoint: usize, axis: usize| {
        let mine = slopes.iter().skip(keypoint).step_by(keypoints).flatten();
        let (pull, weight) = mine.fold((0.0, 0.0), |(pull, weight), row| {
            let [offset, residual] = [row[axis][OFFSET], row[axis][RESIDUAL]];
            let counts = influence(row);
            (
                pull + counts * offset * residual,
                weight + counts * offset * offset,
            )
        });
        0.5 * pull * pull / (weight + OFFSET_STD_PX.powi(-2))
    };
    (0..keypoints)
        .map(|keypoint| of_keypoint(keypoint, 0) + of_keypoint(keypoint, 1))
        .sum()
}

/// What offsets of this deviation (px) add to the covariance of a fit that does not know of them:
/// `C J'o o'J C` of each, where `C` is the covariance without and `o` the slopes over the offset.
pub(super) fn covariance(
    (rows, fitted): (&Rows, usize),
    covariance: &Square,
    film: &Film<'_>,
    noise: &Noise,
    std_px: f64,
) -> Square {
    let grid = film.grid(Fidelity::Fine);
    let offsets = slopes(rows, film, noise);
    let mut whitened = rows.clone();
    noise.whiten(grid, &mut whitened, fitted);
    let pairs: Vec<Option<(&[Row; 2], &[Row; 2])>> = (whitened.iter().zip(&offsets))
        .map(|(row, offset)| row.as_ref().zip(offset.as_ref()))
        .collect();
    let mut sum = Square::zeros();
    for keypoint in 0..grid.keypoints {
        for axis in 0..2 {
            let mut pull = Point::zeros();
            for (row, offset) in pairs
                .iter()
                .skip(keypoint)
                .step_by(grid.keypoints)
                .flatten()
            {
                let counts = influence(row) * offset[axis][OFFSET];
                for i in 0..fitted {
                    pull[i] += counts * row[axis][i];
                }
            }
            let moved = covariance * pull * std_px;
            sum += moved * moved.transpose();
        }
    }
    sum
}
