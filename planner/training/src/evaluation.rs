//! Predictions against the truth on held-out ropes, beside the paper's figures.

use planner::identify::scale::median_mass_per_length;
use serde::Serialize;
use shared_types::RopeParams;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use std::fmt::Write as _;

/// Mean absolute errors printed in the paper (table of in-domain results), order
/// of [`RANGES`].
pub(crate) const PAPER: [f64; ROPE_PARAMETERS] = [
    0.098, 0.006, 0.010, 0.111, 0.002, 0.007, 0.005, 0.008, 0.152,
];

/// Half width of a central 90 % interval of a Gaussian in its deviations.
const NINETY: f64 = 1.645;

/// A held-out rope and what the network made of its film.
#[derive(Debug)]
pub(crate) struct Judged {
    pub(crate) truth: RopeParams,
    /// Parameters found, order of [`RANGES`].
    pub(crate) found: [f64; ROPE_PARAMETERS],
    /// Their deviations as the network says.
    pub(crate) std_dev: [f64; ROPE_PARAMETERS],
}

/// One parameter's line.
#[derive(Debug, Serialize)]
pub(crate) struct Line {
    pub(crate) parameter: &'static str,
    pub(crate) unit: &'static str,
    /// Mean absolute error of the network.
    pub(crate) error: f64,
    /// The paper's.
    pub(crate) paper: f64,
    /// Of always guessing the middle of the range.
    pub(crate) middle: f64,
    /// Of knowing every ratio of stiffness, damping and masses, and nothing of
    /// their common scale, which no camera sees; none for other parameters.
    pub(crate) best_possible: Option<f64>,
    /// Part of the truths in the 90 % intervals that the network gives.
    pub(crate) covered_90: f64,
}

/// Errors of all parameters on held-out ropes.
#[derive(Debug, Serialize)]
pub(crate) struct Evaluation {
    /// Ropes judged.
    pub(crate) ropes: usize,
    pub(crate) lines: Vec<Line>,
    /// Mean of the errors as parts of the ranges.
    pub(crate) overall: f64,
    /// Median relative errors of stiffness, damping and lead mass over mass per
    /// length: what a throw depends on.
    pub(crate) ratio_errors: [f64; 3],
}

/// Judges predictions.
pub(crate) fn evaluate(judged: &[Judged]) -> Evaluation {
    let count = judged.len().max(1) as f64;
    let mean = |f: &dyn Fn(&Judged) -> f64| judged.iter().map(f).sum::<f64>() / count;
    let lines: Vec<Line> = (0..ROPE_PARAMETERS)
        .map(|i| {
            let range = RANGES[i];
            let middle = (range.min + range.max) / 2.0;
            let truth = |j: &Judged| j.truth.to_array()[i];
            let best = |j: &Judged| best_possible(&j.truth)[i].map(|b| (b - truth(j)).abs());
            Line {
                parameter: range.label,
                unit: range.unit,
                error: mean(&|j| (j.found[i] - truth(j)).abs()),
                paper: PAPER[i],
                middle: mean(&|j| (middle - truth(j)).abs()),
                best_possible: judged
                    .iter()
                    .map(best)
                    .sum::<Option<f64>>()
                    .map(|s| s / count),
                covered_90: mean(&|j| {
                    let inside = (j.found[i] - truth(j)).abs() <= NINETY * j.std_dev[i];
                    f64::from(u8::from(inside))
                }),
            }
        })
        .collect();
    let spans = RANGES.map(|r| r.max - r.min);
    let parts = lines
        .iter()
        .zip(spans)
        .map(|(line, span)| line.error / span);
    Evaluation {
        ropes: judged.len(),
        overall: parts.sum::<f64>() / ROPE_PARAMETERS as f64,
        lines,
        ratio_errors: core::array::from_fn(|which| {
            let mut errors: Vec<f64> = judged
                .iter()
                .map(|j| ratios(&j.found)[which] / ratios(&j.truth.to_array())[which] - 1.0)
                .map(f64::abs)
                .collect();
            errors.sort_by(f64::total_cmp);
            errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN)
        }),
    }
}

/// Stiffness, damping and lead mass over mass per length.
fn ratios(v: &[f64; ROPE_PARAMETERS]) -> [f64; 3] {
    [v[3] / v[5], v[2] / v[5], v[6] / v[5]]
}

/// The best guess of one who knows the ratios of stiffness, damping and masses.
fn best_possible(rope: &RopeParams) -> [Option<f64>; ROPE_PARAMETERS] {
    let ratios = ratios(&rope.to_array());
    let mass = median_mass_per_length(ratios);
    let mut best = [None; ROPE_PARAMETERS];
    best[3] = Some(ratios[0] * mass);
    best[2] = Some(ratios[1] * mass);
    best[5] = Some(mass);
    best[6] = Some(ratios[2] * mass);
    best
}

impl Evaluation {
    /// The table, as Markdown.
    pub(crate) fn table(&self) -> String {
        let mut out = String::from(
            "| parameter | unit | this network | paper | middle of range | best possible | inside 90 % |\n\
             |---|---|---:|---:|---:|---:|---:|\n",
        );
        for line in &self.lines {
            let best = line
                .best_possible
                .map_or_else(|| "-".to_owned(), |b| format!("{b:.4}"));
            // Writing to a string does not fail.
            let _ = writeln!(
                out,
                "| {} | {} | {:.4} | {} | {:.4} | {best} | {:.0} % |",
                line.parameter,
                line.unit,
                line.error,
                line.paper,
                line.middle,
                line.covered_90 * 100.0
            );
        }
        let _ = writeln!(
            out,
            "\n{} ropes; mean error {:.4} of the range (paper 0.045). Median error of \
             stiffness / mass {:.1} %, damping / mass {:.1} %, lead / rope mass {:.1} %.",
            self.ropes,
            self.overall,
            self.ratio_errors[0] * 100.0,
            self.ratio_errors[1] * 100.0,
            self.ratio_errors[2] * 100.0,
        );
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypercube::{Hypercube, Share};

    #[test]
    fn guessing_the_middle_and_knowing_the_ratios_give_the_known_errors() {
        let cube = Hypercube::new(1, Share::HeldOut, 4000);
        let judged: Vec<Judged> = (0..4000)
            .map(|i| Judged {
                truth: cube.rope(i),
                found: RANGES.map(|r| (r.min + r.max) / 2.0),
                std_dev: RANGES.map(|r| (r.max - r.min) / 2.0 / NINETY * 0.5),
            })
            .collect();
        let evaluation = evaluate(&judged);
        // The middle: a quarter of every range but the whole numbers'.
        assert!(
            (evaluation.overall - 0.254).abs() < 0.003,
            "{}",
            evaluation.overall
        );
        for line in &evaluation.lines[1..] {
            assert!((line.error / line.middle - 1.0).abs() < 1e-9);
            assert!((line.covered_90 - 0.5).abs() < 0.01, "{}", line.covered_90);
        }
        for (i, best) in [(3, 0.071), (2, 0.0034), (5, 0.0098), (6, 0.0098)] {
            let found = evaluation.lines[i].best_possible.unwrap();
            assert!((found / best - 1.0).abs() < 0.05, "{found} against {best}");
        }
        assert!(evaluation.lines[1].best_possible.is_none());
        assert!(
            evaluation
                .table()
                .contains("| length | m | 0.0500 | 0.006 |")
        );
    }
}
