//! Striking: the rope's tip passes through a point.
//!
//! Fitness of the paper's appendix "CMA-ES Fitness Functions", pole striking:
//! `f = d_min - R_prox + M + P_vel + P_coll`, with `d_min` in continuous time.

use super::{ThrowConfig, ThrowOutcome, ThrowTask, proximity_reward, verdict};
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, Verdict};

/// Radius of the ball that is struck (m).
const BALL_RADIUS_M: f64 = 0.02;

/// A strike at a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Strike {
    /// Where the tip shall pass (m).
    pub target_m: [f64; 3],
    /// Tuned values.
    pub config: ThrowConfig,
}

impl ThrowTask for Strike {
    fn target_m(&self) -> [f64; 3] {
        self.target_m
    }

    fn config(&self) -> &ThrowConfig {
        &self.config
    }

    fn fitness(&self, _: &RopeParams, outcome: &ThrowOutcome) -> f64 {
        let weights = &self.config.weights;
        weights.distance_per_m * outcome.closest_m
            - weights.proximity * proximity_reward(outcome.closest_m)
    }

    fn judge(&self, rope: &RopeParams, outcome: &ThrowOutcome) -> Verdict {
        let gap_m = outcome.closest_m - rope.lead_radius_m - BALL_RADIUS_M;
        verdict([("lead touches the ball", gap_m <= 0.0)])
    }

    fn polishes(&self) -> bool {
        true
    }
}
