//! The result for people and for programs.

use super::evidence::Evidence;
use crate::config::RESPONSE_FILE;
use arm_model::response::{Estimate, NotExcited};
use arm_model::{ArmResponse, JointResponse};
use cli_output::table;
use comfy_table::Table;
use planner::arm_response::delay::TargetDelay;
use rt_controller::bridge::Latencies;
use run_log::loop_table;
use serde_json::{Value, json};
use std::path::PathBuf;

/// A value with its interval, in some unit and decimals.
fn with_interval(e: Estimate, scale: f64, decimals: usize) -> String {
    let [low, high] = e.interval.map(|v| scale * v);
    format!(
        "{:.decimals$} ({low:.decimals$} to {high:.decimals$})",
        scale * e.value
    )
}

pub(super) struct Findings<'a> {
    pub evidence: &'a Evidence,
    pub latencies: Latencies,
    pub target_delay: Option<TargetDelay>,
    pub response: ArmResponse,
    /// Where the response was written.
    pub path: Option<PathBuf>,
}

impl Findings<'_> {
    /// Joints (1-based) that were measured.
    pub(super) fn joints(&self) -> impl Iterator<Item = usize> {
        let joints = (1..).zip(&self.response.joints);
        joints.filter_map(|(joint, response)| response.lag().map(|_| joint))
    }

    fn joint_table(&self) -> Table {
        let joints = (1_u32..).zip(&self.response.joints);
        let rows = joints.map(|(joint, response)| match response {
            JointResponse::Excited(lag) => [
                joint.to_string(),
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
                row[0] = joint.to_string();
                row[7] = format!("not excited: {}", why.explain());
                row
            }
        });
        let header = [
            "joint",
            "dead time (ms)",
            "natural frequency (Hz)",
            "damping",
            "-3 dB (Hz)",
            "delay at low speed (ms)",
            "residual (µrad)",
            "",
        ];
        table::numbers(header, 1, rows)
    }

    /// Prints tables and one line for each other result.
    pub(super) fn print(&self) {
        let (evidence, report) = (self.evidence, self.latencies.report());
        println!("{}", loop_table(&report));
        println!(
            "{} cycles, {} missed, at most {} in a row.\n",
            report.cycles, report.missed, report.longest_miss
        );
        println!("{}", self.joint_table());
        match self.target_delay {
            Some(delay) => println!(
                "From command to the arm's target: {:.1} to {:.1} ms, as {:.0} % of {} setpoints agree.",
                1e3 * delay.interval_s[0],
                1e3 * delay.interval_s[1],
                1e2 * delay.agreed_fraction,
                delay.seen
            ),
            None if evidence.has_targets => println!(
                "From command to the arm's target: not known; its targets are not the setpoints it was sent."
            ),
            None => println!("From command to the arm's target: not recorded."),
        }
        if let Some(offset_s) = evidence.camera_offset_s {
            println!("Camera against arm: {:.1} ms.", 1e3 * offset_s);
        }
        let is_slow = |j: &JointResponse| *j == JointResponse::NotExcited(NotExcited::Indistinct);
        let slow = (1_u32..).zip(&self.response.joints);
        let slow = slow.filter(|(_, j)| is_slow(j));
        let slow: Vec<String> = slow.map(|(joint, _)| joint.to_string()).collect();
        if !slow.is_empty() && evidence.excitation.is_some() {
            println!(
                "Joints {}: the tool speed allowed while setting up keeps them too slow to be measured. A pose with the tool nearer to their axes (`pose_rad` of --excitation FILE) lets them swing faster; measure them alone with --joints {}.",
                slow.join(", "),
                slow.join(",")
            );
        }
        if let Some(path) = &self.path {
            println!("Written to {}.", path.display());
        } else if self.joints().next().is_some() {
            // Where no joint was measured, that is the command's failure.
            println!(
                "Not written: {} is kept; name another file with --response.",
                evidence.folder.join(RESPONSE_FILE).display()
            );
        }
    }

    /// What `--json` prints and `summary.json` keeps.
    pub(super) fn json(&self) -> Value {
        let joints = (1_u32..).zip(&self.response.joints);
        let joints = joints.map(|(joint, response)| match response {
            JointResponse::Excited(lag) => {
                let mut value = json!(lag);
                value["joint"] = joint.into();
                value["excited"] = true.into();
                value["bandwidth_hz"] = lag.bandwidth_hz().into();
                value["slow_delay_s"] = lag.slow_delay_s().into();
                value
            }
            JointResponse::NotExcited(why) => json!({
                "joint": joint, "excited": false, "why": why, "explanation": why.explain(),
            }),
        });
        let mut of_loop = json!(self.latencies.report());
        let parts = ["wake", "compute", "send", "reply"];
        for (part, bins) in parts.iter().zip(self.latencies.bins()) {
            let bins = bins.iter();
            let bins = bins.map(|(to_us, count)| json!({ "to_us": to_us, "count": count }));
            of_loop[part]["bins"] = bins.collect();
        }
        json!({
            "ok": true,
            "command": "latency",
            "source": self.response.source,
            "run": self.evidence.folder,
            "response": self.path,
            "version": self.response.version,
            "excitation": self.response.excitation,
            "loop": of_loop,
            "joints": joints.collect::<Vec<Value>>(),
            "joints_measured": self.joints().collect::<Vec<usize>>(),
            "command_to_target": self.target_delay.map(|d| json!({
                "interval_s": d.interval_s, "agreed_fraction": d.agreed_fraction, "setpoints": d.seen,
            })),
            "camera_offset_s": self.evidence.camera_offset_s,
        })
    }
}
