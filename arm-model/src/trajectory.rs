//! Joint trajectories: waypoints joined by a clamped cubic spline.
//!
//! The spline starts and ends at rest (zero velocity at both ends) and is C2
//! between; its acceleration is piecewise linear, so positions, velocities and
//! accelerations have closed-form extrema and no limit can hide between samples.
//! Storage is fixed-size: a trajectory crosses process borders as it is, and
//! evaluating it is RT-safe (no allocation, bounded search).

use crate::joint::{JOINTS, JointState, JointVector};
use alloc::vec::Vec;
#[cfg(feature = "std")]
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Most waypoints of one trajectory, start and end included.
pub const MAX_WAYPOINTS: usize = 256;
/// Shortest allowed time between two waypoints (s): one cycle at 250 Hz.
pub const MIN_SEGMENT_S: f64 = 0.004;
/// Longest allowed trajectory (s).
pub const MAX_DURATION_S: f64 = 600.0;

/// Why a trajectory is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// Too few or too many waypoints.
    #[error("a trajectory needs 2 to {MAX_WAYPOINTS} waypoints, found {0}")]
    WaypointCount(usize),
    /// As many times as waypoints are needed.
    #[error("`times_s` has {times} entries but `waypoints_rad` has {waypoints}")]
    LengthMismatch {
        /// Entries in `times_s`.
        times: usize,
        /// Entries in `waypoints_rad`.
        waypoints: usize,
    },
    /// A number of a waypoint is NaN or infinite.
    #[error("waypoint {0} holds a number that is not finite")]
    NotFinite(usize),
    /// Times must start at zero and increase by at least [`MIN_SEGMENT_S`].
    #[error(
        "time {time_s} s of waypoint {index} must be {MIN_SEGMENT_S} s or more after the one before \
         (the first is 0), at most {MAX_DURATION_S} s"
    )]
    TimeOrder {
        /// Index of the waypoint.
        index: usize,
        /// Its time (s).
        time_s: f64,
    },
}

/// A validated clamped cubic spline through joint-space waypoints. RT-safe to
/// evaluate; construct it before the loop.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
#[serde(try_from = "TrajectoryForm", into = "TrajectoryForm")]
pub struct JointTrajectory {
    len: u64,
    t_s: [f64; MAX_WAYPOINTS],
    q: [JointVector; MAX_WAYPOINTS],
    /// Second derivatives at the waypoints (rad/s²).
    m: [JointVector; MAX_WAYPOINTS],
}

/// The file form: times and waypoints only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TrajectoryForm {
    times_s: Vec<f64>,
    waypoints_rad: Vec<JointVector>,
}

impl TryFrom<TrajectoryForm> for JointTrajectory {
    type Error = TrajectoryError;
    fn try_from(form: TrajectoryForm) -> Result<Self, TrajectoryError> {
        Self::new(&form.times_s, &form.waypoints_rad)
    }
}

impl From<JointTrajectory> for TrajectoryForm {
    fn from(t: JointTrajectory) -> Self {
        Self {
            times_s: t.times_s().to_vec(),
            waypoints_rad: t.waypoints().to_vec(),
        }
    }
}

impl core::fmt::Debug for JointTrajectory {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("JointTrajectory")
            .field("times_s", &self.times_s())
            .field("waypoints_rad", &self.waypoints())
            .finish()
    }
}

/// An extreme value of one quantity of one joint along a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Extremum {
    /// Value of largest magnitude (rad, rad/s, rad/s² or rad/s³).
    pub value: f64,
    /// When it occurs (s).
    pub time_s: f64,
}

/// Exact extrema of one joint along a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JointExtrema {
    /// Smallest position (rad).
    pub q_min: Extremum,
    /// Largest position (rad).
    pub q_max: Extremum,
    /// Velocity of largest magnitude (rad/s).
    pub qd: Extremum,
    /// Acceleration of largest magnitude (rad/s²).
    pub qdd: Extremum,
    /// Jerk of largest magnitude inside a segment (rad/s³).
    pub qddd: Extremum,
}

impl JointTrajectory {
    /// Spline through `waypoints_rad` at `times_s`, at rest at both ends.
    ///
    /// # Errors
    /// Wrong counts, numbers that are not finite, times out of order.
    pub fn new(times_s: &[f64], waypoints_rad: &[JointVector]) -> Result<Self, TrajectoryError> {
        let n = waypoints_rad.len();
        if times_s.len() != n {
            return Err(TrajectoryError::LengthMismatch {
                times: times_s.len(),
                waypoints: n,
            });
        }
        if !(2..=MAX_WAYPOINTS).contains(&n) {
            return Err(TrajectoryError::WaypointCount(n));
        }
        for (index, (t, q)) in times_s.iter().zip(waypoints_rad).enumerate() {
            if !t.is_finite() || !q.is_finite() {
                return Err(TrajectoryError::NotFinite(index));
            }
            let ordered = if index == 0 {
                *t == 0.0
            } else {
                t - times_s[index - 1] >= MIN_SEGMENT_S - 1e-9 && *t <= MAX_DURATION_S
            };
            if !ordered {
                return Err(TrajectoryError::TimeOrder { index, time_s: *t });
            }
        }
        let mut out = Self {
            len: n as u64,
            t_s: [0.0; MAX_WAYPOINTS],
            q: [JointVector::ZERO; MAX_WAYPOINTS],
            m: [JointVector::ZERO; MAX_WAYPOINTS],
        };
        out.t_s[..n].copy_from_slice(times_s);
        out.q[..n].copy_from_slice(waypoints_rad);
        out.solve_second_derivatives();
        Ok(out)
    }

    /// A trajectory that stays in `q` for `duration_s`.
    ///
    /// # Errors
    /// As [`JointTrajectory::new`].
    pub fn hold(q: JointVector, duration_s: f64) -> Result<Self, TrajectoryError> {
        Self::new(&[0.0, duration_s], &[q, q])
    }

    /// Thomas algorithm on the clamped-spline system (zero end velocities).
    fn solve_second_derivatives(&mut self) {
        let n = self.waypoint_count();
        let mut upper = [0.0; MAX_WAYPOINTS];
        let span = |i: usize| self.t_s[i + 1] - self.t_s[i];
        let slope = |i: usize, j: usize| (self.q[i + 1][j] - self.q[i][j]) / span(i);
        let mut rhs = [JointVector::ZERO; MAX_WAYPOINTS];
        for i in 0..n {
            let left = if i > 0 { span(i - 1) } else { 0.0 };
            let right = if i + 1 < n { span(i) } else { 0.0 };
            let pivot = 2.0 * (left + right) - if i > 0 { left * upper[i - 1] } else { 0.0 };
            upper[i] = right / pivot;
            for j in 0..JOINTS {
                let after = if i + 1 < n { slope(i, j) } else { 0.0 };
                let before = if i > 0 { slope(i - 1, j) } else { 0.0 };
                let carried = if i > 0 { left * rhs[i - 1][j] } else { 0.0 };
                rhs[i][j] = (6.0 * (after - before) - carried) / pivot;
            }
        }
        self.m[n - 1] = rhs[n - 1];
        for i in (0..n - 1).rev() {
            self.m[i] = rhs[i] - self.m[i + 1] * upper[i];
        }
    }

    /// Number of waypoints.
    #[must_use]
    pub fn waypoint_count(&self) -> usize {
        usize::try_from(self.len).map_or(MAX_WAYPOINTS, |n| n.clamp(2, MAX_WAYPOINTS))
    }

    /// Times of the waypoints (s), the first is 0.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.t_s[..self.waypoint_count()]
    }

    /// The waypoints (rad).
    #[must_use]
    pub fn waypoints(&self) -> &[JointVector] {
        &self.q[..self.waypoint_count()]
    }

    /// First waypoint (rad).
    #[must_use]
    pub fn start(&self) -> JointVector {
        self.q[0]
    }

    /// Last waypoint (rad).
    #[must_use]
    pub fn end(&self) -> JointVector {
        self.q[self.waypoint_count() - 1]
    }

    /// Duration (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.t_s[self.waypoint_count() - 1]
    }

    /// Joint state at `time_s`; at rest before the start and after the end.
    /// RT-safe: one binary search, no allocation, no panic for any input.
    #[must_use]
    pub fn state_at(&self, time_s: f64) -> JointState {
        if time_s.is_nan() || time_s < 0.0 {
            return JointState::at_rest(self.start());
        }
        if time_s > self.duration_s() {
            return JointState::at_rest(self.end());
        }
        let times = self.times_s();
        let i = times
            .partition_point(|t| *t <= time_s)
            .clamp(1, times.len() - 1)
            - 1;
        let h = self.t_s[i + 1] - self.t_s[i];
        let (a, b) = (self.t_s[i + 1] - time_s, time_s - self.t_s[i]);
        let mut out = JointState::default();
        for j in 0..JOINTS {
            let (q0, q1) = (self.q[i][j], self.q[i + 1][j]);
            let (m0, m1) = (self.m[i][j], self.m[i + 1][j]);
            let (c0, c1) = (q0 / h - m0 * h / 6.0, q1 / h - m1 * h / 6.0);
            out.q[j] = (m0 * a * a * a + m1 * b * b * b) / (6.0 * h) + c0 * a + c1 * b;
            out.qd[j] = (m1 * b * b - m0 * a * a) / (2.0 * h) + c1 - c0;
            out.qdd[j] = (m0 * a + m1 * b) / h;
        }
        out
    }

    /// Exact extrema of joint `joint` (0-based).
    #[must_use]
    pub fn extrema(&self, joint: usize) -> JointExtrema {
        let at = |value, time_s| Extremum { value, time_s };
        let mut e = JointExtrema {
            q_min: at(self.q[0][joint], 0.0),
            q_max: at(self.q[0][joint], 0.0),
            qd: at(0.0, 0.0),
            qdd: at(0.0, 0.0),
            qddd: at(0.0, 0.0),
        };
        let grow = |slot: &mut Extremum, value: f64, time_s: f64| {
            if value.abs() > slot.value.abs() {
                *slot = at(value, time_s);
            }
        };
        for i in 0..self.waypoint_count() - 1 {
            let (t0, t1) = (self.t_s[i], self.t_s[i + 1]);
            let h = t1 - t0;
            let (m0, m1) = (self.m[i][joint], self.m[i + 1][joint]);
            grow(&mut e.qdd, m0, t0);
            grow(&mut e.qdd, m1, t1);
            grow(&mut e.qddd, (m1 - m0) / h, t0);
            let v0 = (self.q[i + 1][joint] - self.q[i][joint]) / h - h * (2.0 * m0 + m1) / 6.0;
            let v1 = v0 + h * (m0 + m1) / 2.0;
            grow(&mut e.qd, v0, t0);
            grow(&mut e.qd, v1, t1);
            // Velocity is v0 + m0 u + (m1 - m0) u^2 / (2 h): its vertex and its roots.
            let curve = (m1 - m0) / (2.0 * h);
            let vertex = -m0 / (2.0 * curve);
            if vertex > 0.0 && vertex < h {
                let v = v0 + m0 * vertex + curve * vertex * vertex;
                grow(&mut e.qd, v, t0 + vertex);
            }
            let disc = crate::exact::sqrt((m0 * m0 - 4.0 * curve * v0).max(0.0));
            let qq = -0.5 * (m0 + disc.copysign(m0));
            for u in [0.0, h, qq / curve, v0 / qq] {
                if (0.0..=h).contains(&u) {
                    let q =
                        self.q[i][joint] + u * (v0 + u * (m0 / 2.0 + u * (m1 - m0) / (6.0 * h)));
                    if q < e.q_min.value {
                        e.q_min = at(q, t0 + u);
                    }
                    if q > e.q_max.value {
                        e.q_max = at(q, t0 + u);
                    }
                }
            }
        }
        e
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn arbitrary() -> impl Strategy<Value = JointTrajectory> {
        prop::collection::vec((0.02f64..0.9, prop::array::uniform7(-2.0f64..2.0)), 2..9).prop_map(
            |rows| {
                let mut t = 0.0;
                let mut times = Vec::new();
                let mut points = Vec::new();
                for (i, (dt, q)) in rows.into_iter().enumerate() {
                    if i > 0 {
                        t += dt;
                    }
                    times.push(t);
                    points.push(JointVector(q));
                }
                JointTrajectory::new(&times, &points).unwrap()
            },
        )
    }

    proptest! {
        #[test]
        fn passes_through_waypoints_at_rest_at_both_ends(t in arbitrary()) {
            for (time, q) in t.times_s().iter().zip(t.waypoints()) {
                prop_assert!((t.state_at(*time).q - *q).max_abs() < 1e-9);
            }
            prop_assert!(t.state_at(0.0).qd.max_abs() < 1e-6);
            prop_assert!(t.state_at(t.duration_s()).qd.max_abs() < 1e-6);
        }

        #[test]
        fn no_sample_exceeds_the_exact_extrema_and_they_are_reached(t in arbitrary()) {
            for j in 0..JOINTS {
                let e = t.extrema(j);
                let mut seen = [f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0];
                for k in 0..=4000 {
                    let s = t.state_at(t.duration_s() * f64::from(k) / 4000.0);
                    seen[0] = seen[0].min(s.q[j]);
                    seen[1] = seen[1].max(s.q[j]);
                    seen[2] = f64::max(seen[2], s.qd[j].abs());
                    seen[3] = f64::max(seen[3], s.qdd[j].abs());
                }
                let scale = 1.0 + e.qdd.value.abs();
                prop_assert!(seen[0] >= e.q_min.value - 1e-9);
                prop_assert!(seen[1] <= e.q_max.value + 1e-9);
                prop_assert!(seen[2] <= e.qd.value.abs() + 1e-9 * scale);
                prop_assert!(seen[3] <= e.qdd.value.abs() + 1e-9 * scale);
                prop_assert!((t.state_at(e.q_min.time_s).q[j] - e.q_min.value).abs() < 1e-9);
                prop_assert!((t.state_at(e.q_max.time_s).q[j] - e.q_max.value).abs() < 1e-9);
                prop_assert!((t.state_at(e.qd.time_s).qd[j] - e.qd.value).abs() < 1e-8 * scale);
                prop_assert!((t.state_at(e.qdd.time_s).qdd[j] - e.qdd.value).abs() < 1e-8 * scale);
            }
        }

        #[test]
        fn any_time_gives_a_finite_state(t in arbitrary(), bits in any::<u64>()) {
            prop_assert!(t.state_at(f64::from_bits(bits)).is_finite());
        }
    }

    #[test]
    fn is_twice_continuously_differentiable_at_waypoints() {
        let q = [0.0, 1.0, -0.5, 0.2].map(JointVector::splat);
        let t = JointTrajectory::new(&[0.0, 0.4, 0.9, 1.3], &q).unwrap();
        for time in [0.4, 0.9] {
            let (a, b) = (t.state_at(time - 1e-9), t.state_at(time + 1e-9));
            assert!((a.qd - b.qd).max_abs() < 1e-6);
            assert!((a.qdd - b.qdd).max_abs() < 1e-5);
        }
    }

    #[test]
    fn bad_input_is_named() {
        for (times_s, waypoints, said) in [
            (&[0.0, 0.5, 0.5][..], 3, "time 0.5 s of waypoint 2"),
            (&[0.0, f64::NAN, 0.5], 3, "waypoint 1 holds"),
            (&[0.0, 1.0], 3, "`times_s` has 2 entries"),
            (&[0.0], 1, "found 1"),
        ] {
            let q = vec![JointVector::ZERO; waypoints];
            let error = JointTrajectory::new(times_s, &q).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
