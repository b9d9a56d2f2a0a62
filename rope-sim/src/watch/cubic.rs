//! The lead's path within one step: a cubic through position and velocity at both ends.

use crate::algebra::Vec3;
use crate::frames::hermite;
use crate::lanes::Lanes;

/// Pieces into which a step is cut before a minimum is narrowed down.
const PIECES: u32 = 8;
/// Halvings after which a bracket is as narrow as double precision allows.
const HALVINGS: usize = 50;

/// States of the lead at both ends of a step, one rope per lane; positions relative to
/// the clock's origin.
#[derive(Clone, Copy)]
pub(super) struct TipStep<V> {
    /// Position (m) and velocity (m/s) at the start.
    pub(super) before: [Vec3<V>; 2],
    /// The same at the end.
    pub(super) after: [Vec3<V>; 2],
    /// Length of the step (s).
    pub(super) h: V,
    /// Positive in lanes that take part.
    pub(super) running: V,
}

impl<V: Lanes> TipStep<V> {
    /// The path of one lane within a step of `h_s`.
    #[inline(always)]
    pub(super) fn cubic(&self, lane: usize, h_s: f64) -> Cubic {
        let [x0, v0] = self.before.map(|s| s.get(lane));
        let [x1, v1] = self.after.map(|s| s.get(lane));
        Cubic {
            states: [x0, v0, x1, v1],
            h_s,
        }
    }

    /// Corners of the polygon whose hull holds the whole path (Bézier points).
    #[inline(always)]
    pub(super) fn hull(&self) -> [Vec3<V>; 4] {
        let third = self.h * V::splat(1.0 / 3.0);
        let ([x0, v0], [x1, v1]) = (self.before, self.after);
        [x0, v0.scale_add(third, x0), v1.scale_sub(third, x1), x1]
    }
}

/// One lane's path within a step, in double precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cubic {
    /// Position (m) and velocity (m/s) at the start, then at the end.
    pub(super) states: [[f64; 3]; 4],
    /// Length of the step (s).
    pub(super) h_s: f64,
}

impl Cubic {
    /// Position at the fraction `u` of the step (m).
    pub(super) fn at(&self, u: f64) -> [f64; 3] {
        self.weighed(hermite(u, self.h_s))
    }

    /// Velocity at the fraction `u` of the step (m/s).
    pub(super) fn velocity(&self, u: f64) -> [f64; 3] {
        let rise = 6.0 * (u - u * u) / self.h_s;
        let weights = [-rise, 1.0 + u * (3.0 * u - 4.0), rise, u * (3.0 * u - 2.0)];
        self.weighed(weights)
    }

    fn weighed(&self, weights: [f64; 4]) -> [f64; 3] {
        core::array::from_fn(|axis| (0..4).map(|i| weights[i] * self.states[i][axis]).sum())
    }

    /// Fraction of the step at which the path is nearest to a shape; `foot` gives the
    /// shape's point nearest to a position.
    ///
    /// The rate of the squared distance, twice `(x - foot) . v`, crosses zero steeply
    /// where the distance itself is flat, so its root is good to rounding.
    pub(super) fn nearest(&self, foot: impl Fn([f64; 3]) -> [f64; 3]) -> f64 {
        let gap = |u: f64| {
            let x = self.at(u);
            let foot = foot(x);
            [x[0] - foot[0], x[1] - foot[1], x[2] - foot[2]]
        };
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let piece = 1.0 / f64::from(PIECES);
        let nearest_end = (0..=PIECES)
            .map(|i| f64::from(i) * piece)
            .min_by(|a, b| dot(gap(*a), gap(*a)).total_cmp(&dot(gap(*b), gap(*b))))
            .unwrap_or(0.0);
        let mut low = (nearest_end - piece).max(0.0);
        let mut high = (nearest_end + piece).min(1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if dot(gap(middle), self.velocity(middle)) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// The step of every lane that a rating calls best, with its states.
pub(super) struct BestStep<V> {
    rating: V,
    step: V,
    states: [Vec3<V>; 4],
}

impl<V: Lanes> BestStep<V> {
    /// No step yet; the lead stands at `tip` (position, velocity).
    #[inline(always)]
    pub(super) fn new(tip: [Vec3<V>; 2]) -> Self {
        Self {
            rating: V::splat(f64::from(f32::MAX)),
            step: V::splat(1.0),
            states: [tip[0], tip[1], tip[0], tip[1]],
        }
    }

    /// Keeps step number `count` (from 1) in lanes where it rates lower than all before.
    #[inline(always)]
    pub(super) fn offer(&mut self, rating: V, count: f64, tip: &TipStep<V>) {
        let rating = V::select_less(V::splat(0.0), tip.running, rating, self.rating);
        let new = [tip.before[0], tip.before[1], tip.after[0], tip.after[1]];
        for (kept, state) in self.states.iter_mut().zip(new) {
            *kept = Vec3::select_less(rating, self.rating, state, *kept);
        }
        self.step = V::select_less(rating, self.rating, V::splat(count), self.step);
        self.rating = V::select_less(rating, self.rating, rating, self.rating);
    }

    /// Path within one lane's best step and the time at which that step starts (s);
    /// `time_of_step` gives end and length of a step counted from 1 (s).
    #[inline(always)]
    pub(super) fn cubic(
        &self,
        lane: usize,
        time_of_step: impl Fn(usize) -> (f64, f64),
    ) -> (Cubic, f64) {
        let (end_s, h_s) = time_of_step(self.step.get(lane) as usize);
        let states = self.states.map(|s| s.get(lane));
        (Cubic { states, h_s }, end_s - h_s)
    }
}

/// The steps of a lead with this position and velocity over time.
#[cfg(test)]
pub(super) fn steps_along(
    state: impl Fn(f64) -> [Vec3<f64>; 2],
    h_s: f64,
    count: u32,
) -> impl Iterator<Item = TipStep<f64>> {
    (0..count).map(move |i| TipStep {
        before: state(f64::from(i) * h_s),
        after: state(f64::from(i + 1) * h_s),
        h: h_s,
        running: 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_is_the_slope_of_the_path() {
        let cubic = Cubic {
            states: [
                [0.0, 1.0, 2.0],
                [3.0, -1.0, 0.5],
                [0.2, 0.9, 2.2],
                [1.0, 2.0, -4.0],
            ],
            h_s: 0.1,
        };
        for u in [0.1, 0.35, 0.8] {
            let (a, b, v) = (cubic.at(u - 1e-5), cubic.at(u + 1e-5), cubic.velocity(u));
            for axis in 0..3 {
                let slope = (b[axis] - a[axis]) / (2e-5 * cubic.h_s);
                assert!(
                    (slope - v[axis]).abs() < 1e-6,
                    "{slope} against {}",
                    v[axis]
                );
            }
        }
        assert_eq!(cubic.velocity(0.0), cubic.states[1]);
    }

    #[test]
    fn the_hull_holds_the_path() {
        let v = |x: f64| Vec3(x, 0.0, 0.0);
        let step = TipStep {
            before: [v(0.0), v(30.0)],
            after: [v(0.0), v(-30.0)],
            h: 0.1,
            running: 1.0,
        };
        let hull = step.hull().map(|p| p.0);
        assert_eq!(hull, [0.0, 1.0, 1.0, 0.0]);
        // The apex of the parabola with these slopes.
        assert!((step.cubic(0, 0.1).at(0.5)[0] - 0.75).abs() < 1e-12);
    }
}
