//! Maximum likelihood over dead time, natural frequency, damping and the
//! standing offset of one joint.
//!
//! A coarse grid finds the valley, Levenberg-Marquardt steps its floor. Weights
//! come from the residuals themselves ([`Noise`]), so that quantisation, jitter
//! of the reports and single wild reports are each met by what they deserve.
//! Intervals come from the scatter of the score over short blocks of time
//! (the sandwich estimate), which stays honest when residuals of neighbouring
//! reports hang together.

use super::lag::Lag;
use super::noise::Noise;
use super::window::Window;
use arm_model::response::{Estimate, TrackingLag};
use nalgebra::{Matrix4, Vector4};

/// Parameters: dead time (s), logarithms of natural frequency (rad/s) and
/// damping ratio, offset (rad).
type Parameters = Vector4<f64>;

/// Range of each parameter that is looked at.
const LOW: [f64; 4] = [0.0, 0.693, -2.9, -0.1];
const HIGH: [f64; 4] = [0.25, 6.91, 1.4, 0.1];
/// Steps of the central differences.
const STEP: [f64; 4] = [2e-5, 1e-4, 1e-4, 1e-6];
/// Grid of the start: dead times (s), natural frequencies (Hz).
const GRID_DEAD_TIMES: usize = 20;
const GRID_STEP_S: f64 = 0.008;
const GRID_HZ: [f64; 6] = [2.0, 4.0, 8.0, 15.0, 30.0, 60.0];
/// Points of the grid that are followed to their valley.
const STARTS: usize = 4;
/// Steps within one valley, and rounds of weighing the reports anew.
const STEPS: usize = 40;
const ROUNDS: usize = 3;
/// Reports per block of the interval estimate: 0.24 s at 250 Hz, since the map
/// of the arm's clock wanders that slowly.
const BLOCK: usize = 60;
/// How late the map of the arm's clock may put a report: it lets go 200 ppm
/// between the fastest reports, about one a second (s).
const CLOCK_MAP_S: f64 = 2e-4;
/// Half a 95 % interval in standard deviations, and what few blocks add to it:
/// Student's quantile is 1.96 + 2.4 / degrees of freedom to a few percent.
const HALF_95: f64 = 1.96;
const HALF_95_FEW: f64 = 2.4;

fn lag(p: &Parameters) -> Lag {
    Lag {
        dead_time_s: p[0],
        natural_frequency_rad_s: p[1].exp(),
        damping_ratio: p[2].exp(),
    }
}

fn inside(p: Parameters) -> Parameters {
    Parameters::from_fn(|i, _| p[i].clamp(LOW[i], HIGH[i]))
}

/// Residuals (measured less model, rad) and speeds of the model (rad/s).
fn residuals(windows: &[Window], p: &Parameters) -> (Vec<f64>, Vec<f64>) {
    let count = windows.iter().map(|w| w.samples.len()).sum();
    let (mut off, mut speeds) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let lag = lag(p);
    for window in windows {
        let mut measured = window.samples.iter();
        lag.follow(window, |q, v| {
            if let Some((_, seen)) = measured.next() {
                off.push(seen - q - p[3]);
                speeds.push(v);
            }
        });
    }
    (off, speeds)
}

/// Derivatives of the model's positions by each parameter.
fn slopes(windows: &[Window], p: &Parameters) -> Vec<Parameters> {
    let mut out: Vec<Parameters> = Vec::new();
    for i in 0..4 {
        let mut ends = [*p, *p];
        ends[0][i] -= STEP[i];
        ends[1][i] += STEP[i];
        // A dead time below zero would be no model: one side only there.
        ends[0] = inside(ends[0]);
        let span = ends[1][i] - ends[0][i];
        let [(before, _), (after, _)] = ends.map(|p| residuals(windows, &p));
        out.resize(before.len(), Parameters::zeros());
        for (slope, (b, a)) in out.iter_mut().zip(before.iter().zip(&after)) {
            slope[i] = (b - a) / span;
        }
    }
    out
}

fn cost(windows: &[Window], p: &Parameters, noise: &Noise, speeds: &[f64]) -> f64 {
    let (off, _) = residuals(windows, p);
    off.iter()
        .zip(speeds)
        .map(|(r, v)| noise.cost(*r, *v))
        .sum()
}

/// Normal equations: curvature and descent.
fn normal(
    slopes: &[Parameters],
    off: &[f64],
    speeds: &[f64],
    noise: &Noise,
) -> (Matrix4<f64>, Vector4<f64>) {
    let (mut curvature, mut descent) = (Matrix4::zeros(), Vector4::zeros());
    for ((slope, r), v) in slopes.iter().zip(off).zip(speeds) {
        let weight = noise.weight(*r, *v);
        curvature += slope * slope.transpose() * weight;
        descent += slope * (weight * r);
    }
    (curvature, descent)
}

/// Steps downhill from `p` until nothing is gained; `noise` and the speeds it
/// is taken at stay fixed.
fn descend(windows: &[Window], start: Parameters, noise: &Noise) -> (Parameters, f64) {
    let mut p = start;
    let (mut off, speeds) = residuals(windows, &p);
    let mut best = cost(windows, &p, noise, &speeds);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let (curvature, descent) = normal(&slopes(windows, &p), &off, &speeds, noise);
        let mut gained = 0.0;
        while damping < 1e8 {
            let mut damped = curvature;
            for i in 0..4 {
                damped[(i, i)] += damping * curvature[(i, i)] + 1e-12;
            }
            let Some(step) = damped.lu().solve(&descent) else {
                damping *= 10.0;
                continue;
            };
            let next = inside(p + step);
            let found = cost(windows, &next, noise, &speeds);
            if found < best {
                gained = best - found;
                (p, best) = (next, found);
                damping = (damping * 0.2).max(1e-9);
                break;
            }
            damping *= 5.0;
        }
        if gained < 1e-7 * best.max(1e-9) {
            break;
        }
        off = residuals(windows, &p).0;
    }
    (p, best)
}

/// The best points of a coarse grid.
fn starts(windows: &[Window]) -> Vec<Parameters> {
    let mut tried: Vec<(f64, Parameters)> = Vec::new();
    for k in 0..GRID_DEAD_TIMES {
        for hz in GRID_HZ {
            let dead_time_s = GRID_STEP_S * k as f64;
            let w = (core::f64::consts::TAU * hz).ln();
            let p = Parameters::new(dead_time_s, w, -0.2, 0.0);
            let (off, _) = residuals(windows, &p);
            tried.push((off.iter().map(|r| r.abs()).sum(), p));
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    tried.truncate(STARTS);
    tried.into_iter().map(|(_, p)| p).collect()
}

/// The most likely lag for what one joint did, and whether a parameter of it sits at the end
/// of its range; `None` without samples. The lower end of the dead time leaves room for what
/// two clocks cannot tell from a lag: `round_trip_s` on the wire, and the error of their map.
pub(super) fn most_likely(windows: &[Window], round_trip_s: f64) -> Option<(TrackingLag, bool)> {
    let starts = starts(windows);
    let even = Noise::even(&residuals(windows, starts.first()?).0);
    let (mut p, _) = starts
        .into_iter()
        .map(|start| descend(windows, start, &even))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    for _ in 0..ROUNDS {
        let (off, speeds) = residuals(windows, &p);
        let noise = Noise::from_residuals(&off, &speeds);
        (p, _) = descend(windows, p, &noise);
    }
    let (off, speeds) = residuals(windows, &p);
    let noise = Noise::from_residuals(&off, &speeds);
    let half = half_95(&slopes(windows, &p), &off, &speeds, &noise)?;
    let exponential = |i: usize, unit: f64| Estimate {
        value: p[i].exp() * unit,
        interval: [(p[i] - half[i]).exp() * unit, (p[i] + half[i]).exp() * unit],
    };
    let earliest_s = p[0] - half[0] - round_trip_s - CLOCK_MAP_S;
    let cut = |r: &f64, v: &f64| (r * r).min(9.0 * noise.variance(*v));
    let squares: f64 = off.iter().zip(&speeds).map(|(r, v)| cut(r, v)).sum();
    let lag = TrackingLag {
        dead_time_s: Estimate {
            value: p[0],
            interval: [earliest_s.max(0.0), p[0] + half[0]],
        },
        natural_frequency_hz: exponential(1, 1.0 / core::f64::consts::TAU),
        damping_ratio: exponential(2, 1.0),
        residual_rad: (squares / off.len().max(1) as f64).sqrt(),
        samples: u32::try_from(off.len()).unwrap_or(u32::MAX),
    };
    let at_bound = (1..3).any(|i| p[i] <= LOW[i] || p[i] >= HIGH[i]) || p[0] >= HIGH[0];
    Some((lag, at_bound))
}

/// Half of each parameter's 95 % interval.
fn half_95(
    slopes: &[Parameters],
    off: &[f64],
    speeds: &[f64],
    noise: &Noise,
) -> Option<Parameters> {
    let (curvature, _) = normal(slopes, off, speeds, noise);
    let inverse = curvature.try_inverse()?;
    let mut scatter = Matrix4::zeros();
    let rows: Vec<Parameters> = slopes
        .iter()
        .zip(off.iter().zip(speeds))
        .map(|(slope, (r, v))| slope * (noise.weight(*r, *v) * r))
        .collect();
    for block in rows.chunks(BLOCK) {
        let score: Parameters = block.iter().sum();
        scatter += score * score.transpose();
    }
    // Few blocks scatter less than many would, by the parameters fitted.
    let blocks = rows.len().div_ceil(BLOCK).max(6) as f64;
    let freedom = blocks - 5.0;
    let robust = inverse * scatter * inverse * (blocks / freedom);
    // Whichever is wider: what the noise allows, or what was seen.
    let std_dev = Parameters::from_fn(|i, _| robust[(i, i)].max(inverse[(i, i)]).max(0.0).sqrt());
    Some(std_dev * (HALF_95 + HALF_95_FEW / freedom))
}
