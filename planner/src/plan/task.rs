//! What a task is.

use super::waypoints::WAYPOINTS;
use super::{PlanOptions, PolePose, ThrowConfig, ThrowOutcome, ThrowSimulator};
use crate::collide::Block;
use arm_model::Cell;
use rope_sim::{Precision, Scene, Watch};
use shared_types::{Condition, RopeParams, Verdict};

/// What a throw is for. A new task says what stands around, what a throw is worth and
/// when it succeeded; drawing, screening, simulating, contacts with the arm and the
/// search are the same for all.
pub trait ThrowTask: Sync {
    /// The target in the world (m). Its bearing is the plane of the throw.
    fn target_m(&self) -> [f64; 3];

    /// Tuned values.
    fn config(&self) -> &ThrowConfig;

    /// What the rope can touch in this cell.
    fn scene(&self, _cell: &Cell) -> Scene {
        Scene::EMPTY
    }

    /// What is measured in the simulation; [`Watch::point_m`] must be among it.
    fn watch(&self, _rope: &RopeParams, _cell: &Cell) -> Watch {
        Watch::point(self.target_m())
    }

    /// Poses of the pole at the waypoints around which the search begins; none for a
    /// search around the start pose.
    fn warm_start(&self, _rope: &RopeParams) -> Vec<PolePose> {
        Vec::new()
    }

    /// The task's part of the fitness, smaller is better; the planner adds motion, speed
    /// and contacts with the arm.
    fn fitness(&self, rope: &RopeParams, outcome: &ThrowOutcome) -> f64;

    /// The error that is told (m).
    fn error_m(&self, outcome: &ThrowOutcome) -> f64 {
        outcome.closest_m
    }

    /// Whether the throw succeeded.
    fn judge(&self, rope: &RopeParams, outcome: &ThrowOutcome) -> Verdict;

    /// Whether the closest approach to [`Watch::point_m`] is all that counts and has
    /// slopes, so that it can be polished, and throws of the library at that point are throws
    /// of this task.
    fn polishes(&self) -> bool {
        false
    }
}

/// `R_prox = 1 / (1 + d_min)` of the paper's appendix.
#[must_use]
pub fn proximity_reward(closest_m: f64) -> f64 {
    1.0 / (1.0 + closest_m)
}

/// Success is all conditions met.
#[must_use]
pub fn verdict<const N: usize>(conditions: [(&str, bool); N]) -> Verdict {
    let condition = |(name, met): (&str, bool)| Condition {
        name: name.to_owned(),
        met,
    };
    Verdict {
        success: conditions.iter().all(|(_, met)| *met),
        conditions: conditions.map(condition).into(),
        unseen: Vec::new(),
    }
}

/// The simulator that values throws of a task with a rope in a cell.
#[must_use]
pub fn simulator_for(
    task: &dyn ThrowTask,
    rope: &RopeParams,
    cell: &Cell,
    options: &PlanOptions,
) -> ThrowSimulator {
    let config = task.config();
    let scene = task.scene(cell);
    ThrowSimulator {
        watch: task.watch(rope, cell),
        keep_clear: scene.obstacles.iter().filter_map(Block::around).collect(),
        scene,
        // Longer throws than these times are among the candidates of free times only.
        motion_s_min: config.waypoint_times_s[WAYPOINTS - 1] * options.segment_stretch_max,
        tail_s: config.tail_s,
        contact_tail_s: config.contact_tail_s,
        step_s: options.step_s,
        precision: Precision::F32,
        contact_period_s: config.contact_period_s,
        cell: *cell,
        following: None,
        keeps_tip: false,
        threads: options.threads.max(1),
    }
}
