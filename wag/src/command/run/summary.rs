//! What a run shows at its end.

use crate::command::identify::parameter_table;
use crate::command::latency::loop_table;
use run_log::{Film, RunRecord};
use shared_types::Task;

/// One line about a film.
pub fn of_film(film: &Film) -> String {
    format!("{} frames, {} dropped", film.frames, film.dropped)
}

pub fn show(record: &RunRecord) {
    if let (Some(estimate), Some(truth)) = (&record.identified, &record.true_rope) {
        println!("{}", parameter_table(estimate, Some(truth)));
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
    let made = stages.iter().filter(|(_, s)| *s > 0.0);
    let times: Vec<String> = made.map(|(name, s)| format!("{name} {s:.1}")).collect();
    println!("time: {} s\n", times.join(", "));
    for warning in &record.warnings {
        println!("warning: {warning}");
    }
    let cm =
        |v: Option<f64>| v.map_or_else(|| "unknown".to_owned(), |m| format!("{:.1} cm", 100.0 * m));
    let Some([x, y, z]) = record.target_m else {
        println!("run folder: {}", record.run);
        return;
    };
    let told = match record.task {
        Task::Strike => "closest approach of the tip",
        Task::Lob => "closest approach of the tip, and what became of it",
        Task::Drape => "distance of the rope's middle from the edge, and what became of it",
    };
    let task = record.task.name();
    println!("{task}, target ({x:.3}, {y:.3}, {z:.3}) m, {told}:");
    let planned = cm(record.planned_tip_target_distance_m);
    println!("  planned      {planned}");
    let interval = record
        .plan
        .as_ref()
        .map(|plan| &plan["forecast"]["interval_90_m"]);
    if let Some((low, high)) = interval.and_then(|i| i[0].as_f64().zip(i[1].as_f64())) {
        let [low, high] = [low, high].map(|m| 100.0 * m);
        println!("  forecast     {low:.1} to {high:.1} cm in nine of ten");
    }
    if record.true_tip_target_distance_m.is_some() {
        let achieved = cm(record.true_tip_target_distance_m);
        println!("  achieved     {achieved}   (the simulator's truth)");
    }
    for (verdict, whose) in [
        (&record.true_verdict, "the simulator's truth"),
        (&record.camera_verdict, "by camera"),
    ] {
        if let Some(verdict) = verdict {
            println!("  {verdict}   ({whose})");
        }
    }
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
