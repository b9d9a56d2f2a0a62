//! Striking: the rope's tip passes through a point.
//!
//! Fitness of the paper's appendix "CMA-ES Fitness Functions", pole striking:
//! `f = d_min - R_prox + M + P_vel + P_coll`, with `d_min` in continuous time.

mod config;
#[cfg(test)]
mod tests;

pub use config::{Robustness, StrikeConfig, StrikeOptions, StrikeWeights};

use super::throw::{ThrowOutcome, ThrowSimulator};
use super::{PlanError, PlanProgress, check_reach, start_pose_for};
use crate::collide::{ContactCounts, Scene};
use crate::trajopt::{
    Screen, SearchOptions, SearchResult, Valued, WAYPOINTS, WaypointSpace, search,
};
use rope_sim::Precision;
use shared_types::plan::trajectory_hash_hex;
use shared_types::{JointTrajectory, Limits, Plan, RopeParams, Task, VERSION};
use std::ops::ControlFlow;

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
