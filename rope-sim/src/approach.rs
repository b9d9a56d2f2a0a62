//! Closest approach of the lead to a point, in continuous time.
//!
//! At 15 m/s the lead moves 7 mm within a step of 0.5 ms, so looking at step ends is
//! not enough. Every step is rated by the straight line through its end; the best
//! step's states are kept and refined afterwards on their cubic Hermite.

use crate::algebra::Vec3;
use crate::frames::hermite;
use crate::lanes::Lanes;

/// Closest approach of the lead's centre to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestApproach {
    /// Distance (m).
    pub distance_m: f64,
    /// When (s).
    pub time_s: f64,
}

/// Best step so far of every lane; positions relative to the target.
pub(crate) struct ApproachRecorder<V> {
    best: V,
    best_step: V,
    states: [Vec3<V>; 4],
    last: [Vec3<V>; 2],
    peak_speed_squared: V,
    step: f64,
}

impl<V: Lanes> ApproachRecorder<V> {
    /// From the lead's position relative to the target and velocity at the start.
    #[inline(always)]
    pub(crate) fn new(x: Vec3<V>, v: Vec3<V>) -> Self {
        Self {
            best: V::splat(f64::from(f32::MAX)),
            best_step: V::splat(1.0),
            states: [x, v, x, v],
            last: [x, v],
            peak_speed_squared: v.dot(v),
            step: 0.0,
        }
    }

    /// Takes in the state after a step of length `h`; lanes where `running` is not
    /// positive are left alone.
    #[inline(always)]
    pub(crate) fn after_step(&mut self, x: Vec3<V>, v: Vec3<V>, h: V, running: V) {
        self.step += 1.0;
        let zero = V::splat(0.0);
        let speed_squared = v.dot(v);
        let back = x.dot(v) * (speed_squared + V::splat(1e-12)).recip();
        let nearest = v.scale_sub(back.max(zero).min(h), x);
        let distance = V::select_less(zero, running, nearest.dot(nearest), self.best);
        let better = |new: V, old: V| V::select_less(distance, self.best, new, old);
        let keep = |new: Vec3<V>, old: Vec3<V>| {
            Vec3(
                better(new.0, old.0),
                better(new.1, old.1),
                better(new.2, old.2),
            )
        };
        self.states = [
            keep(self.last[0], self.states[0]),
            keep(self.last[1], self.states[1]),
            keep(x, self.states[2]),
            keep(v, self.states[3]),
        ];
        self.best_step = better(V::splat(self.step), self.best_step);
        self.best = better(distance, self.best);
        self.last = [x, v];
        let faster = V::select_less(zero, running, speed_squared, zero);
        self.peak_speed_squared = self.peak_speed_squared.max(faster);
    }

    /// Highest speed of the lead at step ends (m/s).
    #[inline(always)]
    pub(crate) fn peak_speed_m_s(&self, lane: usize) -> f64 {
        self.peak_speed_squared.get(lane).sqrt()
    }

    /// Refined closest approach of one lane; `time_of_step` gives end and length of a
    /// step counted from 1 (s).
    #[inline(always)]
    pub(crate) fn closest(
        &self,
        lane: usize,
        time_of_step: impl Fn(usize) -> (f64, f64),
    ) -> ClosestApproach {
        let (end_s, h) = time_of_step(self.best_step.get(lane) as usize);
        let states: [[f64; 3]; 4] = [0, 1, 2, 3]
            .map(|i| [self.states[i].0, self.states[i].1, self.states[i].2].map(|s| s.get(lane)));
        let (fraction, distance_m) = refine(&states, h);
        ClosestApproach {
            distance_m,
            time_s: end_s - h + h * fraction,
        }
    }
}

/// Smallest distance from the origin on the cubic through value and rate at both
/// ends: (fraction of the step, distance).
fn refine(states: &[[f64; 3]; 4], h: f64) -> (f64, f64) {
    const PIECES: u32 = 8;
    let distance = |u: f64| {
        let w = hermite(u, h);
        let coordinate = |axis: usize| -> f64 { (0..4).map(|i| w[i] * states[i][axis]).sum() };
        (0..3).map(|axis| coordinate(axis).powi(2)).sum::<f64>()
    };
    let coarse = (0..=PIECES).map(|i| f64::from(i) / f64::from(PIECES));
    let start = coarse
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
        .unwrap_or(0.0);
    let (mut low, mut high) = (
        (start - 1.0 / f64::from(PIECES)).max(0.0),
        (start + 1.0 / f64::from(PIECES)).min(1.0),
    );
    for _ in 0..40 {
        let (a, b) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
        if distance(a) < distance(b) {
            high = b
        } else {
            low = a
        }
    }
    let u = 0.5 * (low + high);
    (u, distance(u).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passing_between_two_steps_is_seen() {
        // Along x at 10 m/s, 3 mm beside the target, passing it at t = 0.0127.
        let h = 1e-3;
        let at = |t: f64| Vec3(10.0 * (t - 0.0127), 0.003, 0.0);
        let v = Vec3(10.0, 0.0, 0.0);
        let mut recorder = ApproachRecorder::new(at(0.0), v);
        for i in 1..=30 {
            recorder.after_step(at(f64::from(i) * h), v, h, 1.0);
        }
        let closest = recorder.closest(0, |step| (step as f64 * h, h));
        assert!((closest.distance_m - 0.003).abs() < 1e-9);
        assert!((closest.time_s - 0.0127).abs() < 1e-7);
        assert!((recorder.peak_speed_m_s(0) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn curved_paths_are_refined_on_the_curve() {
        // A circle of radius 0.1 m about (0, 0.1): closest to the origin at the bottom.
        let (h, turn) = (2e-3, 40.0);
        let state = |t: f64| {
            let (s, c) = (turn * (t - 0.0213)).sin_cos();
            let offset = 0.102;
            (
                Vec3(0.1 * s, offset - 0.1 * c, 0.0),
                Vec3(0.1 * turn * c, 0.1 * turn * s, 0.0),
            )
        };
        let (x, v) = state(0.0);
        let mut recorder = ApproachRecorder::new(x, v);
        for i in 1..=25 {
            let (x, v) = state(f64::from(i) * h);
            recorder.after_step(x, v, h, 1.0);
        }
        let closest = recorder.closest(0, |step| (step as f64 * h, h));
        assert!((closest.distance_m - 0.002).abs() < 1e-7, "{closest:?}");
        assert!((closest.time_s - 0.0213).abs() < 1e-6, "{closest:?}");
    }
}
