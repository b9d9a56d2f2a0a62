//! `wag latency`: how late everything is, on an arm or from a recorded run.
//!
//! Three things are reported: the control loop's own jitter, the delay from a
//! setpoint to each joint's motion, and the camera's offset where a run holds
//! one. The delays go into `arm-response.toml`, for plans to be made through.

mod measure;
mod show;

use crate::cli::LatencyArgs;
use crate::files;
use anyhow::{Context, anyhow};
use arm_model::response::Excitation;
use arm_model::{ArmResponse, JOINTS, JointResponse};
use cli_output::Stage;
use cli_output::{Failure, OrInput, Outcome};
use planner::response::delay::{TargetDelay, command_to_target};
use planner::response::{Recording, Sample, Setpoint, identify};
use rt_controller::bridge::Latencies;
use run_log::{Cycles, Run};
use serde_json::Value;
use shared_types::MonotonicNs;
use shared_types::ipc::{CycleRecord, JointReport};
use std::path::{Path, PathBuf};

/// File written into the run folder.
const RESPONSE_FILE: &str = "arm-response.toml";
/// Reports closer than this are one and the same (s).
const SAME_REPORT_S: f64 = 1e-3;

/// What was recorded, live or before.
struct Evidence {
    /// Arm or run.
    source: String,
    /// Run folder.
    folder: PathBuf,
    /// Control cycles in order.
    cycles: Vec<CycleRecord>,
    /// Joint reports in order of arrival.
    reports: Vec<JointReport>,
    /// Whether the reports tell the arm's own targets.
    has_targets: bool,
    /// The motion it was measured with.
    excitation: Option<Excitation>,
    /// How much later the camera's clock is than the arm's (s), if known.
    camera_offset_s: Option<f64>,
}

/// Everything that was found.
struct Findings {
    latencies: Latencies,
    target_delay: Option<TargetDelay>,
    response: ArmResponse,
    camera_offset_s: Option<f64>,
}

pub fn run(args: &LatencyArgs, quiet: bool) -> Outcome<Option<Value>> {
    let evidence = match (&args.arm.address, &args.run) {
        (_, None) if args.arm.dry_run => return measure::dry_run(args, quiet).map(Some),
        (Some(_), None) => measure::measure(args, quiet)?,
        (None, Some(run)) => recorded(run).or_input()?,
        _ => {
            return Err(Failure::input(anyhow!(
                "say what to measure: --arm ADDR moves an arm (start `wag rig` for a simulated one), --run RUN reads a recorded run"
            )));
        }
    };
    let findings = examine(&evidence, quiet)?;
    let known = findings.response.joints.iter().any(|j| j.lag().is_some());
    let path = response_path(args, &evidence).filter(|_| known);
    if let Some(path) = &path {
        files::write_arm_response(path, &findings.response).or_failed()?;
    }
    let value = show::json(&findings, &evidence, path.as_deref());
    if args.arm.address.is_some() {
        files::write_json(&evidence.folder.join("summary.json"), &value).or_failed()?;
    }
    if !quiet {
        show::print(&findings, &evidence, path.as_deref());
    }
    if !known {
        return Err(Failure::failed(anyhow!(
            "no joint moved in a way that shows how it follows, so nothing is written; measure with `wag latency --arm ADDR`"
        )));
    }
    Ok(Some(value))
}

/// Where the response goes: a file that was named, or the run folder's own, which is
/// never replaced.
fn response_path(args: &LatencyArgs, evidence: &Evidence) -> Option<PathBuf> {
    let own = || Some(evidence.folder.join(RESPONSE_FILE)).filter(|path| !path.exists());
    args.response.clone().or_else(own)
}

/// A recorded run as evidence.
///
/// # Errors
/// The run holds no recording, or a file of it is damaged.
fn recorded(run: &Path) -> anyhow::Result<Evidence> {
    let Cycles { cycles, joints } = Run::open(run)?.cycles()?;
    Ok(Evidence {
        source: format!("run {}", run.display()),
        folder: run.to_owned(),
        cycles,
        has_targets: joints.iter().any(|r| r.arm_clock != 0),
        reports: joints,
        excitation: None,
        camera_offset_s: camera_offset_s(&run.join("params.toml"))?,
    })
}

/// The offset that `wag identify` and `wag demo` leave in their result (s).
fn camera_offset_s(path: &Path) -> anyhow::Result<Option<f64>> {
    if !path.is_file() {
        return Ok(None);
    }
    let table: toml::Table = toml::from_str(&files::read_text(path)?)
        .with_context(|| format!("`{}`", path.display()))?;
    Ok(table
        .get("fit")
        .and_then(|fit| fit.get("time_offset_s"))
        .and_then(toml::Value::as_float))
}

fn examine(evidence: &Evidence, quiet: bool) -> Outcome<Findings> {
    let stage = Stage::begin("identify", quiet);
    let mut latencies = Latencies::new().or_failed()?;
    for cycle in &evidence.cycles {
        latencies.record(cycle);
    }
    let recording = recording(evidence, &latencies);
    let joints = identify(&recording, |joint| {
        stage.say(format!("joint {} of {JOINTS}", joint + 1));
    })
    .with_context(|| evidence.source.clone())
    .or_failed()?;
    let target_delay = evidence
        .has_targets
        .then(|| command_to_target(&recording))
        .flatten();
    let known = joints.iter().filter(|j| j.lag().is_some()).count();
    stage.done(&format!("{known} of {JOINTS} joints measured"));
    Ok(Findings {
        latencies,
        target_delay,
        response: ArmResponse {
            version: shared_types::VERSION.to_owned(),
            source: evidence.source.clone(),
            command_to_target_s: target_delay.map(|d| d.interval_s),
            excitation: evidence.excitation,
            joints,
        },
        camera_offset_s: evidence.camera_offset_s,
    })
}

/// Setpoints when they were sent and joints when they were measured, both in
/// seconds since the first cycle.
fn recording(evidence: &Evidence, latencies: &Latencies) -> Recording {
    let epoch = MonotonicNs(evidence.cycles.first().map_or(0, |c| c.deadline_ns));
    let mut setpoints: Vec<Setpoint> = evidence
        .cycles
        .iter()
        .filter(|c| c.sent != 0)
        .map(|c| Setpoint {
            sent_s: MonotonicNs(c.deadline_ns).since_s(epoch)
                + 1e-9 * (f64::from(c.wake_late_ns) + f64::from(c.send_ns)),
            q: c.q_c,
        })
        .collect();
    setpoints.sort_by(|a, b| a.sent_s.total_cmp(&b.sent_s));
    setpoints.dedup_by(|next, kept| next.sent_s <= kept.sent_s);
    let first_s = setpoints.first().map_or(0.0, |s| s.sent_s);
    let mut samples: Vec<Sample> = evidence
        .reports
        .iter()
        .map(|r| Sample {
            at_s: MonotonicNs(r.stamp_ns).since_s(epoch),
            q: r.q,
            q_target: evidence.has_targets.then_some(r.q_target),
        })
        .filter(|s| s.at_s >= first_s)
        .collect();
    samples.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    samples.dedup_by(|next, kept| next.at_s - kept.at_s < SAME_REPORT_S);
    Recording {
        setpoints,
        samples,
        round_trip_s: 1e-6 * latencies.report().reply.p50_us,
    }
}

/// The joints (1-based) that are known, for messages.
fn known_joints(joints: &[JointResponse; JOINTS]) -> Vec<usize> {
    (1..)
        .zip(joints)
        .filter(|(_, j)| j.lag().is_some())
        .map(|(joint, _)| joint)
        .collect()
}
