//! The result for people and for programs.

use super::evidence::{Evidence, Findings, RESPONSE_FILE};
use arm_model::JointResponse;
use arm_model::response::{Estimate, NotExcited, TrackingLag};
use cli_output::table;
use comfy_table::Table;
use serde_json::{Value, json};
use shared_types::ipc::message::{LatencyReport, Percentiles};
use std::path::Path;

/// Times within the control loop.
pub fn loop_table(report: &LatencyReport) -> Table {
    let rows = [
        ("wake-up late", report.wake),
        ("compute", report.compute),
        ("wake-up to sent", report.send),
        ("reply round trip", report.reply),
    ]
    .map(|(what, p)| {
        let us = |value: f64| format!("{value:.0}");
        [
            what.to_owned(),
            us(p.p50_us),
            us(p.p99_us),
            us(p.p999_us),
            us(p.max_us),
            p.count.to_string(),
        ]
    });
    table::numbers(
        ["control loop (µs)", "p50", "p99", "p99.9", "max", "count"],
        0,
        rows,
    )
}

/// A value with its interval, in some unit and decimals.
fn with_interval(e: Estimate, scale: f64, decimals: usize) -> String {
    let [low, high] = e.interval.map(|v| scale * v);
    format!(
        "{:.decimals$} ({low:.decimals$} to {high:.decimals$})",
        scale * e.value
    )
}

fn joint_table(findings: &Findings) -> Table {
    let rows = (1..)
        .zip(&findings.response.joints)
        .map(|(joint, response)| {
            let name = format!("{joint}");
            match response {
                JointResponse::Excited(lag) => [
                    name,
                    with_interval(lag.dead_time_s, 1e3, 1),
                    with_interval(lag.natural_frequency_hz, 1.0, 1),
                    with_interval(lag.damping_ratio, 1.0, 2),
                    format!("{:.1}", lag.bandwidth_hz()),
                    format!("{:.1}", 1e3 * lag.slow_delay_s()),
                    format!("{:.0}", 1e6 * lag.residual_rad),
                    String::new(),
                ],
                JointResponse::NotExcited(why) => {
                    let mut row = core::array::from_fn(|_| "-".to_owned());
                    row[0] = name;
                    row[7] = format!("not excited: {}", why.explain());
                    row
                }
            }
        });
    table::numbers(
        [
            "joint",
            "dead time (ms)",
            "natural frequency (Hz)",
            "damping",
            "-3 dB (Hz)",
            "late when slow (ms)",
            "residual (µrad)",
            "",
        ],
        1,
        rows,
    )
}

/// Prints tables and one line for each other result.
pub(super) fn print(findings: &Findings, evidence: &Evidence, path: Option<&Path>) {
    let report = findings.latencies.report();
    println!("{}", loop_table(&report));
    println!(
        "{} cycles, {} missed, at most {} in a row.\n",
        report.cycles, report.missed, report.longest_miss
    );
    println!("{}", joint_table(findings));
    match findings.target_delay {
        Some(delay) => println!(
            "From command to the arm's target: {:.1} to {:.1} ms, as {:.0} % of {} setpoints agree.",
            1e3 * delay.interval_s[0],
            1e3 * delay.interval_s[1],
            1e2 * delay.agreed_part,
            delay.seen
        ),
        None if evidence.has_targets => println!(
            "From command to the arm's target: not known; its targets are not the setpoints it was sent."
        ),
        None => println!("From command to the arm's target: not recorded."),
    }
    if let Some(offset_s) = findings.camera_offset_s {
        println!("Camera against arm: {:.1} ms.", 1e3 * offset_s);
    }
    let slow: Vec<String> = (1..)
        .zip(&findings.response.joints)
        .filter(|(_, j)| matches!(j, JointResponse::NotExcited(NotExcited::Indistinct)))
        .map(|(joint, _): (usize, _)| joint.to_string())
        .collect();
    if !slow.is_empty() {
        println!(
            "Joints {}: the tool speed allowed while setting up keeps them too slow to be measured. A pose with the tool nearer to their axes (`pose_rad` of --excitation FILE) lets them swing faster; measure them alone with --joints {}.",
            slow.join(", "),
            slow.join(",")
        );
    }
    let known = findings.response.joints.iter().any(|j| j.lag().is_some());
    match path {
        Some(path) => println!("Written to {}.", path.display()),
        None if known => println!(
            "Not written: {} is kept; name another file with --response.",
            evidence.folder.join(RESPONSE_FILE).display()
        ),
        // What this comes to is the command's failure.
        None => {}
    }
}

/// What `--json` prints and `summary.json` keeps.
pub(super) fn json(findings: &Findings, evidence: &Evidence, path: Option<&Path>) -> Value {
    let report = findings.latencies.report();
    let joints: Vec<Value> = (1..)
        .zip(&findings.response.joints)
        .map(|(joint, response)| match response {
            JointResponse::Excited(lag) => lag_json(joint, lag),
            JointResponse::NotExcited(why) => json!({
                "joint": joint, "excited": false, "why": why, "explanation": why.explain(),
            }),
        })
        .collect();
    let known: Vec<usize> = (1..)
        .zip(&findings.response.joints)
        .filter(|(_, j)| j.lag().is_some())
        .map(|(joint, _)| joint)
        .collect();
    json!({
        "ok": true,
        "command": "latency",
        "source": findings.response.source,
        "run": evidence.folder,
        "response": path,
        "version": findings.response.version,
        "excitation": findings.response.excitation,
        "loop": loop_json(&report, findings),
        "joints": joints,
        "joints_measured": known,
        "command_to_target": findings.target_delay.map(|d| json!({
            "interval_s": d.interval_s, "agreed_part": d.agreed_part, "setpoints": d.seen,
        })),
        "camera_offset_s": findings.camera_offset_s,
    })
}

fn lag_json(joint: usize, lag: &TrackingLag) -> Value {
    json!({
        "joint": joint,
        "excited": true,
        "dead_time_s": lag.dead_time_s,
        "natural_frequency_hz": lag.natural_frequency_hz,
        "damping_ratio": lag.damping_ratio,
        "bandwidth_hz": lag.bandwidth_hz(),
        "slow_delay_s": lag.slow_delay_s(),
        "residual_rad": lag.residual_rad,
        "samples": lag.samples,
    })
}

fn loop_json(report: &LatencyReport, findings: &Findings) -> Value {
    let one = |p: &Percentiles, bins: Vec<(f64, u64)>| {
        let mut value = json!(p);
        value["bins"] = bins
            .into_iter()
            .map(|(to_us, count)| json!({ "to_us": to_us, "count": count }))
            .collect();
        value
    };
    let [wake, compute, send, reply] = findings.latencies.bins();
    json!({
        "cycles": report.cycles,
        "missed": report.missed,
        "longest_miss": report.longest_miss,
        "wake": one(&report.wake, wake),
        "compute": one(&report.compute, compute),
        "send": one(&report.send, send),
        "reply": one(&report.reply, reply),
    })
}
