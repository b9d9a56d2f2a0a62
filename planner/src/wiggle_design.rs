//! A wiggle that tells as much as possible about ropes of the ranges, within the arm's
//! limits and clear of arm and column.

use crate::identify::{IdentifyError, WiggleInformation, information};
use crate::ropes::random_rope;
use crate::wiggle::{WiggleConfig, WiggleError, clearance_m, wiggle};
use arm_model::{Cell, Limits};
use cmaes::{CmaError, CmaEs, CmaOptions, StopRules};
use rope_sim::PlannedArm;
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, StereoCamera};
use std::ops::ControlFlow;

/// Ropes a wiggle is judged by.
const ROPES: u64 = 8;
/// Least gap between rope and arm or column (m).
const GAP_MIN_M: f64 = 0.10;
/// Value of a wiggle that may not be executed.
const FORBIDDEN: f64 = 1e3;

/// Why a wiggle could not be judged.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// The wiggle itself.
    #[error(transparent)]
    Wiggle(#[from] WiggleError),
    /// Its information.
    #[error(transparent)]
    Information(#[from] IdentifyError),
    /// The search.
    #[error(transparent)]
    Search(#[from] CmaError),
    /// No wiggle of the search may be executed.
    #[error("no wiggle keeps limits and clearances: allow more of either")]
    Nothing,
    /// The caller broke off.
    #[error("the design was cancelled")]
    Cancelled,
}

/// A wiggle judged: medians over some ropes of the ranges.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JudgedWiggle {
    /// Amplitude (rad).
    pub amplitude_rad: f64,
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Time over which it fades in and out (s).
    pub ramp_s: f64,
    /// Deviations left.
    pub information: WiggleInformation,
    /// Smallest gap between any of the ropes and arm or column (m).
    pub gap_m: f64,
}

fn ropes(seed: u64) -> Vec<RopeParams> {
    (0..ROPES)
        .map(|i| random_rope((seed << 16) ^ 0x00de_5160 ^ i))
        .collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Judges a wiggle. `exact` takes the refinement's steps, else the search's.
///
/// # Errors
/// See [`DesignError`].
pub fn judge(
    config: &WiggleConfig,
    limits: &Limits,
    cell: &Cell,
    camera: &StereoCamera,
    seed: u64,
    exact: bool,
    threads: usize,
) -> Result<JudgedWiggle, DesignError> {
    let trajectory = wiggle(config, limits)?;
    let arm = PlannedArm::new(trajectory, cell.pole);
    let ropes = ropes(seed);
    let mut all = Vec::with_capacity(ropes.len());
    for rope in &ropes {
        all.extend(information(rope, &arm, camera, exact, threads)?);
    }
    let over = |of: fn(&WiggleInformation) -> f64| median(all.iter().map(of));
    let gaps = clearance_m(&trajectory, &ropes, cell, threads)?;
    Ok(JudgedWiggle {
        amplitude_rad: config.amplitude_rad,
        frequency_hz: config.frequency_hz,
        ramp_s: config.ramp_s,
        information: WiggleInformation {
            length_m: over(|i| i.length_m),
            bending_stiffness: over(|i| i.bending_stiffness),
            damping: over(|i| i.damping),
            lead_mass: over(|i| i.lead_mass),
            lead_radius_m: over(|i| i.lead_radius_m),
            links: over(|i| i.links),
            log_volume: over(|i| i.log_volume),
        },
        gap_m: gaps.iter().map(|g| g.0).fold(f64::INFINITY, f64::min),
    })
}

/// Searches amplitude, frequency and ramp for the most telling wiggle. `progress` gets
/// the generation and the best value so far.
///
/// # Errors
/// See [`DesignError`].
pub fn optimise(
    start: &WiggleConfig,
    limits: &Limits,
    cell: &Cell,
    camera: &StereoCamera,
    seed: u64,
    threads: usize,
    progress: &mut dyn FnMut(usize, f64) -> ControlFlow<()>,
) -> Result<WiggleConfig, DesignError> {
    const GENERATIONS: usize = 12;
    let most_ramp_s = start.duration_s / 2.0;
    let mut strategy = CmaEs::new(CmaOptions {
        mean: vec![
            start.amplitude_rad,
            start.frequency_hz,
            start.ramp_s.min(0.9 * most_ramp_s),
        ],
        std_dev: vec![0.12, 0.3, 0.6],
        lower: vec![0.05, 0.3, 0.3],
        upper: vec![0.8, 3.0, most_ramp_s],
        population: 8,
        draws_max: 1,
        seed,
        stop: StopRules {
            generations_max: GENERATIONS,
            ..StopRules::default()
        },
    })?;
    let at = |x: &[f64]| WiggleConfig {
        amplitude_rad: x[0],
        frequency_hz: x[1],
        ramp_s: x[2],
        ..*start
    };
    loop {
        let requested: Vec<Vec<f64>> = strategy.ask(&mut |_| true)?;
        let mut values = Vec::with_capacity(requested.len());
        for x in &requested {
            let value = match judge(&at(x), limits, cell, camera, seed, false, threads) {
                Ok(judged) if judged.gap_m >= GAP_MIN_M => judged.information.log_volume,
                Ok(_) | Err(DesignError::Wiggle(_)) => FORBIDDEN,
                Err(e) => return Err(e),
            };
            values.push(value);
        }
        strategy.tell(&values)?;
        let best = strategy.best().ok_or(DesignError::Nothing)?;
        if progress(strategy.generation(), best.fitness).is_break() {
            return Err(DesignError::Cancelled);
        }
        if strategy.stop().is_some() {
            return if best.fitness < FORBIDDEN {
                Ok(at(&best.x))
            } else {
                Err(DesignError::Nothing)
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::side_camera;

    #[test]
    fn a_wider_wiggle_tells_more() {
        let limits = Limits::default();
        let (cell, camera) = (Cell::default(), side_camera());
        let of = |amplitude_rad: f64| {
            let config = WiggleConfig {
                amplitude_rad,
                ..WiggleConfig::default()
            };
            judge(&config, &limits, &cell, &camera, 1, false, 2).unwrap()
        };
        let (narrow, wide) = (of(0.1), of(0.25));
        assert!(wide.information.log_volume < narrow.information.log_volume - 0.3);
        assert!(wide.information.length_m < narrow.information.length_m);
        assert!(wide.gap_m < narrow.gap_m + 1e-9);
    }
}
