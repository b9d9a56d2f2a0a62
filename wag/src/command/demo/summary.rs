//! What a demo keeps and shows: every stage's figures, and the truth apart.

use crate::command::latency::loop_table;
use crate::pipeline::{MotionSpan, RunFolder};
use anyhow::bail;
use cli_output::table;
use comfy_table::Table;
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::ipc::message::{LatencyReport, RigEvent, RopeAppearance, ScoreResult};
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use shared_types::{Plan, RopeEstimate, RopeParams};

/// Wall time of each stage (s).
#[derive(Debug, Clone, Default, Serialize)]
pub struct StageTimes {
    pub start_s: f64,
    pub bringup_s: f64,
    pub wiggle_s: f64,
    pub track_s: f64,
    pub identify_s: f64,
    pub plan_s: f64,
    pub settle_s: f64,
    pub throw_s: f64,
    pub score_s: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub struct Film {
    /// Start of exposure of the first frame (CLOCK_MONOTONIC, ns).
    pub first_stamp_ns: u64,
    pub frames: u32,
    /// Frames the camera dropped.
    pub dropped: u32,
    /// When the motion ran.
    #[serde(skip)]
    pub motion: MotionSpan,
}

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

#[derive(Debug, Clone, Copy, Serialize)]
pub struct Settled {
    /// Simulated residual vibration of the tip after a plain move (m).
    pub plain_residual_m: f64,
    /// The same after the move that was made (m).
    pub residual_m: f64,
    /// How much later than planned the move began (s).
    pub late_s: f64,
}

/// Everything a demo reports; `summary.json` and `--json`.
#[derive(Debug, Clone, Default, Serialize)]
pub struct DemoRecord {
    /// Whether the throw went through.
    pub ok: bool,
    command: &'static str,
    version: &'static str,
    pub seed: u64,
    run: String,
    task: &'static str,
    pub target_m: [f64; 3],
    /// What went wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Distance of tip and target by the rig's truth (m).
    true_tip_target_distance_m: Option<f64>,
    /// Distance the planner predicted (m).
    planned_tip_target_distance_m: Option<f64>,
    /// Distance measured by the stereo camera (m).
    stereo_tip_target_distance_m: Option<f64>,
    /// Instant that times in the run's files count from (CLOCK_MONOTONIC, ns): the
    /// wiggle's first frame.
    epoch_ns: u64,
    /// Wall time of the whole demo (s).
    pub wall_s: f64,
    pub stages: StageTimes,
    wiggle: Option<Film>,
    pub track: Option<Tracked>,
    pub identified: Option<RopeEstimate>,
    plan: Option<Value>,
    pub settle: Option<Settled>,
    /// How late the arm follows its setpoints, from the wiggle (s).
    pub arm_lag_s: Option<f64>,
    score: Option<ScoreResult>,
    score_failed: Option<String>,
    pub latency: Option<LatencyReport>,
    /// What the real-time set-up could not get, and what is poor about the plan.
    pub warnings: Vec<String>,
    truth: Option<Value>,
    #[serde(skip)]
    true_rope: Option<RopeParams>,
}

impl DemoRecord {
    pub fn new(seed: u64, target_m: [f64; 3], folder: &RunFolder) -> Self {
        Self {
            command: "demo",
            version: shared_types::VERSION,
            seed,
            run: folder.path.display().to_string(),
            task: "strike",
            target_m,
            ..Self::default()
        }
    }

    pub fn set_wiggle(&mut self, film: Film) {
        self.epoch_ns = film.first_stamp_ns;
        self.wiggle = Some(film);
    }

    pub fn set_plan(&mut self, plan: &Plan) {
        self.planned_tip_target_distance_m = Some(plan.predicted_error_m);
        self.plan = Some(json!({
            "predicted_error_m": plan.predicted_error_m, "predicted_time_s": plan.predicted_time_s,
            "simulations": plan.simulations, "resampled": plan.resampled,
            "forecast": plan.forecast, "trajectory_sha256": plan.trajectory_sha256,
        }));
    }

    pub fn set_score(&mut self, score: anyhow::Result<ScoreResult>) {
        match score {
            Ok(score) => {
                self.stereo_tip_target_distance_m = Some(score.closest_m);
                self.score = Some(score);
            }
            Err(e) => self.score_failed = Some(format!("{e:#}")),
        }
    }

    /// Keeps the truth, known only because the rig is simulated; the throw is complete
    /// with it.
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
                self.ok = true;
                Ok(())
            }
            RigEvent::Failed { message } => bail!(message),
            other => bail!("the rig answered with {other:?}"),
        }
    }
}

fn rope_table(estimate: &RopeEstimate, truth: &RopeParams) -> Table {
    let (found, real) = (estimate.params.to_array(), truth.to_array());
    let rows = (0..ROPE_PARAMETERS).map(|i| {
        [
            RANGES[i].label.to_owned(),
            table::number(found[i], estimate.std_dev[i]),
            table::std_dev(estimate.std_dev[i]),
            table::number(real[i], estimate.std_dev[i]),
            RANGES[i].unit.to_owned(),
        ]
    });
    let header = ["parameter", "identified", "± std", "hidden truth", "unit"];
    table::numbers(header, 1, rows)
}

pub fn show(record: &DemoRecord) {
    if let (Some(estimate), Some(truth)) = (&record.identified, &record.true_rope) {
        println!("{}", rope_table(estimate, truth));
        println!(
            "Only ratios of stiffness, damping and masses show in a film, so their common scale is a guess.\n"
        );
    }
    if let Some(latency) = &record.latency {
        println!("{}", loop_table(latency));
        println!(
            "throw: {} cycles, {} missed\n",
            latency.cycles, latency.missed
        );
    }
    let s = &record.stages;
    let stages = [
        ("start", s.start_s),
        ("bring-up", s.bringup_s),
        ("wiggle", s.wiggle_s),
        ("track", s.track_s),
        ("identify", s.identify_s),
        ("plan", s.plan_s),
        ("settle", s.settle_s),
        ("throw", s.throw_s),
        ("score", s.score_s),
        ("in all", record.wall_s),
    ];
    let times = stages.map(|(name, s)| format!("{name} {s:.1}"));
    println!("time: {} s\n", times.join(", "));
    for warning in &record.warnings {
        println!("warning: {warning}");
    }
    let cm =
        |v: Option<f64>| v.map_or_else(|| "unknown".to_owned(), |m| format!("{:.1} cm", 100.0 * m));
    let [x, y, z] = record.target_m;
    println!("target ({x:.3}, {y:.3}, {z:.3}) m, closest approach of the tip:");
    let planned = cm(record.planned_tip_target_distance_m);
    let achieved = cm(record.true_tip_target_distance_m);
    println!("  planned      {planned}");
    println!("  achieved     {achieved}   (the simulator's truth)");
    match (&record.score, &record.score_failed) {
        (Some(score), _) => println!(
            "  by camera    {}   ({:.1} to {:.1} cm)",
            cm(Some(score.closest_m)),
            100.0 * score.interval_m[0],
            100.0 * score.interval_m[1]
        ),
        (None, Some(why)) => println!("  by camera    not measured: {why}"),
        (None, None) => {}
    }
    println!("run folder: {}", record.run);
}
