//! What a report holds, as the page's script reads it.

use super::approach::TipCurve;
use super::limits::LimitRow;
use arm_model::Cell;
use arm_model::JOINTS;
use run_log::Explanation;
use serde::Serialize;
use serde_json::Value;
use shared_types::MonotonicNs;

#[derive(Debug, Serialize)]
pub(crate) struct ReportData {
    /// Version of the program that made the report.
    pub version: &'static str,
    /// Name of the run folder.
    pub run: String,
    /// What came of it, in one line.
    pub headline: String,
    /// `summary.json`, without the long tables.
    pub summary: Value,
    /// Tip and target.
    pub error: Errors,
    pub rope: Vec<RopeRow>,
    /// The tightest limits of the plan.
    pub planned_limits: Vec<LimitRow>,
    /// Limits used by what was commanded.
    pub limits: Vec<LimitRow>,
    /// What the recording of control cycles tells.
    pub explanation: Option<Explanation>,
    /// Its stops as text, if there were any.
    pub cause: Option<String>,
    pub latency: Vec<Histogram>,
    pub scenes: Vec<Scene>,
    /// Film with the rope drawn in.
    pub pictures: Vec<Picture>,
    /// What the folder does not hold.
    pub missing: Vec<String>,
}

/// Distances of tip and target (m).
#[derive(Debug, Default, Serialize)]
pub(crate) struct Errors {
    /// Predicted by the planner.
    pub planned_m: Option<f64>,
    /// Expected over what is known of the rope, 90 %.
    pub forecast_90_m: Option<[f64; 2]>,
    /// The simulated rig's truth.
    pub true_m: Option<f64>,
    /// Measured by the camera.
    pub camera_m: Option<f64>,
    /// Interval of that.
    pub camera_interval_m: Option<[f64; 2]>,
}

/// One parameter of the rope.
#[derive(Debug, Serialize)]
pub struct RopeRow {
    /// Its name.
    pub label: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// In that unit.
    pub value: f64,
    /// Interval that holds it with a probability of 90 %.
    pub interval_90: Option<[f64; 2]>,
    /// Range the simulated ropes are drawn from.
    pub range: [f64; 2],
    /// The hidden truth of a simulated rig.
    pub truth: Option<f64>,
}

/// How often something took how long.
#[derive(Debug, Serialize)]
pub struct Histogram {
    /// What.
    pub name: &'static str,
    /// Upper ends of the bins (µs); the last bin has none.
    pub upto_us: Vec<f64>,
    /// Cycles in each bin, one more than `upto_us`.
    pub counts: Vec<usize>,
    /// Cycles in all.
    pub cycles: usize,
    /// Half of them are at most this (µs).
    pub p50_us: f64,
    /// 99 % of them are at most this (µs).
    pub p99_us: f64,
    /// The longest (µs).
    pub max_us: f64,
}

/// One motion: pictures of arm and rope, and its joints as numbers.
#[derive(Debug, Serialize)]
pub(crate) struct Scene {
    pub name: String,
    /// When the motion began.
    #[serde(skip)]
    pub begin: MonotonicNs,
    /// Time of the first frame on the motion's clock (s).
    pub from_s: f64,
    /// Time between frames (s).
    pub period_s: f64,
    /// The cell it ran in.
    pub cell: Cell,
    /// Each frame: joints' origins from the base to the pole's end (0.1 mm).
    pub arm: Vec<Vec<i32>>,
    /// Each frame: the rope's nodes (0.1 mm); none when no rope is known.
    pub rope: Vec<Vec<i32>>,
    /// Planned path of the tip, at the same times (0.1 mm).
    pub planned_tip: Vec<i32>,
    /// The tip of a throw's rope, simulated under the joints of the run.
    pub tip: Option<TipCurve>,
    /// The same as planned.
    pub planned: Option<TipCurve>,
    /// Radius of the rope and of its lead (m).
    pub radii_m: [f64; 2],
    pub target_m: Option<[f64; 3]>,
    pub joints: Joints,
}

/// Joints over time; all series have the length of `t_s`.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Joints {
    /// What `wanted` is.
    pub wanted_is: &'static str,
    /// Time on the motion (s).
    pub t_s: Vec<f64>,
    /// Planned or commanded (rad), by joint.
    pub wanted: [Vec<f64>; JOINTS],
    /// Setpoint minus measured (rad), by joint.
    pub error: [Vec<f64>; JOINTS],
    /// Measured (rad), by joint.
    pub measured: [Vec<f64>; JOINTS],
}

#[derive(Debug, Serialize)]
pub(crate) struct Picture {
    /// File it was made from.
    pub file: &'static str,
    pub title: &'static str,
    /// JPEG as a data URL.
    pub url: String,
}
