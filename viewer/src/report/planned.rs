//! A motion that is to come, as a page draws it beside the arm.

use super::limits::{self, LimitRow};
use super::replay::{arm_points, frames, rows, simulate};
use arm_model::{Cell, JointTrajectory};
use rope_sim::{FrameTimes, PlannedArm};
use serde::Serialize;
use shared_types::Plan;

/// Shown after a throw (s).
const AFTER_S: f64 = 0.8;
/// Step of the simulation (s).
const STEP_S: f64 = 1e-3;

/// Arm and rope over the time of a motion.
#[derive(Debug, Serialize)]
pub struct PlannedMotion {
    /// Time between frames (s); the first is at the motion's begin.
    period_s: f64,
    /// Each frame: joints' origins from the base to the pole's end (0.1 mm).
    arm: Vec<Vec<i32>>,
    /// Each frame: the rope's nodes (0.1 mm); none where no rope is known.
    rope: Vec<Vec<i32>>,
    /// Radius of the rope and of its lead (m).
    radii_m: [f64; 2],
    /// The tightest limits, the tightest first.
    limits: Vec<LimitRow>,
}

impl PlannedMotion {
    /// Of a motion without a rope: a wiggle before the rope is known.
    #[must_use]
    pub fn of_arm(trajectory: &JointTrajectory, cell: &Cell) -> Self {
        Self::of(trajectory, cell, frames(trajectory.duration_s()))
    }

    /// Of a throw, with the rope it was planned for.
    ///
    /// # Errors
    /// Its rope cannot be simulated.
    pub fn of_plan(plan: &Plan, cell: &Cell) -> anyhow::Result<Self> {
        let cell = plan.cell.as_ref().unwrap_or(cell);
        let arm = PlannedArm::new(plan.trajectory, cell.pole);
        let frames = frames(plan.trajectory.duration_s() + AFTER_S);
        let around = rope_sim::Scene::of_task(plan.task, plan.target_m, cell);
        let rope = simulate(
            &around,
            (&plan.rope, plan.start.as_ref()),
            &arm,
            frames,
            STEP_S,
        )?;
        Ok(Self {
            rope: rope.map_or_else(Vec::new, |rope| rows(&rope, 1)),
            radii_m: [plan.rope.radius_m, plan.rope.lead_radius_m],
            limits: limits::planned(&plan.margins),
            ..Self::of(&plan.trajectory, cell, frames)
        })
    }

    fn of(trajectory: &JointTrajectory, cell: &Cell, frames: FrameTimes) -> Self {
        let q = |frame| trajectory.state_at(frames.time_s(frame)).q;
        Self {
            period_s: frames.period_s,
            arm: (0..frames.count)
                .map(|frame| arm_points(&q(frame), &cell.pole))
                .collect(),
            rope: Vec::new(),
            radii_m: [0.0; 2],
            limits: Vec::new(),
        }
    }
}
