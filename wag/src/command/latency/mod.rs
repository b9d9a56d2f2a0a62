//! `wag latency`: how late everything is, on an arm or from a recorded run.
//!
//! Three things are reported: the control loop's own jitter, the delay from a
//! setpoint to each joint's motion, and the camera's offset where a run holds
//! one. The delays go into `arm-response.toml`, for plans to be made through.

mod evidence;
mod measure;
mod show;

pub use show::loop_table;

use crate::cli::LatencyArgs;
use anyhow::Context;
use arm_model::{ArmResponse, JOINTS};
use cli_output::{OrInput, Outcome, Stage};
use evidence::{Evidence, Findings, RESPONSE_FILE, recorded};
use planner::arm_response::delay::command_to_target;
use planner::arm_response::{Recording, Sample, Setpoint, identify};
use rt_controller::bridge::Latencies;
use run_log::files;
use serde_json::{Value, json};
use shared_types::MonotonicNs;
use std::path::PathBuf;

pub fn run(args: &LatencyArgs) -> Outcome<Option<Value>> {
    let conclude = |evidence: &Evidence| conclude(args, evidence);
    let value = match (&args.arm.address, &args.run) {
        (_, None) if args.arm.dry_run => return measure::dry_run(args).map(Some),
        (Some(_), None) => measure::measure(args, conclude)?,
        (None, Some(run)) => conclude(&recorded(run).or_input()?).or_failed()?,
        _ => {
            return Err(bad_input!(
                "say what to measure: --arm ADDR moves an arm (start `wag rig` for a simulated one), --run RUN reads a recorded run"
            ));
        }
    };
    if value["joints_measured"] == json!([]) {
        return Err(failed!(
            "no joint moved in a way that shows how it follows, so nothing is written; measure with `wag latency --arm ADDR`"
        ));
    }
    Ok(Some(value))
}

/// Examines what was recorded, writes the response and shows it; returns what was found.
fn conclude(args: &LatencyArgs, evidence: &Evidence) -> anyhow::Result<Value> {
    let findings = examine(evidence)?;
    let known = findings.response.joints.iter().any(|j| j.lag().is_some());
    let path = response_path(args, evidence).filter(|_| known);
    if let Some(path) = &path {
        files::write_arm_response(path, &findings.response)?;
    }
    show::print(&findings, evidence, path.as_deref());
    Ok(show::json(&findings, evidence, path.as_deref()))
}

/// Where the response goes: a file that was named, or the run folder's own, which is
/// never replaced.
fn response_path(args: &LatencyArgs, evidence: &Evidence) -> Option<PathBuf> {
    let own = || Some(evidence.folder.join(RESPONSE_FILE)).filter(|path| !path.exists());
    args.response.clone().or_else(own)
}

fn examine(evidence: &Evidence) -> anyhow::Result<Findings> {
    let stage = Stage::begin("identify");
    let mut latencies = Latencies::new()?;
    for cycle in &evidence.run.cycles {
        latencies.record(cycle);
    }
    let recording = recording(evidence, &latencies);
    let joints = identify(&recording, |joint| {
        stage.say(format!("joint {} of {JOINTS}", joint + 1));
    })
    .with_context(|| evidence.source.clone())?;
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
    let cycles = &evidence.run.cycles;
    let epoch = MonotonicNs(cycles.first().map_or(0, |c| c.deadline_ns));
    let sent = cycles.iter().filter(|c| c.sent != 0);
    let mut setpoints: Vec<Setpoint> = sent
        .map(|c| Setpoint {
            sent_s: MonotonicNs(c.deadline_ns).since_s(epoch)
                + 1e-9 * (f64::from(c.wake_late_ns) + f64::from(c.send_ns)),
            q: c.q_c,
        })
        .collect();
    setpoints.sort_by(|a, b| a.sent_s.total_cmp(&b.sent_s));
    setpoints.dedup_by(|next, kept| next.sent_s <= kept.sent_s);
    let first_s = setpoints.first().map_or(0.0, |s| s.sent_s);
    let samples = evidence.run.reports().into_iter().map(|r| Sample {
        at_s: MonotonicNs(r.stamp_ns).since_s(epoch),
        q: r.q,
        q_target: evidence.has_targets.then_some(r.q_target),
    });
    Recording {
        setpoints,
        samples: samples.filter(|s| s.at_s >= first_s).collect(),
        round_trip_s: 1e-6 * latencies.report().reply.p50_us,
    }
}
