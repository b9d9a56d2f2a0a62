//! Simulated throws: rope, arm, scene and contacts of many candidates at once.

use super::PlanError;
use crate::arm_response::Following;
use crate::collide::{
    ArmShape, Block, ContactCounts, RopeShape, block_contacts, rope_contacts, tool_contacts,
};
use crate::workers::map_in_order;
use arm_model::{Cell, JointTrajectory};
use nalgebra::Vector3;
use rope_sim::{
    Candidate, ContactSummary, DominoOutcome, FrameTimes, Outcome, PlannedArm, Precision, Rollout,
    Scene, SimOptions, Watch, Watched, roll_out_in,
};
use shared_types::{RopeParams, RopeState};

/// What one simulated throw did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ThrowOutcome {
    /// Smallest distance between tip and watched point, in continuous time (m).
    pub closest_m: f64,
    /// When it occurs (s after the start).
    pub closest_s: f64,
    /// Contacts summed over the sampled instants.
    pub contacts: ContactCounts,
    /// Whether the simulation stayed finite; the other fields mean nothing if
    /// it did not.
    pub finite: bool,
    /// The tip every `contact_period_s` from 0 s on (m, base frame), where it is kept.
    pub tip_m: Vec<[f64; 3]>,
    /// Everything the task asked to be watched.
    pub watched: Watched,
    /// What the rope did with each obstacle of the task's scene.
    pub obstacles: Vec<ContactSummary>,
    /// What became of its domino.
    pub domino: Option<DominoOutcome>,
    /// End of the simulation (s after the start).
    pub end_s: f64,
    /// The watched point (m).
    pub point_m: [f64; 3],
    /// Ends of the watched segment (m).
    pub segment_m: [[f64; 3]; 2],
}

/// A rope as a throw begins.
#[derive(Debug, Clone, Copy)]
pub struct RopeAtStart<'a> {
    /// The rope.
    pub rope: &'a RopeParams,
    /// Its state; none for one that hangs still.
    pub state: Option<&'a RopeState>,
}

impl<'a> RopeAtStart<'a> {
    /// The rope on a motion.
    pub(super) fn on(self, motion: &'a PlannedArm) -> Candidate<'a> {
        Candidate::new(self.rope, motion).from_state(self.state)
    }
}

impl<'a> From<&'a RopeParams> for RopeAtStart<'a> {
    /// Hanging still.
    fn from(rope: &'a RopeParams) -> Self {
        Self { rope, state: None }
    }
}

/// How throws of one task are simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct ThrowSimulator {
    /// What is measured; [`Watch::point_m`] must be among it.
    pub watch: Watch,
    /// What the rope can touch.
    pub scene: Scene,
    /// What arm and pole must not touch.
    pub keep_clear: Vec<Block>,
    /// Time allowed for the motion, whatever a throw's own (s).
    pub motion_s_min: f64,
    /// Time simulated after the motion's end (s).
    pub tail_s: f64,
    /// Time after the motion's end in which contacts with the arm are looked for (s).
    pub contact_tail_s: f64,
    /// Step of the rope simulation (s).
    pub step_s: f64,
    /// Arithmetic of the rope simulation.
    pub precision: Precision,
    /// Period at which contacts with the arm are looked for (s).
    pub contact_period_s: f64,
    /// The pole, column and floor.
    pub cell: Cell,
    /// How the arm follows what it is told; none for an arm that does exactly that.
    pub following: Option<Following>,
    /// Whether outcomes keep the path of the tip.
    pub keeps_tip: bool,
    /// Threads.
    pub threads: usize,
}

impl ThrowSimulator {
    /// The same in double precision at half the step: what predictions come from.
    #[must_use]
    pub fn exact(&self) -> Self {
        Self {
            precision: Precision::F64,
            step_s: self.step_s / 2.0,
            ..self.clone()
        }
    }

    /// Options of the rope simulation for motions that end at `motion_s`.
    pub(crate) fn options(&self, motion_s: f64, frames: FrameTimes) -> SimOptions {
        SimOptions {
            frames,
            watch: self.watch,
            threads: self.threads,
            ..SimOptions::new(self.step_s, self.precision, motion_s + self.tail_s)
        }
    }

    /// The arm when it is told a trajectory.
    ///
    /// # Errors
    /// A joint moves whose response is not known.
    pub(super) fn arm(&self, command: &JointTrajectory) -> Result<PlannedArm, PlanError> {
        let motion = match &self.following {
            None => *command,
            Some(following) => following.motion(command)?,
        };
        Ok(PlannedArm::new(motion, self.cell.pole))
    }

    /// Commands each trajectory with its rope. Results are in the order of the
    /// input and do not depend on the number of threads.
    ///
    /// # Errors
    /// What the rope simulator refuses.
    pub fn run<'a, R: Into<RopeAtStart<'a>> + Copy>(
        &self,
        throws: &[(R, &JointTrajectory)],
    ) -> Result<Vec<ThrowOutcome>, PlanError> {
        let throws: Vec<_> = throws
            .iter()
            .map(|(rope, t)| ((*rope).into(), *t))
            .collect();
        self.run_from(&throws)
    }

    fn run_from(
        &self,
        throws: &[(RopeAtStart<'_>, &JointTrajectory)],
    ) -> Result<Vec<ThrowOutcome>, PlanError> {
        let arms = throws
            .iter()
            .map(|(_, command)| self.arm(command))
            .collect::<Result<Vec<_>, _>>()?;
        let motion_s = arms.iter().map(|arm| arm.trajectory().duration_s());
        let motion_s = motion_s.fold(self.motion_s_min, f64::max);
        let candidates: Vec<Candidate<'_>> = throws
            .iter()
            .zip(&arms)
            .map(|((rope, _), arm)| rope.on(arm))
            .collect();
        let looked_s = motion_s + self.contact_tail_s.min(self.tail_s);
        let count = (looked_s / self.contact_period_s).floor() as usize + 1;
        let frames = FrameTimes {
            first_s: 0.0,
            period_s: self.contact_period_s,
            count,
        };
        let options = self.options(motion_s, frames);
        let rollouts = roll_out_in(&self.scene, &candidates, &options)?;
        let jobs: Vec<_> = throws.iter().zip(&arms).zip(&rollouts).collect();
        Ok(map_in_order(
            &jobs,
            self.threads,
            |(((rope, _), arm), rollout)| {
                self.outcome(rope.rope, arm.trajectory(), rollout, options.horizon_s)
            },
        ))
    }

    fn outcome(
        &self,
        rope: &RopeParams,
        motion: &JointTrajectory,
        rollout: &Rollout,
        end_s: f64,
    ) -> ThrowOutcome {
        let mut contacts = ContactCounts::default();
        let shape = RopeShape::from(rope);
        let mut nodes: Vec<Vector3<f64>> = Vec::new();
        let mut arm = ArmShape::at(&motion.state_at(0.0).q, &self.cell.pole);
        let mut of_arm = ContactCounts::default();
        let mut tip_m = Vec::new();
        let mut time_s = 0.0;
        for frame in 0..rollout.nodes.frames() {
            // Once the arm stands, only the rope moves on.
            if time_s < motion.duration_s() + self.contact_period_s {
                arm = ArmShape::at(&motion.state_at(time_s).q, &self.cell.pole);
                of_arm = tool_contacts(&arm, &self.cell);
                of_arm.pole_robot += block_contacts(&arm, &self.keep_clear);
            }
            contacts += of_arm;
            nodes.clear();
            nodes
                .extend((0..rollout.nodes.nodes()).map(|node| rollout.nodes.position(frame, node)));
            let tip = nodes.last().filter(|_| self.keeps_tip);
            tip_m.extend(tip.map(|p| <[f64; 3]>::from(*p)));
            contacts += rope_contacts(&arm, &self.cell, &shape, &nodes);
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
            tip_m,
            watched: rollout.watched.clone(),
            obstacles: rollout.contacts.clone(),
            domino: rollout.domino,
            end_s,
            point_m: self.watch.point_m.unwrap_or_default(),
            segment_m: self.watch.segment_m.unwrap_or_default(),
        }
    }
}
