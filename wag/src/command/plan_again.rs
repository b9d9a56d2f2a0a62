//! `wag plan again`: the last strike, corrected by its miss.

use super::plan::{LOOK, check_fault, classify, describe, read, tell};
use crate::cli::{AgainArgs, Point};
use crate::config;
use anyhow::anyhow;
use arm_model::{ArmResponse, Cell, Limits};
use cli_output::{OrInput, Outcome, Stage};
use planner::PlannerConfig;
use planner::arm_response::Following;
use planner::plan::{PlanRequest, Shortcoming, correction, plan_again, shortcoming, warnings};
use run_log::{Run, confirm, files};
use serde_json::{Value, json};
use shared_types::{Plan, Task};
use std::path::Path;

/// Refuses to throw a plan whose track is unconfirmed, that was made for another cell, or for a
/// rope that swung.
pub fn check_thrown(plan: &Plan, accept_unconfirmed: bool) -> Outcome {
    confirm(&plan.unconfirmed, accept_unconfirmed, LOOK).or_failed()?;
    config::cell_for(plan).or_input()?;
    plan.require_at_rest().or_input()
}

/// A throw that was made, and where its tip passed.
pub struct LastThrow {
    pub plan: Plan,
    /// Tip minus target (m, base frame).
    pub miss_m: [f64; 3],
    cell: Cell,
}

impl LastThrow {
    /// The throw of a run's folder or of a plan's file, with its `miss` where that is named.
    pub fn read(last: &Path, miss: Option<Point>) -> Outcome<Self> {
        let run = last.is_dir().then(|| Run::open(last));
        let run = run.transpose().or_input()?;
        let thrown = run.as_ref().map(Run::summary_of_throw).transpose();
        thrown.or_input()?;
        let in_run = run.as_ref().map(|run| run.folder().join(files::PLAN));
        let plan = files::read_plan(in_run.as_deref().unwrap_or(last)).or_input()?;
        if plan.task != Task::Strike {
            let task = plan.task.name();
            return Err(bad_input!(
                "a {task} is not corrected by its miss: plan another (`wag run {task} --from plan RUN`)"
            ));
        }
        let unnamed = || {
            anyhow!("where did the tip pass? Name it with --miss X,Y,Z, as `wag score` prints it")
        };
        let of_run = |run: &Option<Run>| run.as_ref().ok_or_else(unnamed)?.miss_m();
        let miss_m = miss.map_or_else(|| of_run(&run), |miss| Ok(miss.0));
        let cell = run.map_or_else(|| config::cell_for(&plan), |run| config::cell_of(&run));
        Ok(Self {
            miss_m: miss_m.or_input()?,
            cell: cell.or_input()?,
            plan,
        })
    }

    /// The same throw, changed so that the miss is taken out, for an arm that follows like this.
    pub fn corrected(
        &self,
        (limits, config): (Limits, PlannerConfig),
        following: Option<Following>,
    ) -> Outcome<Plan> {
        let last = &self.plan;
        let request = PlanRequest::to_correct(last, self.cell, (limits, &config), following);
        let stage = Stage::begin("plan");
        let plan = plan_again(&request, last, self.miss_m).map_err(classify)?;
        stage.done(&describe(&plan));
        println!("{}", correction(last, &plan, self.miss_m));
        Ok(plan)
    }

    /// The same, for a throw at once: by an arm whose response counts if it did before.
    pub fn to_throw(
        &self,
        (limits, config): (Limits, PlannerConfig),
        response: Option<ArmResponse>,
    ) -> Outcome<Plan> {
        let response = response.filter(|_| self.plan.arm_response.is_some());
        let following = response.map(|response| Following::new(&response, &limits));
        let plan = self.corrected((limits, config), following)?;
        tell(&plan);
        match shortcoming(&plan) {
            Some(Shortcoming { message, is_severe }) if is_severe => Err(failed!(message)),
            _ => Ok(plan),
        }
    }
}

pub fn run(args: &AgainArgs) -> Outcome<Option<Value>> {
    let last = LastThrow::read(&args.last, args.miss)?;
    let (limits, config, following) = read(&args.planner).or_input()?;
    let plan = last.corrected((limits, config), following)?;
    check_fault(&plan, args.allow_miss, &args.out).or_failed()?;
    tell(&plan);
    files::write_json(&args.out, &plan).or_failed()?;
    println!("corrected plan written to `{}`", args.out.display());
    Ok(Some(json!({
        "ok": true, "command": "plan again", "out": args.out, "miss_m": last.miss_m,
        "target_m": plan.target_m, "aim": plan.aim, "warnings": warnings(&plan), "forecast": plan.forecast,
        "predicted_error_m": plan.predicted_error_m, "simulations": plan.simulations,
        "trajectory_sha256": plan.trajectory_sha256,
    })))
}
