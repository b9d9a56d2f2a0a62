//! Time the lead spends inside a box, with crossings found within the step.

use super::cubic::{Cubic, TipStep};
use crate::algebra::Vec3;
use crate::lanes::Lanes;

/// Halvings of a step whose path is near a face. Visits shorter than a sixteenth of a
/// step may go unseen there.
const SPLITS: u32 = 4;
/// Halvings that narrow a crossing down to rounding.
const HALVINGS: usize = 40;

/// A box in the world, turned about the vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxRegion {
    /// Centre (m, world).
    pub center_m: [f64; 3],
    /// Half its extents along its own axes (m); infinite for a region without faces
    /// across that axis.
    pub half_m: [f64; 3],
    /// Turn of its axes about the world's z (rad).
    pub yaw_rad: f64,
}

impl BoxRegion {
    /// Whether a point (m, world) is inside.
    #[must_use]
    pub fn contains(&self, at_m: [f64; 3]) -> bool {
        let [x, y, z]: [f64; 3] = core::array::from_fn(|k| at_m[k] - self.center_m[k]);
        let (s, c) = self.yaw_rad.sin_cos();
        let local = [c * x + s * y, c * y - s * x, z];
        local
            .iter()
            .zip(self.half_m)
            .all(|(p, half)| p.abs() <= half)
    }
}

/// How long the lead's centre was inside a [`BoxRegion`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dwell {
    /// Time inside in all (s).
    pub total_s: f64,
    /// Since when it has been inside at the end of the simulation (s); `None` if it is
    /// outside then.
    pub inside_since_s: Option<f64>,
}

/// Stays of one lane up to now.
#[derive(Debug, Clone, Copy)]
struct Stays {
    done: Dwell,
    /// Time up to which everything is known (s).
    until_s: f64,
}

impl Stays {
    fn set(&mut self, inside: bool, time_s: f64) {
        match (inside, self.done.inside_since_s) {
            (true, None) => self.done.inside_since_s = Some(time_s),
            (false, Some(_)) => {
                self.close(time_s);
                self.done.inside_since_s = None;
            }
            _ => {}
        }
    }

    /// Counts the stay under way as if it ended at `time_s`.
    fn close(&mut self, time_s: f64) {
        if let Some(since_s) = self.done.inside_since_s {
            self.done.total_s += time_s - since_s;
        }
    }
}

/// The box in the clock's coordinates, with the stays of every lane.
pub(super) struct DwellRecorder {
    center: [f64; 3],
    half: [f64; 3],
    /// Cosine and sine of the yaw.
    turn: [f64; 2],
    stays: Vec<Stays>,
}

impl DwellRecorder {
    /// For `lanes` leads at `tip`; `origin_m` is the clock's origin.
    #[inline(always)]
    pub(super) fn new<V: Lanes>(
        region: &BoxRegion,
        origin_m: [f64; 3],
        tip: Vec3<V>,
        lanes: usize,
    ) -> Self {
        let (sin, cos) = region.yaw_rad.sin_cos();
        let mut recorder = Self {
            center: core::array::from_fn(|i| region.center_m[i] - origin_m[i]),
            half: region.half_m,
            turn: [cos, sin],
            stays: Vec::with_capacity(lanes),
        };
        for lane in 0..lanes {
            let inside = recorder.outside_by(tip.get(lane)) < 0.0;
            recorder.stays.push(Stays {
                done: Dwell {
                    total_s: 0.0,
                    inside_since_s: inside.then_some(0.0),
                },
                until_s: 0.0,
            });
        }
        recorder
    }

    /// Takes in a step; `span_s` gives its start and end in a lane (s).
    #[inline(always)]
    pub(super) fn after_step<V: Lanes>(
        &mut self,
        tip: &TipStep<V>,
        span_s: impl Fn(usize) -> (f64, f64),
    ) {
        let (reach, gap) = self.hull_margins(tip);
        for lane in 0..self.stays.len() {
            if tip.running.get(lane) > 0.0 {
                let (start_s, end_s) = span_s(lane);
                let stays = &mut self.stays[lane];
                stays.until_s = end_s;
                if reach.get(lane) < 0.0 {
                    stays.set(true, start_s);
                } else if gap.get(lane) > 0.0 {
                    stays.set(false, start_s);
                } else {
                    let cubic = tip.cubic(lane, end_s - start_s);
                    self.follow(lane, &cubic, start_s);
                }
            }
        }
    }

    /// The stays of one lane up to now.
    pub(super) fn dwell(&self, lane: usize) -> Dwell {
        let mut stays = self.stays[lane];
        stays.close(stays.until_s);
        stays.done
    }

    /// How far the path's hull reaches outside (negative: the path is inside) and by
    /// how much it misses the box (positive: the path is outside).
    #[inline(always)]
    fn hull_margins<V: Lanes>(&self, tip: &TipStep<V>) -> (V, V) {
        let [cos, sin] = self.turn.map(V::splat);
        let [x, y, z] = self.center;
        let center = Vec3::splat(x, y, z);
        let [mut low, mut high] = [None, None];
        for corner in tip.hull() {
            let d = corner.sub(center);
            let local = Vec3(d.0.fma(cos, d.1 * sin), d.1.fma(cos, -(d.0 * sin)), d.2);
            let l: Vec3<V> = low.unwrap_or(local);
            let h: Vec3<V> = high.unwrap_or(local);
            low = Some(l.min(local));
            high = Some(h.max(local));
        }
        let (low, high) = (low.unwrap_or(center), high.unwrap_or(center));
        let [a, b, c] = self.half.map(V::splat);
        let reach = |l: V, h: V, half: V| h.max(-l) - half;
        let gap = |l: V, h: V, half: V| l.max(-h) - half;
        (
            reach(low.0, high.0, a)
                .max(reach(low.1, high.1, b))
                .max(reach(low.2, high.2, c)),
            gap(low.0, high.0, a)
                .max(gap(low.1, high.1, b))
                .max(gap(low.2, high.2, c)),
        )
    }

    /// Distance by which a position is outside, along the worst axis (m); negative
    /// inside.
    fn outside_by(&self, x: [f64; 3]) -> f64 {
        let d: [f64; 3] = core::array::from_fn(|i| x[i] - self.center[i]);
        let [cos, sin] = self.turn;
        let local = [d[0] * cos + d[1] * sin, d[1] * cos - d[0] * sin, d[2]];
        (0..3)
            .map(|i| local[i].abs() - self.half[i])
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Notes the crossings of one lane within a step near a face.
    fn follow(&mut self, lane: usize, cubic: &Cubic, start_s: f64) {
        let pieces = 1 << SPLITS;
        let is_inside = |u: f64| self.outside_by(cubic.at(u)) < 0.0;
        let mut crossings = Vec::new();
        let mut was_inside = is_inside(0.0);
        crossings.push((was_inside, 0.0));
        for piece in 1..=pieces {
            let u = f64::from(piece) / f64::from(pieces);
            let now_inside = is_inside(u);
            if now_inside != was_inside {
                let (mut low, mut high) = (u - 1.0 / f64::from(pieces), u);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if is_inside(middle) == was_inside {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                crossings.push((now_inside, high));
                was_inside = now_inside;
            }
        }
        for (inside, u) in crossings {
            self.stays[lane].set(inside, start_s + cubic.h_s * u);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cubic::steps_along;
    use super::*;

    fn stay(
        region: &BoxRegion,
        h: f64,
        steps: u32,
        state: impl Fn(f64) -> [Vec3<f64>; 2],
    ) -> Dwell {
        let origin = [0.2, 0.0, -0.1];
        let shifted = |t: f64| {
            let [x, v] = state(t);
            [x.sub(Vec3(0.2, 0.0, -0.1)), v]
        };
        let mut recorder = DwellRecorder::new(region, origin, shifted(0.0)[0], 1);
        for (i, tip) in (0_u32..).zip(steps_along(shifted, h, steps)) {
            recorder.after_step(&tip, |_| (f64::from(i) * h, f64::from(i + 1) * h));
        }
        recorder.dwell(0)
    }

    fn cube(half: f64) -> BoxRegion {
        BoxRegion {
            center_m: [0.0, 0.0, 1.0],
            half_m: [half; 3],
            yaw_rad: 0.0,
        }
    }

    #[test]
    fn a_swing_through_a_slab_is_inside_for_the_time_the_sine_says() {
        let region = BoxRegion {
            half_m: [0.1, f64::INFINITY, 0.5],
            ..cube(0.1)
        };
        let w = 5.0;
        let swing = |t: f64| {
            let (s, c) = (w * t).sin_cos();
            [Vec3(0.3 * s, 4.0, 1.0), Vec3(0.3 * w * c, 0.0, 0.0)]
        };
        // Two and a quarter periods from the middle: five passes, the first cut in half.
        let h = core::f64::consts::TAU / w * 2.25 / 900.0;
        let found = stay(&region, h, 900, swing);
        let half_pass = (1.0_f64 / 3.0).asin() / w;
        assert!((found.total_s - 9.0 * half_pass).abs() < 1e-8, "{found:?}");
        assert_eq!(found.inside_since_s, None);
    }

    #[test]
    fn a_pass_within_one_step_is_seen_in_a_turned_box() {
        // 12 m/s through a box 4 cm wide in that direction, within a step of 10 ms.
        let region = BoxRegion {
            half_m: [0.02, 0.5, 0.5],
            yaw_rad: 0.6,
            ..cube(0.0)
        };
        let (s, c) = 0.6_f64.sin_cos();
        let pass = |t: f64| {
            let x = 12.0 * (t - 0.015);
            [Vec3(c * x, s * x, 1.0), Vec3(12.0 * c, 12.0 * s, 0.0)]
        };
        let found = stay(&region, 0.01, 3, pass);
        assert!((found.total_s - 0.04 / 12.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn the_stay_under_way_at_the_end_counts() {
        let arrive = |t: f64| {
            [
                Vec3(0.1 * (1.2 - t).max(0.0), 0.0, 1.0),
                Vec3(0.0, 0.0, 0.0),
            ]
        };
        let still = |_: f64| arrive(2.0);
        let found = stay(&cube(0.05), 0.01, 50, still);
        assert_eq!(found.inside_since_s, Some(0.0));
        assert!((found.total_s - 0.5).abs() < 1e-12);
        let outside = stay(&cube(0.05), 0.01, 50, |_| arrive(0.0));
        assert_eq!((outside.total_s, outside.inside_since_s), (0.0, None));
    }
}
