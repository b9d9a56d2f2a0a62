//! A run folder as what a report holds.

use super::data::{Errors, ReportData, RopeRow, Scene};
use super::headline::headline;
use super::limits::{self, Span};
use super::names::names;
use super::replay::{Known, motions, scene};
use super::{latency, pictures};
use anyhow::{Context, ensure};
use run_log::{CellHere, NoRecording, RopeMotion, Run, explain, files, show};
use serde::de::DeserializeOwned;
use serde_json::Value;
use shared_types::ipc::CycleRecord;
use shared_types::rope::RANGES;
use shared_types::{MonotonicNs, Plan, RopeParams};
use std::path::Path;

/// Parts of `summary.json` that are told elsewhere, and better.
const TOLD_ELSEWHERE: [&str; 4] = ["identified", "truth", "explanation", "run"];
/// Most motions that are shown.
const SCENES_MAX: usize = 6;

/// The first motions of a run.
fn scenes(known: &Known<'_>, summary: &Value) -> anyhow::Result<Vec<Scene>> {
    let motions = motions(&known.cycles.cycles);
    let named = motion_names(&motions, known, summary);
    let scene = |(name, motion)| scene(name, motion, known);
    named
        .into_iter()
        .zip(motions)
        .take(SCENES_MAX)
        .map(scene)
        .collect()
}

fn motion_names(motions: &[&[CycleRecord]], known: &Known<'_>, summary: &Value) -> Vec<String> {
    let duration_s = |motion: &&[CycleRecord]| motion.last().map_or(0.0, |c| c.trajectory_s);
    let durations_s: Vec<f64> = motions.iter().map(duration_s).collect();
    let planned_s = known.plan.map(|plan| plan.trajectory.duration_s());
    names(&durations_s, planned_s, summary, known.rope.is_some())
}

/// The motions' names and when each was (s from the first cycle).
fn spans(known: &Known<'_>, summary: &Value) -> Vec<Span> {
    let motions = motions(&known.cycles.cycles);
    let named = motion_names(&motions, known, summary);
    let first = known.cycles.cycles.first().map_or(0, |c| c.deadline_ns);
    let at_s = |c: &CycleRecord| MonotonicNs(c.deadline_ns).since_s(MonotonicNs(first));
    let ends = |motion: &[CycleRecord]| [at_s(&motion[0]), at_s(&motion[motion.len() - 1])];
    named
        .into_iter()
        .zip(motions.into_iter().map(ends))
        .collect()
}

/// The identified rope, simulated on the motions of a run folder.
///
/// # Errors
/// A file of the run is damaged.
pub fn simulated_rope(run: &Path) -> anyhow::Result<Vec<RopeMotion>> {
    let run = Run::open(run)?;
    let plan = run.plan()?;
    let Some(rope) = run.rope()?.or(plan.as_ref().map(|p| p.rope)) else {
        return Ok(Vec::new());
    };
    let summary = run.summary()?.unwrap_or_default();
    let known = Known {
        cell: run.cell()?.unwrap_or_default(),
        cycles: &run.recording()?.cycles()?,
        rope: Some(&rope),
        plan: plan.as_ref(),
        target_m: None,
    };
    let motion = |scene: Scene| RopeMotion {
        begin: scene.begin.plus_s(scene.from_s),
        period_s: scene.period_s,
        nodes: scene.rope,
        radii_m: scene.radii_m,
    };
    Ok(scenes(&known, &summary)?.into_iter().map(motion).collect())
}

/// What came of a run in one line; nothing before it has ended.
pub fn headline_of(run: &Path) -> Option<String> {
    let run = Run::open(run).ok()?;
    let summary = run.summary().ok()??;
    let plan = run.plan().ok()?;
    let rope = run.rope().ok()?.or(plan.as_ref().map(|plan| plan.rope));
    let error = errors(plan.as_ref(), &summary);
    let tip_radius_m = rope.map_or(0.0, |rope| rope.lead_radius_m);
    Some(headline(&error, &summary, tip_radius_m))
}

/// What plan and summary of a run tell of its miss.
fn errors(plan: Option<&Plan>, summary: &Value) -> Errors {
    Errors {
        planned_m: plan.map(|plan| plan.predicted_error_m),
        forecast_90_m: plan.and_then(|plan| Some(plan.forecast?.interval_90_m)),
        true_m: summary["true_tip_target_distance_m"].as_f64(),
        camera_m: summary["score"]["closest_m"].as_f64(),
        camera_interval_m: value(&summary["score"]["interval_m"]),
    }
}

pub(crate) fn read_run(run: &Path, here: &CellHere) -> anyhow::Result<ReportData> {
    ensure!(
        run.is_dir(),
        "`{}` is not a folder; name a run folder as made by wag run, demo, throw, wiggle or record",
        run.display()
    );
    let of_run = Run::open(run)?;
    let mut missing = Vec::new();
    let mut note = |is_there: bool, file: &str, gives: &str| {
        if !is_there {
            missing.push(format!("{file}: {gives}"));
        }
    };
    let summary = of_run.summary()?;
    note(summary.is_some(), files::SUMMARY, "no figures of the run");
    let recorded = match of_run.recording() {
        Ok(recording) => Some((recording.cycles()?, explain(&recording.log()?))),
        Err(none) if none.is::<NoRecording>() => None,
        Err(damaged) => return Err(damaged),
    };
    ensure!(
        summary.is_some() || recorded.is_some(),
        "`{}` is not a run folder: it holds neither {} nor {}",
        run.display(),
        files::SUMMARY,
        files::RUN
    );
    let mut summary = summary.unwrap_or_default();
    let gives = "no motions, no times of the control loop, no limits used, no causes of stops";
    note(recorded.is_some(), files::RUN, gives);
    let (cycles, explanation) = recorded.unzip();
    let cycles = cycles.unwrap_or_default();
    let plan = of_run.plan()?;
    note(plan.is_some(), files::PLAN, "no plan to compare with");
    let params = of_run.rope()?;
    note(params.is_some(), files::ROPE, "no identified rope");
    let rope = match &params {
        Some(rope) => rope_rows(rope, &run.join(files::ROPE), &summary["truth"]["rope"])?,
        None => Vec::new(),
    };
    let known = Known {
        cell: here.of_run(of_run.cell()?),
        cycles: &cycles,
        // A throw alone has the rope it was planned for.
        rope: params.as_ref().or(plan.as_ref().map(|p| &p.rope)),
        plan: plan.as_ref(),
        target_m: value(&summary["target_m"]).or(plan.as_ref().map(|p| p.target_m)),
    };
    let scenes = scenes(&known, &summary).with_context(|| format!("run `{}`", run.display()))?;
    let moving: Vec<_> = motions(&cycles.cycles).into_iter().flatten().collect();
    let pictures = pictures::read(run, &mut missing)?;
    let error = errors(plan.as_ref(), &summary);
    let tip_radius_m = known.rope.map_or(0.0, |rope| rope.lead_radius_m);
    let headline = headline(&error, &summary, tip_radius_m);
    let spans = spans(&known, &summary);
    let used = explanation.as_ref().map(|e| limits::commanded(e, &spans));
    if let Some(table) = summary.as_object_mut() {
        for key in TOLD_ELSEWHERE {
            table.remove(key);
        }
    }
    Ok(ReportData {
        version: shared_types::VERSION,
        run: folder_name(run),
        headline,
        summary,
        error,
        rope,
        planned_limits: plan
            .as_ref()
            .map(|p| limits::planned(&p.margins))
            .unwrap_or_default(),
        limits: used.unwrap_or_default(),
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

/// A value of the summary, where it is there and as it should be.
fn value<T: DeserializeOwned>(found: &Value) -> Option<T> {
    T::deserialize(found).ok()
}

/// Rows of a rope with the intervals in its file; `truth` is what a simulated rig said
/// about it.
///
/// # Errors
/// The file is wrong.
pub fn rope_rows(params: &RopeParams, path: &Path, truth: &Value) -> anyhow::Result<Vec<RopeRow>> {
    let table: toml::Table = toml::from_str(&files::read_text(path)?)
        .with_context(|| format!("rope file `{}`", path.display()))?;
    let interval = |key: &str| {
        let ends = table.get("interval_90")?.get(key)?.as_array()?;
        match ends.iter().map(toml::Value::as_float).collect::<Vec<_>>()[..] {
            [Some(low), Some(high)] => Some([low, high]),
            _ => None,
        }
    };
    Ok(RANGES
        .iter()
        .zip(params.to_array())
        .map(|(range, value)| RopeRow {
            label: range.label,
            unit: range.unit,
            value,
            interval_90: interval(range.key),
            range: [range.min, range.max],
            truth: truth[range.key].as_f64(),
        })
        .collect())
}
