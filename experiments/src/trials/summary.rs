//! Tables of identified parameters.

use super::{Trial, mean, quantile};
use serde::{Deserialize, Serialize};
use shared_types::rope::{RANGES, ROPE_PARAMETERS};

/// Errors of the paper's network: mean absolute, in the order of [`RANGES`].
pub const PAPER: [f64; ROPE_PARAMETERS] = [
    0.098, 0.006, 0.010, 0.111, 0.002, 0.007, 0.005, 0.008, 0.152,
];
/// Best possible mean absolute errors of what no film shows, all ratios known exactly.
const BEST: [Option<f64>; ROPE_PARAMETERS] = [
    None,
    None,
    Some(0.0034),
    Some(0.071),
    None,
    Some(0.0098),
    Some(0.0098),
    None,
    None,
];

/// One parameter over all trials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterRow {
    /// Name of the parameter.
    pub label: String,
    /// Mean absolute error, in the parameter's unit.
    pub mean_error: f64,
    /// Median absolute error.
    pub median_error: f64,
    /// Mean error of the paper's network.
    pub paper: f64,
    /// Mean error of always answering the middle of the range.
    pub middle: f64,
    /// Best possible mean error where the scale of the masses limits it.
    pub best_possible: Option<f64>,
    /// Fraction of the trials whose interval of 90 % holds the truth.
    pub coverage: f64,
}

/// A ratio over all trials: absolute relative errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RatioRow {
    /// What it is.
    pub label: String,
    /// Median (1).
    pub median: f64,
    /// Nine tenths are below (1).
    pub p90: f64,
}

/// Summary of all trials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SysidSummary {
    /// Trials.
    pub trials: usize,
    /// Rows per parameter.
    pub parameters: Vec<ParameterRow>,
    /// Rows of ratios.
    pub ratios: Vec<RatioRow>,
    /// Fraction of the ropes, all of the ranges, that were flagged as out of distribution.
    pub flagged_fraction: f64,
    /// Median distance of the fit to the keypoints (px).
    pub residual_px: f64,
    /// Mean number of simulations.
    pub simulations: f64,
}

fn parameter(trials: &[Trial], i: usize) -> ParameterRow {
    let range = RANGES[i];
    let error = |t: &Trial| (t.found[i] - t.truth[i]).abs();
    let holds = |t: &Trial| {
        let [low, high] = t.interval_90[i];
        f64::from(u8::from(t.truth[i] >= low && t.truth[i] <= high))
    };
    ParameterRow {
        label: range.label.to_owned(),
        mean_error: mean(trials.iter().map(error)),
        median_error: quantile(trials.iter().map(error), 0.5),
        paper: PAPER[i],
        middle: mean(
            trials
                .iter()
                .map(|t| (f64::midpoint(range.min, range.max) - t.truth[i]).abs()),
        ),
        best_possible: BEST[i],
        coverage: mean(trials.iter().map(holds)),
    }
}

/// Sums trials up.
#[must_use]
pub fn summarise(trials: &[Trial]) -> SysidSummary {
    let ratio = |label: &str, of: fn(&[f64; ROPE_PARAMETERS]) -> f64| {
        let error = |t: &Trial| (of(&t.found) / of(&t.truth) - 1.0).abs();
        RatioRow {
            label: label.to_owned(),
            median: quantile(trials.iter().map(error), 0.5),
            p90: quantile(trials.iter().map(error), 0.9),
        }
    };
    SysidSummary {
        trials: trials.len(),
        parameters: (0..ROPE_PARAMETERS).map(|i| parameter(trials, i)).collect(),
        ratios: vec![
            ratio("bending stiffness k s / mass per length", |v| {
                v[3] * v[1] / v[0] / v[5]
            }),
            ratio("joint stiffness k / mass per length", |v| v[3] / v[5]),
            ratio("damping c / stiffness k", |v| v[2] / v[3]),
            ratio("lead mass / mass per length", |v| v[6] / v[5]),
        ],
        flagged_fraction: mean(trials.iter().map(|t| f64::from(u8::from(t.flagged)))),
        residual_px: quantile(trials.iter().map(|t| t.residual_px), 0.5),
        simulations: mean(trials.iter().map(|t| f64::from(t.simulations))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_coverage_and_ratios_are_those_of_the_trials() {
        let truth = [23.0, 0.55, 0.02, 0.4, 0.008, 0.06, 0.06, 0.03, 0.9];
        let trial = |factor: f64, low: f64| Trial {
            index: 0,
            truth,
            found: truth.map(|v| v * factor),
            interval_90: truth.map(|v| [v * low, v * 1.2]),
            residual_px: 1.0,
            out_of_distribution: 0.0,
            flagged: low > 1.0,
            method: "hybrid-search".to_owned(),
            simulations: 10,
        };
        let s = summarise(&[trial(1.1, 0.9), trial(1.0, 1.1)]);
        let length = &s.parameters[1];
        assert!((length.mean_error - 0.0275).abs() < 1e-12);
        assert_eq!(length.coverage, 0.5);
        assert_eq!(s.flagged_fraction, 0.5);
        // A common factor leaves ratios alone; a bending stiffness has a length in it.
        assert!(s.ratios[2].median < 1e-12 && s.ratios[3].p90 < 1e-12);
        assert!(s.ratios[0].p90 < 1e-12);
    }
}
