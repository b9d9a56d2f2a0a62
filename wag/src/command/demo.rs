//! `wag demo`: one throw from start to end on a simulated rig that is started for it.

use super::plan_again::{LastThrow, check_thrown};
use super::run::{Entry, Run, Setup, check_target, in_folder};
use crate::cli::DemoArgs;
use crate::config;
use crate::pipeline::{self, FramesFrom, RunFolder};
use arm_model::Limits;
use cli_output::{OrInput, Outcome, Stage, watch_interrupts};
use planner::PlannerConfig;
use rig_sim::{RigConfig, random_target};
use run_log::RunRecord;
use serde_json::Value;
use shared_types::Task;
use std::path::{Path, PathBuf};

pub fn run(args: &DemoArgs) -> Outcome<Option<Value>> {
    let last = args.again.as_deref().map(last_demo).transpose()?;
    let (last, rig_config) = last.unzip();
    let rig_config = rig_config.as_ref().or(args.rig_config.as_ref());
    let rig: RigConfig = config::here(rig_config.map(PathBuf::as_path)).or_input()?;
    let seed = last.as_ref().map_or(args.seed, |_| rig.seed);
    let settings = config::here::<PlannerConfig>(None)
        .or_input()?
        .with_identify_seed(seed);
    let limits: Limits = config::here(None).or_input()?;
    let target_m = match (&last, args.target) {
        (Some(last), _) => last.plan.target_m,
        (None, Some(target)) => target.0,
        (None, None) => random_target(args.task, seed),
    };
    let short = || settings.short_wiggle(args.task, target_m).or_input();
    let short_wiggle = args.fast.then(short).transpose()?;
    // Refused before anything starts, whatever rope turns out to be there.
    check_target(target_m, &settings)?;
    watch_interrupts().or_failed()?;
    args.out
        .as_deref()
        .map_or(Ok(()), RunFolder::refuse_existing)?;
    let entry = match last {
        Some(last) => {
            check_thrown(&last.plan, args.accept_unconfirmed)?;
            let plan = last.to_throw((limits.clone(), settings.clone()), None)?;
            Entry::Plan(Box::new(plan))
        }
        None => Entry::Wiggle,
    };
    let folder = RunFolder::create(args.out.as_deref(), &format!("demo-{seed}"))?;
    let mut record = RunRecord::new("demo", seed, (args.task, Some(target_m)), &folder.path);
    record.simulated = true;
    let ball_m = Some(target_m).filter(|_| args.task == Task::Strike);
    let rig_config = pipeline::rig_config(&folder, &rig.seeing(args.task), seed, ball_m);
    in_folder(&folder, record, |session, record| {
        let stage = Stage::begin("start");
        // First, because the arm's ports are found there.
        let (rig, address) = pipeline::start_rig(session, &folder, &rig_config)?;
        let colours = rig_config.appearance();
        record.tip_rgb = Some(colours.lead_rgb);
        record.target_rgb = Some(colours.target_rgb);
        let setup = Setup {
            settings,
            limits,
            address,
            asks: false,
            acknowledges: false,
            frames: FramesFrom::Domain(folder.domain.clone()),
            camera: rig_config.camera.stereo_camera(),
            rig: Some(rig),
            accept_unconfirmed: args.accept_unconfirmed,
            robust: 0,
            keeps_films: false,
            short_wiggle,
        };
        Run::start(&folder, session, record, setup, &stage)?.go(entry)
    })
}

/// The throw of a demo, and the file of its rig, seed and all.
fn last_demo(run: &Path) -> Outcome<(LastThrow, PathBuf)> {
    let rig_config = run.join("config").join("rig.toml");
    if !rig_config.is_file() {
        return Err(bad_input!(
            "`{}` is not the folder of a demo: it lacks config/rig.toml",
            run.display()
        ));
    }
    Ok((LastThrow::read(run, None)?, rig_config))
}
