//! `experiments parameter-importance`: strikes planned with some parameters identified and
//! the others random, thrown with the true rope, next to the paper's table.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use super::strikes::{StrikeCase, Thrower, strike_trials};
use crate::report::Column;
use cli_output::Outcome;
use experiments::trials::Spread;
use planner::plan::PlanError;
use planner::ropes::trial_rope;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shared_types::RopeParams;

/// Ropes of the paper's table.
const ROPES: u64 = 30;
/// Random parameter sets per rope and condition, as many as the paper has.
const DRAWS: usize = 10;
/// Sets drawn at most to find those: the target may be out of a random rope's reach.
const ATTEMPTS: u64 = 40;
/// Keeps the random parameters apart from the ropes thrown.
const OTHER: u64 = 0x0072_6e64_0000;

/// Position of length and lead mass in [`RopeParams::to_array`].
const LENGTH: usize = 1;
const LEAD_MASS: usize = 6;

/// What is identified while the rest is random, its name, and mean and standard deviation of
/// the paper (cm).
type Condition = (&'static [usize], &'static str, [f64; 2]);

/// In the order of `ImportanceTrial::partly_m`.
const CONDITIONS: [Condition; 4] = [
    (&[LENGTH, LEAD_MASS], "length and lead mass", [10.9, 10.1]),
    (&[LENGTH], "length", [13.3, 13.5]),
    (&[LEAD_MASS], "lead mass", [12.3, 10.5]),
    (&[], "none", [14.2, 12.5]),
];

/// One rope and target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ImportanceTrial {
    index: u64,
    target_m: [f64; 3],
    /// Error with all parameters identified (m).
    identified_m: f64,
    /// Errors in each condition, by draw (m).
    partly_m: [Vec<f64>; CONDITIONS.len()],
}

impl ImportanceTrial {
    fn of(case: &StrikeCase) -> Result<Self, PlanError> {
        let (thrower, found) = (&case.thrower, &case.found.params);
        let whole = thrower.plan(found, 1)?;
        let mut partly_m = [const { Vec::new() }; CONDITIONS.len()];
        for (errors_m, (identified, ..)) in partly_m.iter_mut().zip(CONDITIONS) {
            let seed = case.seed.wrapping_add(case.index);
            *errors_m = errors_with(thrower, found, identified, seed)?;
        }
        Ok(Self {
            index: case.index,
            target_m: case.target_m,
            identified_m: thrower.throw(&whole)?.error_m,
            partly_m,
        })
    }
}

/// Errors of throws planned with random parameters besides the identified ones.
fn errors_with(
    thrower: &Thrower,
    found: &RopeParams,
    identified: &[usize],
    seed: u64,
) -> Result<Vec<f64>, PlanError> {
    let mut errors_m = Vec::with_capacity(DRAWS);
    for attempt in 0..ATTEMPTS {
        let rope = mixed(found, identified, &trial_rope(seed ^ OTHER, attempt));
        match thrower.plan(&rope, 1) {
            Err(PlanError::OnlyCollisions { .. } | PlanError::Unreachable { .. }) => {}
            planned => errors_m.push(thrower.throw(&planned?)?.error_m),
        }
        if errors_m.len() == DRAWS {
            break;
        }
    }
    Ok(errors_m)
}

/// Some parameters of one rope in another.
fn mixed(found: &RopeParams, identified: &[usize], other: &RopeParams) -> RopeParams {
    let (found, mut values) = (found.to_array(), other.to_array());
    for at in identified {
        values[*at] = found[*at];
    }
    RopeParams::from_array(values)
}

/// One condition, with mean and standard deviation of the paper (cm).
#[derive(Debug, Serialize)]
struct Row {
    identified: &'static str,
    error: Spread,
    throws: usize,
    paper_cm: [f64; 2],
}

const TABLE: [Column<Row>; 6] = [
    ("identified, the rest random", |row| {
        row.identified.to_owned()
    }),
    ("mean (cm)", |row| cm(row.error.mean_m)),
    ("std (cm)", |row| cm(row.error.std_m)),
    ("median (cm)", |row| cm(row.error.median_m)),
    ("throws", |row| row.throws.to_string()),
    ("paper (cm)", |row| {
        format!("{} ± {}", row.paper_cm[0], row.paper_cm[1])
    }),
];

/// The conditions, with their errors (cm) as curves.
fn rows(trials: &[ImportanceTrial]) -> (Vec<Row>, Vec<Curve>) {
    let row = |identified: &'static str, errors_m: Vec<f64>, paper_cm: [f64; 2]| {
        let curve = Curve::cm(identified, errors_m.iter().copied(), Some(paper_cm[0]));
        let row = Row {
            identified,
            throws: errors_m.len(),
            error: Spread::of(errors_m),
            paper_cm,
        };
        (row, curve)
    };
    let all = trials.iter().map(|t| t.identified_m).collect();
    let conditions = CONDITIONS.into_iter().enumerate();
    let partly = conditions.map(|(condition, (_, name, paper_cm))| {
        let errors_m = trials.iter().flat_map(|t| t.partly_m[condition].clone());
        row(name, errors_m.collect(), paper_cm)
    });
    core::iter::once(row("all", all, [0.9, 0.4]))
        .chain(partly)
        .unzip()
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let figure = |t: &ImportanceTrial| 100.0 * t.identified_m;
    let sequence = experiment.sequence(ROPES, 1, (figure, "ropes, cm identified"));
    let made = strike_trials(&experiment, sequence, ImportanceTrial::of)?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let axis = "distance of tip and target (cm); dashed: the paper's mean";
    experiment.finish_rows(trials.len(), rows(&trials), axis, TABLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixed_rope_has_the_identified_length_and_lead_and_nothing_else() {
        let (found, other) = (trial_rope(1, 1), trial_rope(1, 2));
        let rope = mixed(&found, CONDITIONS[0].0, &other);
        let expected = RopeParams {
            length_m: found.length_m,
            lead_mass_kg: found.lead_mass_kg,
            ..other
        };
        assert_eq!(rope, expected);
        assert_eq!(mixed(&found, CONDITIONS[3].0, &other), other);
    }
}
