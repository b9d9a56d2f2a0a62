//! One run, as far as its folder tells.

use crate::{Run, files};
use anyhow::Result;
use serde::Serialize;
use shared_types::RopeParams;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What came of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RunResult {
    /// It went through.
    Ok,
    /// It ran and failed.
    Failed,
    /// Its folder does not tell, or a file in it is damaged.
    Broken,
}

/// One run.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// Its folder.
    pub run: PathBuf,
    /// What came of it.
    pub result: RunResult,
    /// What went wrong, or what is wrong with the folder.
    pub problems: Vec<String>,
    /// When it was begun (UTC), if known.
    pub started: Option<String>,
    /// Arguments of `wag`.
    pub arguments: Option<Vec<String>>,
    /// Version of the program.
    pub version: Option<String>,
    /// Seed.
    pub seed: Option<u64>,
    /// Task of the throw.
    pub task: Option<String>,
    /// Target (m).
    pub target_m: Option<[f64; 3]>,
    /// Frames of the wiggle's film.
    pub wiggle_frames: Option<u64>,
    /// The identified rope, or the one that the plan is for.
    pub rope: Option<RopeParams>,
    /// Hash of the plan's trajectory.
    pub plan_sha256: Option<String>,
    /// Distance of tip and target: predicted, by the rig's truth, by the camera (m).
    pub predicted_m: Option<f64>,
    /// By the simulated rig's truth (m).
    pub true_m: Option<f64>,
    /// By the camera (m).
    pub camera_m: Option<f64>,
    /// Cause of the first stop.
    pub stopped_by: Option<String>,
}

impl Entry {
    /// What was done: the first argument.
    pub fn command(&self) -> Option<&str> {
        self.arguments.as_ref()?.first().map(String::as_str)
    }
}

impl FromStr for RunResult {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "ok" => Ok(Self::Ok),
            "failed" => Ok(Self::Failed),
            "broken" => Ok(Self::Broken),
            _ => Err("a run is ok, failed or broken".to_owned()),
        }
    }
}

/// A file of a run; one that is damaged is a problem of the run.
fn part<T>(name: &str, damage: &mut Vec<String>, found: Result<Option<T>>) -> Option<T> {
    found.unwrap_or_else(|error| {
        damage.push(format!("{name}: {error:#}").replace('\n', " "));
        None
    })
}

/// Reads a run that is there; whatever is wrong with it is reported in it.
pub fn read(folder: &Path) -> Result<Entry> {
    let run = Run::open(folder)?;
    let mut damage = Vec::new();
    let summary = part(files::SUMMARY, &mut damage, run.summary());
    let plan = part(files::PLAN, &mut damage, run.plan());
    let rope = part(files::ROPE, &mut damage, run.rope());
    let cause = part(files::CAUSE, &mut damage, run.cause()).unwrap_or_default();
    let line = part(files::COMMAND, &mut damage, run.command());
    if summary.is_none() && damage.is_empty() {
        damage.push("summary.json is missing: the run is under way, or was killed".to_owned());
    }
    let broken = !damage.is_empty();
    let summary = summary.unwrap_or_default();
    let text = |key: &str| summary[key].as_str().map(str::to_owned);
    let failed = text("error");
    let result = match (broken, summary["ok"].as_bool()) {
        (true, _) => RunResult::Broken,
        (false, Some(true)) => RunResult::Ok,
        (false, Some(false) | None) => RunResult::Failed,
    };
    Ok(Entry {
        run: folder.to_owned(),
        result,
        problems: failed.into_iter().chain(damage).collect(),
        started: line.as_ref().map(|l| l.started.clone()),
        version: line.as_ref().map(|l| l.version.clone()).or(text("version")),
        // An old run's summary names its command, if not its arguments.
        arguments: line
            .map(|l| l.arguments)
            .or(text("command").map(|c| vec![c])),
        seed: summary["seed"].as_u64().or(plan.as_ref().map(|p| p.seed)),
        task: text("task").or(plan.as_ref().map(|p| p.task.name().to_owned())),
        target_m: serde_json::from_value(summary["target_m"].clone())
            .ok()
            .or(plan.as_ref().map(|p| p.target_m)),
        wiggle_frames: summary["wiggle"]["frames"].as_u64(),
        rope: rope.or(plan.as_ref().map(|p| p.rope)),
        plan_sha256: plan.as_ref().map(|p| p.trajectory_sha256.clone()),
        predicted_m: plan.as_ref().map(|p| p.predicted_error_m),
        true_m: summary["true_tip_target_distance_m"].as_f64(),
        camera_m: summary["score"]["closest_m"].as_f64(),
        stopped_by: cause["stops"][0]["code"].as_str().map(str::to_owned),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_broken_folder_says_what_is_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let run = dir.path();
        let found = read(run).unwrap();
        assert_eq!(found.result, RunResult::Broken);
        assert!(
            found.problems[0].contains("summary.json is missing"),
            "{found:?}"
        );
        fs::write(run.join("summary.json"), "{\"ok\": true, \"seed\": 4}").unwrap();
        assert_eq!(read(run).unwrap().result, RunResult::Ok);
        fs::write(run.join("params.toml"), "links = no").unwrap();
        let found = read(run).unwrap();
        assert_eq!((found.result, found.seed), (RunResult::Broken, Some(4)));
        assert!(found.problems[0].starts_with("params.toml"), "{found:?}");
        fs::remove_file(run.join("params.toml")).unwrap();
        fs::write(
            run.join("summary.json"),
            "{\"ok\": false, \"error\": \"no arm\"}",
        )
        .unwrap();
        let found = read(run).unwrap();
        assert_eq!(
            (found.result, found.problems.as_slice()),
            (RunResult::Failed, &["no arm".to_owned()][..])
        );
    }
}
