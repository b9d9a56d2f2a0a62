//! How one joint follows its setpoints: dead time, second-order lag, bounded
//! speed.

use serde::{Deserialize, Serialize};
use shared_types::MonotonicNs;
use std::collections::VecDeque;

/// How a joint follows its setpoint: silence, then a second-order lag.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLag {
    /// Time before a setpoint has any effect (s).
    pub dead_time_s: f64,
    /// Natural frequency of the lag (rad/s).
    pub natural_frequency_rad_s: f64,
    /// Damping ratio of the lag; 1 is critical.
    pub damping_ratio: f64,
}

impl Default for JointLag {
    /// No tracking delay of the real arm is published; these are plausible for
    /// a harmonic drive with a 1 kHz loop behind a 250 Hz command cycle.
    fn default() -> Self {
        Self {
            dead_time_s: 0.008,
            natural_frequency_rad_s: core::f64::consts::TAU * 25.0,
            damping_ratio: 0.9,
        }
    }
}

/// A joint driven by a staircase of setpoints.
///
/// `q'' = w² (u - q) - 2 z w q'`, `u` being the setpoint of one dead time ago
/// and `|q'|` bounded. Setpoints switch at their exact time, not at the next
/// step of the integration, so that arrival jitter shows in the motion.
#[derive(Debug, Clone)]
pub(super) struct JointDynamics {
    lag: JointLag,
    speed_max_rad_s: f64,
    /// Setpoints under way, with the time they reach the drive.
    on_the_way: VecDeque<(MonotonicNs, f64)>,
    setpoint: f64,
    /// Dead time on top of the lag's own (s).
    pub(super) extra_lag_s: f64,
    /// Something holds it.
    pub(super) stuck: bool,
    pub(super) q: f64,
    pub(super) qd: f64,
    pub(super) qdd: f64,
}

impl JointDynamics {
    pub(super) fn new(lag: JointLag, q: f64, speed_max_rad_s: f64) -> Self {
        Self {
            lag,
            speed_max_rad_s,
            on_the_way: VecDeque::new(),
            setpoint: q,
            extra_lag_s: 0.0,
            stuck: false,
            q,
            qd: 0.0,
            qdd: 0.0,
        }
    }

    /// Gives a setpoint (rad) at time `at`.
    pub(super) fn command(&mut self, at: MonotonicNs, setpoint: f64) {
        let arrival = at.plus_s(self.lag.dead_time_s + self.extra_lag_s);
        // None overtakes the one before when the lag shrinks.
        let last = self.on_the_way.back().map_or(arrival, |(last, _)| *last);
        self.on_the_way.push_back((arrival.max(last), setpoint));
    }

    /// Runs from `from` to `to`, at most a few milliseconds later.
    pub(super) fn advance(&mut self, from: MonotonicNs, to: MonotonicNs) {
        let mut t = from;
        while let Some(&(arrival, setpoint)) = self.on_the_way.front() {
            if arrival > to {
                break;
            }
            if arrival > t {
                self.integrate(arrival.since_s(t));
                t = arrival;
            }
            self.setpoint = setpoint;
            self.on_the_way.pop_front();
        }
        if to > t {
            self.integrate(to.since_s(t));
        }
    }

    fn acceleration(&self, q: f64, qd: f64) -> f64 {
        let w = self.lag.natural_frequency_rad_s;
        w * w * (self.setpoint - q) - 2.0 * self.lag.damping_ratio * w * qd
    }

    /// One Runge-Kutta step of fourth order, then the speed bound.
    fn integrate(&mut self, dt_s: f64) {
        if self.stuck {
            (self.qd, self.qdd) = (0.0, 0.0);
            return;
        }
        let (q, v) = (self.q, self.qd);
        let half = 0.5 * dt_s;
        let a1 = self.acceleration(q, v);
        let v2 = v + half * a1;
        let a2 = self.acceleration(q + half * v, v2);
        let v3 = v + half * a2;
        let a3 = self.acceleration(q + half * v2, v3);
        let v4 = v + dt_s * a3;
        let a4 = self.acceleration(q + dt_s * v3, v4);
        let q_free = q + dt_s / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        let v_free = v + dt_s / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);

        let bound = self.speed_max_rad_s;
        self.q = q_free.clamp(q - bound * dt_s, q + bound * dt_s);
        self.qd = v_free.clamp(-bound, bound);
        let pull = self.acceleration(self.q, self.qd);
        let saturated = self.qd.abs() >= bound && pull * self.qd > 0.0;
        self.qdd = if saturated { 0.0 } else { pull };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn joint(dead_time_s: f64, damping_ratio: f64) -> JointDynamics {
        let lag = JointLag {
            dead_time_s,
            natural_frequency_rad_s: 100.0,
            damping_ratio,
        };
        JointDynamics::new(lag, 0.0, 3.0)
    }

    /// Textbook step response of a critically damped second-order lag,
    /// `1 - (1 + w t) exp(-w t)`, after the dead time.
    #[test]
    fn small_step_follows_the_closed_form() {
        let mut j = joint(0.0083, 1.0);
        j.command(MonotonicNs(0), 0.01);
        for k in 1..=60_u64 {
            j.advance(MonotonicNs((k - 1) * MS), MonotonicNs(k * MS));
            let wt = 100.0 * (k as f64 * 1e-3 - 0.0083).max(0.0);
            let want = 0.01 * (1.0 - (1.0 + wt) * (-wt).exp());
            assert!((j.q - want).abs() < 2e-8, "{k} ms: {} against {want}", j.q);
        }
    }

    #[test]
    fn a_big_step_never_exceeds_the_speed_bound() {
        let mut j = joint(0.0, 0.9);
        j.command(MonotonicNs(0), 2.0);
        let mut last = 0.0;
        for k in 1..=2000_u64 {
            j.advance(MonotonicNs((k - 1) * MS), MonotonicNs(k * MS));
            assert!(j.qd.abs() <= 3.0 && (j.q - last).abs() <= 3.0e-3 + 1e-12);
            last = j.q;
        }
        assert!((j.q - 2.0).abs() < 1e-6 && j.qd.abs() < 1e-6);
    }
}
