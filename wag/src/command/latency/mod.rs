//! `wag latency`: how late everything is, on an arm or from a recorded run.
//!
//! Three things are reported: the control loop's own jitter, the delay from a
//! setpoint to each joint's motion, and the camera's offset where a run holds
//! one. The delays go into `arm-response.toml`, for plans to be made through.

mod evidence;
mod measure;
mod show;
mod stops;

use crate::cli::LatencyArgs;
use crate::config::RESPONSE_FILE;
use anyhow::Context;
use arm_model::{ArmResponse, JOINTS};
use cli_output::{OrInput, Outcome, Stage};
use evidence::Evidence;
use planner::arm_response::delay::command_to_target;
use planner::arm_response::identify;
use rt_controller::bridge::Latencies;
use run_log::files;
use serde_json::{Value, json};
use show::Findings;

pub fn run(args: &LatencyArgs) -> Outcome<Option<Value>> {
    if args.stops {
        return stops::measure(args).map(Some);
    }
    let conclude = |evidence: &Evidence| conclude(args, evidence);
    let value = match (args.arm.names_arm(), &args.run) {
        (_, None) if args.arm.dry_run => return measure::dry_run(args).map(Some),
        (true, None) => measure::measure(args, conclude)?,
        (false, Some(run)) => conclude(&Evidence::recorded(run).or_input()?).or_failed()?,
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
    let mut findings = examine(evidence)?;
    if findings.joints().next().is_some() {
        // A file that was named, or the run folder's own, which is never replaced.
        let own = || Some(evidence.folder.join(RESPONSE_FILE)).filter(|path| !path.exists());
        findings.path = args.response.clone().or_else(own);
    }
    if let Some(path) = &findings.path {
        files::write_arm_response(path, &findings.response)?;
    }
    findings.print();
    Ok(findings.json())
}

fn examine(evidence: &Evidence) -> anyhow::Result<Findings<'_>> {
    let stage = Stage::begin("identify");
    let mut latencies = Latencies::new()?;
    for cycle in &evidence.run.cycles {
        latencies.record(cycle);
    }
    let recording = evidence.recording(&latencies);
    let joints = identify(&recording, |joint| {
        stage.say(format!("joint {} of {JOINTS}", joint + 1));
    })
    .with_context(|| evidence.source.clone())?;
    let seen = evidence.has_targets.then_some(&recording);
    let target_delay = seen.and_then(command_to_target);
    let findings = Findings {
        evidence,
        latencies,
        target_delay,
        response: ArmResponse {
            version: shared_types::VERSION.to_owned(),
            source: evidence.source.clone(),
            command_to_target_s: target_delay.map(|d| d.interval_s),
            excitation: evidence.excitation,
            joints,
        },
        path: None,
    };
    let known = findings.joints().count();
    stage.done(&format!("{known} of {JOINTS} joints measured"));
    Ok(findings)
}
