//! Simulated throws: rope, arm and contacts of many candidates at once.

use super::PlanError;
use crate::collide::{ArmShape, ContactCounts, RopeShape, Scene, rope_contacts, tool_contacts};
use crate::workers::map_in_order;
use nalgebra::Vector3;
use rope_sim::{
    Candidate, FrameTimes, Outcome, PlannedArm, Precision, Rollout, SimOptions, Start, Watch,
    roll_out,
};
use shared_types::{JointTrajectory, RopeParams};

/// What one simulated throw did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrowOutcome {
    /// Smallest distance between tip and target, in continuous time (m).
    pub closest_m: f64,
    /// When it occurs (s after the start).
    pub closest_s: f64,
    /// Contacts summed over the sampled instants.
    pub contacts: ContactCounts,
    /// Whether the simulation stayed finite; the other fields mean nothing if
    /// it did not.
    pub finite: bool,
}

/// How throws at one target are simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrowSimulator {
    /// Target of the tip (m).
    pub target_m: [f64; 3],
    /// Time simulated after the motion's end (s).
    pub tail_s: f64,
    /// Step of the rope simulation (s).
    pub step_s: f64,
    /// Arithmetic of the rope simulation.
    pub precision: Precision,
    /// Period at which contacts are looked for (s).
    pub contact_period_s: f64,
    /// Column and floor.
    pub scene: Scene,
    /// Threads.
    pub threads: usize,
}

impl ThrowSimulator {
    /// Throws each trajectory with its rope. Results are in the order of the
    /// input and do not depend on the number of threads.
    ///
    /// # Errors
    /// What the rope simulator refuses.
    pub fn run(
        &self,
        throws: &[(&RopeParams, &JointTrajectory)],
    ) -> Result<Vec<ThrowOutcome>, PlanError> {
        let horizon_s = throws
            .iter()
            .map(|(_, t)| t.duration_s())
            .fold(0.0, f64::max)
            + self.tail_s;
        let arms: Vec<PlannedArm> = throws.iter().map(|(_, t)| PlannedArm::new(**t)).collect();
        let candidates: Vec<Candidate<'_>> = throws
            .iter()
            .zip(&arms)
            .map(|((rope, _), arm)| Candidate::new(rope, arm))
            .collect();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive count of a few hundred"
        )]
        let count = (horizon_s / self.contact_period_s).floor() as usize + 1;
        let rollouts = roll_out(
            &candidates,
            &SimOptions {
                step_s: self.step_s,
                precision: self.precision,
                start: Start::Equilibrium,
                frames: FrameTimes {
                    first_s: 0.0,
                    period_s: self.contact_period_s,
                    count,
                },
                watch: Watch::point(self.target_m),
                horizon_s,
                threads: self.threads,
            },
        )?;
        let jobs: Vec<_> = throws.iter().zip(&rollouts).collect();
        Ok(map_in_order(
            &jobs,
            self.threads,
            |((rope, trajectory), rollout)| self.outcome(rope, trajectory, rollout),
        ))
    }

    fn outcome(
        &self,
        rope: &RopeParams,
        trajectory: &JointTrajectory,
        rollout: &Rollout,
    ) -> ThrowOutcome {
        let mut contacts = ContactCounts::default();
        let shape = RopeShape::from(rope);
        let mut nodes: Vec<Vector3<f64>> = Vec::new();
        let mut time_s = 0.0;
        for frame in 0..rollout.nodes.frames() {
            let arm = ArmShape::at(&trajectory.state_at(time_s).q);
            contacts += tool_contacts(&arm, &self.scene);
            nodes.clear();
            nodes
                .extend((0..rollout.nodes.nodes()).map(|node| rollout.nodes.position(frame, node)));
            contacts += rope_contacts(&arm, &self.scene, &shape, &nodes);
            time_s += self.contact_period_s;
        }
        let closest = rollout
            .watched
            .to_point
            .filter(|c| c.distance_m.is_finite() && !matches!(rollout.outcome, Outcome::Diverged));
        ThrowOutcome {
            closest_m: closest.map_or(f64::INFINITY, |c| c.distance_m),
            closest_s: closest.map_or(0.0, |c| c.time_s),
            contacts,
            finite: closest.is_some(),
        }
    }
}
