//! Gauss-Newton polish of the fit and its uncertainty.
//!
//! Iteratively reweighted least squares with a weak Gaussian prior per
//! coordinate, finite differences from one batch of simulations in double
//! precision.

use super::coordinates::{CLOCK, COORDINATES as FREE, Coordinates};
use super::observe::{Film, INVISIBLE_PX, Swing};
use super::{Found, IdentifyError};
use nalgebra::{SMatrix, SVector};
use shared_types::RopeEstimate;

/// Steps of the finite differences: length (m), three logarithms, lead radius
/// (m), clock (s).
const STEPS: [f64; FREE] = [2e-4, 5e-3, 5e-3, 5e-3, 5e-4, 5e-4];
/// Most iterations.
const ITERATIONS: usize = 8;
/// Most iterations for each other link count.
const ITERATIONS_PER_COUNT: usize = 1;
/// A coordinate whose deviation keeps more than this part of the prior's was
/// not seen.
const UNSEEN_PART: f64 = 0.7;

type Point = [f64; FREE];
type Normal = SMatrix<f64, FREE, FREE>;
type Gradient = SVector<f64, FREE>;

/// Normal equations at a point.
struct Linearised {
    normal: Normal,
    gradient: Gradient,
    /// Robust cost: half the weighted sum of Huber losses (px²).
    cost: f64,
    /// Weighted mean of the squared distances (px²).
    mean_square: f64,
}

/// Refines the point of a search, chooses the link count, and measures how
/// well each coordinate is known.
pub(super) fn polish(
    film: &Film<'_>,
    coordinates: &Coordinates,
    seed: u64,
    found: &Found,
) -> Result<RopeEstimate, IdentifyError> {
    let mut descent = Descent {
        film,
        prior_std: SVector::from_fn(|i, _| {
            (coordinates.upper[i] - coordinates.lower[i]) / 12.0_f64.sqrt()
        }),
        simulations: found.simulations,
    };
    let (x, _) = descent.run(coordinates, &found.x, ITERATIONS)?;
    let mut best: Option<(Coordinates, Point, Linearised)> = None;
    for links in Coordinates::link_counts() {
        let with_links = coordinates.with_links(links);
        let (x, at) = descent.run(&with_links, &x, ITERATIONS_PER_COUNT)?;
        if best.as_ref().is_none_or(|(_, _, b)| at.cost < b.cost) {
            best = Some((with_links, x, at));
        }
    }
    let Some((coordinates, x, at)) = best.filter(|(_, _, at)| at.mean_square < INVISIBLE_PX) else {
        return Err(IdentifyError::NothingVisible);
    };
    Ok(RopeEstimate {
        params: coordinates.rope(&x),
        std_dev: coordinates.rope_std_dev(&x, &descent.std_dev(&at)),
        residual_px: at.mean_square.sqrt(),
        method: "cmaes".try_into().unwrap_or_default(),
        simulations: u32::try_from(descent.simulations).unwrap_or(u32::MAX),
        seed,
        time_offset_s: x[CLOCK],
    })
}

/// A damped Gauss-Newton descent.
struct Descent<'a> {
    film: &'a Film<'a>,
    /// Deviations of the prior.
    prior_std: Gradient,
    simulations: usize,
}

impl Descent<'_> {
    fn prior(&self) -> Normal {
        Normal::from_diagonal(&self.prior_std.map(|s| 1.0 / (s * s)))
    }

    fn evaluate(&mut self, c: &Coordinates, x: &Point) -> Result<Linearised, IdentifyError> {
        self.simulations += 2 * FREE + 1;
        linearise(self.film, c, x)
    }

    fn run(
        &mut self,
        c: &Coordinates,
        start: &Point,
        iterations: usize,
    ) -> Result<(Point, Linearised), IdentifyError> {
        let mut x = *start;
        let mut at = self.evaluate(c, &x)?;
        let mut damping = 1e-4;
        for _ in 0..iterations {
            let information = information_per_px2(self.film, &at);
            let from_prior: Gradient =
                SVector::from_fn(|i, _| (x[i] - c.middle[i]) / self.prior_std[i].powi(2));
            let normal = at.normal * information + self.prior();
            let gradient = at.gradient * information + from_prior;
            let damped = normal + Normal::from_diagonal(&(normal.diagonal() * damping));
            let Some(step) = damped.cholesky().map(|f| f.solve(&gradient)) else {
                break;
            };
            let tried = core::array::from_fn(|i| (x[i] - step[i]).clamp(c.lower[i], c.upper[i]));
            let there = self.evaluate(c, &tried)?;
            if there.cost < at.cost {
                let settled = at.cost - there.cost < 1e-4 * at.cost;
                (x, at) = (tried, there);
                damping = (damping / 10.0_f64).max(1e-9);
                if settled {
                    break;
                }
            } else {
                damping = damping.max(1e-5) * 30.0;
                if damping > 1e3 {
                    break;
                }
            }
        }
        Ok((x, at))
    }

    /// Deviation of each coordinate; `None` where the film added little to the
    /// prior.
    fn std_dev(&self, at: &Linearised) -> [Option<f64>; FREE] {
        let normal = at.normal * information_per_px2(self.film, at) + self.prior();
        let covariance = normal.try_inverse().unwrap_or_else(Normal::zeros);
        core::array::from_fn(|i| {
            let deviation = covariance[(i, i)].max(0.0).sqrt();
            (deviation > 0.0 && deviation < UNSEEN_PART * self.prior_std[i]).then_some(deviation)
        })
    }
}

/// Inverse variance of one squared pixel of cost. Keypoints of one frame come
/// from one curve and err together, so a frame counts as one measurement.
#[allow(clippy::cast_precision_loss, reason = "counts are small")]
fn information_per_px2(film: &Film<'_>, at: &Linearised) -> f64 {
    let together = film.all.len() as f64 / film.frames.max(1) as f64;
    // Half of the squared distance per image axis; never better than 0.05 px.
    let variance = (at.mean_square / 2.0).max(2.5e-3);
    1.0 / (variance * together.max(1.0))
}

fn linearise(
    film: &Film<'_>,
    coordinates: &Coordinates,
    x: &Point,
) -> Result<Linearised, IdentifyError> {
    let mut points = vec![*x];
    let mut spans = [0.0; FREE];
    for i in 0..FREE {
        let mut span = 0.0;
        for sign in [1.0, -1.0] {
            let mut p = *x;
            p[i] = (x[i] + sign * STEPS[i]).clamp(coordinates.lower[i], coordinates.upper[i]);
            span += sign * p[i];
            points.push(p);
        }
        spans[i] = span;
    }
    let ropes: Vec<_> = points.iter().map(|p| coordinates.rope(p)).collect();
    let swings = film.simulate(&ropes)?;
    Ok(accumulate(film, &points, &swings, &spans))
}

fn accumulate(
    film: &Film<'_>,
    points: &[Point],
    swings: &[Swing],
    spans: &[f64; FREE],
) -> Linearised {
    let mut out = Linearised {
        normal: Normal::zeros(),
        gradient: Gradient::zeros(),
        cost: f64::INFINITY,
        mean_square: INVISIBLE_PX,
    };
    let clocks: Vec<f64> = points.iter().map(|p| p[CLOCK]).collect();
    let Some(residuals) = film.residuals_px(swings, &clocks) else {
        return out;
    };
    let (mut cost, mut squares, mut weights) = (0.0, 0.0, 0.0);
    for (index, sighting) in film.all.iter().enumerate() {
        let residual: [[f64; 2]; 2 * FREE + 1] = core::array::from_fn(|i| residuals[i][index]);
        let distance = residual[0][0].hypot(residual[0][1]);
        let influence = film.influence(distance);
        let weight = sighting.weight * influence;
        for axis in 0..2 {
            let slope: Gradient = SVector::from_fn(|i, _| {
                (residual[2 * i + 1][axis] - residual[2 * i + 2][axis]) / spans[i]
            });
            out.normal.ger(weight, &slope, &slope, 1.0);
            out.gradient += slope * (weight * residual[0][axis]);
        }
        // Huber's loss is d² (2 - w) w with w the influence.
        cost += sighting.weight * distance * distance * influence * (2.0 - influence);
        squares += sighting.weight * distance * distance;
        weights += sighting.weight;
    }
    out.cost = cost;
    out.mean_square = squares / f64::max(weights, 1e-9);
    out
}
