//! Whether a rope is one of those the ranges know.
//!
//! Two things speak against it: no rope of the ranges has the fitted ratios, length or
//! lead; and the best fit leaves more over than a tracker's noise would.

use super::coordinates::{
    DAMPING, LEAD_MASS, LEAD_RADIUS, LENGTH, LINKS, Point, STIFFNESS, parameter,
};
use super::refine::Refined;
use super::reliance::INFLATION_MAX;
use shared_types::rope::{OutOfDistribution, RANGES};

/// Score from which a rope counts as outside.
const LIMIT: f64 = 4.0;
/// Errors of the model itself, added to those of the fit: length and radius (m), and
/// logarithms of ratios.
const TOLERANCE_M: f64 = 1e-3;
const TOLERANCE_LN: f64 = 0.02;
/// Most noise of a tracker that follows a rope (px), in each axis, and the part of it
/// that counts as one deviation.
const NOISE_MAX_PX: f64 = 4.0;
const NOISE_SPREAD: f64 = 0.1;

/// An edge of the ranges.
struct Edge {
    /// How far the fit is outside; negative inside.
    value: f64,
    /// Its slope over the coordinates.
    slope: Point,
    tolerance: f64,
    what: String,
}

/// Scores a fit.
pub(super) fn out_of_distribution(fit: &Refined) -> OutOfDistribution {
    let mut worst = f64::NEG_INFINITY;
    let mut reasons = Vec::new();
    for edge in edges(&fit.x) {
        // That a film contradicts itself is no evidence that its rope is in the ranges.
        let inflation = fit.inflation.min(INFLATION_MAX);
        let variance = (fit.covariance * edge.slope).dot(&edge.slope).max(0.0) * inflation;
        let score = edge.value / variance.sqrt().hypot(edge.tolerance);
        worst = worst.max(score);
        if score >= LIMIT {
            reasons.push(edge.what);
        }
    }
    let sizes = fit.noise.axes.iter().map(|a| a.sigma_px);
    let noise_px = sizes.fold(0.0, f64::max);
    let score = (noise_px / NOISE_MAX_PX - 1.0) / NOISE_SPREAD;
    if score >= LIMIT {
        reasons.push(format!(
            "the best rope misses the keypoints by {noise_px:.1} px"
        ));
    }
    OutOfDistribution {
        score: worst.max(score),
        limit: LIMIT,
        reasons,
    }
}

fn edges(x: &Point) -> impl Iterator<Item = Edge> {
    edges_in_m(x).into_iter().chain(edges_of_ratios(x))
}

/// Edges of lengths.
fn edges_in_m(x: &Point) -> Vec<Edge> {
    let mut out = Vec::new();
    for (coordinate, i) in [
        (LENGTH, parameter::LENGTH),
        (LEAD_RADIUS, parameter::LEAD_RADIUS),
    ] {
        let range = RANGES[i];
        for (sign, end, side) in [(-1.0, range.min, "below"), (1.0, range.max, "above")] {
            let mut slope = Point::zeros();
            slope[coordinate] = sign;
            out.push(Edge {
                value: sign * (x[coordinate] - end),
                slope,
                tolerance: TOLERANCE_M,
                what: format!("{} is {side} {end} m", range.label),
            });
        }
    }
    out
}

/// `ln` of a parameter over the mass per length, and its slope.
fn log_ratio(x: &Point, i: usize) -> (f64, Point) {
    let mut slope = Point::zeros();
    let coordinate = match i {
        parameter::STIFFNESS => STIFFNESS,
        parameter::DAMPING => DAMPING,
        parameter::LEAD_MASS => LEAD_MASS,
        _ => return (0.0, slope),
    };
    slope[coordinate] = 1.0;
    let mut value = x[coordinate];
    if coordinate != LEAD_MASS {
        // The coordinate is that of `k s`, and `s = L / N`.
        value += (x[LINKS] / x[LENGTH]).ln();
        slope[LINKS] += 1.0 / x[LINKS];
        slope[LENGTH] -= 1.0 / x[LENGTH];
    }
    (value, slope)
}

/// Edges of ratios: `a / b` is at most the largest `a` over the smallest `b`.
fn edges_of_ratios(x: &Point) -> Vec<Edge> {
    let four = [
        parameter::STIFFNESS,
        parameter::DAMPING,
        parameter::LEAD_MASS,
        parameter::MASS_PER_LENGTH,
    ];
    let pairs = four.iter().flat_map(|a| four.iter().map(move |b| (*a, *b)));
    pairs
        .filter(|(a, b)| a != b)
        .map(|(a, b)| {
            let ((ln_a, slope_a), (ln_b, slope_b)) = (log_ratio(x, a), log_ratio(x, b));
            let most = RANGES[a].max / RANGES[b].min;
            Edge {
                value: ln_a - ln_b - most.ln(),
                slope: slope_a - slope_b,
                tolerance: TOLERANCE_LN,
                what: format!(
                    "{} over {} is above {most:.3}",
                    RANGES[a].label, RANGES[b].label
                ),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::coordinates::point_of;
    use super::*;
    use crate::ropes::{outside_rope, random_rope};

    fn worst(x: &Point) -> f64 {
        edges(x).map(|e| e.value).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn ropes_of_the_ranges_break_no_edge_and_ropes_outside_do() {
        for seed in 0..500 {
            assert!(worst(&point_of(&random_rope(seed))) <= 1e-9);
        }
        for index in 0..64 {
            assert!(worst(&point_of(&outside_rope(3, index))) > 0.03, "{index}");
        }
    }

    #[test]
    fn slopes_of_edges_are_those_of_their_values() {
        let x = point_of(&random_rope(4));
        for (i, edge) in edges_of_ratios(&x).into_iter().enumerate() {
            for coordinate in [LENGTH, STIFFNESS, DAMPING, LEAD_MASS, LINKS] {
                let mut moved = x;
                moved[coordinate] += 1e-6;
                let slope = (edges_of_ratios(&moved)[i].value - edge.value) / 1e-6;
                assert!((slope - edge.slope[coordinate]).abs() < 1e-4);
            }
        }
    }
}
