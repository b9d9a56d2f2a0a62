//! `wag score`: closest approach of tip and target from stereo video.

use crate::cli::ScoreArgs;
use camera_ingest::{ScoreError, load_camera, open_video, score};
use cli_output::{Failure, OrInput, Outcome, Stage};
use run_log::{Run, files};
use serde_json::{Value, json};
use shared_types::ipc::message::ScoreResult;
use std::path::Path;

/// Bad input, or a marker that was looked for and not found.
pub fn not_scored(error: ScoreError, video: &Path) -> Failure {
    let video = format!("video `{}`", video.display());
    Failure::of(error.is_input(), anyhow::Error::new(error).context(video))
}

pub fn run(args: &ScoreArgs) -> Outcome<Option<Value>> {
    let run = args.run.as_deref().map(Run::open).transpose().or_input()?;
    // One that cannot keep a score is refused before anything is measured.
    if let Some(run) = &run {
        run.summary_of_throw().or_input()?;
        files::check_writable(&run.folder().join(files::SUMMARY)).or_input()?;
    }
    let camera = load_camera(&args.film.camera).or_input()?;
    let mut video = open_video(&args.film.video, args.film.fps).or_input()?;
    let stage = Stage::begin("score");
    let found = score(&mut video, &camera, args.tip_rgb.0, args.target_rgb.0)
        .map_err(|error| not_scored(error, &args.film.video))?;
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
    let kept = run.map(|run| run.keep_score(&score));
    kept.transpose().or_input()?;
    let mut value = serde_json::to_value(score).or_failed()?;
    value["ok"] = true.into();
    value["command"] = "score".into();
    value["run"] = json!(args.run);
    Ok(Some(value))
}
