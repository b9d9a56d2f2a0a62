//! `wag score`: what a stereo film shows of a throw: the closest approach of tip and target, or
//! what became of a lob or drape.

use crate::cli::ScoreArgs;
use crate::config;
use anyhow::Context;
use camera_ingest::{ScoreError, load_camera, look, open_video, score};
use cli_output::{Failure, OrInput, Outcome, Stage};
use planner::PlannerConfig;
use run_log::{Kept, NamedFilm, Run, ScoredBy, UNNAMED_COLOURS, files};
use serde_json::{Value, json};
use shared_types::ipc::message::ScoreResult;
use shared_types::{Plan, StereoCamera, Task};
use std::path::Path;

/// Bad input, or a marker that was looked for and not found.
pub fn not_scored(error: ScoreError, video: &Path) -> Failure {
    let video = format!("video `{}`", video.display());
    Failure::of(error.is_input(), anyhow::Error::new(error).context(video))
}

/// Measures a strike.
fn measured(
    args: &ScoreArgs,
    run: Option<&Run>,
    (by, camera): (ScoredBy, &StereoCamera),
) -> Outcome<Value> {
    let target_rgb = by.target_rgb.context(UNNAMED_COLOURS).or_input()?;
    let mut frames = open_video(&by.video, args.fps).or_input()?;
    let stage = Stage::begin("score");
    let found = score(&mut frames, camera, by.tip_rgb, target_rgb)
        .map_err(|error| not_scored(error, &by.video))?;
    stage.done("tip and target measured");
    println!("{found}");
    let score = ScoreResult::from(&found);
    let mut value = serde_json::to_value(score).or_failed()?;
    if let Some(run) = run {
        let kept = run.keep_score(&score, &by).or_input()?;
        value["replaced_m"] = json!(kept.replaced.map(|r| r.closest_m));
        tell(&kept);
    }
    Ok(value)
}

/// Judges a lob or drape as its run did: the film's times are those of the run.
fn judged(
    args: &ScoreArgs,
    (run, plan): (&Run, &Plan),
    (by, camera): (ScoredBy, &StereoCamera),
) -> Outcome<Value> {
    let cell = config::cell_of(run).or_input()?;
    let kept = run.planner_file();
    let settings: PlannerConfig = config::here(kept.as_deref()).or_input()?;
    let goal = settings.goal(plan.task, plan.target_m);
    let domino = by.target_rgb.and_then(|rgb| goal.domino_look(&cell, rgb));
    let span_ns = goal.span_ns(&plan.trajectory, run.throw_began_ns().or_input()?);
    let mut frames = open_video(&by.video, args.fps).or_input()?;
    let stage = Stage::begin("score");
    let seen = look(&mut frames, camera, by.tip_rgb, domino.as_ref(), span_ns)
        .map_err(|error| not_scored(error, &by.video))?;
    let verdict = goal.judge_film((&plan.trajectory, &plan.rope), &cell, &seen);
    let verdict = verdict.map_err(anyhow::Error::msg).or_failed()?;
    stage.done("tip and scene looked at");
    println!("{}: {verdict}", plan.task.name());
    let kept = run.keep_verdict(&verdict, &by).or_input()?;
    tell(&kept);
    Ok(json!({ "task": plan.task, "camera_verdict": verdict, "replaced_verdict": kept.replaced }))
}

fn tell<T>(kept: &Kept<T>) {
    println!("{kept}");
    for warning in &kept.warnings {
        eprintln!("warning: {warning}");
    }
}

pub fn run(args: &ScoreArgs) -> Outcome<Option<Value>> {
    let run = args.run.as_deref().map(Run::open).transpose().or_input()?;
    // One that cannot keep a score is refused before anything is measured.
    if let Some(run) = &run {
        run.summary_of_throw().or_input()?;
        files::check_writable(&run.folder().join(files::SUMMARY)).or_input()?;
    }
    let named = NamedFilm {
        video: args.video.clone(),
        camera: args.camera.clone(),
        colours: [args.tip_rgb, args.target_rgb].map(|colour| colour.map(|named| named.0)),
    };
    let by = ScoredBy::of(named, run.as_ref()).or_input()?;
    let sees = load_camera(&by.camera).or_input()?;
    let plan = run.as_ref().and_then(|run| Some((run, run.plan().ok()??)));
    let mut value = match plan {
        Some((run, plan)) if plan.task != Task::Strike => judged(args, (run, &plan), (by, &sees)),
        _ => measured(args, run.as_ref(), (by, &sees)),
    }?;
    value["ok"] = true.into();
    value["command"] = "score".into();
    value["run"] = json!(args.run);
    Ok(Some(value))
}
