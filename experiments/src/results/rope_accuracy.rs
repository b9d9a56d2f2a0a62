//! `experiments rope-accuracy`: how far the simulator's steps take a rope's tip from where the
//! same equations in MuJoCo take it, in the built-in wiggle and in a planned strike.
//!
//! The reference needs no data from elsewhere: `contact.py` steps with second order, so its runs at
//! a step and at half of it give an estimate of the limit that they tend to. A third run, at twice
//! the step, shows the order, and with it whether that holds.

use super::contact_dynamics::engines::{PERIOD_S, rolled_out, theirs, tip_of};
use super::contact_dynamics::scenes::TouchScene;
use super::experiment::{built_in, number};
use super::other_reality::child::Mujoco;
use crate::args::RopeAccuracyArgs;
use crate::program::program;
use crate::report::{Column, print_table};
use arm_model::{JointTrajectory, Pole};
use cli_output::{OrInput, Outcome, Stage};
use experiments::trials::{TrialRig, in_parallel, quantile};
use nalgebra::Vector3;
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest};
use planner::ropes::{random_strike_target, trial_rope};
use rope_sim::{Outcome as SimOutcome, PlannedArm, Scene};
use run_log::files;
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::{RopeParams, Task, VERSION};
use std::ops::ControlFlow;

const NAME: &str = "rope-accuracy";
/// Steps of the simulator that are compared (s).
const STEPS_S: [f64; 3] = [1e-3, 5e-4, 2.5e-4];
/// MuJoCo's (s).
const THEIR_STEPS_S: [f64; 3] = [1e-4, 5e-5, 2.5e-5];
/// What of a throw is compared, with what the rope does after it (s).
const THROW_S: f64 = 2.5;

/// One rope in one motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Row {
    index: u64,
    motion: &'static str,
    rope: RopeParams,
    /// Greatest distance of the tip from the reference at each of [`STEPS_S`] (m); infinite where
    /// it blew up twice.
    error_m: [f64; STEPS_S.len()],
    /// Whether it blew up at that step and was repeated in steps of a quarter.
    repeated: [bool; STEPS_S.len()],
    /// The same of MuJoCo's finest run: where the order is 2, the reference is closer than that to
    /// the solution of the equations (m).
    reference_m: f64,
    /// Observed order of MuJoCo's steps.
    order: f64,
}

/// Of one motion at one step, over all ropes (m).
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Spread {
    motion: &'static str,
    /// Of the simulator; `None` stands for MuJoCo's finest run.
    step_s: Option<f64>,
    median_m: f64,
    p90_m: f64,
    max_m: f64,
    repeated: usize,
}

const TABLE: [Column<Spread>; 6] = [
    ("motion", |row| row.motion.to_owned()),
    ("step (ms)", |row| {
        row.step_s
            .map_or_else(|| "MuJoCo's".to_owned(), |step_s| number(1e3 * step_s, 2))
    }),
    ("median (mm)", |row| number(1e3 * row.median_m, 3)),
    ("p90 (mm)", |row| number(1e3 * row.p90_m, 3)),
    ("max (mm)", |row| number(1e3 * row.max_m, 3)),
    ("repeated", |row| row.repeated.to_string()),
];

/// Greatest distance between two paths of the tip (m).
fn apart_m(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let distances = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    distances.fold(0.0, f64::max)
}

fn compare(
    mujoco: &Mujoco,
    index: u64,
    scene: &TouchScene<PlannedArm>,
) -> anyhow::Result<(Row, String)> {
    let [coarse, middle, fine] = THEIR_STEPS_S.map(|step_s| theirs(mujoco, scene, step_s, false));
    let (coarse, middle, (fine, version)) = (coarse?.0.tip_m, middle?.0.tip_m, fine?);
    // An error of second order is a third of what half the step changes.
    let reference: Vec<_> = (middle.iter().zip(&fine.tip_m))
        .map(|(middle, fine)| fine + (fine - middle) / 3.0)
        .collect();
    let (mut error_m, mut repeated) = ([f64::INFINITY; STEPS_S.len()], [false; STEPS_S.len()]);
    for (k, step_s) in STEPS_S.into_iter().enumerate() {
        let run = rolled_out(scene, &scene.scene, step_s)?;
        repeated[k] = run.outcome != SimOutcome::Clean;
        if run.outcome != SimOutcome::Diverged {
            error_m[k] = apart_m(&tip_of(&run), &reference);
        }
    }
    let halved = apart_m(&coarse, &middle) / apart_m(&middle, &fine.tip_m);
    let row = Row {
        index,
        motion: scene.name,
        rope: scene.rope,
        error_m,
        repeated,
        reference_m: apart_m(&fine.tip_m, &reference),
        order: halved.log2(),
    };
    Ok((row, version))
}

/// A strike planned for `rope`, at a target of its own.
fn throw(config: &PlannerConfig, rope: &RopeParams, seed: u64) -> anyhow::Result<JointTrajectory> {
    let options = PlanOptions {
        seed,
        threads: 1,
        ..config.search
    };
    let goal = config.goal(Task::Strike, random_strike_target(seed));
    let plan = planner::plan(&PlanRequest::new(goal, rope, options), &mut |_| {
        ControlFlow::Continue(())
    })?;
    Ok(plan.trajectory)
}

/// Rope `index` in both motions.
fn scenes(
    config: &PlannerConfig,
    wiggle: &PlannedArm,
    seed: u64,
    index: u64,
) -> anyhow::Result<[TouchScene<PlannedArm>; 2]> {
    let rope = trial_rope(seed, index);
    let thrown = throw(config, &rope, (seed << 32) ^ index)?;
    let scene = |name, motion, horizon_s: f64| TouchScene {
        name,
        rope,
        scene: Scene::EMPTY,
        motion,
        // Whole periods.
        horizon_s: (horizon_s / PERIOD_S).floor() * PERIOD_S,
    };
    Ok([
        scene("wiggle", wiggle.clone(), wiggle.trajectory().duration_s()),
        scene("strike", PlannedArm::new(thrown, Pole::default()), THROW_S),
    ])
}

fn spreads(rows: &[Row]) -> Vec<Spread> {
    let mut all = Vec::new();
    for motion in ["wiggle", "strike"] {
        let of_motion = || rows.iter().filter(|row| row.motion == motion);
        let mut spread = |step_s, error_m: &dyn Fn(&Row) -> f64, repeated| {
            let at = |fraction| quantile(of_motion().map(error_m), fraction);
            let [median_m, p90_m, max_m] = [0.5, 0.9, 1.0].map(at);
            all.push(Spread {
                motion,
                step_s,
                median_m,
                p90_m,
                max_m,
                repeated,
            });
        };
        for (k, step_s) in STEPS_S.into_iter().enumerate() {
            let repeated = of_motion().filter(|row| row.repeated[k]).count();
            spread(Some(step_s), &|row| row.error_m[k], repeated);
        }
        spread(None, &|row| row.reference_m, 0);
    }
    all
}

pub(super) fn run(args: &RopeAccuracyArgs) -> Outcome<Option<Value>> {
    let mujoco = Mujoco::from_environment().or_input()?;
    if let Some(path) = &args.out {
        files::check_writable(path).or_input()?;
    }
    let config = built_in().or_failed()?;
    let wiggle = TrialRig::new(&config.wiggle).or_failed()?.motion;
    let stage = Stage::begin(NAME);
    let indices: Vec<u64> = (0..args.ropes).collect();
    let compared = in_parallel("rope", &indices, usize::from(args.threads), |index| {
        let scenes = scenes(&config, &wiggle, args.seed, index)?;
        let [wiggled, thrown] = scenes.map(|scene| compare(&mujoco, index, &scene));
        Ok([wiggled?, thrown?])
    });
    let compared = compared.or_failed()?.into_iter().flatten();
    let (rows, versions): (Vec<Row>, Vec<String>) = compared.unzip();
    let table = spreads(&rows);
    let value = json!({
        "ok": true, "command": NAME, "version": VERSION, "program": program().or_failed()?,
        "seed": args.seed, "ropes": args.ropes, "mujoco": versions.first(), "mujoco_steps_s": THEIR_STEPS_S,
        "steps_s": STEPS_S, "summary": table, "rows": rows, "out": args.out,
    });
    stage.done(&format!("{} ropes", args.ropes));
    print_table(&table, 1, TABLE);
    let least = rows
        .iter()
        .map(|row| row.order)
        .fold(f64::INFINITY, f64::min);
    println!(
        "\ngreatest distance of the tip from the limit of MuJoCo's steps, whose order is {least:.2} or more"
    );
    if let Some(out) = &args.out {
        files::write_json(out, &value).or_failed()?;
        println!("written to `{}`", out.display());
    }
    Ok(Some(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_half_a_millisecond_follow_mujoco() {
        let Some(mujoco) = Mujoco::for_tests() else {
            return;
        };
        let config = built_in().unwrap();
        let wiggle = TrialRig::new(&config.wiggle).unwrap().motion;
        let scenes = scenes(&config, &wiggle, 9, 0).unwrap();
        for (mut scene, within_m) in scenes.into_iter().zip([2e-6, 1e-5]) {
            // A part shows as much, sooner.
            scene.horizon_s = scene.horizon_s.min(1.5);
            let (row, _) = compare(&mujoco, 0, &scene).unwrap();
            println!("{row:?}");
            assert!(row.reference_m < within_m / 10.0, "{row:?}");
            assert!((1.8..2.2).contains(&row.order), "{row:?}");
            assert!(row.error_m[1] < within_m, "{row:?}");
            assert!(row.error_m[2] <= row.error_m[1], "{row:?}");
        }
    }
}
