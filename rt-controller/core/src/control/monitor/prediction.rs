//! Where the joints should be: behind what was commanded by as much as was measured of this
//! arm.
//!
//! Each joint follows `q'' = w² (u(t - dead time) - q) - 2 z w q'`, `u` being the setpoint in
//! force. Between two instants a millisecond apart that is one product with a matrix, which is
//! computed once.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of floats only; integers use saturating calls"
)]

use super::history::Commanded;
use arm_model::{JOINTS, JointVector};
use serde::{Deserialize, Serialize};
use shared_types::MonotonicNs;

/// Step (s, ns).
const STEP_S: f64 = 1e-3;
const STEP_NS: u64 = 1_000_000;
/// Steps to catch up with at most; after a longer pause the joints rest.
const STEPS_MAX: u32 = 256;
/// Longest dead time (s): less than setpoints are remembered.
pub const DEAD_TIME_MAX_S: f64 = 0.2;
/// How much earlier or later than predicted a measured joint may be somewhere (ns): allows for
/// errors of dead time and clocks.
pub const PREDICTED_WITHIN_NS: u64 = 20_000_000;

/// How a joint follows its setpoints, as measured. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeasuredLag {
    /// Time before a setpoint has any effect (s).
    pub dead_time_s: f64,
    /// Natural frequency of the lag (rad/s).
    pub natural_frequency_rad_s: f64,
    /// Damping ratio of the lag; 1 is critical.
    pub damping_ratio: f64,
}

/// The lag of each joint, joint 1 first; `None` for a joint that was not measured.
pub type MeasuredLags = [Option<MeasuredLag>; JOINTS];

/// A joint's distance from its setpoint (rad) and velocity (rad/s), a step later.
type Transition = [[f64; 2]; 2];

fn product(a: &Transition, b: &Transition) -> Transition {
    let [[b00, b01], [b10, b11]] = *b;
    a.map(|[left, right]| [left * b00 + right * b10, left * b01 + right * b11])
}

impl MeasuredLag {
    /// The exponential of the lag's matrix times a step, by its series for a 1024th of the step
    /// and ten squares.
    fn transition(&self) -> Transition {
        let (w, z) = (self.natural_frequency_rad_s, self.damping_ratio);
        let h = STEP_S / 1024.0;
        let matrix = [[0.0, h], [-w * w * h, -2.0 * z * w * h]];
        let mut power = [[1.0, 0.0], [0.0, 1.0]];
        let mut sum = power;
        for n in 1..=6_u8 {
            power = product(&power, &matrix).map(|row| row.map(|v| v / f64::from(n)));
            for (to, from) in sum.as_flattened_mut().iter_mut().zip(power.as_flattened()) {
                *to += from;
            }
        }
        (0..10).fold(sum, |m, _| product(&m, &m))
    }
}

/// One joint: what its lag makes of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Follower {
    dead_ns: u64,
    transition: Transition,
}

/// Where the joints should be, and should have been. RT-safe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    joints: [Option<Follower>; JOINTS],
    at_ns: u64,
    q: JointVector,
    qd: JointVector,
    passed: Commanded,
}

impl Prediction {
    /// Of an arm that was measured; it rests at zero.
    #[must_use]
    pub fn new(lags: &MeasuredLags) -> Self {
        let joints = lags.map(|lag| {
            lag.map(|lag| Follower {
                dead_ns: MonotonicNs(0).plus_s(lag.dead_time_s).0,
                transition: lag.transition(),
            })
        });
        Self {
            joints,
            at_ns: 0,
            q: JointVector::ZERO,
            qd: JointVector::ZERO,
            passed: Commanded::holding(JointVector::ZERO),
        }
    }

    /// The same arm at rest in `q` (rad).
    #[must_use]
    pub fn holding(&self, q: JointVector) -> Self {
        Self {
            joints: self.joints,
            at_ns: 0,
            q,
            qd: JointVector::ZERO,
            passed: Commanded::holding(q),
        }
    }

    /// Of each joint: what is predicted if it was measured, else something else.
    #[must_use]
    pub fn or_else(&self, predicted: JointVector, otherwise: JointVector) -> JointVector {
        let mut chosen = otherwise;
        for (j, joint) in self.joints.iter().enumerate() {
            if joint.is_some() {
                chosen[j] = predicted[j];
            }
        }
        chosen
    }

    /// Advances to `now_ns` under the setpoints `sent`. RT-safe: 256 steps at most.
    pub fn advance(&mut self, now_ns: u64, sent: &Commanded) {
        let behind_ns = now_ns.saturating_sub(self.at_ns);
        if behind_ns > STEP_NS.saturating_mul(STEPS_MAX.into()) {
            // It rests: nothing was sent before, or not for long.
            self.at_ns = now_ns;
            self.qd = JointVector::ZERO;
            for (j, joint) in self.joints.iter().enumerate() {
                if joint.is_some() {
                    self.q[j] = sent.in_force(now_ns, j);
                }
            }
        }
        for _ in 0..STEPS_MAX {
            let next_ns = self.at_ns.saturating_add(STEP_NS);
            if next_ns > now_ns {
                break;
            }
            for (j, joint) in self.joints.iter().enumerate() {
                let Some(Follower {
                    dead_ns,
                    transition: [position, velocity],
                }) = joint
                else {
                    continue;
                };
                let setpoint = sent.in_force(self.at_ns.saturating_sub(*dead_ns), j);
                let (e, v) = (self.q[j] - setpoint, self.qd[j]);
                self.q[j] = setpoint + position[0] * e + position[1] * v;
                self.qd[j] = velocity[0] * e + velocity[1] * v;
            }
            self.at_ns = next_ns;
        }
        self.passed.push(self.at_ns, self.q);
    }

    /// Where the joints should have been at `at_ns` (rad).
    #[must_use]
    pub fn at(&self, at_ns: u64) -> JointVector {
        self.passed.at(at_ns)
    }

    /// Least and largest of where the joints should be within [`PREDICTED_WITHIN_NS`] of `at_ns`
    /// (rad): beyond the present, where nothing is known yet, as fast as now.
    #[must_use]
    pub fn bounds(&self, at_ns: u64) -> [JointVector; 2] {
        let from_ns = at_ns.saturating_sub(PREDICTED_WITHIN_NS);
        let to_ns = at_ns.saturating_add(PREDICTED_WITHIN_NS);
        let [low, high] = self.passed.bounds(from_ns, to_ns);
        let beyond_ns = to_ns.saturating_sub(self.at_ns).min(PREDICTED_WITHIN_NS);
        let ahead = self.q + self.qd * MonotonicNs(beyond_ns).since_s(MonotonicNs(0));
        [
            low.zip_with(ahead, f64::min),
            high.zip_with(ahead, f64::max),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lag(dead_time_s: f64, w_rad_s: f64, damping_ratio: f64) -> Option<MeasuredLag> {
        Some(MeasuredLag {
            dead_time_s,
            natural_frequency_rad_s: w_rad_s,
            damping_ratio,
        })
    }

    /// An arm that rests at zero, and what was sent to it.
    fn at_zero(lags: MeasuredLags) -> (Prediction, Commanded) {
        let zero = JointVector::ZERO;
        (
            Prediction::new(&lags).holding(zero),
            Commanded::holding(zero),
        )
    }

    /// Closed forms of the unit step response, under-, critically and overdamped, fast and slow.
    #[test]
    fn steps_follow_their_closed_forms() {
        for (w, z) in [(60.0, 0.3), (60.0, 1.0), (15.0, 1.7), (3000.0, 10.0)] {
            let mut lags = [None; JOINTS];
            lags[3] = lag(0.02, w, z);
            let (mut joints, mut sent) = at_zero(lags);
            let start_ns = 1_000_000_000;
            for cycle in 0..60_u64 {
                let now_ns = start_ns + cycle * 4_000_000;
                joints.advance(now_ns, &sent);
                sent.push(now_ns, JointVector::splat(1.0));
                let t_s = (cycle as f64).mul_add(4e-3, -0.02).max(0.0);
                let (found, expected) = (joints.q[3], step(w, z, t_s));
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{w} {z} {t_s}: {found} {expected}"
                );
                assert_eq!(joints.q[2], 0.0, "it was not measured");
            }
        }
    }

    fn step(w: f64, z: f64, t: f64) -> f64 {
        if z == 1.0 {
            return 1.0 - (1.0 + w * t) * (-w * t).exp();
        }
        if z < 1.0 {
            let d = w * (1.0 - z * z).sqrt();
            return 1.0 - (-z * w * t).exp() * ((d * t).cos() + z * w / d * (d * t).sin());
        }
        let root = (z * z - 1.0).sqrt();
        let (a, b) = (w * (z - root), w * (z + root));
        1.0 - (b * (-a * t).exp() - a * (-b * t).exp()) / (b - a)
    }

    #[test]
    fn after_a_long_pause_it_rests_where_it_was_sent() {
        let (mut joints, mut sent) = at_zero([lag(0.01, 5.0, 0.9); JOINTS]);
        for now_ns in (0..20_u64).map(|cycle| 1_000_000_000 + cycle * 4_000_000) {
            joints.advance(now_ns, &sent);
            sent.push(now_ns, JointVector::splat(1.0));
        }
        assert!((0.01..0.5).contains(&joints.q[0]), "{:?}", joints.q);
        for now_ns in [3_000_000_000, u64::MAX] {
            joints.advance(now_ns, &sent);
            assert_eq!(
                (joints.q, joints.qd),
                (JointVector::splat(1.0), JointVector::ZERO)
            );
        }
    }

    /// A joint that is early or late by less than the tolerance is where it should be.
    #[test]
    fn bounds_reach_20_ms_before_and_after() {
        let (mut joints, mut sent) = at_zero([lag(0.02, 300.0, 1.0); JOINTS]);
        let (start_ns, speed_rad_s) = (1_000_000_000, 2.0);
        let cycle_ns = |cycle: u32| start_ns + u64::from(cycle) * 4_000_000;
        for cycle in 0..50 {
            joints.advance(cycle_ns(cycle), &sent);
            let q_rad = f64::from(cycle) * 4e-3 * speed_rad_s;
            sent.push(cycle_ns(cycle), JointVector::splat(q_rad));
        }
        // Reports of the present and of a cycle before.
        for stamp_ns in [cycle_ns(49), cycle_ns(48)] {
            let [low, high] = joints.bounds(stamp_ns).map(|q| q[3]);
            let here = joints.at(stamp_ns)[3];
            for (way_rad, expected_s) in [(here - low, 0.02), (high - here, 0.02)] {
                let way_s = way_rad / speed_rad_s;
                assert!((way_s - expected_s).abs() < 0.005, "{low} {here} {high}");
            }
        }
    }
}
