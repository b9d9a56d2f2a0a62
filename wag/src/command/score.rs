//! `wag score`: closest approach of tip and target from stereo video.

use crate::cli::ScoreArgs;
use anyhow::Context;
use camera_ingest::{ScoreError, load_camera, open_video, score};
use cli_output::{Failure, OrInput, Outcome, Stage};
use run_log::{Run, ScoredBy, files};
use serde_json::{Value, json};
use shared_types::ipc::message::ScoreResult;
use std::path::{Path, PathBuf};

/// Bad input, or a marker that was looked for and not found.
pub fn not_scored(error: ScoreError, video: &Path) -> Failure {
    let video = format!("video `{}`", video.display());
    Failure::of(error.is_input(), anyhow::Error::new(error).context(video))
}

/// The film and the camera's file: those that are named, else what the run keeps of its throw.
fn filmed(args: &ScoreArgs, run: Option<&Run>) -> anyhow::Result<(PathBuf, PathBuf)> {
    let kept = || run.context("name film and camera with --video and --camera, or --run");
    let camera = match &args.camera {
        Some(camera) => camera.clone(),
        None => kept()?.folder().join(files::CAMERA),
    };
    let video = args.video.clone().map_or_else(|| kept()?.throw_film(), Ok);
    Ok((video?, camera))
}

pub fn run(args: &ScoreArgs) -> Outcome<Option<Value>> {
    let run = args.run.as_deref().map(Run::open).transpose().or_input()?;
    // One that cannot keep a score is refused before anything is measured.
    if let Some(run) = &run {
        run.summary_of_strike().or_input()?;
        files::check_writable(&run.folder().join(files::SUMMARY)).or_input()?;
    }
    let of_run = run.as_ref().map(Run::colours).transpose().or_input()?;
    let named = [args.tip_rgb, args.target_rgb].map(|colour| colour.map(|named| named.0));
    let [tip_rgb, target_rgb] = [0, 1].map(|i| named[i].or(of_run.and_then(|of| of[i])));
    let (video, camera) = filmed(args, run.as_ref()).or_input()?;
    let known = tip_rgb
        .zip(target_rgb)
        .context("name the colours with --tip-rgb and --target-rgb");
    let (tip_rgb, target_rgb) = known.or_input()?;
    let sees = load_camera(&camera).or_input()?;
    let mut frames = open_video(&video, args.fps).or_input()?;
    let stage = Stage::begin("score");
    let found = score(&mut frames, &sees, tip_rgb, target_rgb)
        .map_err(|error| not_scored(error, &video))?;
    let [x, y, z] = found.miss_m;
    let line = format!(
        "closest approach {:.1} mm ({:.1} to {:.1}) at {:.4} s; miss {x:.4},{y:.4},{z:.4} m (tip minus target)",
        1e3 * found.closest_m,
        1e3 * found.interval_m[0],
        1e3 * found.interval_m[1],
        found.time_s
    );
    stage.done("tip and target measured");
    println!("{line}");
    let score = ScoreResult::from(&found);
    let mut value = serde_json::to_value(score).or_failed()?;
    if let Some(run) = &run {
        let by = ScoredBy {
            video,
            camera,
            tip_rgb,
            target_rgb,
        };
        let kept = run.keep_score(&score, &by).or_input()?;
        println!("{kept}");
        for warning in &kept.warnings {
            eprintln!("warning: {warning}");
        }
        value["replaced_m"] = json!(kept.replaced.map(|r| r.closest_m));
    }
    value["ok"] = true.into();
    value["command"] = "score".into();
    value["run"] = json!(args.run);
    Ok(Some(value))
}
