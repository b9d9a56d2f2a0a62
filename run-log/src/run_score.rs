//! The score of a run's throw, or the verdict on it: by which colours it is found, and what is kept.

use crate::{Run, files};
use anyhow::{Context, Result, ensure};
use nalgebra::Vector3;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use shared_types::ipc::message::ScoreResult;
use shared_types::{Task, Verdict};
use std::fmt;
use std::path::PathBuf;

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
    /// Colour of the target, or of a lob's domino, where it was looked for.
    pub target_rgb: Option<[u8; 3]>,
}

/// What is named of a film and of its colours.
#[derive(Debug)]
pub struct NamedFilm {
    /// The film.
    pub video: Option<PathBuf>,
    /// The camera's file.
    pub camera: Option<PathBuf>,
    /// Colours of tip and target.
    pub colours: Colours,
}

/// What is missing where no colour is named.
pub const UNNAMED_COLOURS: &str = "name the colours with --tip-rgb and --target-rgb";

impl ScoredBy {
    /// What is named, else what a run keeps of its throw.
    ///
    /// # Errors
    /// Film, camera or a colour, a strike's target's too, are named by neither.
    pub fn of(named: NamedFilm, run: Option<&Run>) -> Result<Self> {
        let kept = || run.context("name film and camera with --video and --camera, or --run");
        let camera = match named.camera {
            Some(camera) => camera,
            None => kept()?.folder().join(files::CAMERA),
        };
        let video = named.video.map_or_else(|| kept()?.throw_film(), Ok)?;
        let of_run = run.map(Run::colours).transpose()?.unwrap_or_default();
        let [tip_rgb, target_rgb] = [0, 1].map(|i| named.colours[i].or(of_run[i]));
        let plan = run.map(Run::plan).transpose()?.flatten();
        let is_strike = plan.is_none_or(|plan| plan.task == Task::Strike);
        ensure!(target_rgb.is_some() || !is_strike, UNNAMED_COLOURS);
        Ok(Self {
            video,
            camera,
            tip_rgb: tip_rgb.context(UNNAMED_COLOURS)?,
            target_rgb,
        })
    }
}

/// What a run keeps of a throw that was measured or judged again.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept<T> {
    folder: PathBuf,
    /// What was there before.
    pub replaced: Option<T>,
    /// The same in words.
    replaced_words: Option<String>,
    /// What speaks against it.
    pub warnings: Vec<String>,
}

impl<T> fmt::Display for Kept<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let folder = self.folder.display();
        write!(f, "kept in `{folder}`")?;
        if let Some(replaced) = &self.replaced_words {
            write!(f, " in place of {replaced}")?;
        }
        write!(f, "; `wag report {folder}` makes its report anew")
    }
}

/// Whether the intervals of two scores have nothing in common.
fn contradict(one: &ScoreResult, other: &ScoreResult) -> bool {
    let ([a_low, a_high], [b_low, b_high]) = (one.interval_m, other.interval_m);
    a_low > b_high || b_low > a_high
}

/// Whether two verdicts disagree about a condition, or one saw what the other did not.
fn disagree(one: &Verdict, other: &Verdict) -> bool {
    if one.unseen != other.unseen {
        return true;
    }
    let mut pairs = one
        .conditions
        .iter()
        .flat_map(|a| other.conditions.iter().map(move |b| (a, b)));
    pairs.any(|(a, b)| a.name == b.name && a.met != b.met)
}

/// Colours of tip and target, as far as they are known.
pub type Colours = [Option<[u8; 3]>; 2];

/// Refuses a score whose target is not that of the throw: it is of another film, of something else
/// of its colour, or of a camera that stands elsewhere than it is calibrated for.
///
/// # Errors
/// In words.
pub fn require_same_target(seen_m: [f64; 3], planned_m: [f64; 3]) -> Result<()> {
    /// Farthest that a target may be seen from where it was planned (m).
    const APART_MAX_M: f64 = 0.05;
    let apart_m = (Vector3::from(seen_m) - Vector3::from(planned_m)).norm();
    let at = |m: [f64; 3]| m.map(|m| format!("{m:.3}")).join(", ");
    ensure!(
        apart_m < APART_MAX_M,
        "the film shows a target at ({}) m, but the throw was planned for ({}) m, {:.1} cm away: it \
         is the film of another throw, something else has the target's colour, or the camera stands \
         elsewhere",
        at(seen_m),
        at(planned_m),
        100.0 * apart_m
    );
    Ok(())
}

impl Run {
    /// When the first setpoint of its throw was due (CLOCK_MONOTONIC, ns).
    ///
    /// # Errors
    /// An older version, or a throw that no camera filmed, does not tell.
    pub fn throw_began_ns(&self) -> Result<u64> {
        let summary = self.summary()?.unwrap_or_default();
        summary["throw"]["start_ns"].as_u64().with_context(|| {
            format!(
                "`{}` does not tell when the throw began (`throw.start_ns`): an older version made \
                 it, or no camera filmed the throw",
                self.folder().join(files::SUMMARY).display()
            )
        })
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
    /// As [`Self::summary_of_throw`]; the film shows another target than the plan's.
    pub fn keep_score(&self, score: &ScoreResult, by: &ScoredBy) -> Result<Kept<ScoreResult>> {
        let mut summary = self.summary_of_throw()?;
        if let Some(plan) = self.plan()? {
            require_same_target(score.target_m, plan.target_m)?;
        }
        if let Some(figures) = summary.as_object_mut() {
            // A demo tells it a second time.
            figures
                .entry("stereo_tip_target_distance_m")
                .and_modify(|m| *m = score.closest_m.into());
        }
        let contradicts = |own: &ScoreResult| contradict(own, score);
        let mut kept = self.keep(summary, ("score", score), by, contradicts)?;
        let replaced = kept.replaced.map(|replaced| 1e3 * replaced.closest_m);
        kept.replaced_words = replaced.map(|mm| format!("{mm:.1} mm"));
        if let Err(why) = self.miss_m() {
            kept.warnings.push(format!("{why:#}"));
        }
        Ok(kept)
    }

    /// Keeps how a camera judged its lob or drape, in the same way.
    ///
    /// # Errors
    /// As [`Self::summary_of_throw`].
    pub fn keep_verdict(&self, verdict: &Verdict, by: &ScoredBy) -> Result<Kept<Verdict>> {
        let summary = self.summary_of_throw()?;
        let contradicts = |own: &Verdict| disagree(own, verdict);
        let mut kept = self.keep(summary, ("camera_verdict", verdict), by, contradicts)?;
        kept.replaced_words = kept.replaced.as_ref().map(|old| format!("`{old}`"));
        Ok(kept)
    }

    fn keep<T: Serialize + DeserializeOwned>(
        &self,
        mut summary: Value,
        (key, value): (&str, &T),
        by: &ScoredBy,
        contradicts: impl Fn(&T) -> bool,
    ) -> Result<Kept<T>> {
        let before = summary[key].take();
        let replaced = serde_json::from_value(before.clone()).ok();
        if summary[SCORED_BY].is_null() {
            let failed = summary["score_failed"].take();
            summary[SCORE_OF_RUN] = if before.is_null() { failed } else { before };
        }
        summary[key] = serde_json::to_value(value)?;
        let own: Option<T> = serde_json::from_value(summary[SCORE_OF_RUN].clone()).ok();
        let mut warnings = Vec::new();
        if own.is_some_and(|own| contradicts(&own)) {
            warnings.push(format!(
                "it contradicts what the run itself measured: look at the film and the colours; \
                 without --tip-rgb and --target-rgb, `wag score --run {}` takes the run's own",
                self.folder().display()
            ));
        }
        summary[SCORED_BY] = serde_json::to_value(by)?;
        summary[SCORED_BY]["warnings"] = serde_json::to_value(&warnings)?;
        if let Some(figures) = summary.as_object_mut() {
            figures.remove("score_failed");
        }
        files::write_json(&self.folder().join(files::SUMMARY), &summary)?;
        Ok(Kept {
            folder: self.folder().to_owned(),
            replaced,
            replaced_words: None,
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
            format!("`{name}` has no miss by the camera (`score.miss_m`): measure it with `wag score --run`, or name it to `wag throw --again RUN --miss X,Y,Z`")
        })?;
        let [low_m, high_m]: [f64; 2] = serde_json::from_value(score["interval_m"].clone())
            .with_context(|| format!("`{name}`: `score.interval_m`"))?;
        ensure!(
            high_m - low_m < INTERVAL_MAX_M,
            "`{name}`: the camera knows the distance from {low_m:.3} to {high_m:.3} m only \
             (`score.interval_m`); look at the film, and name the miss to `wag throw --again RUN --miss X,Y,Z`"
        );
        let target_m = serde_json::from_value(score["target_m"].clone()).ok();
        if let Some((target_m, plan)) = target_m.zip(self.plan()?) {
            require_same_target(target_m, plan.target_m).with_context(|| format!("`{name}`"))?;
        }
        Ok(miss_m)
    }
}
