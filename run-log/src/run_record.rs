//! What a run from wiggle to throw keeps of itself: every stage's figures, and the truth of a
//! simulated one apart.

use anyhow::bail;
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::ipc::message::{LatencyReport, RigEvent, RopeAppearance, ScoreResult};
use shared_types::{MonotonicNs, Plan, RopeEstimate, RopeParams, Task, Verdict};
use std::path::Path;

/// When a motion ran (CLOCK_MONOTONIC, ns).
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct MotionSpan {
    /// Deadline of the first setpoint.
    pub start_ns: u64,
    /// Deadline of the last setpoint.
    pub end_ns: u64,
}

/// Latest begin of a throw out of a swing after its instant that is as good as planned (s).
pub const LATE_MAX_S: f64 = 0.02;

/// Wall time of each stage (s).
#[derive(Debug, Clone, Default, Serialize)]
pub struct StageTimes {
    /// Starting the processes.
    pub start_s: f64,
    /// Enabling the arm and moving to the start.
    pub bringup_s: f64,
    /// The wiggle.
    pub wiggle_s: f64,
    /// Tracking.
    pub track_s: f64,
    /// Identification.
    pub identify_s: f64,
    /// Planning.
    pub plan_s: f64,
    /// Bringing the rope to rest.
    pub settle_s: f64,
    /// The throw.
    pub throw_s: f64,
    /// Measuring the miss.
    pub score_s: f64,
}

impl StageTimes {
    /// Each by its name, in their order (s).
    #[must_use]
    pub fn named(&self) -> [(&'static str, f64); 9] {
        [
            ("start", self.start_s),
            ("bring-up", self.bringup_s),
            ("wiggle", self.wiggle_s),
            ("track", self.track_s),
            ("identify", self.identify_s),
            ("plan", self.plan_s),
            ("settle", self.settle_s),
            ("throw", self.throw_s),
            ("score", self.score_s),
        ]
    }
}

/// A film and its motion.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Film {
    /// Start of exposure of the first frame (CLOCK_MONOTONIC, ns).
    pub first_stamp_ns: u64,
    /// Frames kept.
    pub frames: u32,
    /// Frames the camera dropped.
    pub dropped: u32,
    /// When the motion ran.
    pub motion: MotionSpan,
}

impl Film {
    /// One line about it.
    #[must_use]
    pub fn describe(&self) -> String {
        format!("{} frames, {} dropped", self.frames, self.dropped)
    }
}

/// How a film was tracked.
#[derive(Debug, Clone, Serialize)]
pub struct Tracked {
    /// Part of the frames in which the rope was lost (0 to 1).
    pub lost_fraction: f64,
    /// Sizes of rope and lead.
    #[serde(flatten)]
    pub appearance: RopeAppearance,
    /// Processing time per frame (ms).
    pub ms_per_frame: f64,
    /// Why the track should not be relied on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unconfirmed: Vec<String>,
}

/// A move that brings the rope to rest.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Settled {
    /// Simulated residual vibration of the tip after a plain move (m).
    pub plain_residual_m: f64,
    /// The same after the move that was made (m).
    pub residual_m: f64,
    /// How much later than planned the move began (s).
    pub late_s: f64,
}

/// Everything a run reports; `summary.json` and `--json`.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RunRecord {
    /// Whether the throw went through.
    pub ok: bool,
    command: &'static str,
    version: &'static str,
    /// Seed of every search; of a demo's hidden rope, target and noise, too.
    pub seed: u64,
    /// The run's folder.
    pub run: String,
    /// Whether the arm is simulated.
    pub simulated: bool,
    /// What the throw is for.
    pub task: Task,
    /// Target in the arm's base frame (m); none of a wiggle alone.
    pub target_m: Option<[f64; 3]>,
    /// What went wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Distance of tip and target by the rig's truth (m).
    pub true_tip_target_distance_m: Option<f64>,
    /// Distance the planner predicted (m).
    pub planned_tip_target_distance_m: Option<f64>,
    /// Distance measured by the stereo camera (m).
    stereo_tip_target_distance_m: Option<f64>,
    /// Instant that times in the run's files count from (CLOCK_MONOTONIC, ns): the
    /// wiggle's first frame, or the throw's where there was no wiggle.
    epoch_ns: u64,
    /// Wall time of the whole run (s).
    pub wall_s: f64,
    /// Wall time of each stage.
    pub stages: StageTimes,
    /// From the arm being enabled to the tip's closest approach as planned, of a throw made in the
    /// same run (s).
    pub enabled_to_strike_s: Option<f64>,
    /// How much later than planned a throw out of a swing began (s).
    pub throw_late_s: Option<f64>,
    wiggle: Option<Film>,
    /// When the throw ran.
    throw: Option<MotionSpan>,
    /// How the rope was tracked through the wiggle.
    pub track: Option<Tracked>,
    /// The rope.
    pub identified: Option<RopeEstimate>,
    /// What the plan promises.
    pub plan: Option<Value>,
    /// How it was brought to rest.
    pub settle: Option<Settled>,
    /// How late the arm follows its setpoints, from the wiggle (s).
    pub arm_lag_s: Option<f64>,
    /// The throw as the camera measured it.
    pub score: Option<ScoreResult>,
    /// Whether a lob or drape succeeded, as the camera saw it.
    pub camera_verdict: Option<Verdict>,
    /// The same by the rig's truth.
    pub true_verdict: Option<Verdict>,
    /// Why it could not.
    pub score_failed: Option<String>,
    /// Latency of the control loop during the throw.
    pub latency: Option<LatencyReport>,
    /// What the real-time set-up could not get, and what is poor about the plan.
    pub warnings: Vec<String>,
    /// Colours by which the camera measured, or should have measured, the throw.
    pub tip_rgb: Option<[u8; 3]>,
    /// That of the target.
    pub target_rgb: Option<[u8; 3]>,
    /// Who operated the arm, where somebody had to.
    pub operator: Option<String>,
    /// The words by which motions were confirmed, and when.
    pub confirmed: Vec<Value>,
    /// Steps of the arm's bring-up and their results.
    pub bring_up: Vec<Value>,
    truth: Option<Value>,
    /// The rope as it is.
    #[serde(skip)]
    pub true_rope: Option<RopeParams>,
}

impl RunRecord {
    /// Nothing yet, of a command's run in this folder.
    #[must_use]
    pub fn new(
        command: &'static str,
        seed: u64,
        (task, target_m): (Task, Option<[f64; 3]>),
        folder: &Path,
    ) -> Self {
        Self {
            command,
            version: shared_types::VERSION,
            seed,
            run: folder.display().to_string(),
            task,
            target_m,
            ..Self::default()
        }
    }

    /// Keeps the film of the wiggle, from whose first frame times count.
    pub fn set_wiggle(&mut self, film: Film) {
        self.epoch_ns = film.first_stamp_ns;
        self.wiggle = Some(film);
    }

    /// Keeps when the throw ran, and how much later than it was planned to `begin`; times count
    /// from its film where there was no wiggle.
    pub fn set_throw(&mut self, film: Film, begin: Option<MonotonicNs>) {
        self.throw = Some(film.motion);
        let late_s = begin.map(|begin| MonotonicNs(film.motion.start_ns).since_s(begin));
        self.throw_late_s = late_s;
        if let Some(late_s) = late_s.filter(|s| s.abs() > LATE_MAX_S) {
            self.warnings.push(format!(
                "the throw began {:+.0} ms off the instant that it was planned for: the rope was elsewhere",
                1e3 * late_s
            ));
        }
        if self.wiggle.is_none() {
            self.epoch_ns = film.first_stamp_ns;
        }
    }

    /// Keeps what the plan promises.
    pub fn set_plan(&mut self, plan: &Plan) {
        self.planned_tip_target_distance_m = Some(plan.predicted_error_m);
        self.plan = Some(json!({
            "predicted_error_m": plan.predicted_error_m, "predicted_time_s": plan.predicted_time_s,
            "simulations": plan.simulations, "resampled": plan.resampled,
            "forecast": plan.forecast, "trajectory_sha256": plan.trajectory_sha256,
        }));
    }

    /// Keeps what the camera measured, or why it could not.
    pub fn set_score(&mut self, score: anyhow::Result<ScoreResult>) {
        match score {
            Ok(score) => {
                self.stereo_tip_target_distance_m = Some(score.closest_m);
                self.score = Some(score);
            }
            Err(e) => self.score_failed = Some(format!("{e:#}")),
        }
    }

    /// Keeps the truth, known only because the rig is simulated.
    ///
    /// # Errors
    /// The rig failed.
    pub fn set_truth(&mut self, truth: RigEvent) -> anyhow::Result<()> {
        match truth {
            RigEvent::Truth {
                rope,
                closest_m,
                peak_tip_speed_m_s,
                touched,
                ..
            } => {
                self.true_tip_target_distance_m = Some(closest_m);
                self.true_rope = Some(rope);
                self.truth = Some(json!({
                    "rope": rope, "closest_m": closest_m, "peak_tip_speed_m_s": peak_tip_speed_m_s,
                    "rope_touched_robot": touched,
                }));
                Ok(())
            }
            RigEvent::Failed { message } => bail!(message),
            other => bail!("the rig answered with {other:?}"),
        }
    }
}
