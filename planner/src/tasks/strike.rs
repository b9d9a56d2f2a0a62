//! Striking: the rope's tip passes through a point.
//!
//! Fitness of the paper's appendix "CMA-ES Fitness Functions", pole striking:
//! `f = d_min - R_prox + M + P_vel + P_coll`, with `d_min` in continuous time.

use super::throw::{ThrowOutcome, ThrowSimulator};
use super::{PlanError, PlanProgress, check_reach, start_pose_for};
use crate::collide::{ContactCounts, Scene};
use crate::trajopt::{
    Clearance, Dimensions, Screen, SearchOptions, SearchResult, Valued, WAYPOINTS, WaypointSpace,
    search,
};
use rope_sim::Precision;
use serde::{Deserialize, Serialize};
use shared_types::plan::trajectory_hash_hex;
use shared_types::{JOINTS, JointTrajectory, Limits, Plan, RopeParams, Task, VERSION};
use std::ops::ControlFlow;

/// Weights of the fitness terms. The paper gives the terms, not the weights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StrikeWeights {
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

impl Default for StrikeWeights {
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

/// Relative changes of the rope under which the finalists are compared: about
/// what identification leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Robustness {
    /// Finalists compared; 1 switches the comparison off.
    pub finalists: usize,
    /// Change of the length (1).
    pub length: f64,
    /// Change of stiffness over mass (1).
    pub stiffness: f64,
    /// Change of damping over mass (1).
    pub damping: f64,
    /// Change of lead mass over rope mass (1).
    pub lead_mass: f64,
}

impl Default for Robustness {
    fn default() -> Self {
        Self {
            finalists: 12,
            length: 0.003,
            stiffness: 0.03,
            damping: 0.03,
            lead_mass: 0.02,
        }
    }
}

impl Robustness {
    /// The rope itself and two variants per parameter.
    #[must_use]
    pub fn variants(&self, rope: &RopeParams) -> Vec<RopeParams> {
        let mut out = vec![*rope];
        for sign in [-1.0, 1.0] {
            let mut change = |edit: &dyn Fn(&mut RopeParams)| {
                let mut r = *rope;
                edit(&mut r);
                out.push(r);
            };
            change(&|r| r.length_m *= 1.0 + sign * self.length);
            change(&|r| r.joint_stiffness_nm_per_rad *= 1.0 + sign * self.stiffness);
            change(&|r| r.joint_damping_nms_per_rad *= 1.0 + sign * self.damping);
            change(&|r| r.lead_mass_kg *= 1.0 + sign * self.lead_mass);
        }
        out
    }
}

/// Everything about striking that is tuned rather than asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StrikeConfig {
    /// Times of the three waypoints (s).
    pub waypoint_times_s: [f64; WAYPOINTS],
    /// Deviation of the first generation for each joint (rad). The mean is the
    /// start pose: for striking the paper starts unbiased.
    pub std_dev_rad: [f64; JOINTS],
    /// Time simulated after the motion's end (s).
    pub tail_s: f64,
    /// Period at which contacts are looked for (s).
    pub contact_period_s: f64,
    /// Draws of one candidate before it is pulled towards the mean.
    pub draws_max: usize,
    /// Weights of the fitness terms.
    pub weights: StrikeWeights,
    /// Distances the tool keeps from the scene.
    pub clearance: Clearance,
    /// Comparison of the finalists.
    pub robustness: Robustness,
}

impl Default for StrikeConfig {
    fn default() -> Self {
        Self {
            waypoint_times_s: [0.45, 0.80, 1.15],
            std_dev_rad: [0.15, 0.35, 0.25, 0.35, 0.25, 0.5, 0.25],
            tail_s: 0.35,
            contact_period_s: 0.015,
            draws_max: 40,
            weights: StrikeWeights::default(),
            clearance: Clearance::default(),
            robustness: Robustness::default(),
        }
    }
}

/// Size of the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StrikeOptions {
    /// Which joints move.
    pub dimensions: Dimensions,
    /// Candidates per generation (paper: 60).
    pub population: usize,
    /// Most generations (paper: 25).
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Step of the rope simulation (s).
    pub step_s: f64,
    /// Threads.
    pub threads: usize,
    /// Error that is good enough to stop (m).
    pub stop_below_m: Option<f64>,
}

impl Default for StrikeOptions {
    fn default() -> Self {
        Self {
            dimensions: Dimensions::Planar,
            population: 60,
            generations: 25,
            seed: 0,
            step_s: 5e-4,
            threads: 2,
            stop_below_m: None,
        }
    }
}

/// A strike to plan.
#[derive(Debug, Clone, PartialEq)]
pub struct StrikeRequest {
    /// The rope, as identified or known.
    pub rope: RopeParams,
    /// Where the tip shall pass (m).
    pub target_m: [f64; 3],
    /// What the arm may do.
    pub limits: Limits,
    /// Size of the search.
    pub options: StrikeOptions,
    /// Tuned values.
    pub config: StrikeConfig,
}

/// Plans a strike: CMA-ES-traj, then the finalist least sensitive to what
/// identification leaves open. Deterministic for a seed, whatever the threads.
///
/// # Errors
/// See [`PlanError`]; an unreachable target is refused before any simulation.
pub fn plan_strike(
    request: &StrikeRequest,
    progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
) -> Result<Plan, PlanError> {
    request.rope.validate()?;
    check_options(&request.options)?;
    check_reach(request.target_m, request.rope.length_m)?;
    let config = &request.config;
    let space = WaypointSpace {
        start: start_pose_for(request.target_m),
        dimensions: request.options.dimensions,
        times_s: config.waypoint_times_s,
    };
    let screen = Screen::new(space.clone(), request.limits.clone(), config.clearance)?;
    let simulator = ThrowSimulator::for_strike(request);
    let joints = space.dimensions.joints();
    let options = SearchOptions {
        population: request.options.population,
        generations: request.options.generations,
        seed: request.options.seed,
        std_dev_rad: (0..WAYPOINTS)
            .flat_map(|_| joints.iter().map(|&j| config.std_dev_rad[j]))
            .collect(),
        draws_max: config.draws_max,
        stop_below_m: request.options.stop_below_m,
        keep: config.robustness.finalists,
    };
    let mut value = |trajectories: &[JointTrajectory]| {
        let throws: Vec<_> = trajectories.iter().map(|t| (&request.rope, t)).collect();
        let outcomes = simulator.run(&throws)?;
        Ok(trajectories
            .iter()
            .zip(outcomes)
            .map(|(t, o)| valued(&config.weights, &screen, t, &o))
            .collect())
    };
    let bounds = space.bounds(&request.limits);
    let found = search(&space, &screen, bounds, &options, &mut value, progress)?;
    finish(request, &simulator, &found)
}

fn check_options(options: &StrikeOptions) -> Result<(), PlanError> {
    let refuse = |option, value, expected| {
        Err(PlanError::Option {
            option,
            value,
            expected,
        })
    };
    if !(options.step_s > 0.0 && options.step_s <= 5e-3) {
        return refuse("step_s", options.step_s, "above 0 and at most 0.005 s");
    }
    if options.generations == 0 {
        return refuse("generations", 0.0, "1 or more");
    }
    Ok(())
}

impl ThrowSimulator {
    /// The simulator that values candidates of a strike.
    #[must_use]
    pub fn for_strike(request: &StrikeRequest) -> Self {
        let config = &request.config;
        Self {
            target_m: request.target_m,
            tail_s: config.tail_s,
            step_s: request.options.step_s,
            precision: Precision::F32,
            contact_period_s: config.contact_period_s,
            scene: Scene {
                column_half_width_m: config.clearance.column_half_width_m,
                floor_z_m: config.clearance.floor_z_m,
            },
            threads: request.options.threads.max(1),
        }
    }
}

/// Fitness `f(τ)` of one simulated throw.
fn valued(
    weights: &StrikeWeights,
    screen: &Screen,
    trajectory: &JointTrajectory,
    outcome: &ThrowOutcome,
) -> Valued {
    // A simulation that blew up ranks behind every one that did not.
    const DIVERGED: f64 = 1e3;
    let fitness = if outcome.finite {
        weights.distance_per_m * outcome.closest_m
            - weights.proximity * proximity_reward(outcome.closest_m)
            + weights.motion_per_rad * joint_motion_rad(trajectory)
            + weights.speed_excess_per_rad_s * screen.speed_excess_rad_s(trajectory)
            + contact_penalty(weights, &outcome.contacts)
    } else {
        DIVERGED
    };
    Valued {
        fitness,
        error_m: outcome.closest_m,
        time_s: outcome.closest_s,
    }
}

/// `R_prox = 1 / (1 + d_min)`.
fn proximity_reward(closest_m: f64) -> f64 {
    1.0 / (1.0 + closest_m)
}

/// `M(τ)`: way of all joints from knot to knot, summed (rad).
fn joint_motion_rad(trajectory: &JointTrajectory) -> f64 {
    trajectory
        .waypoints()
        .windows(2)
        .map(|w| (w[1] - w[0]).iter().map(|d| d.abs()).sum::<f64>())
        .sum()
}

/// `P_coll`: weighted contact counts, the base region weighing most.
fn contact_penalty(weights: &StrikeWeights, contacts: &ContactCounts) -> f64 {
    weights.rope_contact * f64::from(contacts.rope_robot)
        + weights.pole_contact * f64::from(contacts.pole_robot)
        + weights.base_contact * f64::from(contacts.base_region)
}

/// Chooses among the finalists by root mean square error over the rope's
/// variants and makes the plan.
fn finish(
    request: &StrikeRequest,
    simulator: &ThrowSimulator,
    found: &SearchResult,
) -> Result<Plan, PlanError> {
    let variants = request.config.robustness.variants(&request.rope);
    let throws: Vec<_> = found
        .best
        .iter()
        .flat_map(|(trajectory, _)| variants.iter().map(move |rope| (rope, trajectory)))
        .collect();
    let outcomes = simulator.run(&throws)?;
    let chosen = outcomes
        .chunks(variants.len())
        .zip(&found.best)
        .filter(|(outcomes, _)| outcomes[0].finite && outcomes[0].contacts.pole_robot == 0)
        .map(|(outcomes, (trajectory, valued))| {
            let squares: f64 = outcomes.iter().map(|o| o.closest_m.powi(2)).sum();
            let contacts = contact_penalty(&request.config.weights, &outcomes[0].contacts);
            (squares.sqrt() + contacts, trajectory, valued)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let simulations = found.simulations + u32::try_from(throws.len()).unwrap_or(u32::MAX);
    let Some((_, trajectory, valued)) = chosen else {
        return Err(PlanError::OnlyCollisions { simulations });
    };
    if let Some(margin) = request.limits.worst_violation(trajectory) {
        return Err(PlanError::BreaksLimit {
            what: margin.describe(),
        });
    }
    // The prediction written down comes from double precision at half the step.
    let exact = ThrowSimulator {
        precision: Precision::F64,
        step_s: simulator.step_s / 2.0,
        ..*simulator
    };
    let last = exact.run(&[(&request.rope, trajectory)])?;
    let outcome = last.first().filter(|o| o.finite);
    Ok(Plan {
        version: VERSION.to_owned(),
        seed: request.options.seed,
        task: Task::Strike,
        target_m: request.target_m,
        rope: request.rope,
        trajectory: *trajectory,
        predicted_error_m: outcome.map_or(valued.error_m, |o| o.closest_m),
        predicted_time_s: outcome.map_or(valued.time_s, |o| o.closest_s),
        fitness: valued.fitness,
        simulations: simulations + 1,
        resampled: found.resampled,
        margins: request.limits.margins(trajectory),
        trajectory_sha256: trajectory_hash_hex(trajectory),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ropes::random_rope;

    fn request(target_m: [f64; 3]) -> StrikeRequest {
        StrikeRequest {
            rope: random_rope(11),
            target_m,
            limits: Limits::default(),
            options: StrikeOptions {
                population: 24,
                generations: 12,
                ..StrikeOptions::default()
            },
            config: StrikeConfig::default(),
        }
    }

    fn go_on(_: PlanProgress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    #[test]
    fn fitness_is_the_sum_of_its_named_terms() {
        let weights = StrikeWeights::default();
        let space = WaypointSpace {
            start: start_pose_for([0.9, 0.0, 0.2]),
            dimensions: Dimensions::Planar,
            times_s: [0.45, 0.8, 1.15],
        };
        let clearance = Clearance::default();
        let screen = Screen::new(space.clone(), Limits::default(), clearance).unwrap();
        let rest = space.decode(&space.resting()).unwrap();
        let outcome = ThrowOutcome {
            closest_m: 0.25,
            closest_s: 0.7,
            contacts: ContactCounts {
                rope_robot: 3,
                pole_robot: 2,
                base_region: 1,
            },
            finite: true,
        };
        let got = valued(&weights, &screen, &rest, &outcome).fitness;
        let want = 0.25 - 1.0 / 1.25 + 3.0 * 0.02 + 2.0 * 0.1 + 0.2;
        assert!((got - want).abs() < 1e-12);
        let mut x = space.resting();
        x[0] += 0.2;
        let moved = space.decode(&x).unwrap();
        assert!((joint_motion_rad(&moved) - 0.4).abs() < 1e-12);
        let lost = ThrowOutcome {
            finite: false,
            ..outcome
        };
        assert!(valued(&weights, &screen, &rest, &lost).fitness > 100.0);
    }

    #[test]
    fn a_small_search_comes_close_and_keeps_every_limit() {
        let mut generations = 0;
        let r = request([0.95, 0.25, 0.1]);
        let plan = plan_strike(&r, &mut |p| {
            generations = p.generation;
            ControlFlow::Continue(())
        })
        .unwrap();
        assert!(plan.predicted_error_m < 0.05, "{}", plan.predicted_error_m);
        assert_eq!(generations, 12);
        assert!(plan.margins.iter().all(|m| m.left >= 0.0));
        assert_eq!(plan.trajectory.start(), start_pose_for(r.target_m));
        assert_eq!(
            plan.trajectory_sha256,
            trajectory_hash_hex(&plan.trajectory)
        );
    }

    #[test]
    fn same_plan_for_one_and_two_threads() {
        let mut r = request([0.9, -0.2, 0.3]);
        r.options.generations = 4;
        r.options.threads = 1;
        let one = plan_strike(&r, &mut go_on).unwrap();
        r.options.threads = 2;
        assert_eq!(one, plan_strike(&r, &mut go_on).unwrap());
        r.options.seed += 1;
        assert_ne!(
            one.trajectory,
            plan_strike(&r, &mut go_on).unwrap().trajectory
        );
    }

    #[test]
    fn impossible_requests_are_refused_before_any_simulation() {
        let mut called = false;
        let mut progress = |_: PlanProgress| {
            called = true;
            ControlFlow::Continue(())
        };
        let far = plan_strike(&request([1.8, 0.3, 0.4]), &mut progress);
        assert!(matches!(far, Err(PlanError::Unreachable { .. })));
        let mut r = request([0.9, 0.0, 0.2]);
        r.rope.length_m = f64::NAN;
        assert!(matches!(
            plan_strike(&r, &mut progress),
            Err(PlanError::Rope(_))
        ));
        let mut r = request([0.9, 0.0, 0.2]);
        r.options.step_s = 0.0;
        assert!(matches!(
            plan_strike(&r, &mut progress),
            Err(PlanError::Option {
                option: "step_s",
                ..
            })
        ));
        assert!(!called);
    }

    #[test]
    fn a_search_can_be_broken_off() {
        let result = plan_strike(&request([0.9, 0.0, 0.2]), &mut |p| {
            if p.generation == 2 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert!(matches!(
            result,
            Err(PlanError::Cancelled { generation: 2 })
        ));
    }
}
