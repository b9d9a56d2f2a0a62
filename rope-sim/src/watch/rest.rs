//! Whether the rope lies still at the end: how much tip and middle moved lately.

use super::cubic::TipStep;
use super::height::span;
use crate::algebra::Vec3;
use crate::lanes::Lanes;
use crate::state::Link;

/// Largest rounding of a step's end against the start of the window (s).
const SAME_TIME_S: f64 = 1e-9;

/// Movement of the rope within the window before the end of the simulation, and its
/// state at the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestMeasures {
    /// Highest minus lowest place of the lead within the window (m).
    pub tip_height_spread_m: f64,
    /// Diagonal of the smallest upright box around the way of the rope's middle (half
    /// its arc length) within the window (m); no two of its places are further apart.
    pub middle_movement_m: f64,
    /// Lead's centre at the end (m, world).
    pub tip_m: [f64; 3],
    /// Middle of the rope at the end (m, world).
    pub middle_m: [f64; 3],
}

/// Extremes within the window and the latest states. The window begins with the first
/// step that ends in it.
pub(super) struct RestRecorder<V> {
    from_s: f64,
    /// 1 in lanes within the window, else 0.
    begun: V,
    waiting: usize,
    height: [V; 2],
    low: Vec3<V>,
    high: Vec3<V>,
    tip: Vec3<V>,
    middle: Vec3<V>,
}

impl<V: Lanes> RestRecorder<V> {
    /// For a window from `from_s` to the end, in `lanes` lanes.
    #[inline(always)]
    pub(super) fn new(from_s: f64, lanes: usize) -> Self {
        let most = f64::from(f32::MAX);
        Self {
            from_s,
            begun: V::splat(0.0),
            waiting: lanes,
            height: [V::splat(most), V::splat(-most)],
            low: Vec3::splat(most, most, most),
            high: Vec3::splat(-most, -most, -most),
            tip: Vec3::zero(),
            middle: Vec3::zero(),
        }
    }

    /// Takes in a step; `attach` is the attach point at the step's end, `span_s` gives
    /// start and end of the step in a lane (s).
    #[inline(always)]
    pub(super) fn after_step(
        &mut self,
        tip: &TipStep<V>,
        attach: Vec3<V>,
        links: &[Link<V>],
        link_length: V,
        lanes: usize,
        span_s: impl Fn(usize) -> (f64, f64),
    ) {
        let zero = V::splat(0.0);
        let before = self.begun;
        if self.waiting > 0 {
            for lane in 0..lanes {
                if self.begun.get(lane) <= 0.0 && span_s(lane).1 >= self.from_s - SAME_TIME_S {
                    self.begun.set(lane, 1.0);
                    self.waiting -= 1;
                }
            }
            if self.waiting == lanes {
                return;
            }
        }
        let counts = V::select_less(zero, self.begun, tip.running, zero);
        let (low, high) = span(tip);
        // Of the first step only the end lies in the window for sure.
        let end = tip.after[0].2;
        let low = V::select_less(zero, before, low, end);
        let high = V::select_less(zero, before, high, end);
        let [lowest, highest] = self.height;
        self.height = [
            V::select_less(zero, counts, low.min(lowest), lowest),
            V::select_less(zero, counts, high.max(highest), highest),
        ];
        let m = attach.add(middle(links, link_length));
        self.low = Vec3::select_less(zero, counts, m.min(self.low), self.low);
        self.high = Vec3::select_less(zero, counts, m.max(self.high), self.high);
        self.middle = Vec3::select_less(zero, counts, m, self.middle);
        self.tip = Vec3::select_less(zero, counts, tip.after[0], self.tip);
    }

    /// Measures of one lane; `origin_m` is the clock's origin.
    #[inline(always)]
    pub(super) fn measures(&self, lane: usize, origin_m: [f64; 3]) -> RestMeasures {
        let (low, high) = (self.low.get(lane), self.high.get(lane));
        let squared: f64 = (0..3).map(|i| (high[i] - low[i]).powi(2)).sum();
        let world = |x: Vec3<V>| {
            let x = x.get(lane);
            core::array::from_fn(|i| x[i] + origin_m[i])
        };
        RestMeasures {
            tip_height_spread_m: self.height[1].get(lane) - self.height[0].get(lane),
            middle_movement_m: squared.sqrt(),
            tip_m: world(self.tip),
            middle_m: world(self.middle),
        }
    }
}

/// Middle of the rope relative to node 0: a node, or with an odd number of links the
/// middle of a link.
#[inline(always)]
fn middle<V: Lanes>(links: &[Link<V>], link_length: V) -> Vec3<V> {
    let mut x = Vec3::zero();
    let whole = links.len() / 2;
    let half = links.len() % 2;
    for (index, link) in links.iter().take(whole + half).enumerate() {
        let length = if index == whole {
            link_length * V::splat(0.5)
        } else {
            link_length
        };
        x = x.add(link.q.down(length));
    }
    x
}
