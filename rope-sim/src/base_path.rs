//! The attach motion as the integrator reads it: steps, restarts and a quintic per
//! few milliseconds.
//!
//! Evaluating an arm's kinematics at every step would cost as much as the rope.
//! Instead pose, velocity and acceleration are taken exactly at knots a few
//! milliseconds apart and joined by quintics in position and quaternion components,
//! whose own second derivatives match the accelerations at the knots. Coefficients
//! are made in double precision.

use crate::arm_knots::ArmKnots;
use crate::knot::{CHANNELS, Knot};
use crate::lanes::Precision;
use crate::motion::AttachMotion;
use arm_model::JointState;
use arm_model::kinematics::FrameMotion;

/// Longest time between exact evaluations of the attach motion (s).
const KNOT_S: f64 = 0.004;
/// Knots evaluated at a time; few enough to stay in the cache.
const AT_ONCE: usize = 32;
/// Jumps closer together than this are one (s).
const SAME_TIME_S: f64 = 1e-6;
/// How far beside a jump its two sides are looked at (s).
const BESIDE_S: f64 = 1e-11;

/// A few equal steps with one quintic per channel over them.
#[derive(Debug, Clone)]
pub(crate) struct Interval {
    pub(crate) start_s: f64,
    pub(crate) step_s: f64,
    pub(crate) steps: usize,
    /// Whether the first step is a restart.
    pub(crate) restart: bool,
    /// Powers of the fraction of the interval, lowest first.
    pub(crate) quintic: [[f64; 6]; CHANNELS],
}

impl Interval {
    /// Length (s).
    pub(crate) fn length_s(&self) -> f64 {
        self.step_s * self.steps as f64
    }

    /// Attach point (m) at time `t_s`.
    pub(crate) fn position_m(&self, t_s: f64) -> [f64; 3] {
        let u = (t_s - self.start_s) / self.length_s();
        core::array::from_fn(|c| {
            self.quintic[c]
                .iter()
                .rev()
                .fold(0.0, |sum: f64, a| sum.mul_add(u, *a))
        })
    }
}

/// The whole motion from 0 to the horizon.
#[derive(Debug, Clone)]
pub(crate) struct BasePath {
    pub(crate) intervals: Vec<Interval>,
    pub(crate) start: FrameMotion,
}

/// The motion gave a number that is not finite.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NotFinite {
    pub(crate) time_s: f64,
}

impl BasePath {
    /// Cuts `[0, horizon_s]` at the motion's acceleration jumps into steps of at most
    /// `step_s`.
    ///
    /// `memory` is that of a path no longer needed, or empty: asking the system for it
    /// anew for every candidate takes as long as filling it.
    pub(crate) fn new_in(
        mut memory: Vec<Interval>,
        motion: &dyn AttachMotion,
        step_s: f64,
        horizon_s: f64,
    ) -> Result<Self, NotFinite> {
        memory.clear();
        let mut path = Self {
            intervals: memory,
            start: evaluate(motion, 0.0)?,
        };
        let mut from_s = 0.0;
        for to_s in breaks(motion, horizon_s) {
            path.push_smooth_piece(motion, step_s, from_s, to_s)?;
            from_s = to_s;
        }
        Ok(path)
    }

    fn push_smooth_piece(
        &mut self,
        motion: &dyn AttachMotion,
        max_step_s: f64,
        from_s: f64,
        to_s: f64,
    ) -> Result<(), NotFinite> {
        let steps = steps_within(to_s - from_s, max_step_s);
        let step_s = (to_s - from_s) / steps as f64;
        let per_interval = ((KNOT_S / step_s + 1e-9).floor() as usize).max(1);
        let count = steps.div_ceil(per_interval);
        let at_s = |knot: usize| from_s + step_s * (knot * per_interval) as f64;
        let times_s: Vec<f64> = (0..=count)
            .map(|knot| match knot {
                0 => from_s + BESIDE_S,
                last if last == count => to_s - BESIDE_S,
                inner => at_s(inner),
            })
            .collect();
        self.intervals.reserve(count);
        let mut before: Option<Knot> = None;
        let mut index = 0;
        for times_s in times_s.chunks(AT_ONCE) {
            for mut after in knots(motion, times_s)? {
                if let Some(before) = &before {
                    after.on_the_side_of(before);
                    let now = per_interval.min(steps - index * per_interval);
                    self.intervals.push(Interval {
                        start_s: at_s(index),
                        step_s,
                        steps: now,
                        restart: index == 0,
                        quintic: quintics(before, &after, step_s * now as f64),
                    });
                    index += 1;
                }
                before = Some(after);
            }
        }
        Ok(())
    }

    /// Time at the end of step `count`, counted from 1 over the whole path, and the
    /// length of that step (s).
    pub(crate) fn end_of_step_s(&self, count: usize) -> (f64, f64) {
        let mut left = count;
        for interval in &self.intervals {
            if left <= interval.steps {
                return (
                    interval.start_s + interval.step_s * left as f64,
                    interval.step_s,
                );
            }
            left -= interval.steps;
        }
        self.intervals
            .last()
            .map_or((0.0, 0.0), |i| (i.start_s + i.length_s(), i.step_s))
    }
}

/// Equal steps of at most `max_step_s` that a smooth piece is cut into.
fn steps_within(length_s: f64, max_step_s: f64) -> usize {
    (length_s / max_step_s - 1e-9).ceil().max(1.0) as usize
}

/// Steps of at most `step_s` from jump to jump, up to the horizon: motions with equal
/// counts are integrated alike.
pub(crate) fn steps_between_jumps(
    motion: &dyn AttachMotion,
    step_s: f64,
    horizon_s: f64,
) -> Vec<usize> {
    let mut from_s = 0.0;
    breaks(motion, horizon_s)
        .into_iter()
        .map(|to_s| steps_within(to_s - core::mem::replace(&mut from_s, to_s), step_s))
        .collect()
}

/// Jumps inside the horizon, then the horizon.
fn breaks(motion: &dyn AttachMotion, horizon_s: f64) -> Vec<f64> {
    let mut times: Vec<f64> = motion
        .acceleration_jumps_s()
        .into_iter()
        .filter(|t| *t > SAME_TIME_S && *t < horizon_s - SAME_TIME_S)
        .collect();
    times.push(horizon_s);
    times.sort_by(f64::total_cmp);
    times.dedup_by(|later, earlier| *later - *earlier < SAME_TIME_S);
    times
}

fn evaluate(motion: &dyn AttachMotion, time_s: f64) -> Result<FrameMotion, NotFinite> {
    let m = motion.at(time_s);
    let sum = m.p_m.sum()
        + m.r.sum()
        + m.v_m_s.sum()
        + m.w_rad_s.sum()
        + m.a_m_s2.sum()
        + m.alpha_rad_s2.sum();
    if sum.is_finite() {
        Ok(m)
    } else {
        Err(NotFinite { time_s })
    }
}

/// Exact motion at each of the times.
fn knots(motion: &dyn AttachMotion, times_s: &[f64]) -> Result<Vec<Knot>, NotFinite> {
    let joints: Option<Vec<JointState>> = times_s.iter().map(|t| motion.joints_at(*t)).collect();
    let knots = match (joints, motion.pole()) {
        (Some(states), Some(pole)) => {
            let kernel = Precision::F64.fastest_kernel();
            kernel.run_double(ArmKnots {
                states: &states,
                pole_end_m: pole.end_m().into(),
            })
        }
        _ => times_s.iter().map(|t| Knot::new(&motion.at(*t))).collect(),
    };
    match knots.iter().position(|knot| !knot.is_finite()) {
        Some(index) => Err(NotFinite {
            time_s: times_s[index],
        }),
        None => Ok(knots),
    }
}

/// Quintics matching value, rate and acceleration at both ends.
fn quintics(a: &Knot, b: &Knot, length_s: f64) -> [[f64; 6]; CHANNELS] {
    core::array::from_fn(|c| {
        let (v0, v1) = (a.rate[c] * length_s, b.rate[c] * length_s);
        let (a0, a1) = (
            a.acceleration[c] * length_s * length_s,
            b.acceleration[c] * length_s * length_s,
        );
        // What is left for the cubic and higher powers to do at the far end.
        let d = (b.value[c] - a.value[c]) - v0 - 0.5 * a0;
        let e = v1 - v0 - a0;
        let f = a1 - a0;
        [
            a.value[c],
            v0,
            0.5 * a0,
            10.0 * d - 4.0 * e + 0.5 * f,
            -15.0 * d + 7.0 * e - f,
            6.0 * d - 3.0 * e + 0.5 * f,
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannedArm;
    use arm_model::{JointTrajectory, JointVector, Pole};

    fn arm() -> PlannedArm {
        let waypoints = [
            JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
            JointVector([0.3, -0.2, 0.4, 0.7, -0.5, 1.1, 0.6]),
            JointVector([0.1, -0.5, 0.2, 1.0, 0.3, 1.6, -0.4]),
        ];
        PlannedArm::new(
            JointTrajectory::new(&[0.0, 0.31234, 0.70321], &waypoints).unwrap(),
            Pole::default(),
        )
    }

    #[test]
    fn quintics_follow_the_arm_and_its_acceleration() {
        let arm = arm();
        let path = BasePath::new_in(Vec::new(), &arm, 5e-4, 1.0).unwrap();
        let mut squared = 0.0;
        for interval in &path.intervals {
            let u = 0.37_f64;
            let t_s = interval.start_s + u * interval.length_s();
            let want = arm.at(t_s);
            let got = interval.position_m(t_s);
            for axis in 0..3 {
                assert!(
                    (got[axis] - want.p_m[axis]).abs() < 1e-8,
                    "position at {t_s}"
                );
                let [_, _, c2, c3, c4, c5] = interval.quintic[axis];
                let second = 2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5));
                let error = second / interval.length_s().powi(2) - want.a_m_s2[axis];
                // Within the interval that holds a waypoint the jerk jumps.
                assert!(error.abs() < 0.3, "acceleration at {t_s}: {error}");
                squared += error * error;
            }
        }
        let rms = (squared / path.intervals.len() as f64).sqrt();
        assert!(rms < 0.03, "acceleration error {rms} m/s² of some 10");
    }

    #[test]
    fn steps_meet_the_end_of_the_trajectory_and_restart_there() {
        let path = BasePath::new_in(Vec::new(), &arm(), 5e-4, 1.0).unwrap();
        let starts: Vec<f64> = path
            .intervals
            .iter()
            .filter(|i| i.restart)
            .map(|i| i.start_s)
            .collect();
        assert_eq!(starts.len(), 2);
        assert!((starts[1] - 0.70321).abs() < 1e-12);
        let steps: usize = path.intervals.iter().map(|i| i.steps).sum();
        let (end_s, step_s) = path.end_of_step_s(steps);
        assert!((end_s - 1.0).abs() < 1e-12);
        assert!(step_s <= 5e-4 + 1e-15);
        assert!(path.intervals.iter().all(|i| i.length_s() <= KNOT_S + 1e-9));
    }
}
