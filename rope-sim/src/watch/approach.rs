//! Closest approach of the lead to a point or a segment, in continuous time.
//!
//! At 15 m/s the lead moves 7 mm within a step of 0.5 ms, so looking at step ends is
//! not enough. Every step is rated by a straight line in place of its path; the best
//! step's states are kept and refined afterwards on their cubic Hermite.

use super::cubic::{BestStep, TipStep};
use crate::algebra::Vec3;
use crate::lanes::Lanes;

/// Keeps divisions by squared lengths finite (m²).
const TINY_M2: f64 = 1e-20;

/// Closest approach of the lead's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestApproach {
    /// Distance (m).
    pub distance_m: f64,
    /// When (s).
    pub time_s: f64,
    /// Lead's centre at that time (m, world).
    pub tip_m: [f64; 3],
    /// Velocity of the lead at that time (m/s, world): how it arrives.
    pub velocity_m_s: [f64; 3],
}

/// What the lead comes near to, relative to the clock's origin (m).
#[derive(Clone, Copy)]
pub(super) enum Target<V> {
    /// In each lane its own.
    Point(Vec3<V>),
    /// Between two ends.
    Segment([[f64; 3]; 2]),
}

impl<V: Lanes> Target<V> {
    /// Rating of a step by a straight line in place of its path: squared distance (m²).
    #[inline(always)]
    fn rate(&self, tip: &TipStep<V>) -> V {
        match *self {
            Self::Point(point) => {
                let zero = V::splat(0.0);
                let [x, v] = [tip.after[0].sub(point), tip.after[1]];
                let back = x.dot(v) * (v.dot(v) + V::splat(1e-12)).recip();
                let nearest = v.scale_sub(back.max(zero).min(tip.h), x);
                nearest.dot(nearest)
            }
            Self::Segment([a, b]) => {
                let ends = [Vec3::splat(a[0], a[1], a[2]), Vec3::splat(b[0], b[1], b[2])];
                squared_distance([tip.before[0], tip.after[0]], ends)
            }
        }
    }

    /// Its point nearest to `x` in one lane.
    fn foot(&self, lane: usize, x: [f64; 3]) -> [f64; 3] {
        match *self {
            Self::Point(point) => point.get(lane),
            Self::Segment(ends) => nearest_on(ends, x),
        }
    }
}

/// Watches the distance to a point or a segment.
pub(super) struct ApproachRecorder<V> {
    target: Target<V>,
    best: BestStep<V>,
}

impl<V: Lanes> ApproachRecorder<V> {
    #[inline(always)]
    pub(super) fn new(target: Target<V>, tip: [Vec3<V>; 2]) -> Self {
        Self {
            target,
            best: BestStep::new(tip),
        }
    }

    /// Takes in step number `count`.
    #[inline(always)]
    pub(super) fn after_step(&mut self, count: f64, tip: &TipStep<V>) {
        self.best.offer(self.target.rate(tip), count, tip);
    }

    /// Refined approach of one lane; `origin_m` is the clock's origin.
    #[inline(always)]
    pub(super) fn closest(
        &self,
        lane: usize,
        origin_m: [f64; 3],
        time_of_step: impl Fn(usize) -> (f64, f64),
    ) -> ClosestApproach {
        let (cubic, start_s) = self.best.cubic(lane, time_of_step);
        let u = cubic.nearest(|x| self.target.foot(lane, x));
        let tip = cubic.at(u);
        let foot = self.target.foot(lane, tip);
        let squared: f64 = (0..3).map(|i| (tip[i] - foot[i]).powi(2)).sum();
        ClosestApproach {
            distance_m: squared.sqrt(),
            time_s: start_s + cubic.h_s * u,
            tip_m: core::array::from_fn(|i| tip[i] + origin_m[i]),
            velocity_m_s: cubic.velocity(u),
        }
    }
}

/// Point of a segment nearest to `x`.
fn nearest_on([a, b]: [[f64; 3]; 2], x: [f64; 3]) -> [f64; 3] {
    let (mut dot, mut squared) = (0.0, TINY_M2);
    for i in 0..3 {
        dot += (x[i] - a[i]) * (b[i] - a[i]);
        squared += (b[i] - a[i]).powi(2);
    }
    let along = (dot / squared).clamp(0.0, 1.0);
    core::array::from_fn(|i| a[i] + along * (b[i] - a[i]))
}

/// Squared distance of two segments (m²): the closest points of the lines, each in
/// turn brought back into its segment.
#[inline(always)]
fn squared_distance<V: Lanes>(p: [Vec3<V>; 2], q: [Vec3<V>; 2]) -> V {
    let (zero, one, tiny) = (V::splat(0.0), V::splat(1.0), V::splat(TINY_M2));
    let unit = |x: V| x.max(zero).min(one);
    let (d, e, r) = (p[1].sub(p[0]), q[1].sub(q[0]), p[0].sub(q[0]));
    let (dd, ee, de) = (d.dot(d) + tiny, e.dot(e) + tiny, d.dot(e));
    let (dr, er) = (d.dot(r), e.dot(r));
    let determinant = dd.fma(ee, -(de * de)).max(tiny * tiny);
    let mut s = unit(de.fma(er, -(dr * ee)) * determinant.recip());
    let (per_dd, per_ee) = (dd.recip(), ee.recip());
    let mut t = unit(de.fma(s, er) * per_ee);
    s = unit(de.fma(t, -dr) * per_dd);
    t = unit(de.fma(s, er) * per_ee);
    let gap = e.scale_sub(t, d.scale_add(s, r));
    gap.dot(gap)
}

#[cfg(test)]
mod tests {
    use super::super::cubic::steps_along;
    use super::*;

    /// Closest approach of a path with its velocity, in `steps` steps of `h`.
    fn closest(
        target: Target<f64>,
        state: impl Fn(f64) -> [Vec3<f64>; 2],
        h: f64,
        steps: u32,
    ) -> ClosestApproach {
        let mut recorder = ApproachRecorder::new(target, state(0.0));
        for (i, tip) in (1_u32..).zip(steps_along(state, h, steps)) {
            recorder.after_step(f64::from(i), &tip);
        }
        recorder.closest(0, [1.0, 0.0, 0.0], |step| (step as f64 * h, h))
    }

    #[test]
    fn passing_between_two_steps_is_seen() {
        // Along x at 10 m/s, 3 mm beside the target, passing it at t = 0.0127.
        let state = |t: f64| [Vec3(10.0 * (t - 0.0127), 0.003, 0.0), Vec3(10.0, 0.0, 0.0)];
        let closest = closest(Target::Point(Vec3::zero()), state, 1e-3, 30);
        assert!((closest.distance_m - 0.003).abs() < 1e-12);
        assert!((closest.time_s - 0.0127).abs() < 1e-12);
        assert!((closest.tip_m[0] - 1.0).abs() < 1e-10);
        assert!((closest.velocity_m_s[0] - 10.0).abs() < 1e-9);
    }

    #[test]
    fn curved_paths_are_refined_on_the_curve() {
        // A circle of radius 0.1 m about (0, 0.1): closest to the origin at the bottom.
        let turn = 40.0;
        let state = |t: f64| {
            let (s, c) = (turn * (t - 0.0213)).sin_cos();
            [
                Vec3(0.1 * s, 0.102 - 0.1 * c, 0.0),
                Vec3(0.1 * turn * c, 0.1 * turn * s, 0.0),
            ]
        };
        let closest = closest(Target::Point(Vec3::zero()), state, 2e-3, 25);
        assert!((closest.distance_m - 0.002).abs() < 1e-7, "{closest:?}");
        assert!((closest.time_s - 0.0213).abs() < 1e-6, "{closest:?}");
        assert!((closest.velocity_m_s[0] - 4.0).abs() < 1e-3, "{closest:?}");
    }

    #[test]
    fn a_path_above_a_segment_is_nearest_where_the_lines_cross() {
        // Crossing a segment along y at 7 m/s, 4 mm above, at (0.3, 0.12).
        let state = |t: f64| {
            let s = t - 0.0204;
            [Vec3(0.3 + 7.0 * s, 0.12 + s, 0.504), Vec3(7.0, 1.0, 0.0)]
        };
        let ends = [[0.3, 0.1, 0.5], [0.3, 0.2, 0.5]];
        let found = closest(Target::Segment(ends), state, 1e-3, 40);
        assert!((found.distance_m - 0.004).abs() < 1e-12);
        assert!((found.time_s - 0.0204).abs() < 1e-12);
        assert!((found.tip_m[1] - 0.12).abs() < 1e-9);
    }

    #[test]
    fn distances_of_segments_agree_with_a_fine_search() {
        let point = |i: u32| {
            let x = |k: u32| (f64::from(i * 7 + k) * 12.9898).sin();
            Vec3(x(1), x(2), x(3))
        };
        for i in 0..200 {
            let (p, q) = (
                [point(4 * i), point(4 * i + 1)],
                [point(4 * i + 2), point(4 * i + 3)],
            );
            let mut best = f64::INFINITY;
            for s in 0..=1000 {
                let x = p[1].sub(p[0]).scale_add(f64::from(s) / 1000.0, p[0]);
                let foot = nearest_on(q.map(|e| e.get(0)), x.get(0));
                let gap = x.sub(Vec3(foot[0], foot[1], foot[2]));
                best = best.min(gap.dot(gap));
            }
            let got = squared_distance(p, q);
            assert!((got.sqrt() - best.sqrt()).abs() < 2e-3, "{i}: {got} {best}");
        }
        // Equal and parallel segments, and one of no length.
        let (a, b, up) = (
            Vec3(0.0, 0.0, 0.0),
            Vec3(1.0, 0.0, 0.0),
            Vec3(0.0, 0.0, 2.0),
        );
        assert_eq!(squared_distance([a, b], [a, b]), 0.0);
        assert_eq!(squared_distance([a, b], [a.add(up), b.add(up)]), 4.0);
        assert_eq!(squared_distance([a, b], [up, up]), 4.0);
    }
}
