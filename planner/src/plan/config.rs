//! What is tuned about throws of every task, and the size of their search.

use super::screen::Clearance;
use super::waypoints::{Dimensions, WAYPOINTS};
use crate::OutOfRange;
use crate::collide::ContactCounts;
use arm_model::JOINTS;
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;

/// Weights of the fitness terms that all tasks share. The paper gives the terms, not
/// the weights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ThrowWeights {
    /// Of the distance `d_min` (1/m).
    pub distance_per_m: f64,
    /// Of the proximity reward `R_prox`.
    pub proximity: f64,
    /// Of the motion regulariser `M` (1/rad). Small enough that giving up 1 mm
    /// never pays for less than a radian of motion.
    pub motion_per_rad: f64,
    /// Of joint speed above the limit, `P_vel` (s/rad).
    pub speed_excess_per_rad_s: f64,
    /// Of one contact of the rope with the robot at one sampled instant.
    pub rope_contact: f64,
    /// Of one contact of the tool side with the robot at one sampled instant.
    pub pole_contact: f64,
    /// Of one contact in the base region at one sampled instant.
    pub base_contact: f64,
}

impl Default for ThrowWeights {
    fn default() -> Self {
        Self {
            distance_per_m: 1.0,
            proximity: 1.0,
            motion_per_rad: 0.001,
            speed_excess_per_rad_s: 1.0,
            rope_contact: 0.02,
            pole_contact: 0.1,
            base_contact: 0.2,
        }
    }
}

impl ThrowWeights {
    /// `P_coll`: weighted contact counts, the base region weighing most.
    #[must_use]
    pub fn contacts(&self, contacts: &ContactCounts) -> f64 {
        self.rope_contact * f64::from(contacts.rope_robot)
            + self.pole_contact * f64::from(contacts.pole_robot)
            + self.base_contact * f64::from(contacts.base_region)
    }
}

/// Relative changes of the rope under which the finalists are compared: about
/// what identification leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Robustness {
    /// Finalists compared; 1 switches the comparison off.
    pub finalists: usize,
    /// How many of them are polished where the task can be.
    pub polished: usize,
    /// Change of the length (1).
    pub length: f64,
    /// Change of stiffness over mass (1).
    pub stiffness: f64,
    /// Change of damping over mass (1).
    pub damping: f64,
    /// Change of lead mass over rope mass (1).
    pub lead_mass: f64,
    /// Change of the lead's radius (1); 0 where nothing is to be touched with it.
    pub lead_radius: f64,
}

impl Default for Robustness {
    fn default() -> Self {
        Self {
            finalists: 12,
            polished: 4,
            length: 0.003,
            stiffness: 0.03,
            damping: 0.03,
            lead_mass: 0.02,
            lead_radius: 0.0,
        }
    }
}

impl Robustness {
    /// The rope itself and two variants per parameter.
    #[must_use]
    pub fn variants(&self, rope: &RopeParams) -> Vec<RopeParams> {
        let mut out = vec![*rope];
        for sign in [-1.0, 1.0] {
            let mut varied = [*rope; 4];
            varied[0].length_m *= 1.0 + sign * self.length;
            varied[1].joint_stiffness_nm_per_rad *= 1.0 + sign * self.stiffness;
            varied[2].joint_damping_nms_per_rad *= 1.0 + sign * self.damping;
            if let Some(friction) = varied[1].extras.as_mut().and_then(|e| e.friction.as_mut()) {
                // Identified as a part of the stiffness.
                friction.moment_max_nm *= 1.0 + sign * self.stiffness;
            }
            varied[3].lead_mass_kg *= 1.0 + sign * self.lead_mass;
            out.extend(varied);
            if self.lead_radius > 0.0 {
                let lead_radius_m = rope.lead_radius_m * (1.0 + sign * self.lead_radius);
                out.push(RopeParams {
                    lead_radius_m,
                    ..*rope
                });
            }
        }
        out
    }
}

/// What is tuned about the throws of a task rather than asked for; the defaults are
/// those of striking.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ThrowConfig {
    /// Most generations of one search (paper: 25 for striking, 50 for lobbing, 15 for
    /// draping).
    pub generations: usize,
    /// Times of the three waypoints (s).
    pub waypoint_times_s: [f64; WAYPOINTS],
    /// Deviation of the first generation for each joint (rad). Its mean is the start
    /// pose, or the task's warm start.
    pub std_dev_rad: [f64; JOINTS],
    /// Time simulated after the motion's end in the search (s).
    pub tail_s: f64,
    /// Time after the motion's end for which the finalists are observed and judged (s).
    pub observed_s: f64,
    /// Time after the motion's end in which contacts of the rope with the arm are
    /// looked for (s).
    pub contact_tail_s: f64,
    /// Period at which contacts are looked for (s).
    pub contact_period_s: f64,
    /// Draws of one candidate before it is pulled towards the mean.
    pub draws_max: usize,
    /// Fraction of a generation that succeeds from which a search is done; none to search on.
    pub stop_success_fraction: Option<f64>,
    /// Weights of the fitness terms.
    pub weights: ThrowWeights,
    /// Distances the tool keeps from the scene.
    pub clearance: Clearance,
    /// Comparison of the finalists.
    pub robustness: Robustness,
}

impl Default for ThrowConfig {
    fn default() -> Self {
        Self {
            generations: 25,
            waypoint_times_s: [0.45, 0.80, 1.15],
            std_dev_rad: [0.15, 0.35, 0.25, 0.35, 0.25, 0.5, 0.25],
            tail_s: 0.35,
            observed_s: 0.35,
            contact_tail_s: 0.35,
            contact_period_s: 0.015,
            draws_max: 40,
            stop_success_fraction: None,
            weights: ThrowWeights::default(),
            clearance: Clearance::default(),
            robustness: Robustness::default(),
        }
    }
}

/// Most generations of one search.
const GENERATIONS_MAX: f64 = 1e7;
/// Most candidates of one generation, and most draws of one candidate.
const COUNT_MAX: f64 = 1e4;

impl ThrowConfig {
    /// Refuses what would hide collisions, or take a search without end.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        let within = OutOfRange::unless_within;
        let (weights, compared) = (&self.weights, &self.robustness);
        let times_s = self.waypoint_times_s.map(|t| ("waypoint_times_s", t));
        within(0.0..=30.0, "from 0 to 30 s", &times_s)?;
        let tails_s = [
            ("tail_s", self.tail_s),
            ("observed_s", self.observed_s),
            ("contact_tail_s", self.contact_tail_s),
        ];
        within(0.0..=30.0, "from 0 to 30 s", &tails_s)?;
        let period_s = [("contact_period_s", self.contact_period_s)];
        within(1e-3..=1.0, "from 0.001 to 1 s", &period_s)?;
        let unsigned = [
            ("weights.rope_contact", weights.rope_contact),
            ("weights.pole_contact", weights.pole_contact),
            ("weights.base_contact", weights.base_contact),
            ("clearance.tool_m", self.clearance.tool_m),
        ];
        within(0.0..=f64::MAX, "finite and 0 or more", &unsigned)?;
        let speed_excess = weights.speed_excess_per_rad_s;
        OutOfRange::unless_finite(&[
            ("weights.distance_per_m", weights.distance_per_m),
            ("weights.proximity", weights.proximity),
            ("weights.motion_per_rad", weights.motion_per_rad),
            ("weights.speed_excess_per_rad_s", speed_excess),
        ])?;
        let generations = [("generations", self.generations as f64)];
        within(0.0..=GENERATIONS_MAX, "at most 10000000", &generations)?;
        let draws = [("draws_max", self.draws_max as f64)];
        within(0.0..=COUNT_MAX, "at most 10000", &draws)?;
        let finalists = [
            ("robustness.finalists", compared.finalists as f64),
            ("robustness.polished", compared.polished as f64),
        ];
        within(0.0..=1e3, "at most 1000", &finalists)
    }
}

/// Size of the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanOptions {
    /// Which joints move.
    pub dimensions: Dimensions,
    /// Most by which a segment's duration is stretched or shrunk (1); 1 keeps the
    /// waypoints' times, as the paper does.
    pub segment_stretch_max: f64,
    /// Candidates per generation (paper: 60).
    pub population: usize,
    /// Most generations of one search; the task's own number if left out.
    pub generations: Option<usize>,
    /// Most searches: where one ends without a throw that is good enough, the next
    /// begins with other random numbers. 1 is the paper's budget.
    pub searches: usize,
    /// Throws of the library that are tried before any search; 0 is the paper's way, which
    /// searches at once.
    pub library_candidates: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Step of the rope simulation for finalists and their polish (s).
    pub step_s: f64,
    /// Step in the generations of a search, which only rank (s); `step_s` if that is
    /// greater.
    pub search_step_s: f64,
    /// Threads.
    pub threads: usize,
    /// Error below which no further search begins (m).
    pub good_enough_m: f64,
    /// Error that is good enough to stop within a search (m).
    pub stop_below_m: Option<f64>,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            dimensions: Dimensions::Planar,
            segment_stretch_max: 1.0,
            population: 60,
            generations: None,
            searches: 3,
            library_candidates: 32,
            seed: 0,
            step_s: 5e-4,
            search_step_s: 1e-3,
            threads: 2,
            good_enough_m: 1e-3,
            stop_below_m: None,
        }
    }
}

/// Most by which a segment of a throw may be stretched or shrunk (1).
pub(super) const STRETCH_MAX: f64 = 2.0;

impl PlanOptions {
    /// Refuses what cannot be searched with, or never ends.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        let within = OutOfRange::unless_within;
        let steps_s = [
            ("step_s", self.step_s),
            ("search_step_s", self.search_step_s),
        ];
        let range = f64::MIN_POSITIVE..=5e-3;
        within(range, "above 0 and at most 0.005 s", &steps_s)?;
        let stretch = [("segment_stretch_max", self.segment_stretch_max)];
        within(1.0..=STRETCH_MAX, "from 1 to 2", &stretch)?;
        let population = [("population", self.population as f64)];
        within(4.0..=COUNT_MAX, "from 4 to 10000", &population)?;
        let generations = self.generations.map_or(1.0, |count| count as f64);
        let generations = [("generations", generations)];
        within(1.0..=GENERATIONS_MAX, "from 1 to 10000000", &generations)?;
        let searches = [("searches", self.searches as f64)];
        within(0.0..=1e3, "at most 1000", &searches)?;
        let library_candidates = [("library_candidates", self.library_candidates as f64)];
        within(0.0..=1e3, "at most 1000", &library_candidates)
    }
}
