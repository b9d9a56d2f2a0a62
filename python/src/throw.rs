//! Plans of throws.

use crate::error::{OrRaise, interruptible, of_plan};
use crate::film::config_of;
use crate::motion::{cell_of, limits_of};
use crate::rope::rope_of_json;
use crate::threads::THREADS_MAX;
use anyhow::{Context, ensure};
use planner::arm_response::Following;
use planner::plan::{PlanOptions, PlanRequest, PosteriorEnsemble, shortcoming, warnings};
use pyo3::prelude::*;
use run_log::files;
use serde_json::json;
use shared_types::rope::RopePosterior;
use shared_types::{RopeParams, Task};
use std::path::PathBuf;

/// What a throw is planned with, beside rope and target.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Given {
    seed: u64,
    /// Ropes of the posterior that the plan weighs.
    robust: usize,
    limits: Option<PathBuf>,
    cell: Option<PathBuf>,
    config: Option<PathBuf>,
    arm_response: Option<PathBuf>,
    threads: usize,
}

/// Plans a throw of a rope (JSON) that may be something else by its posterior (JSON): the plan
/// and its warnings as JSON.
#[pyfunction]
#[pyo3(signature = (task, rope, posterior, target_m, given))]
pub(crate) fn plan(
    py: Python<'_>,
    task: &str,
    rope: &str,
    posterior: Option<&str>,
    target_m: [f64; 3],
    given: Given,
) -> PyResult<String> {
    let named = serde_json::Value::from(task);
    let kind = serde_json::from_value::<Task>(named);
    let kind =
        kind.with_context(|| format!("`task` is `{task}`, but must be strike, lob or drape"));
    let kind = kind.or_input()?;
    let rope = rope_of_json(rope)?;
    let config = config_of(given.config.as_deref())?;
    let limits = limits_of(given.limits.as_deref())?;
    let response = given.arm_response.as_deref().map(files::read_arm_response);
    let response = response.transpose().or_input()?;
    let posterior = posterior
        .map(serde_json::from_str::<RopePosterior>)
        .transpose();
    let posterior = posterior.context("posterior").or_input()?;
    let ensemble = posterior.map_or_else(
        || Ok(PosteriorEnsemble::default()),
        |posterior| ensemble(&rope, &posterior, &given),
    );
    let ensemble = ensemble.or_input()?;
    let options = PlanOptions {
        seed: given.seed,
        threads: given.threads.clamp(1, THREADS_MAX),
        ..config.search
    };
    let request = PlanRequest {
        cell: match &given.cell {
            Some(path) => cell_of(Some(path))?,
            None => config.cell,
        },
        ensemble,
        following: response.map(|response| Following::new(&response, &limits)),
        limits,
        ..PlanRequest::new(config.goal(kind, target_m), &rope, options)
    };
    interruptible(py, |progress| {
        let plan = planner::plan(&request, progress).map_err(of_plan)?;
        let severe = shortcoming(&plan)
            .filter(|s| s.is_severe)
            .map(|s| s.message);
        let told = json!({ "warnings": warnings(&plan), "shortcoming": severe, "plan": plan });
        Ok(told.to_string())
    })
}

/// Where a rope comes from, for errors.
const FROM: &str = "the identified rope";

/// Ropes (JSON, a list) drawn from what an identified rope (JSON) may be by its posterior (JSON).
#[pyfunction]
pub(crate) fn drawn_ropes(
    rope: &str,
    posterior: &str,
    count: usize,
    seed: u64,
) -> PyResult<String> {
    let rope = rope_of_json(rope)?;
    let posterior = serde_json::from_str::<RopePosterior>(posterior).context("posterior");
    let drawn = PosteriorEnsemble::of_posterior(&rope, &posterior.or_input()?, count, seed, FROM);
    serde_json::to_string(&drawn.or_failed()?.optimised).or_failed()
}

/// What the rope might be instead, as `wag plan` takes it.
fn ensemble(
    rope: &RopeParams,
    posterior: &RopePosterior,
    given: &Given,
) -> anyhow::Result<PosteriorEnsemble> {
    /// Ropes that a plan may weigh.
    const ROBUST_MAX: usize = 1000;
    let robust = given.robust;
    ensure!(
        robust <= ROBUST_MAX,
        "`robust` is {robust}, but must be at most {ROBUST_MAX} ropes"
    );
    let drawn = PosteriorEnsemble::of_posterior(rope, posterior, robust, given.seed, FROM);
    Ok(drawn?)
}
