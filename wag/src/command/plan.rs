//! `wag plan`: from a rope and a target to a checked plan.

use super::reach_picture;
use crate::cli::PlanArgs;
use crate::config;
use anyhow::{Context, anyhow, bail};
use arm_model::{Cell, JointVector, Limits, kinematics};
use cli_output::{Failure, OrInput, Outcome, Stage, interrupted};
use nalgebra::Vector3;
use planner::process::PlannerConfig;
use planner::response::Following;
use planner::tasks::{
    Belief, PlanError, PlanOptions, PlanRequest, ReachMap, plan_throw, start_pose_for,
};
use run_log::files;
use serde_json::{Value, json};
use shared_types::ipc::message::Progress;
use shared_types::{Plan, Task};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::Ordering;

/// A task that the demo's rig has no scene for.
pub fn not_there(task: &str) -> Failure {
    Failure::failed(anyhow!(
        "a demo of the {task} is not implemented in this version; `wag plan {task}` plans and judges one in simulation"
    ))
}

/// Radius of a cylinder around everything of the arm near its base axis: base,
/// shoulder and the stand below (m).
const BODY_RADIUS_M: f64 = 0.15;
/// Its upper end: the shoulder stands 0.267 m high (m).
const BODY_TOP_M: f64 = 0.40;
/// Half the thickness of the arm's links and of the pole, with some room (m).
const LINK_RADIUS_M: f64 = 0.08;

/// Refuses targets in the base or where the arm stands before the throw.
///
/// # Errors
/// Which part the target lies in.
pub fn clear_of_arm(target_m: [f64; 3], cell: &Cell) -> anyhow::Result<()> {
    let [x, y, z] = target_m;
    let refuse = |part: &str| {
        bail!(
            "target ({x:.3}, {y:.3}, {z:.3}) m lies in the arm's {part}; name one at least {:.0} cm away from it",
            100.0 * LINK_RADIUS_M
        )
    };
    if x.hypot(y) < BODY_RADIUS_M && z < BODY_TOP_M {
        return refuse("base");
    }
    let target = Vector3::new(x, y, z);
    let chain = arm_chain(&start_pose_for(target_m), cell);
    let near = |pair: &[Vector3<f64>]| distance_to_segment(target, pair[0], pair[1]);
    if chain.windows(2).map(near).any(|d| d < LINK_RADIUS_M) {
        return refuse("links in the start pose");
    }
    Ok(())
}

/// Points along the arm in a pose: the shoulder, the joints, the flange, the pole's end (m).
fn arm_chain(q: &JointVector, cell: &Cell) -> Vec<Vector3<f64>> {
    let mut chain: Vec<Vector3<f64>> = kinematics::link_poses(q).iter().map(|f| f.0).collect();
    chain.push(kinematics::flange_pose(q).0);
    chain.push(cell.pole.attach_pose(q).0);
    chain
}

fn distance_to_segment(p: Vector3<f64>, a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    let along = b - a;
    let t = (p - a).dot(&along) / along.norm_squared().max(1e-12);
    (p - a - along * t.clamp(0.0, 1.0)).norm()
}

/// Bad requests are the caller's; everything else is a failure of the work.
fn classify(error: PlanError) -> Failure {
    match &error {
        PlanError::TargetNotFinite { .. }
        | PlanError::Unreachable { .. }
        | PlanError::Rope(_)
        | PlanError::Follow(_)
        | PlanError::Option { .. } => Failure::input(error),
        _ => Failure::failed(error),
    }
}

/// Predicted distances of tip and target above which a plan is told to be poor,
/// and above which it is refused (m).
const MISS_WARN_M: f64 = 0.01;
const MISS_MAX_M: f64 = 0.05;

/// What is wrong with a plan that keeps every limit.
pub fn warnings(plan: &Plan) -> Vec<String> {
    let broken_off = plan
        .interrupted
        .then(|| "the search was broken off: this is the best throw up to then".to_owned());
    fault(plan).into_iter().chain(broken_off).collect()
}

/// Why a plan should not be thrown: a strike that misses, another task that fails.
fn fault(plan: &Plan) -> Option<String> {
    if plan.task == Task::Strike {
        return miss(plan.predicted_error_m);
    }
    let failed = plan.verdict.conditions.iter().filter(|c| !c.met);
    let failed: Vec<&str> = failed.map(|c| c.name.as_str()).collect();
    (!plan.verdict.success).then(|| {
        format!(
            "the {} is predicted to fail (not met: {}); try another --seed or target",
            plan.task.name(),
            failed.join(", ")
        )
    })
}

fn miss(predicted_error_m: f64) -> Option<String> {
    (predicted_error_m > MISS_WARN_M).then(|| {
        format!(
            "the tip is predicted to miss the target by {:.1} cm; try another --seed or a target closer to the middle of the reach",
            100.0 * predicted_error_m
        )
    })
}

/// Refuses a plan that would not do what it is for, unless that is wanted.
fn check_fault(plan: &Plan, args: &PlanArgs) -> anyhow::Result<()> {
    let hopeless = plan.task != Task::Strike || plan.predicted_error_m > MISS_MAX_M;
    match fault(plan) {
        Some(said) if hopeless && !args.allow_miss => bail!(
            "{said}; `{}` is not written, --allow-miss would write it",
            args.out.display()
        ),
        _ => Ok(()),
    }
}

/// Ropes that a forecast is made with.
const FORECAST_ROPES: usize = 64;

/// What is known about the rope beyond its parameters, for `--robust`.
fn belief(args: &PlanArgs) -> anyhow::Result<Belief> {
    if args.robust == 0 {
        return Ok(Belief::default());
    }
    let rope = files::read_rope(&args.rope)?;
    let posterior = files::read_posterior(&args.rope)?.with_context(|| {
        format!(
            "rope file `{}` has no table `posterior`: --robust needs a rope identified by this version",
            args.rope.display()
        )
    })?;
    Ok(Belief::drawn(
        &rope,
        &posterior,
        args.robust,
        FORECAST_ROPES,
        args.seed,
    ))
}

/// Draws which targets the rope reaches; refuses one that it does not.
fn reach(
    path: &Path,
    args: &PlanArgs,
    limits: &Limits,
    config: &PlannerConfig,
    quiet: bool,
) -> Outcome<()> {
    /// The reach is explored before anything else is done.
    const THREADS: usize = 2;
    let rope = files::read_rope(&args.rope).or_input()?;
    let stage = Stage::begin("reach", quiet);
    let map = ReachMap::explore(
        &rope,
        limits,
        &config.cell,
        &config.strike,
        args.seed,
        THREADS,
    )
    .map_err(classify)?;
    let picture = reach_picture::svg(&map, &rope, args.target.0, args.seed);
    files::write_atomic(path, picture.as_bytes()).or_failed()?;
    stage.done(&format!(
        "{} throws, drawn in `{}`",
        map.throws,
        path.display()
    ));
    map.check(args.target.0).map_err(classify)
}

/// One line about a plan.
pub fn describe(plan: &Plan) -> String {
    format!(
        "residual in simulation {:.2} cm at {:.2} s, {} simulations",
        100.0 * plan.predicted_error_m,
        plan.predicted_time_s,
        plan.simulations
    )
}

/// Plans a throw of a task.
pub fn run(kind: Task, args: &PlanArgs, quiet: bool) -> Outcome<Option<Value>> {
    let rope = files::read_rope(&args.rope).or_input()?;
    let config: PlannerConfig = config::here(args.config.as_deref()).or_input()?;
    clear_of_arm(args.target.0, &config.cell).or_input()?;
    let limits = config::here::<Limits>(args.limits.as_deref()).or_input()?;
    let belief = belief(args).or_input()?;
    let response = args.arm_response.as_deref().map(files::read_arm_response);
    let response = response.transpose().or_input()?;
    if let Some(path) = &args.reach {
        reach(path, args, &limits, &config, quiet)?;
    }
    cli_output::watch_interrupts().or_failed()?;
    let stage = Stage::begin("plan", quiet);
    let request = PlanRequest {
        rope,
        limits: limits.clone(),
        cell: config.cell,
        options: PlanOptions {
            seed: args.seed,
            segment_stretch_max: args
                .segment_stretch
                .unwrap_or(config.search.segment_stretch_max),
            ..config.search
        },
        belief,
        following: response.map(|r| Following::new(&r, &limits)),
    };
    let task = config.task(kind, args.target.0);
    let planned = plan_throw(&*task, &request, &mut |p| {
        stage.progress(&Progress {
            done: u32::try_from(p.generation).unwrap_or(u32::MAX),
            total: u32::try_from(p.generations).unwrap_or(u32::MAX),
            value: 100.0 * p.error_m,
            label: "best cm".to_owned(),
        });
        if interrupted().load(Ordering::SeqCst) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .map_err(classify)?;
    let plan = planned.into_plan(kind, &*task, &request);
    let warnings = warnings(&plan);
    check_fault(&plan, args).or_failed()?;
    stage.done(&describe(&plan));
    files::write_json(&args.out, &plan).or_failed()?;
    if let Some(path) = &args.csv {
        files::write_trajectory(path, &plan.trajectory, limits.period_s()).or_failed()?;
    }
    if !quiet {
        for warning in &warnings {
            eprintln!("warning: {warning}");
        }
        if let Some(f) = plan.forecast {
            println!(
                "over {} ropes it might be: error {:.2} cm in the median, {:.2} to {:.2} cm in nine of ten",
                f.ropes,
                100.0 * f.median_m,
                100.0 * f.interval_90_m[0],
                100.0 * f.interval_90_m[1]
            );
        }
        println!("plan written to `{}`", args.out.display());
    }
    Ok(Some(json!({
        "ok": true, "command": format!("plan {}", kind.name()), "out": args.out, "seed": args.seed,
        "warnings": warnings, "target_m": args.target.0, "predicted_error_m": plan.predicted_error_m,
        "predicted_time_s": plan.predicted_time_s, "simulations": plan.simulations,
        "resampled": plan.resampled, "interrupted": plan.interrupted, "limited_by": plan.limited_by,
        "arm_response": plan.arm_response, "reach": args.reach, "verdict": plan.verdict, "forecast": plan.forecast,
        "trajectory_sha256": plan.trajectory_sha256,
    })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_miss_is_told() {
        assert_eq!(miss(0.004), None);
        assert!(miss(0.03).unwrap().contains("3.0 cm"));
    }

    #[test]
    fn targets_in_the_arm_are_refused() {
        let cell = Cell::default();
        let said = |t| format!("{:#}", clear_of_arm(t, &cell).unwrap_err());
        assert!(said([0.0, 0.0, 0.1]).contains("base"));
        assert!(said([0.05, -0.05, -0.3]).contains("base"));
        let flange = kinematics::flange_pose(&start_pose_for([1.0, 0.0, 0.0])).0;
        assert!(said(flange.into()).contains("links"), "{flange}");
        let turned = start_pose_for([0.6, 0.6, 0.0]);
        let end = cell.pole.attach_pose(&turned).0;
        assert!(said(end.into()).contains("links"), "{end}");
        for free in [[1.0, 0.0, 0.4], [0.85, 0.3, -0.1], [1.05, -0.3, 0.6]] {
            assert!(clear_of_arm(free, &cell).is_ok(), "{free:?}");
        }
    }
}
