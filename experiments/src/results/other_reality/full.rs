//! `experiments full-pipeline`: the paper's full pipeline in MuJoCo, everything that the model
//! leaves out at once, and beside it the same throws planned for unrelated ropes.

use super::case::Case;
use super::child::Mujoco;
use super::kinds::{CONFIGURATIONS, RopeKind};
use super::rows::{TABLE, row, with_refusals};
use super::throwing::Fate;
use super::wiggling::Reality;
use super::{AXIS, Experiment, Sequence};
use crate::args::MujocoArgs;
use cli_output::{OrInput, Outcome};
use experiments::trials::in_parallel;
use planner::ropes::trial_rope;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Every kind in every configuration.
const CASES: u64 = (RopeKind::ALL.len() * CONFIGURATIONS.len()) as u64;
/// Keeps the unrelated ropes apart from all others.
const UNRELATED: u64 = 0x756e_7265;

/// One rope in one configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Trial {
    kind: RopeKind,
    /// Length (m) and lead's mass (kg).
    configuration: (f64, f64),
    /// Planned with what its film told, and corrected twice by the miss before.
    identified: [Fate; 3],
    /// Planned for an unrelated rope of the ranges.
    unrelated: Fate,
}

pub(in crate::results) fn run(args: &MujocoArgs) -> Outcome<Option<Value>> {
    let mujoco = Mujoco::from_environment().or_input()?;
    let experiment = Experiment::begin("full-pipeline", &args.result)?;
    let figure = |t: &Trial| {
        t.identified[0]
            .thrown()
            .map_or(f64::NAN, |t| 100.0 * t.miss_m)
    };
    let requested = experiment.sequence(CASES, 1, (figure, "throws, cm"));
    let method = requested.method.clone();
    let sequence = Sequence {
        method: format!("{method}{}", args.remark()),
        ..requested
    };
    let reality = Reality {
        experiment: &experiment,
        mujoco,
        robust: args.robust,
        fast: args.fast,
    };
    let seed = experiment.args.seed;
    let trial = |index: u64| {
        let (kind, configuration, case) = Case::of_paper(seed, index, args.refinement);
        Ok(Trial {
            kind,
            configuration,
            identified: reality.identified(index, &case)?,
            unrelated: reality.planned_for(index, &case, &trial_rope(UNRELATED ^ seed, index))?,
        })
    };
    let threads = experiment.options.threads;
    let made = experiment.trials(sequence, |batch| {
        in_parallel("trial", batch, threads, trial)
    })?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let both = |name: &str, of: &dyn Fn(RopeKind) -> bool| {
        let of: Vec<&Trial> = trials.iter().filter(|t| of(t.kind)).collect();
        let unrelated: Vec<&Fate> = of.iter().map(|t| &t.unrelated).collect();
        let throw = ["", ", second throw", ", third throw"];
        // None is like one out of a swing, which is not corrected then.
        let throws = if args.fast { 1 } else { throw.len() };
        let mut rows: Vec<_> = (throw.iter().take(throws).enumerate())
            .map(|(n, throw)| {
                let nth: Vec<&Fate> = of.iter().map(|t| &t.identified[n]).collect();
                row(&format!("{name}, {method}{throw}"), &nth)
            })
            .collect();
        rows.push(row(&format!("{name}, unrelated"), &unrelated));
        rows
    };
    let mut rows: Vec<_> = RopeKind::ALL
        .into_iter()
        .flat_map(|kind| both(kind.name(), &|of| of == kind))
        .collect();
    rows.extend(both("all but the chain", &|of| of != RopeKind::Chain));
    experiment.finish_rows(trials.len(), with_refusals(rows), AXIS, TABLE)
}
