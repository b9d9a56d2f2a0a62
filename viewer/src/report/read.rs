//! A run folder as what a report holds.

use super::data::{Errors, ReportData};
use super::motion::{motions, read_cycles};
use super::replay::{Known, scene};
use super::{latency, pictures, rope};
use anyhow::{Context, ensure};
use run_log::files;
use run_log::files::read_plan;
use run_log::{CYCLES_FILE, RunLog, explain, show};
use serde_json::Value;
use std::path::Path;

/// Parts of `summary.json` that are told elsewhere, and better.
const TOLD_ELSEWHERE: [&str; 4] = ["identified", "truth", "explanation", "run"];
/// Most motions that are shown.
const SCENES_MAX: usize = 6;

/// Reads a run.
pub(crate) fn read_run(run: &Path) -> anyhow::Result<ReportData> {
    ensure!(
        run.is_dir(),
        "`{}` is no folder; name a run folder as made by wag demo, throw, wiggle or record",
        run.display()
    );
    let mut missing = Vec::new();
    let mut there = |file: &str, gives: &str| {
        let path = run.join(file);
        let found = path.is_file();
        if !found {
            missing.push(format!("{file}: {gives}"));
        }
        found.then_some(path)
    };
    let summary = there("summary.json", "no figures of the run");
    let cycles = there("cycles.csv", "no motions, no times of the control loop");
    let bin = there(CYCLES_FILE, "no limits used, no causes of stops");
    ensure!(
        summary.is_some() || cycles.is_some() || bin.is_some(),
        "`{}` is no run folder: it holds neither summary.json nor {CYCLES_FILE}",
        run.display()
    );
    let mut summary = summary
        .map(|path| read_json(&path))
        .transpose()?
        .unwrap_or_default();
    let plan = there("plan.json", "no plan to compare with")
        .map(|path| read_plan(&path))
        .transpose()?;
    let (params, rope_rows) = there("params.toml", "no identified rope")
        .map(|path| rope::read(&path, &summary["truth"]["rope"]))
        .transpose()?
        .unzip();
    let joints = there("joints.csv", "no measured joints")
        .map(|path| files::read_joints(&path))
        .transpose()?;
    let rows = cycles
        .map(|path| read_cycles(&path))
        .transpose()?
        .unwrap_or_default();
    let log = bin.map(|path| read_log(&path)).transpose()?;
    let explanation = log.as_ref().map(explain);
    let motions = motions(&rows);
    let known = Known {
        joints: joints.as_ref(),
        // A throw alone has the rope it was planned for.
        rope: params.as_ref().or(plan.as_ref().map(|p| &p.rope)),
        plan: plan.as_ref(),
        target_m: target(&summary).or(plan.as_ref().map(|p| p.target_m)),
    };
    let scenes = motions
        .iter()
        .take(SCENES_MAX)
        .enumerate()
        .map(|(index, motion)| scene(index, motion, &known))
        .collect::<anyhow::Result<_>>()
        .with_context(|| format!("run `{}`", run.display()))?;
    let moving: Vec<_> = motions.iter().copied().flatten().collect();
    let pictures = pictures::read(run, &mut missing)?;
    let error = Errors {
        planned_m: plan.as_ref().map(|p| p.predicted_error_m),
        forecast_90_m: plan.as_ref().and_then(|p| Some(p.forecast?.interval_90_m)),
        true_m: summary["true_tip_target_distance_m"].as_f64(),
        camera_m: summary["score"]["closest_m"].as_f64(),
        camera_interval_m: pair(&summary["score"]["interval_m"]),
    };
    if let Some(table) = summary.as_object_mut() {
        for key in TOLD_ELSEWHERE {
            table.remove(key);
        }
    }
    Ok(ReportData {
        version: shared_types::VERSION,
        run: folder_name(run),
        summary,
        error,
        rope: rope_rows.unwrap_or_default(),
        plan_margins: plan.as_ref().map(|p| p.margins.clone()).unwrap_or_default(),
        cause: explanation.as_ref().filter(|e| e.stopped).map(show),
        explanation,
        latency: latency::histograms(&moving),
        scenes,
        pictures,
        missing,
    })
}

fn folder_name(run: &Path) -> String {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned());
    name(run)
        .or_else(|| name(&run.canonicalize().ok()?))
        .unwrap_or_default()
}

fn read_json(path: &Path) -> anyhow::Result<Value> {
    serde_json::from_str(&files::read_text(path)?)
        .with_context(|| format!("`{}` is no JSON", path.display()))
}

fn read_log(path: &Path) -> anyhow::Result<RunLog> {
    let fail = || format!("recording `{}`", path.display());
    let bytes = std::fs::read(path).with_context(fail)?;
    RunLog::read(&bytes).with_context(fail)
}

fn pair(value: &Value) -> Option<[f64; 2]> {
    Some([value[0].as_f64()?, value[1].as_f64()?])
}

fn target(summary: &Value) -> Option<[f64; 3]> {
    let target = &summary["target_m"];
    Some([
        target[0].as_f64()?,
        target[1].as_f64()?,
        target[2].as_f64()?,
    ])
}
