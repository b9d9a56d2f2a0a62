//! Closest approach of the lead to a point or a segment, in continuous time.
//!
//! At 15 m/s the lead moves 7 mm within a step of 0.5 ms, so looking at step ends is
//! not enough. Every step is rated by a straight line in place of its path; the best
//! step's states are kept and refined afterwards on their cubic Hermite.

use super::cubic::{BestStep, Cubic, TipStep};
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

/// Closest approach of the lead's centre to a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentApproach {
    /// Distance, time and state of the lead.
    pub approach: ClosestApproach,
    /// Place of the nearest point on the segment: 0 its first end, 1 its second.
    pub along: f64,
}

/// Rating of a step by its distance from a point: squared distance of the straight
/// line through its end (m²).
#[inline(always)]
fn rate_point<V: Lanes>(point: Vec3<V>, tip: &TipStep<V>) -> V {
    let zero = V::splat(0.0);
    let [x, v] = [tip.after[0].sub(point), tip.after[1]];
    let back = x.dot(v) * (v.dot(v) + V::splat(1e-12)).recip();
    let nearest = v.scale_sub(back.max(zero).min(tip.h), x);
    nearest.dot(nearest)
}

/// Watches the distance to a point.
pub(super) struct PointRecorder<V> {
    /// Relative to the clock's origin (m).
    point: [f64; 3],
    best: BestStep<V>,
}

impl<V: Lanes> PointRecorder<V> {
    #[inline(always)]
    pub(super) fn new(point: [f64; 3], tip: [Vec3<V>; 2]) -> Self {
        Self {
            point,
            best: BestStep::new(tip),
        }
    }

    /// Takes in step number `count`.
    #[inline(always)]
    pub(super) fn after_step(&mut self, count: f64, tip: &TipStep<V>) {
        let [x, y, z] = self.point;
        self.best
            .offer(rate_point(Vec3::splat(x, y, z), tip), count, tip);
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
        approach_to(&cubic, start_s, origin_m, |_| self.point)
    }
}

/// Watches the distance to a segment.
pub(super) struct SegmentRecorder<V> {
    /// Ends relative to the clock's origin (m).
    ends: [[f64; 3]; 2],
    best: BestStep<V>,
}

impl<V: Lanes> SegmentRecorder<V> {
    #[inline(always)]
    pub(super) fn new(ends: [[f64; 3]; 2], tip: [Vec3<V>; 2]) -> Self {
        Self {
            ends,
            best: BestStep::new(tip),
        }
    }

    /// Takes in step number `count`.
    #[inline(always)]
    pub(super) fn after_step(&mut self, count: f64, tip: &TipStep<V>) {
        let [a, b] = self.ends.map(|[x, y, z]| Vec3::splat(x, y, z));
        let rating = squared_distance([tip.before[0], tip.after[0]], [a, b]);
        self.best.offer(rating, count, tip);
    }

    /// Refined approach of one lane; `origin_m` is the clock's origin.
    #[inline(always)]
    pub(super) fn closest(
        &self,
        lane: usize,
        origin_m: [f64; 3],
        time_of_step: impl Fn(usize) -> (f64, f64),
    ) -> SegmentApproach {
        let (cubic, start_s) = self.best.cubic(lane, time_of_step);
        let approach = approach_to(&cubic, start_s, origin_m, |x| point_at(self.ends, x).1);
        let tip = core::array::from_fn(|i| approach.tip_m[i] - origin_m[i]);
        SegmentApproach {
            approach,
            along: point_at(self.ends, tip).0,
        }
    }
}

/// Approach of a step's path to the shape described by `foot`, see [`Cubic::nearest`].
fn approach_to(
    cubic: &Cubic,
    start_s: f64,
    origin_m: [f64; 3],
    foot: impl Fn([f64; 3]) -> [f64; 3],
) -> ClosestApproach {
    let u = cubic.nearest(&foot);
    let tip = cubic.at(u);
    let foot = foot(tip);
    let squared: f64 = (0..3).map(|i| (tip[i] - foot[i]).powi(2)).sum();
    ClosestApproach {
        distance_m: squared.sqrt(),
        time_s: start_s + cubic.h_s * u,
        tip_m: core::array::from_fn(|i| tip[i] + origin_m[i]),
        velocity_m_s: cubic.velocity(u),
    }
}

/// Place along a segment and point on it nearest to `x`.
fn point_at(ends: [[f64; 3]; 2], x: [f64; 3]) -> (f64, [f64; 3]) {
    let [a, b] = ends;
    let (mut dot, mut squared) = (0.0, TINY_M2);
    for i in 0..3 {
        dot += (x[i] - a[i]) * (b[i] - a[i]);
        squared += (b[i] - a[i]).powi(2);
    }
    let along = (dot / squared).clamp(0.0, 1.0);
    (
        along,
        core::array::from_fn(|i| a[i] + along * (b[i] - a[i])),
    )
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
    use super::*;

    /// Feeds a path with its velocity to a recorder, in steps of `h`.
    fn follow(
        state: impl Fn(f64) -> [Vec3<f64>; 2],
        h: f64,
        steps: u32,
        mut take: impl FnMut(f64, &TipStep<f64>),
    ) {
        for i in 1..=steps {
            let tip = TipStep {
                before: state(f64::from(i - 1) * h),
                after: state(f64::from(i) * h),
                h,
                running: 1.0,
            };
            take(f64::from(i), &tip);
        }
    }

    #[test]
    fn passing_between_two_steps_is_seen() {
        // Along x at 10 m/s, 3 mm beside the target, passing it at t = 0.0127.
        let h = 1e-3;
        let state = |t: f64| [Vec3(10.0 * (t - 0.0127), 0.003, 0.0), Vec3(10.0, 0.0, 0.0)];
        let mut recorder = PointRecorder::new([0.0; 3], state(0.0));
        follow(state, h, 30, |i, tip| recorder.after_step(i, tip));
        let closest = recorder.closest(0, [1.0, 0.0, 0.0], |step| (step as f64 * h, h));
        assert!((closest.distance_m - 0.003).abs() < 1e-12);
        assert!((closest.time_s - 0.0127).abs() < 1e-12);
        assert!((closest.tip_m[0] - 1.0).abs() < 1e-10);
        assert!((closest.velocity_m_s[0] - 10.0).abs() < 1e-9);
    }

    #[test]
    fn curved_paths_are_refined_on_the_curve() {
        // A circle of radius 0.1 m about (0, 0.1): closest to the origin at the bottom.
        let (h, turn) = (2e-3, 40.0);
        let state = |t: f64| {
            let (s, c) = (turn * (t - 0.0213)).sin_cos();
            [
                Vec3(0.1 * s, 0.102 - 0.1 * c, 0.0),
                Vec3(0.1 * turn * c, 0.1 * turn * s, 0.0),
            ]
        };
        let mut recorder = PointRecorder::new([0.0; 3], state(0.0));
        follow(state, h, 25, |i, tip| recorder.after_step(i, tip));
        let closest = recorder.closest(0, [0.0; 3], |step| (step as f64 * h, h));
        assert!((closest.distance_m - 0.002).abs() < 1e-7, "{closest:?}");
        assert!((closest.time_s - 0.0213).abs() < 1e-6, "{closest:?}");
        assert!((closest.velocity_m_s[0] - 4.0).abs() < 1e-3, "{closest:?}");
    }

    #[test]
    fn a_path_above_a_segment_is_nearest_where_the_lines_cross() {
        // Crossing a segment along y at 7 m/s, 4 mm above, at (0.3, 0.12).
        let h = 1e-3;
        let state = |t: f64| {
            let s = t - 0.0204;
            [Vec3(0.3 + 7.0 * s, 0.12 + s, 0.504), Vec3(7.0, 1.0, 0.0)]
        };
        let ends = [[0.3, 0.1, 0.5], [0.3, 0.2, 0.5]];
        let mut recorder = SegmentRecorder::new(ends, state(0.0));
        follow(state, h, 40, |i, tip| recorder.after_step(i, tip));
        let found = recorder.closest(0, [0.0; 3], |step| (step as f64 * h, h));
        assert!((found.approach.distance_m - 0.004).abs() < 1e-12);
        assert!((found.approach.time_s - 0.0204).abs() < 1e-12);
        assert!((found.along - 0.2).abs() < 1e-9);
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
                let foot = point_at(q.map(|e| e.get(0)), x.get(0)).1;
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
