//! The model of one joint: dead time, then a second-order lag of gain one,
//! driven by a staircase.

use super::window::Window;
use serde::{Deserialize, Serialize};

/// Parameters of the model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Lag {
    pub(super) dead_time_s: f64,
    pub(super) natural_frequency_rad_s: f64,
    pub(super) damping_ratio: f64,
}

/// Deviation from the setpoint (rad) and velocity (rad/s).
#[derive(Debug, Clone, Copy)]
struct State {
    e: f64,
    v: f64,
}

/// Below this the series of `sin x / x` is exact to rounding.
const SERIES_BELOW: f64 = 1e-3;

impl Lag {
    /// Time from a step's sending until less than a ten-thousandth of it is missing (s): that of
    /// the slower of its two decays.
    pub(super) fn arrival_s(&self) -> f64 {
        const LEFT: f64 = 1e-4;
        let z = self.damping_ratio;
        let slowest = self.natural_frequency_rad_s * (z - (z * z - 1.0).max(0.0).sqrt());
        // A critical decay has a linear term as well; the factor covers it.
        self.dead_time_s + 1.4 * -LEFT.ln() / slowest.max(1e-3)
    }

    /// Free motion for `dt_s` under a constant setpoint, exact for any damping.
    fn advance(&self, state: State, dt_s: f64) -> State {
        let (w, z) = (self.natural_frequency_rad_s, self.damping_ratio);
        let stiff = 1.0 - z * z;
        let x = w * stiff.abs().sqrt() * dt_s;
        // cos and sin / (w sqrt stiff), or their hyperbolic kin.
        let (c, s) = if x < SERIES_BELOW {
            let square = x * x * stiff.signum();
            (1.0 - 0.5 * square, dt_s * (1.0 - square / 6.0))
        } else if stiff > 0.0 {
            (x.cos(), dt_s * x.sin() / x)
        } else {
            (x.cosh(), dt_s * x.sinh() / x)
        };
        let decay = (-z * w * dt_s).exp();
        State {
            e: decay * (state.e * c + (state.v + z * w * state.e) * s),
            v: decay * (state.v * c - (w * w * state.e + z * w * state.v) * s),
        }
    }

    /// Position (rad) and velocity (rad/s) at every sample of a window, which
    /// the joint enters at rest.
    pub(super) fn follow(&self, window: &Window, mut each: impl FnMut(f64, f64)) {
        let mut setpoints = window.setpoints.iter();
        let Some(&(first_s, first)) = setpoints.next() else {
            return;
        };
        let mut now_s = first_s + self.dead_time_s;
        let mut setpoint = first;
        let mut state = State { e: 0.0, v: 0.0 };
        let mut next = setpoints.next();
        for &(at_s, _) in &window.samples {
            while let Some(&(sent_s, q)) = next {
                let arrives_s = sent_s + self.dead_time_s;
                if arrives_s > at_s {
                    break;
                }
                state = self.advance(state, arrives_s - now_s);
                state.e += setpoint - q;
                (setpoint, now_s) = (q, arrives_s);
                next = setpoints.next();
            }
            if at_s > now_s {
                state = self.advance(state, at_s - now_s);
                now_s = at_s;
            }
            each(setpoint + state.e, state.v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms of the unit step response, under-, critically and
    /// overdamped, sampled unevenly.
    #[test]
    fn steps_follow_their_closed_forms() {
        let times_s: Vec<f64> = (1..200).map(|k| 0.0013 * f64::from(k)).collect();
        let window = Window {
            setpoints: vec![(0.0, 0.0), (0.01, 1.0)],
            samples: times_s.iter().map(|t| (*t, 0.0)).collect(),
        };
        for damping_ratio in [0.3, 0.999_999_9, 1.0, 1.000_000_1, 1.7] {
            let lag = Lag {
                dead_time_s: 0.02,
                natural_frequency_rad_s: 60.0,
                damping_ratio,
            };
            let mut seen = Vec::new();
            lag.follow(&window, |q, _| seen.push(q));
            for (t, q) in times_s.iter().zip(&seen) {
                let want = step(60.0, damping_ratio, (t - 0.03).max(0.0));
                assert!(
                    (q - want).abs() < 1e-6,
                    "{damping_ratio}, {t} s: {q} {want}"
                );
            }
        }
    }

    fn step(w: f64, z: f64, t: f64) -> f64 {
        if (z - 1.0).abs() < 1e-6 {
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
}
