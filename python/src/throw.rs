//! Plans of throws.

use crate::error::{OrRaise, interruptible, of_plan};
use crate::film::config_of;
use crate::motion::{cell_of, limits_of};
use crate::rope::rope_of_json;
use anyhow::Context;
use planner::arm_response::Following;
use planner::plan::{PlanOptions, PlanRequest, PosteriorEnsemble, warnings};
use pyo3::prelude::*;
use run_log::files;
use serde_json::json;
use shared_types::Task;
use shared_types::rope::RopePosterior;
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
    let ensemble = match posterior {
        Some(text) => {
            let posterior: RopePosterior =
                serde_json::from_str(text).context("posterior").or_input()?;
            let (robust, seed) = (given.robust, given.seed);
            let forecast = PosteriorEnsemble::FORECAST;
            PosteriorEnsemble::drawn(&rope, &posterior, robust, forecast, seed)
        }
        None => PosteriorEnsemble::default(),
    };
    let request = PlanRequest {
        goal: config.goal(kind, target_m),
        rope,
        cell: cell_of(given.cell.as_deref())?,
        options: PlanOptions {
            seed: given.seed,
            threads: given.threads,
            ..config.search
        },
        ensemble,
        following: response.map(|response| Following::new(&response, &limits)),
        limits,
    };
    interruptible(py, |progress| {
        let plan = planner::plan(&request, progress).map_err(of_plan)?;
        Ok(json!({ "warnings": warnings(&plan), "plan": plan }).to_string())
    })
}
