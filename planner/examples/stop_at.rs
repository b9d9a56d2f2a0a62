//! A task of one's own: the tip comes to a point slowly, as if to be caught there.
//!
//! `stop_at [SEED]`. See `docs/src/adding-a-task.md`.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use arm_model::Cell;
use arm_model::Limits;
use planner::plan::{
    Belief, PlanOptions, PlanRequest, ThrowConfig, ThrowOutcome, ThrowTask, plan_throw, verdict,
};
use planner::ropes::random_rope;
use shared_types::{RopeParams, Verdict};
use std::ops::ControlFlow;

/// Distance and speed at which a tip can be caught.
const CATCH_M: f64 = 0.02;
const CATCH_M_S: f64 = 1.0;

struct StopAt {
    target_m: [f64; 3],
    config: ThrowConfig,
}

/// Speed of the tip at its closest (m/s).
fn speed_m_s(outcome: &ThrowOutcome) -> f64 {
    outcome.watched.to_point.map_or(f64::INFINITY, |c| {
        c.velocity_m_s.iter().map(|v| v * v).sum::<f64>().sqrt()
    })
}

impl ThrowTask for StopAt {
    fn name(&self) -> &'static str {
        "stop at"
    }

    fn target_m(&self) -> [f64; 3] {
        self.target_m
    }

    fn config(&self) -> &ThrowConfig {
        &self.config
    }

    fn fitness(&self, _: &RopeParams, outcome: &ThrowOutcome) -> f64 {
        outcome.closest_m + 0.05 * speed_m_s(outcome).min(20.0)
    }

    fn judge(&self, _: &RopeParams, outcome: &ThrowOutcome) -> Verdict {
        verdict([
            ("near", outcome.closest_m < CATCH_M),
            ("slow", speed_m_s(outcome) < CATCH_M_S),
        ])
    }
}

fn main() {
    let seed = std::env::args()
        .nth(1)
        .map_or(1, |s| s.parse().expect("a seed is a number"));
    let task = StopAt {
        target_m: [0.95, 0.0, 0.10],
        config: ThrowConfig::default(),
    };
    let request = PlanRequest {
        rope: random_rope(seed),
        limits: Limits::default(),
        cell: Cell::default(),
        options: PlanOptions {
            seed,
            ..PlanOptions::default()
        },
        belief: Belief::default(),
        following: None,
    };
    let planned = plan_throw(&task, &request, &mut |_| ControlFlow::Continue(()))
        .expect("the target is in reach");
    println!(
        "{:.1} cm from the target at {:.2} m/s after {:.2} s: {:?}",
        100.0 * planned.error_m,
        speed_m_s(&planned.outcome),
        planned.outcome.closest_s,
        planned.verdict
    );
}
