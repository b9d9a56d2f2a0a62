//! What is measured while a rope moves, so that no trajectory need be stored.
//!
//! One file per reduction. Between step ends the lead follows the cubic through its
//! positions and velocities, and distances, crossings and heights are those of that
//! curve. What is not asked for costs nothing.

mod approach;
mod cubic;
mod dwell;
mod height;
mod rest;

pub use approach::ClosestApproach;
pub use dwell::{BoxRegion, Dwell};
pub use rest::RestMeasures;

use crate::algebra::Vec3;
use crate::base_path::BasePath;
use crate::clock::Clock;
use crate::error::{refuse_unless, refuse_unless_finite};
use crate::lanes::Lanes;
use crate::state::Link;
use approach::{ApproachRecorder, Target};
use cubic::{BestStep, TipStep};
use dwell::DwellRecorder;
use rest::RestRecorder;

/// What to measure in every rollout of a batch; nothing by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Watch {
    /// Closest approach of the lead to this point (m, world).
    pub point_m: Option<[f64; 3]>,
    /// Closest approach of the lead to the segment between these points (m, world).
    pub segment_m: Option<[[f64; 3]; 2]>,
    /// Time the lead spends in this box.
    pub dwell_in: Option<BoxRegion>,
    /// Highest place of the lead.
    pub height: bool,
    /// Movement of tip and middle within this time before the end (s).
    pub rest_window_s: Option<f64>,
}

/// What was measured; each is `None` if it was not asked for or the simulation
/// diverged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Watched {
    /// See [`Watch::point_m`].
    pub to_point: Option<ClosestApproach>,
    /// See [`Watch::segment_m`].
    pub to_segment: Option<ClosestApproach>,
    /// See [`Watch::dwell_in`].
    pub dwell: Option<Dwell>,
    /// See [`Watch::height`] (m, world z).
    pub highest_m: Option<f64>,
    /// See [`Watch::rest_window_s`].
    pub rest: Option<RestMeasures>,
}

impl Watch {
    /// Nothing.
    pub const NOTHING: Self = Self {
        point_m: None,
        segment_m: None,
        dwell_in: None,
        height: false,
        rest_window_s: None,
    };

    /// Only the closest approach to a point (m, world).
    #[must_use]
    pub const fn point(point_m: [f64; 3]) -> Self {
        Self {
            point_m: Some(point_m),
            ..Self::NOTHING
        }
    }

    /// Point near which positions are resolved best: the origin of the lanes' numbers.
    pub(crate) fn origin_m(&self) -> [f64; 3] {
        self.point_m
            .or(self.segment_m.map(|[a, _]| a))
            .or(self.dwell_in.map(|region| region.center_m))
            .unwrap_or([0.0; 3])
    }

    /// Refuses what cannot be measured within `horizon_s`, by name.
    pub(crate) fn check(&self, horizon_s: f64) -> Result<(), String> {
        refuse_unless_finite("watch.point_m", self.point_m.into_iter().flatten())?;
        let ends = self.segment_m.into_iter().flatten().flatten();
        refuse_unless_finite("watch.segment_m", ends)?;
        if let Some(region) = self.dwell_in {
            refuse_unless_finite("watch.dwell_in.center_m", region.center_m)?;
            refuse_unless_finite("watch.dwell_in.yaw_rad", [region.yaw_rad])?;
            let field = "watch.dwell_in.half_m";
            refuse_unless(field, "must be above 0", region.half_m, |v| v > 0.0)?;
        }
        let need = "must be above 0 and at most the horizon";
        refuse_unless("watch.rest_window_s", need, self.rest_window_s, |v| {
            v > 0.0 && v <= horizon_s
        })
    }
}

/// Takes every measurement of a group's lanes.
pub(crate) struct Watcher<V> {
    origin_m: [f64; 3],
    lanes: usize,
    /// Lanes that have a point to come near to.
    has_point: Vec<bool>,
    /// Steps so far.
    count: f64,
    tip: [Vec3<V>; 2],
    peak_speed_squared: V,
    to_point: Option<ApproachRecorder<V>>,
    to_segment: Option<ApproachRecorder<V>>,
    dwell: Option<DwellRecorder>,
    /// The step with the highest place, rated by negative height.
    highest: Option<BestStep<V>>,
    rest: Option<RestRecorder<V>>,
}

impl<V: Lanes> Watcher<V> {
    /// For leads with these positions, relative to the clock's origin [`Watch::origin_m`], and
    /// velocities at the start; one lane for each of `points_m`, which goes before the watch's.
    #[inline(always)]
    pub(crate) fn new(
        watch: &Watch,
        tip: [Vec3<V>; 2],
        points_m: &[Option<[f64; 3]>],
        horizon_s: f64,
    ) -> Self {
        let (origin_m, lanes) = (watch.origin_m(), points_m.len());
        let relative = |x: [f64; 3]| core::array::from_fn(|i| x[i] - origin_m[i]);
        let mut points = Vec3::zero();
        let mut has_point = vec![false; lanes];
        for (lane, own) in points_m.iter().enumerate() {
            if let Some(point_m) = own.or(watch.point_m) {
                points.set(lane, relative(point_m));
                has_point[lane] = true;
            }
        }
        Self {
            origin_m,
            lanes,
            count: 0.0,
            tip,
            peak_speed_squared: tip[1].dot(tip[1]),
            to_point: has_point
                .contains(&true)
                .then(|| ApproachRecorder::new(Target::Point(points), tip)),
            has_point,
            to_segment: watch
                .segment_m
                .map(|ends| ApproachRecorder::new(Target::Segment(ends.map(relative)), tip)),
            dwell: watch
                .dwell_in
                .map(|region| DwellRecorder::new(&region, origin_m, tip[0], lanes)),
            highest: watch.height.then(|| BestStep::new(tip)),
            rest: watch
                .rest_window_s
                .map(|window_s| RestRecorder::new(horizon_s - window_s, lanes)),
        }
    }

    /// Takes in the state after a step: attach point, lead and its velocity; lanes where `running` is not positive are left alone.
    #[inline(always)]
    pub(crate) fn after_step(
        &mut self,
        attach: Vec3<V>,
        tip: [Vec3<V>; 2],
        clock: &Clock<V>,
        links: &[Link<V>],
        link_length: V,
        running: V,
    ) {
        self.count += 1.0;
        let zero = V::splat(0.0);
        let faster = V::select_less(zero, running, tip[1].dot(tip[1]), zero);
        self.peak_speed_squared = self.peak_speed_squared.max(faster);
        let step = TipStep {
            before: self.tip,
            after: tip,
            h: clock.scheme.h,
            running,
        };
        self.tip = tip;
        if let Some(approach) = &mut self.to_point {
            approach.after_step(self.count, &step);
        }
        if let Some(approach) = &mut self.to_segment {
            approach.after_step(self.count, &step);
        }
        if let Some(dwell) = &mut self.dwell {
            dwell.after_step(&step, |lane| clock.span_s(lane));
        }
        if let Some(highest) = &mut self.highest {
            let (_, high) = height::span(&step);
            highest.offer(-high, self.count, &step);
        }
        if let Some(rest) = &mut self.rest {
            rest.after_step(&step, attach, links, link_length, self.lanes, |lane| {
                clock.span_s(lane)
            });
        }
    }

    /// Highest speed of the lead at step ends (m/s).
    #[inline(always)]
    pub(crate) fn peak_speed_m_s(&self, lane: usize) -> f64 {
        self.peak_speed_squared.get(lane).sqrt()
    }

    /// Everything measured in one lane.
    #[inline(always)]
    pub(crate) fn watched(&self, lane: usize, path: &BasePath) -> Watched {
        let origin_m = self.origin_m;
        let time_of_step = |step| path.end_of_step_s(step);
        let closest =
            |recorder: &ApproachRecorder<V>| recorder.closest(lane, origin_m, time_of_step);
        Watched {
            to_point: self
                .to_point
                .as_ref()
                .filter(|_| self.has_point[lane])
                .map(closest),
            to_segment: self.to_segment.as_ref().map(closest),
            dwell: self.dwell.as_ref().map(|r| r.dwell(lane)),
            highest_m: self
                .highest
                .as_ref()
                .map(|best| height::highest(&best.cubic(lane, time_of_step).0) + origin_m[2]),
            rest: self.rest.as_ref().map(|r| r.measures(lane, origin_m)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_watched_is_named() {
        let region = BoxRegion {
            center_m: [0.0; 3],
            half_m: [0.1, f64::INFINITY, 0.1],
            yaw_rad: 0.5,
        };
        let within = |region| Watch {
            dwell_in: Some(region),
            ..Watch::NOTHING
        };
        let along = |end| Watch {
            segment_m: Some([[0.0; 3], end]),
            ..Watch::NOTHING
        };
        let lately = |window_s| Watch {
            rest_window_s: Some(window_s),
            ..Watch::NOTHING
        };
        for good in [within(region), along([0.0; 3]), lately(2.0)] {
            assert_eq!(good.check(2.0), Ok(()));
        }
        let (nan, half_m) = (f64::NAN, [0.1, 0.0, 0.1]);
        let wrong = [
            ("watch.point_m", Watch::point([0.0, nan, 0.0])),
            ("watch.segment_m", along([f64::INFINITY, 0.0, 0.0])),
            (
                "watch.dwell_in.half_m",
                within(BoxRegion { half_m, ..region }),
            ),
            (
                "watch.dwell_in.yaw_rad",
                within(BoxRegion {
                    yaw_rad: nan,
                    ..region
                }),
            ),
            ("watch.rest_window_s", lately(2.1)),
            ("watch.rest_window_s", lately(nan)),
        ];
        for (name, watch) in wrong {
            let refusal = watch.check(2.0).unwrap_err();
            assert!(refusal.starts_with(&format!("`{name}` is ")), "{refusal}");
        }
    }
}
