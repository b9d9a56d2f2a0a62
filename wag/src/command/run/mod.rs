//! `wag run`: from wiggle to throw with an arm and a camera; what `wag demo` does on a rig of its
//! own.

mod filmed;
mod inputs;
mod rope;
mod stages;
mod swing;

pub use inputs::check_target;
pub use stages::{Entry, Run, Setup};

use super::area::{asks, limits, operator, reach_measured, require_clear_area, response_for_plans};
use super::on_arm::{confirmations, watch_operator};
use super::plan_again::{LastThrow, check_thrown};
use super::runs::explain_stop;
use super::{dry_run, motion};
use crate::cli::{ArmArgs, RunArgs, WiggleArgs};
use crate::config;
use crate::pipeline::{ArmAddress, FramesFrom, RunFolder, Scene};
use anyhow::Context;
use arm_model::{JointTrajectory, Limits};
use cli_output::{OrInput, Outcome, Stage, is_interrupted, watch_interrupts};
use inputs::{Inputs, entry};
use planner::PlannerConfig;
use planner::wiggle::{WiggleConfig, wiggle};
use rig_sim::random_target;
use run_log::{RunRecord, files, outcome};
use serde_json::{Value, json};
use session::Session;
use shared_types::ipc::message::{RigRequest, RigRpc};
use shared_types::{OperatingMode, Task};
use std::path::Path;
use std::time::Instant;
use viewer::report;

/// Does the `work` of a run in its folder and keeps what came of it: summary, keypoints, file of
/// the run, report.
pub fn in_folder(
    folder: &RunFolder,
    mut record: RunRecord,
    work: impl FnOnce(&mut Session, &mut RunRecord) -> anyhow::Result<()>,
) -> Outcome<Option<Value>> {
    let began = Instant::now();
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let result = work(&mut session, &mut record);
    session.end(result.is_ok());
    record.wall_s = began.elapsed().as_secs_f64();
    record.confirmed = confirmations(&session);
    let keypoints_kept = session.received.keep_keypoints(&folder.path);
    record.error = result.as_ref().err().map(|e| format!("{e:#}"));
    let summary_kept = files::write_json(&folder.file(files::SUMMARY), &record);
    let recorded = session.finish_run_file();
    explain_stop(&folder.path);
    if result.is_err() && !is_interrupted() {
        keep_report(&folder.path);
    }
    let result = result.with_context(|| format!("run `{}`", folder.path.display()));
    result.or_failed()?;
    keypoints_kept.or_failed()?;
    println!("{}", outcome(&record).trim_end());
    keep_report(&folder.path);
    recorded.or_failed()?;
    summary_kept.or_failed()?;
    Ok(Some(serde_json::to_value(&record).or_failed()?))
}

/// The run as a page to look at. Without it the run is as good as before.
fn keep_report(run: &Path) {
    match config::cell_here().and_then(|here| report::write(run, None, &here)) {
        Ok(written) => println!("report: {}", written.path.display()),
        Err(reason) => tracing::warn!("no report was written: {reason:#}"),
    }
}

/// The planner's values, with what the command line says of the rope.
fn settings(args: &RunArgs) -> Outcome<PlannerConfig> {
    let mut settings = config::here::<PlannerConfig>(None)
        .or_input()?
        .with_identify_seed(args.seed);
    let options = &mut settings.identify;
    options.lead_mass_kg = args.lead_mass.or(options.lead_mass_kg);
    options.length_m = args.length.or(options.length_m);
    Ok(settings)
}

/// The wiggle of a run that is to be fast.
fn short_wiggle(args: &RunArgs, settings: &PlannerConfig) -> Outcome<Option<WiggleConfig>> {
    let short = || {
        let task = args.task.unwrap_or_default();
        let drawn = || random_target(task, args.seed);
        let target_m = args.target.map_or_else(drawn, |target| target.0);
        settings.short_wiggle(task, target_m).or_input()
    };
    args.fast.then(short).transpose()
}

pub fn run(args: &RunArgs) -> Outcome<Option<Value>> {
    let settings = settings(args)?;
    let short_wiggle = short_wiggle(args, &settings)?;
    if args.arm.dry_run {
        return tell(args, &settings, short_wiggle.as_ref());
    }
    if !args.arm.names_arm() {
        return Err(bad_input!(
            "name the arm with --arm ADDR, or a controller that runs with --controller NAME"
        ));
    }
    let inputs = Inputs::of_run(args, &settings, short_wiggle)?;
    let last = args.again.as_deref();
    let last = last.map(|run| LastThrow::read(run, None)).transpose()?;
    if let Some(last) = &last {
        check_thrown(&last.plan, args.accept_unconfirmed)?;
    }
    let (address, limits) = reach_filmed(&args.arm, &inputs)?;
    let entry = match last {
        Some(last) => {
            let ways = (limits.clone(), settings.clone());
            let plan = last.to_throw(ways, response_for_plans(&address)?)?;
            Entry::Plan(Box::new(plan))
        }
        None => entry(args, &settings)?,
    };
    let place = (args.out.as_deref(), "run", args.seed);
    on_camera(&args.arm, (address, limits, settings), inputs, place, entry)
}

/// The wiggle alone, filmed and tracked: what `wag identify --keypoints RUN` and
/// `wag run --from identify RUN` go on with.
pub fn wiggle_alone(args: &WiggleArgs) -> Outcome<Option<Value>> {
    let settings: PlannerConfig = config::here(None).or_input()?;
    let inputs = Inputs::of_wiggle(args)?;
    let (address, limits) = reach_filmed(&args.arm, &inputs)?;
    let place = (args.out.as_deref(), "wiggle", args.seed);
    let with = (address, limits, settings);
    on_camera(&args.arm, with, inputs, place, Entry::WiggleAlone)
}

/// Tells what would be done first, and checks it.
fn tell(
    args: &RunArgs,
    settings: &PlannerConfig,
    short_wiggle: Option<&WiggleConfig>,
) -> Outcome<Option<Value>> {
    let target_m = args.target.map(|target| target.0);
    target_m.map_or(Ok(()), |target_m| check_target(target_m, settings))?;
    args.out
        .as_deref()
        .map_or(Ok(()), RunFolder::refuse_existing)?;
    // The files that a run would read: of the arm, of the camera.
    reach_measured(&args.arm)?;
    Scene::of_file(args.camera.calibration.as_deref()).or_input()?;
    let limits = limits(&args.arm, None)?;
    let first = entry(args, settings)?;
    let Some((trajectory, operating_mode)) =
        first_motion(&first, &limits, short_wiggle.unwrap_or(&settings.wiggle))?
    else {
        println!("the throw is planned with the rope first, and checked then");
        return Ok(Some(
            json!({ "ok": true, "command": "run", "dry_run": true }),
        ));
    };
    motion::check(None, &limits, &trajectory, operating_mode)?;
    let (name, _) = motion::words(operating_mode);
    let told = dry_run::tell(&args.arm, &limits, &trajectory, name)?;
    if matches!(first, Entry::Wiggle) {
        let calms = if args.fast {
            "plan a throw out of the swing and check it (or damp the swing, and wiggle again, where that promises too little)"
        } else {
            "plan the throw and check it, turn to its start by a move that damps the swing"
        };
        println!(
            "then it would identify the rope from the film, {calms}, throw and measure by the camera; MOVE, PLACED for board or wall, and THROW are asked for, unless the arm is simulated"
        );
    }
    Ok(Some(told))
}

/// The first motion of a run but for moves at set-up speed, where it is known.
fn first_motion(
    entry: &Entry,
    limits: &Limits,
    config: &WiggleConfig,
) -> Outcome<Option<(JointTrajectory, OperatingMode)>> {
    Ok(match entry {
        Entry::Plan(plan) => Some((plan.trajectory, OperatingMode::Throw)),
        Entry::Wiggle | Entry::WiggleAlone => {
            let trajectory = wiggle(config, limits).or_failed()?;
            Some((trajectory, OperatingMode::Wiggle))
        }
        // Its throw is still to be planned.
        Entry::Rope(_) => None,
    })
}

/// Refuses the first motion of a run if it must not be sent.
fn check_first(
    entry: &Entry,
    address: &ArmAddress,
    limits: &Limits,
    config: &WiggleConfig,
) -> Outcome {
    let Some((trajectory, operating_mode)) = first_motion(entry, limits, config)? else {
        return Ok(());
    };
    motion::check(Some(address), limits, &trajectory, operating_mode)?;
    motion::require_measured_joints(address, &trajectory, operating_mode)
}

/// The arm that is named and filmed, and its limits.
fn reach_filmed(arm: &ArmArgs, inputs: &Inputs) -> Outcome<(ArmAddress, Limits)> {
    let address = reach_measured(arm)?.ok_or_else(|| bad_input!("name the arm with --arm ADDR"))?;
    inputs.check_arm(&address)?;
    let limits = limits(arm, Some(&address))?;
    Ok((address, limits))
}

/// Goes from `entry` to its end with an arm and a camera that are there.
fn on_camera(
    arm: &ArmArgs,
    (address, limits, settings): (ArmAddress, Limits, PlannerConfig),
    inputs: Inputs,
    (out, name, seed): (Option<&Path>, &'static str, u64),
    entry: Entry,
) -> Outcome<Option<Value>> {
    // A short one may be followed by the usual one.
    for config in [Some(&settings.wiggle), inputs.short_wiggle.as_ref()] {
        let checks = |config| check_first(&entry, &address, &limits, config);
        config.map_or(Ok(()), checks)?;
    }
    if inputs.task != Task::Strike && !inputs.is_simulated() && !asks(arm, &address) {
        return Err(bad_input!(
            "before a {} somebody must put board or wall in its place, and say so: add --ask",
            inputs.task.name()
        ));
    }
    let operator = operator(arm, &address)?;
    require_clear_area(arm, &address, "MOVE")?;
    watch_interrupts().or_failed()?;
    let mut folder = RunFolder::create(out, name)?;
    let service = address.service.as_ref().map(|s| &s.config.domain);
    if let (FramesFrom::Domain(domain), _) | (_, Some(domain)) = (&inputs.frames, service) {
        folder.domain.clone_from(domain);
    }
    let by_service = address.service.is_some();
    let goal = (inputs.task, inputs.target_m);
    let mut record = RunRecord::new(name, seed, goal, &folder.path);
    record.operator = operator;
    record.simulated = address.simulated;
    let done = |session: &mut Session, record: &mut RunRecord| {
        let stage = Stage::begin("start");
        watch_operator(session, arm, &address)?;
        // One that began since then was not compared with the arm.
        let rig = if inputs.is_simulated() {
            session.find::<RigRpc>(&RigRequest::Ports)?
        } else {
            None
        };
        let told = rig.as_ref().map(|rig| Scene::of_rig(session, rig));
        let told = told.transpose()?;
        let of_file = inputs
            .calibration
            .filter(|_| inputs.names_calibration || told.is_none());
        let colours = told.as_ref().and_then(|scene| scene.colours);
        let camera = of_file.or(told.map(|scene| scene.camera));
        let camera = camera.context("the simulated rig that filmed is gone")?;
        let [tip_rgb, target_rgb] = inputs.colours;
        record.tip_rgb = tip_rgb.or(colours.map(|[tip_rgb, _]| tip_rgb));
        record.target_rgb = target_rgb.or(colours.map(|[_, target_rgb]| target_rgb));
        if let Some(rig) = &rig {
            // What an earlier run left there would be in the way, and its rope still swing.
            session.ask(rig, &RigRequest::Tidy, 5.0, |_| ())?;
        }
        if !matches!(entry, Entry::WiggleAlone) {
            let task = inputs.task;
            let target_m = inputs.target_m.unwrap_or_else(|| random_target(task, seed));
            record.target_m = Some(target_m);
        }
        let setup = Setup {
            settings,
            limits,
            asks: asks(arm, &address),
            acknowledges: arm.acknowledge,
            address,
            frames: inputs.frames,
            camera,
            rig,
            accept_unconfirmed: inputs.accept_unconfirmed,
            robust: inputs.robust,
            keeps_films: inputs.keeps_films,
            short_wiggle: inputs.short_wiggle,
        };
        Run::start(&folder, session, record, setup, &stage)?.go(entry)
    };
    in_folder(&folder, record, |session, record| {
        done(session, record).map_err(|error| session::of_service(by_service, error))
    })
}
