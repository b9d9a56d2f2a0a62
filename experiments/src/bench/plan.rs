//! `experiments bench plan`: time to plan one throw of each task, and what it is spent on.

use super::spent::least;
use crate::args::BenchArgs;
use crate::report::{Column, print_table, report, verdict};
use cli_output::{OrInput, Outcome, Stage};
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest, ThrowSimulator, simulator_for};
use planner::ropes::random_rope;
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::{Plan, Task};
use std::ops::ControlFlow;

/// Longest wall time wanted of one plan on two cores (s), and the target (m).
const TASKS: [(Task, f64, [f64; 3]); 3] = [
    (Task::Strike, 1.5, [1.0, 0.2, 0.3]),
    (Task::Lob, 4.0, [0.85, 0.0, 0.20]),
    (Task::Drape, 4.0, [0.75, 0.0, 0.30]),
];
/// Throws in a batch whose parts are timed.
const BATCH: usize = 60;
/// Longer than any throw: no instant to look for contacts but the first (s).
const NEVER_S: f64 = 60.0;

/// One task's cost.
#[derive(Debug, Serialize)]
struct Row {
    task: &'static str,
    wall_s: f64,
    cpu_s: f64,
    simulations: u32,
    rollouts_per_s: f64,
    /// Fractions of the processor time: rope with its contacts, contacts with the arm, all
    /// else (drawing, screening, learning, what finalists are observed longer and finer).
    rope_fraction: f64,
    contacts_fraction: f64,
    search_fraction: f64,
    limit_wall_s: f64,
    within_limit: bool,
}

const TABLE: [Column<Row>; 9] = [
    ("task", |row| row.task.to_owned()),
    ("wall (s)", |row| format!("{:.2}", row.wall_s)),
    ("processor (s)", |row| format!("{:.2}", row.cpu_s)),
    ("simulations", |row| row.simulations.to_string()),
    ("rollouts per s", |row| format!("{:.0}", row.rollouts_per_s)),
    ("rope", |row| percent(row.rope_fraction)),
    ("contacts with the arm", |row| {
        percent(row.contacts_fraction)
    }),
    ("search", |row| percent(row.search_fraction)),
    ("limit", |row| verdict(row.limit_wall_s, row.within_limit)),
];

fn percent(fraction: f64) -> String {
    format!("{:.0} %", 100.0 * fraction)
}

fn measure(
    config: &PlannerConfig,
    args: &BenchArgs,
    (kind, limit_wall_s, target_m): (Task, f64, [f64; 3]),
) -> Outcome<Row> {
    let repeats = if args.quick { 1 } else { 3 };
    let options = PlanOptions {
        seed: args.seed,
        searches: 1,
        generations: args.quick.then_some(3),
        ..config.search
    };
    let request = PlanRequest::new(
        config.goal(kind, target_m),
        &random_rope(args.seed),
        options,
    );
    let plan = || planner::plan(&request, &mut |_| ControlFlow::Continue(()));
    let (whole, planned): (_, Plan) = least(repeats, plan).or_failed()?;
    let throws = vec![(&request.rope, &planned.trajectory); BATCH];
    let simulator = simulator_for(
        request.goal.task(),
        &request.rope,
        &request.cell,
        &request.options,
    );
    let blind = ThrowSimulator {
        contact_period_s: NEVER_S,
        ..simulator.clone()
    };
    let (both, _) = least(repeats, || simulator.run(&throws)).or_failed()?;
    let (rope, _) = least(repeats, || blind.run(&throws)).or_failed()?;
    let simulations = f64::from(planned.simulations);
    let part = |cpu_s: f64| (cpu_s / BATCH as f64 * simulations / whole.cpu_s).clamp(0.0, 1.0);
    let both_fraction = part(both.cpu_s);
    // Both are measured, and noise may turn their order.
    let rope_fraction = part(rope.cpu_s).min(both_fraction);
    Ok(Row {
        task: kind.name(),
        wall_s: whole.wall_s,
        cpu_s: whole.cpu_s,
        simulations: planned.simulations,
        rollouts_per_s: simulations / whole.wall_s,
        rope_fraction,
        contacts_fraction: both_fraction - rope_fraction,
        search_fraction: 1.0 - both_fraction,
        limit_wall_s,
        within_limit: whole.wall_s < limit_wall_s,
    })
}

pub(super) fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    let config = crate::results::experiment::built_in().or_failed()?;
    let stage = Stage::begin("bench");
    let rows = TASKS
        .into_iter()
        .map(|task| measure(&config, args, task))
        .collect::<Outcome<Vec<Row>>>()?;
    stage.done("one search per task");
    let own = json!({ "tasks": rows });
    Ok(report(args, "bench plan", own, || {
        println!("seed {}", args.seed);
        print_table(&rows, 1, TABLE);
    }))
}
