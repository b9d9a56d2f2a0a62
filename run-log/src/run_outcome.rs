//! What came of a run, in lines of text.

use crate::RunRecord;
use cli_output::table;
use comfy_table::Table;
use shared_types::ipc::message::LatencyReport;
use shared_types::rope::RANGES;
use shared_types::{RopeEstimate, RopeParams, Task};
use std::fmt::Write;

/// What was found, times, warnings, and how near the tip came to the target.
#[must_use]
pub fn outcome(record: &RunRecord) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = write_outcome(&mut out, record);
    out
}

fn write_outcome(out: &mut String, record: &RunRecord) -> std::fmt::Result {
    if let (Some(estimate), Some(truth)) = (&record.identified, &record.true_rope) {
        writeln!(out, "{}", parameter_table(estimate, Some(truth)))?;
        writeln!(
            out,
            "Only ratios of stiffness, damping and masses show in a film, so their common scale is a guess.\n"
        )?;
    }
    if let Some(latency) = &record.latency {
        writeln!(out, "{}", loop_table(latency))?;
        writeln!(
            out,
            "throw: {} cycles, {} missed\n",
            latency.cycles, latency.missed
        )?;
    }
    let stages = record.stages.named().into_iter();
    let all = stages.chain([("in all", record.wall_s)]);
    let made = all.filter(|(_, s)| *s > 0.0);
    let times: Vec<String> = made.map(|(name, s)| format!("{name} {s:.1}")).collect();
    write!(out, "time: {} s", times.join(", "))?;
    if let Some(s) = record.enabled_to_strike_s {
        write!(out, "; from the enabled arm to the strike {s:.1} s")?;
    }
    writeln!(out, "\n")?;
    for warning in &record.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    let cm =
        |v: Option<f64>| v.map_or_else(|| "unknown".to_owned(), |m| format!("{:.1} cm", 100.0 * m));
    let Some([x, y, z]) = record.target_m else {
        return writeln!(out, "run folder: {}", record.run);
    };
    let told = match record.task {
        Task::Strike => "closest approach of the tip",
        Task::Lob => "closest approach of the tip, and what became of it",
        Task::Drape => "distance of the rope's middle from the edge, and what became of it",
    };
    let task = record.task.name();
    writeln!(out, "{task}, target ({x:.3}, {y:.3}, {z:.3}) m, {told}:")?;
    let planned = cm(record.planned_tip_target_distance_m);
    writeln!(out, "  planned      {planned}")?;
    let interval = record
        .plan
        .as_ref()
        .map(|plan| &plan["forecast"]["interval_90_m"]);
    if let Some((low, high)) = interval.and_then(|i| i[0].as_f64().zip(i[1].as_f64())) {
        let [low, high] = [low, high].map(|m| 100.0 * m);
        writeln!(
            out,
            "  forecast     {low:.1} to {high:.1} cm in nine of ten"
        )?;
    }
    if record.true_tip_target_distance_m.is_some() {
        let achieved = cm(record.true_tip_target_distance_m);
        writeln!(out, "  achieved     {achieved}   (the simulator's truth)")?;
    }
    for (verdict, whose) in [
        (&record.true_verdict, "the simulator's truth"),
        (&record.camera_verdict, "by camera"),
    ] {
        if let Some(verdict) = verdict {
            writeln!(out, "  {verdict}   ({whose})")?;
        }
    }
    match (&record.score, &record.score_failed) {
        (Some(score), _) => writeln!(
            out,
            "  by camera    {}   ({:.1} to {:.1} cm)",
            cm(Some(score.closest_m)),
            100.0 * score.interval_m[0],
            100.0 * score.interval_m[1]
        )?,
        (None, Some(why)) => writeln!(out, "  by camera    not measured: {why}")?,
        (None, None) => {}
    }
    writeln!(out, "run folder: {}", record.run)
}

/// What was identified, beside the truth where a rig tells it.
#[must_use]
pub fn parameter_table(estimate: &RopeEstimate, truth: Option<&RopeParams>) -> Table {
    let found = estimate.params.to_array();
    let number = |i: usize, value| table::number(value, estimate.std_dev[i]);
    let cells = |i: usize| {
        let [low, high] = estimate.posterior.interval_90[i];
        let interval = estimate.std_dev[i].map_or_else(
            || "not identifiable".to_owned(),
            |_| format!("{} to {}", number(i, low), number(i, high)),
        );
        let (range, found) = (&RANGES[i], number(i, found[i]));
        let [name, unit] = [range.label, range.unit].map(str::to_owned);
        [name, found, interval, unit]
    };
    let rows = 0..RANGES.len();
    let Some(truth) = truth.map(RopeParams::to_array) else {
        let header = ["parameter", "identified", "90 % interval", "unit"];
        return table::numbers(header, 1, rows.map(cells));
    };
    let header = [
        "parameter",
        "identified",
        "90 % interval",
        "hidden truth",
        "unit",
    ];
    let beside = rows.map(|i| {
        let [name, value, interval, unit] = cells(i);
        [name, value, interval, number(i, truth[i]), unit]
    });
    table::numbers(header, 1, beside)
}

/// Times within the control loop.
#[must_use]
pub fn loop_table(report: &LatencyReport) -> Table {
    let rows = [
        ("wake-up latency", report.wake),
        ("compute", report.compute),
        ("wake-up to sent", report.send),
        ("reply round trip", report.reply),
    ]
    .map(|(what, p)| {
        let [p50, p99, p999, max] =
            [p.p50_us, p.p99_us, p.p999_us, p.max_us].map(|us| format!("{us:.0}"));
        [what.to_owned(), p50, p99, p999, max, p.count.to_string()]
    });
    let header = ["control loop (µs)", "p50", "p99", "p99.9", "max", "count"];
    table::numbers(header, 0, rows)
}
