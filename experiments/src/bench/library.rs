//! `experiments bench library`: strikes planned from the library of throws beside strikes that
//! are searched for, on the same ropes and targets.

use crate::args::BenchArgs;
use crate::report::{Column, print_table, report};
use anyhow::anyhow;
use cli_output::{Failure, OrInput, Outcome, Stage, is_interrupted};
use experiments::trials::{mean, quantile};
use planner::plan::{PlanError, PlanOptions, PlanRequest, Robustness, simulator_for};
use planner::ropes::{random_strike_target, trial_rope};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::ipc::message::Progress;
use shared_types::{RopeParams, Task};
use std::ops::ControlFlow;
use std::time::Instant;

/// Pairs of rope and target; with `--quick`.
const PAIRS: [u64; 2] = [200, 6];
/// Ropes that each throw is judged with.
const ROPES: usize = 16;
/// Predicted error above which a plan is reported to be poor (m).
const POOR_M: f64 = 0.01;

/// One plan.
struct Planned {
    wall_s: f64,
    simulations: u32,
    predicted_m: f64,
    /// Mean error with ropes that differ from the one planned for.
    miss_m: f64,
}

/// One way of planning.
#[derive(Debug, Serialize)]
struct Row {
    way: &'static str,
    plans: usize,
    /// Plans that searched.
    searched: usize,
    median_ms: f64,
    p95_ms: f64,
    predicted_max_mm: f64,
    /// Predicted to miss by a centimetre or more, which is pointed out.
    poor: usize,
    miss_mean_mm: f64,
    miss_median_mm: f64,
    miss_p95_mm: f64,
    miss_max_mm: f64,
}

const TABLE: [Column<Row>; 10] = [
    ("strikes", |row| row.way.to_owned()),
    ("plans", |row| row.plans.to_string()),
    ("searched", |row| row.searched.to_string()),
    ("median (ms)", |row| format!("{:.0}", row.median_ms)),
    ("p95 (ms)", |row| format!("{:.0}", row.p95_ms)),
    ("predicted, max (mm)", |row| {
        format!("{:.3}", row.predicted_max_mm)
    }),
    ("miss, mean (mm)", |row| format!("{:.2}", row.miss_mean_mm)),
    ("median", |row| format!("{:.2}", row.miss_median_mm)),
    ("p95", |row| format!("{:.2}", row.miss_p95_mm)),
    ("max", |row| format!("{:.2}", row.miss_max_mm)),
];

/// Ropes that one might be whose parameters are known as well as identification leaves them.
fn others(rope: &RopeParams, seed: u64) -> Vec<RopeParams> {
    let known = Robustness::default();
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let mut changed = |relative: f64| {
        let normal: f64 = StandardNormal.sample(&mut rng);
        1.0 + relative * normal
    };
    (0..ROPES)
        .map(|_| RopeParams {
            length_m: rope.length_m * changed(known.length),
            joint_stiffness_nm_per_rad: rope.joint_stiffness_nm_per_rad * changed(known.stiffness),
            joint_damping_nms_per_rad: rope.joint_damping_nms_per_rad * changed(known.damping),
            lead_mass_kg: rope.lead_mass_kg * changed(known.lead_mass),
            ..*rope
        })
        .collect()
}

fn planned(request: &PlanRequest, others: &[RopeParams]) -> Result<Planned, PlanError> {
    let began = Instant::now();
    let plan = planner::plan(request, &mut |_| ControlFlow::Continue(()))?;
    let wall_s = began.elapsed().as_secs_f64();
    let task = request.goal.task();
    let simulator = simulator_for(task, &request.rope, &request.cell, &request.options);
    let throws: Vec<_> = others.iter().map(|rope| (rope, &plan.trajectory)).collect();
    let outcomes = simulator.exact().run(&throws)?;
    Ok(Planned {
        wall_s,
        simulations: plan.simulations,
        predicted_m: plan.predicted_error_m,
        miss_m: mean(outcomes.iter().map(|o| task.error_m(o))),
    })
}

fn row(way: &'static str, plans: &[Planned], options: &PlanOptions) -> Row {
    let ms = |fraction| 1e3 * quantile(plans.iter().map(|p| p.wall_s), fraction);
    let miss_mm = |fraction| 1e3 * quantile(plans.iter().map(|p| p.miss_m), fraction);
    let count = |is_so: fn(&Planned) -> bool| plans.iter().filter(|p| is_so(p)).count();
    // Ten generations are more than is simulated of the library's throws.
    let of_search = u32::try_from(options.population * 10).unwrap_or(u32::MAX);
    Row {
        way,
        plans: plans.len(),
        searched: plans.iter().filter(|p| p.simulations > of_search).count(),
        median_ms: ms(0.5),
        p95_ms: ms(0.95),
        predicted_max_mm: 1e3 * quantile(plans.iter().map(|p| p.predicted_m), 1.0),
        poor: count(|p| p.predicted_m > POOR_M),
        miss_mean_mm: 1e3 * mean(plans.iter().map(|p| p.miss_m)),
        miss_median_mm: miss_mm(0.5),
        miss_p95_mm: miss_mm(0.95),
        miss_max_mm: miss_mm(1.0),
    }
}

pub(super) fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    let config = crate::results::experiment::built_in().or_failed()?;
    cli_output::watch_interrupts().or_failed()?;
    let stage = Stage::begin("bench");
    let pairs = PAIRS[usize::from(args.quick)];
    let ways = [
        (
            "from the library",
            PlanOptions::default().library_candidates,
        ),
        ("searched for", 0),
    ];
    let mut plans = [Vec::new(), Vec::new()];
    for index in 0..pairs {
        let rope = trial_rope(args.seed, index);
        let target_m = random_strike_target((args.seed << 32) ^ index);
        let others = others(&rope, (args.seed << 32) ^ index);
        // Side by side, so that a busy machine slows both.
        for ((_, library_candidates), plans) in ways.iter().zip(&mut plans) {
            let options = PlanOptions {
                seed: index,
                library_candidates: *library_candidates,
                ..config.search
            };
            let request = PlanRequest::new(config.goal(Task::Strike, target_m), &rope, options);
            plans.push(planned(&request, &others).or_failed()?);
        }
        if is_interrupted() {
            return Err(Failure::failed(anyhow!("interrupted")));
        }
        stage.progress(&Progress {
            done: index as u32 + 1,
            total: pairs as u32,
            value: plans[0]
                .last()
                .map_or(f64::NAN, |p: &Planned| 1e3 * p.wall_s),
            label: "ms".to_owned(),
        });
    }
    let rows: Vec<Row> = ways
        .iter()
        .zip(&plans)
        .map(|((way, _), plans)| row(way, plans, &config.search))
        .collect();
    stage.done(&format!("{pairs} ropes and targets"));
    let own = json!({ "pairs": pairs, "ropes": ROPES, "ways": rows });
    Ok(report(args, "bench library", own, || {
        println!("seed {}", args.seed);
        print_table(&rows, 0, TABLE);
    }))
}
