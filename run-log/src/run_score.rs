//! The score of a run's throw: by which colours it is measured, and what is kept of it.

use crate::{Run, files};
use anyhow::{Context, Result, ensure};
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::Value;
use shared_types::Task;
use shared_types::ipc::message::ScoreResult;
use std::fmt;
use std::path::{Path, PathBuf};

/// Keys of `summary.json` after another measurement of the throw: the score that the run made
/// itself, or why it made none, and by what the present one was made.
const SCORE_OF_RUN: &str = "score_of_run";
const SCORED_BY: &str = "scored_by";

/// By what a throw was measured again.
#[derive(Debug, Clone, Serialize)]
pub struct ScoredBy {
    /// The film.
    pub video: PathBuf,
    /// The camera's file.
    pub camera: PathBuf,
    /// Colour of the tip.
    pub tip_rgb: [u8; 3],
    /// Colour of the target.
    pub target_rgb: [u8; 3],
}

/// A score that a run keeps.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    folder: PathBuf,
    /// The score that was there before.
    pub replaced: Option<ScoreResult>,
    /// What speaks against it.
    pub warnings: Vec<String>,
}

impl fmt::Display for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let folder = self.folder.display();
        write!(f, "kept in `{folder}`")?;
        if let Some(replaced) = &self.replaced {
            write!(f, " in place of {:.1} mm", 1e3 * replaced.closest_m)?;
        }
        write!(f, "; `wag report {folder}` makes its report anew")
    }
}

/// Whether the intervals of two scores have nothing in common.
fn contradict(one: &ScoreResult, other: &ScoreResult) -> bool {
    let ([a_low, a_high], [b_low, b_high]) = (one.interval_m, other.interval_m);
    a_low > b_high || b_low > a_high
}

/// Colours of tip and target, as far as they are known.
pub type Colours = [Option<[u8; 3]>; 2];

/// Refuses a score whose target is not that of the throw: it is of another film, or of a camera
/// that stands elsewhere than it is calibrated for.
fn require_same_target(file: &Path, seen_m: [f64; 3], planned_m: [f64; 3]) -> Result<()> {
    /// Farthest that a target may be seen from where it was planned (m).
    const APART_MAX_M: f64 = 0.05;
    let apart_m = (Vector3::from(seen_m) - Vector3::from(planned_m)).norm();
    let at = |m: [f64; 3]| m.map(|m| format!("{m:.3}")).join(", ");
    ensure!(
        apart_m < APART_MAX_M,
        "`{}`: the film shows a target at ({}) m, but the throw was planned for ({}) m, {:.1} cm \
         away: it is the film of another throw, or the camera stands elsewhere",
        file.display(),
        at(seen_m),
        at(planned_m),
        100.0 * apart_m
    );
    Ok(())
}

impl Run {
    /// The figures of a run that threw a strike.
    ///
    /// # Errors
    /// As [`Self::summary_of_throw`]; its throw was no strike.
    pub fn summary_of_strike(&self) -> Result<Value> {
        let summary = self.summary_of_throw()?;
        let task = self.plan()?.map_or(Task::Strike, |plan| plan.task);
        ensure!(
            task == Task::Strike,
            "`{}` is the run of a {}, whose verdict by camera is in its {}: the distance of tip and \
             target is measured of strikes",
            self.folder().display(),
            task.name(),
            files::SUMMARY
        );
        Ok(summary)
    }

    /// Colours of tip and target by which it was to measure its throw; where it knew none,
    /// those by which that was done later.
    pub fn colours(&self) -> Result<Colours> {
        let summary = self.summary()?.unwrap_or_default();
        let colour = |value: &Value| serde_json::from_value(value.clone()).ok();
        let tip_rgb = colour(&summary["tip_rgb"]).or_else(|| colour(&summary["track"]["lead_rgb"]));
        let later = |key| colour(&summary[SCORED_BY][key]);
        let target_rgb = colour(&summary["target_rgb"]).or_else(|| later("target_rgb"));
        Ok([tip_rgb.or_else(|| later("tip_rgb")), target_rgb])
    }

    /// Keeps what a camera measured of its throw among its figures, and by what it did; what the
    /// run itself measured stays beside it.
    ///
    /// # Errors
    /// As [`Self::summary_of_strike`]; the film shows another target than the plan's.
    pub fn keep_score(&self, score: &ScoreResult, by: &ScoredBy) -> Result<Kept> {
        let mut summary = self.summary_of_strike()?;
        let file = self.folder().join(files::SUMMARY);
        if let Some(plan) = self.plan()? {
            require_same_target(&file, score.target_m, plan.target_m)?;
        }
        let before = summary["score"].take();
        let replaced: Option<ScoreResult> = serde_json::from_value(before.clone()).ok();
        if summary[SCORED_BY].is_null() {
            let failed = summary["score_failed"].take();
            summary[SCORE_OF_RUN] = if before.is_null() { failed } else { before };
        }
        summary["score"] = serde_json::to_value(score)?;
        summary[SCORED_BY] = serde_json::to_value(by)?;
        if let Some(figures) = summary.as_object_mut() {
            figures.remove("score_failed");
            // A demo tells it a second time.
            figures
                .entry("stereo_tip_target_distance_m")
                .and_modify(|m| *m = score.closest_m.into());
        }
        files::write_json(&file, &summary)?;
        let folder = self.folder().to_owned();
        let mut warnings = Vec::new();
        if replaced.is_some_and(|replaced| contradict(&replaced, score)) {
            warnings.push(format!(
                "it contradicts the score that it replaces: look at the film and the colours; \
                 without --tip-rgb and --target-rgb, `wag score --run {}` takes the run's own",
                folder.display()
            ));
        }
        if let Err(why) = self.miss_m() {
            warnings.push(format!("{why:#}"));
        }
        Ok(Kept {
            folder,
            replaced,
            warnings,
        })
    }

    /// Where the tip passed minus the target (m, base frame), as the run's camera measured it.
    /// One that it hardly knows is refused.
    pub fn miss_m(&self) -> Result<[f64; 3]> {
        /// Widest interval of a distance whose miss is believed (m).
        const INTERVAL_MAX_M: f64 = 0.1;
        let score = self.summary()?.unwrap_or_default()["score"].take();
        let path = self.folder().join(files::SUMMARY);
        let name = path.display();
        let miss_m = serde_json::from_value(score["miss_m"].clone()).ok();
        let miss_m = miss_m.with_context(|| {
            format!("`{name}` has no miss by the camera (`score.miss_m`): name it with --miss, or measure it with `wag score --run`")
        })?;
        let [low_m, high_m]: [f64; 2] = serde_json::from_value(score["interval_m"].clone())
            .with_context(|| format!("`{name}`: `score.interval_m`"))?;
        ensure!(
            high_m - low_m < INTERVAL_MAX_M,
            "`{name}`: the camera knows the distance from {low_m:.3} to {high_m:.3} m only \
             (`score.interval_m`); look at the film and name the miss with --miss"
        );
        let target_m = serde_json::from_value(score["target_m"].clone()).ok();
        if let Some((target_m, plan)) = target_m.zip(self.plan()?) {
            require_same_target(&path, target_m, plan.target_m)?;
        }
        Ok(miss_m)
    }
}
