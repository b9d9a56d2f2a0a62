//! When the arm began to wiggle, from the way of the clamp.
//!
//! The clamp moves as the arm was told, whatever the rope. The delay at which its
//! sway fits the known one sets the film's clock, so that a frame means the same
//! moment of the wiggle in every film.

use super::definition::ObserveError;

/// Delays of the wiggle behind the film's first frame that are tried (s).
const DELAY_S: [f64; 2] = [-0.4, 0.6];
/// Step of the first search (s): a fraction of any wiggle's period.
const COARSE_S: f64 = 0.02;
/// Where the search ends (s).
const FINE_S: f64 = 5e-4;
/// Least correlation of the two sways; tracking errors of 3 px leave 0.98.
const CORRELATION_MIN: f64 = 0.9;
/// Least and most part of the known sway that may be seen: a camera out of place by
/// centimetres changes it by a few hundredths.
const PART: [f64; 2] = [0.8, 1.25];

/// Way of the clamp along the forward axis, about its mean (m).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sway {
    pub(super) period_s: f64,
    pub(super) forward_m: Vec<f64>,
}

impl Sway {
    /// At a time; before and after, the clamp stands.
    fn at(&self, time_s: f64) -> f64 {
        let last = self.forward_m.len() - 1;
        let place = (time_s / self.period_s).clamp(0.0, last as f64);
        let before = (place as usize).min(last.saturating_sub(1));
        let after = (before + 1).min(last);
        let part = place - before as f64;
        self.forward_m[before] + (self.forward_m[after] - self.forward_m[before]) * part
    }
}

/// How far the wiggle is behind the film (s). `seen` holds times since the first
/// frame (s) and forward places (m) of the clamp.
///
/// # Errors
/// A clamp that does not move as in the known wiggle.
pub(super) fn delay_s(seen: &[[f64; 2]], sway: &Sway) -> Result<f64, ObserveError> {
    let fit = |delay_s: f64| fit(seen, sway, delay_s);
    let mut best = (f64::NEG_INFINITY, 0.0, 0.0);
    let consider = |delay_s: f64, best: &mut (f64, f64, f64)| {
        let (correlation, part) = fit(delay_s);
        if correlation > best.0 {
            *best = (correlation, part, delay_s);
        }
    };
    let mut delay = DELAY_S[0];
    while delay <= DELAY_S[1] {
        consider(delay, &mut best);
        delay += COARSE_S;
    }
    let mut step_s = COARSE_S / 2.0;
    while step_s > FINE_S {
        let middle = best.2;
        consider(middle - step_s, &mut best);
        consider(middle + step_s, &mut best);
        step_s /= 2.0;
    }
    let (correlation, part, delay_s) = best;
    if correlation >= CORRELATION_MIN && (PART[0]..=PART[1]).contains(&part) {
        return Ok(delay_s);
    }
    Err(ObserveError::new(format!(
        "the clamp does not move as in the wiggle the network was trained on: correlation {correlation:.2} (at least {CORRELATION_MIN} is needed), its sideways motion {:.0} % of the trained one's: film that wiggle, or use --method hybrid",
        part * 100.0
    )))
}

/// Correlation of the two sways at a delay, and the seen one as a part of the known.
fn fit(seen: &[[f64; 2]], sway: &Sway, delay_s: f64) -> (f64, f64) {
    let count = seen.len().max(1) as f64;
    let (mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [time_s, forward_m] in seen {
        let known = sway.at(time_s - delay_s);
        x += known / count;
        y += forward_m / count;
        xx += known * known / count;
        xy += known * forward_m / count;
        yy += forward_m * forward_m / count;
    }
    let (vx, vy, vxy) = (xx - x * x, yy - y * y, xy - x * y);
    if vx <= 1e-12 || vy <= 1e-12 {
        return (0.0, 0.0);
    }
    (vxy / (vx * vy).sqrt(), vxy / vx)
}
