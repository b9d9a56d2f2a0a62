//! Highest place of the lead, in continuous time.

use super::cubic::{Cubic, TipStep};
use crate::lanes::Lanes;

/// Lowest and highest z within a step: its ends and the apex of the parabola through
/// the end with the step's mean acceleration.
#[inline(always)]
pub(super) fn span<V: Lanes>(tip: &TipStep<V>) -> (V, V) {
    let ([x0, v0], [x1, v1]) = (tip.before, tip.after);
    // Time since the apex; without acceleration the quotient is infinite or not a
    // number, and either ends up at an end of the step.
    let back = v1.2 * tip.h * (v1.2 - v0.2).recip();
    let back = back.max(V::splat(0.0)).min(tip.h);
    let apex = (v1.2 * V::splat(0.5)).fnma(back, x1.2);
    (apex.min(x0.2).min(x1.2), apex.max(x0.2).max(x1.2))
}

/// Largest z within a step.
pub(super) fn highest(cubic: &Cubic) -> f64 {
    let [z0, v0, z1, v1] = cubic.states.map(|s| s[2]);
    let (w0, w1) = (v0 * cubic.h_s, v1 * cubic.h_s);
    // Rate per fraction: a u² + b u + w0.
    let a = 3.0 * (w0 + w1) - 6.0 * (z1 - z0);
    let b = 6.0 * (z1 - z0) - 4.0 * w0 - 2.0 * w1;
    let root = (b * b - 4.0 * a * w0).max(0.0).sqrt();
    let q = -0.5 * (b + root.copysign(b));
    [0.0, 1.0, q / a, w0 / q]
        .into_iter()
        .filter(|u| (0.0..=1.0).contains(u))
        .map(|u| cubic.at(u)[2])
        .max_by(f64::total_cmp)
        .unwrap_or(z0)
}

#[cfg(test)]
mod tests {
    use super::super::cubic::{BestStep, steps_along};
    use super::*;
    use crate::algebra::Vec3;

    /// The step of least negative height, as the watcher keeps it, holds the highest place.
    fn highest_m(state: impl Fn(f64) -> [Vec3<f64>; 2], h_s: f64, count: u32) -> f64 {
        let mut best = BestStep::new(state(0.0));
        for (i, tip) in (1_u32..).zip(steps_along(state, h_s, count)) {
            best.offer(-span(&tip).1, f64::from(i), &tip);
        }
        highest(&best.cubic(0, |step| (step as f64 * h_s, h_s)).0)
    }

    /// Thrown up at 3 m/s from 1 m, long enough to fall below the start.
    #[test]
    fn a_throw_peaks_where_the_formula_says() {
        let g = 9.81;
        let thrown = |t: f64| {
            [
                Vec3(0.0, 0.0, 1.0 + t * (3.0 - 0.5 * g * t)),
                Vec3(0.0, 0.0, 3.0 - g * t),
            ]
        };
        let highest_m = highest_m(thrown, 7e-3, 100);
        assert!((highest_m - (1.0 + 4.5 / g)).abs() < 1e-12, "{highest_m}");
    }

    #[test]
    fn a_lead_that_stands_still_has_one_height() {
        let still = |_: f64| [Vec3(0.0, 0.0, 0.25), Vec3(0.0, 0.0, 0.0)];
        assert_eq!(highest_m(still, 1e-3, 1), 0.25);
        for tip in steps_along(still, 1e-3, 1) {
            assert_eq!(span(&tip), (0.25, 0.25));
        }
    }
}
