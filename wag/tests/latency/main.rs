//! The arm's response is found again: on twenty simulated arms in virtual time,
//! and on one over sockets by the command itself.
#![cfg(test)]

mod command;
mod stops;
#[path = "../support/mod.rs"]
mod support;
mod virtual_time;

use arm_model::JOINTS;
use arm_model::response::TrackingLag;
use nalgebra::Complex;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use xarm_sim::JointLag;

/// A secret for each joint, anywhere in what is plausible for such arms.
fn secret_lags(rng: &mut ChaCha8Rng) -> [JointLag; JOINTS] {
    core::array::from_fn(|_| JointLag {
        dead_time_s: rng.random_range(0.008..0.06),
        natural_frequency_rad_s: core::f64::consts::TAU * rng.random_range(4.0..25.0),
        damping_ratio: rng.random_range(0.5..1.2),
    })
}

/// A throw's joints hardly move faster than this (Hz).
const THROW_HZ: f64 = 4.0;

/// Frequency response: what a joint does of a setpoint's swing, and how late.
fn response(lag: &TrackingLag, hz: f64) -> Complex<f64> {
    let r = hz / lag.natural_frequency_hz.value;
    let swing = Complex::new(1.0 - r * r, 2.0 * lag.damping_ratio.value * r).inv();
    swing * Complex::cis(-core::f64::consts::TAU * hz * lag.dead_time_s.value)
}

/// How far an estimate is off.
#[derive(Debug, Clone, Copy)]
struct Errors {
    dead_time_s: f64,
    /// Of the frequency response up to [`THROW_HZ`], as a part of the joint's swing: the
    /// larger of them all.
    response: f64,
    /// Of the -3 dB bandwidth, as a part of it.
    bandwidth: f64,
    /// Of the natural frequency, as a part of it.
    natural_frequency: f64,
    damping_ratio: f64,
}

impl Errors {
    fn of(found: &TrackingLag, secret: &JointLag) -> Self {
        let exactly = |value| arm_model::response::Estimate {
            value,
            interval: [value; 2],
        };
        let truth = TrackingLag {
            dead_time_s: exactly(secret.dead_time_s),
            natural_frequency_hz: exactly(secret.natural_frequency_rad_s / core::f64::consts::TAU),
            damping_ratio: exactly(secret.damping_ratio),
            ..*found
        };
        let part = |found: f64, true_: f64| (found / true_ - 1.0).abs();
        Self {
            dead_time_s: (found.dead_time_s.value - secret.dead_time_s).abs(),
            response: (1..=16)
                .map(|k| THROW_HZ * f64::from(k) / 16.0)
                .map(|hz| (response(found, hz) - response(&truth, hz)).norm())
                .fold(0.0, f64::max),
            bandwidth: part(found.bandwidth_hz(), truth.bandwidth_hz()),
            natural_frequency: part(
                found.natural_frequency_hz.value,
                truth.natural_frequency_hz.value,
            ),
            damping_ratio: (found.damping_ratio.value - secret.damping_ratio).abs(),
        }
    }

    /// Dead time within so much (s), bandwidth and natural frequency within a part.
    fn are_below(&self, dead_time_s: f64, part: f64) -> bool {
        self.dead_time_s < dead_time_s && self.bandwidth < part && self.natural_frequency < part
    }
}

/// Prints worst and median of each error.
fn report(name: &str, all: &[Errors]) {
    let line = |what: &str, scale: f64, pick: fn(&Errors) -> f64| {
        let mut values: Vec<f64> = all.iter().map(|e| scale * pick(e)).collect();
        values.sort_by(f64::total_cmp);
        let worst = values.last().unwrap();
        println!(
            "{name}: {what}: worst {worst:.3}, median {:.3}",
            values[values.len() / 2]
        );
    };
    line("dead time (ms)", 1e3, |e| e.dead_time_s);
    line("response (%)", 1e2, |e| e.response);
    line("bandwidth (%)", 1e2, |e| e.bandwidth);
    line("natural frequency (%)", 1e2, |e| e.natural_frequency);
    line("damping ratio", 1.0, |e| e.damping_ratio);
}
