//! Where the ropes drawn from a fit lie about: at its coordinates given a link count, within
//! what can be.

use super::clock::ClockWindow;
use super::coordinates::{
    DAMPING, FRICTION, LEAD_MASS, LEAD_RADIUS, LENGTH, LINKS, PLAIN, Point, Reach, STIFFNESS, SWAY,
};
use super::film::Film;
use super::refine::Refined;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// Coordinates drawn, in this order.
const DRAWN: [usize; 5] = [LENGTH, STIFFNESS, DAMPING, LEAD_MASS, LEAD_RADIUS];
/// Most deviations, as if the parts of the film agreed, by which the ranges pull the reported
/// rope from the fit: farther off it would not be the film's any longer.
const PULL_MAX: f64 = 3.0;

pub(super) type Vector = SVector<f64, 5>;
type Matrix = SMatrix<f64, 5, 5>;

/// The drawn coordinates of a fit given a link count.
pub(super) struct Centre {
    fitted: Vector,
    links: f64,
    /// Covariance with the link count, and the variance of that.
    with_links: Vector,
    variance: f64,
    /// What is left when the count is known, as if the parts of the film agreed.
    covariance: Matrix,
    /// What errors that last through the film add to that.
    lasting: Matrix,
    /// What can be, whatever the film and whichever the ranges.
    lower: Vector,
    upper: Vector,
}

impl Centre {
    pub(super) fn of(fit: &Refined, film: &Film<'_>) -> Self {
        let drawn = |x: &Point| Vector::from_fn(|i, _| x[DRAWN[i]]);
        let covariance = Matrix::from_fn(|i, j| fit.covariance[(DRAWN[i], DRAWN[j])]);
        let with_links = Vector::from_fn(|i, _| fit.covariance[(DRAWN[i], LINKS)]);
        let variance = fit.covariance[(LINKS, LINKS)].max(1e-9);
        // Of the coordinates without what moves along with the count.
        let slope = with_links / variance;
        let lasting = |i: usize, j: usize| {
            let of = |i: usize, j: usize| fit.lasting[(i, j)];
            let (a, b) = (DRAWN[i], DRAWN[j]);
            of(a, b) - slope[i] * of(LINKS, b) - of(a, LINKS) * slope[j]
                + slope[i] * slope[j] * of(LINKS, LINKS)
        };
        let any_clock = ClockWindow {
            offset_s: 0.0,
            half_width_s: 1.0,
        };
        let bounds = film.coordinates(any_clock, Reach::Wide);
        Self {
            fitted: drawn(&fit.x),
            links: fit.x[LINKS],
            with_links,
            variance,
            covariance: covariance - with_links * with_links.transpose() / variance,
            lasting: Matrix::from_fn(lasting),
            lower: drawn(&bounds.lower),
            upper: drawn(&bounds.upper),
        }
    }

    /// The fit's point where its drawn coordinates and link count are moved to these, the
    /// rope's extras along with them by their covariance.
    pub(super) fn with_extras(fit: &Refined, drawn: &Vector, links: f64) -> Point {
        const MOVED: [usize; 6] = [LENGTH, STIFFNESS, DAMPING, LEAD_MASS, LEAD_RADIUS, LINKS];
        let between = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                fit.covariance[(rows[i], columns[j])]
            })
        };
        let extras: Vec<usize> = (PLAIN..SWAY).collect();
        let to = |i: usize| if i < 5 { drawn[i] } else { links };
        let shift = DVector::from_fn(MOVED.len(), |i, _| to(i) - fit.x[MOVED[i]]);
        let mut x = fit.x;
        let Some(factor) = between(&MOVED, &MOVED).cholesky() else {
            return x;
        };
        let pull = between(&extras, &MOVED) * factor.solve(&shift);
        for (i, pull) in extras.into_iter().zip(pull.iter()) {
            x[i] += pull;
        }
        x[FRICTION] = x[FRICTION].max(0.0);
        x
    }

    /// Where the fit is likeliest with this link count.
    pub(super) fn given(&self, links: f64) -> Vector {
        let free = self.fitted + self.with_links * ((links - self.links) / self.variance);
        within(free, self.covariance, &self.lower, &self.upper)
    }

    /// Square root of the covariance around it, widened.
    pub(super) fn root(&self, inflation: f64) -> Matrix {
        let widened = self.covariance * inflation + self.lasting;
        widened.cholesky().map_or_else(Matrix::zeros, |c| c.l())
    }

    /// `mean`, but no farther from `centre` than a rope that fits the film may be.
    pub(super) fn near(&self, mean: Vector, centre: Vector) -> Vector {
        let pull = mean - centre;
        let factor = self.covariance.cholesky();
        let deviations = factor.map_or(0.0, |c| pull.dot(&c.solve(&pull)).sqrt());
        if deviations > PULL_MAX {
            centre + pull * (PULL_MAX / deviations)
        } else {
            mean
        }
    }
}

/// The mean if it is within the bounds; else, one after the other, the coordinate that is
/// farthest outside is put on its bound and the others follow by their covariance. What the
/// film leaves open then stays possible, and what it tells stays as it is.
fn within<const N: usize>(
    mut mean: SVector<f64, N>,
    mut covariance: SMatrix<f64, N, N>,
    lower: &SVector<f64, N>,
    upper: &SVector<f64, N>,
) -> SVector<f64, N> {
    for _ in 0..N {
        let missing = |i: usize| mean[i].clamp(lower[i], upper[i]) - mean[i];
        let outside = (0..N).filter(|i| missing(*i) != 0.0 && covariance[(*i, *i)] > 0.0);
        let deviations = |i: usize| missing(i).abs() / covariance[(i, i)].sqrt();
        let Some(i) = outside.max_by(|a, b| deviations(*a).total_cmp(&deviations(*b))) else {
            break;
        };
        let slope = covariance.column(i) / covariance[(i, i)];
        mean += slope * missing(i);
        covariance -= slope * covariance.row(i).into_owned();
        // Exactly, so that it is not moved again.
        covariance.column_mut(i).fill(0.0);
        covariance.row_mut(i).fill(0.0);
    }
    SVector::from_fn(|i, _| mean[i].clamp(lower[i], upper[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2};

    #[test]
    fn what_is_put_on_its_bound_takes_the_others_along() {
        let covariance = Matrix2::new(4.0, 1.0, 1.0, 1.0);
        let (lower, upper) = (Vector2::zeros(), Vector2::repeat(10.0));
        let inside = Vector2::new(3.0, 0.1);
        assert_eq!(within(inside, covariance, &lower, &upper), inside);
        let moved = within(Vector2::new(-2.0, 3.0), covariance, &lower, &upper);
        assert_eq!(moved, Vector2::new(0.0, 3.5));
        // The first takes the second out of the box.
        let both = within(Vector2::new(-8.0, 9.5), covariance, &lower, &upper);
        assert_eq!(both, Vector2::new(0.0, 10.0));
        let known = within(Vector2::new(-2.0, 3.0), Matrix2::zeros(), &lower, &upper);
        assert_eq!(known, Vector2::new(0.0, 3.0));
    }
}
