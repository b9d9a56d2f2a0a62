//! A task of one's own: the tip comes to a point slowly, as if to be caught there.
//!
//! `stop_at [SEED]`. See `docs/src/adding-a-task.md`.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use planner::plan::{
    PlanOptions, PlanRequest, Strike, ThrowConfig, ThrowGoal, ThrowOutcome, ThrowTask, plan_task,
    verdict,
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
    let (target_m, config) = ([0.95, 0.0, 0.10], ThrowConfig::default());
    let task = StopAt {
        target_m,
        config: config.clone(),
    };
    let options = PlanOptions {
        seed,
        ..PlanOptions::default()
    };
    let goal = ThrowGoal::Strike(Strike { target_m, config });
    let request = PlanRequest::new(goal, &random_rope(seed), options);
    let plan = plan_task(&task, &request, &mut |_| ControlFlow::Continue(()))
        .expect("the target is in reach");
    println!(
        "{:.1} cm from the target after {:.2} s: {:?}",
        100.0 * plan.predicted_error_m,
        plan.predicted_time_s,
        plan.verdict
    );
}
