//! A rope in MuJoCo, filmed, identified and thrown at its target.

use super::case::Case;
use super::wiggling::{Reality, Untold, Wiggled};
use crate::results::experiment::Experiment;
use anyhow::{Context, anyhow, ensure};
use arm_model::Cell;
use nalgebra::Vector3;
use planner::plan::{
    MISS_STD_M, PlanError, PlanOptions, PlanRequest, PosteriorEnsemble, is_worth_swinging,
    plan_again, simulator_for, warnings,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use rope_sim::{FrameTimes, Sway};
use serde::{Deserialize, Serialize};
use shared_types::{ErrorForecast, Plan, RopeParams, Task};
use std::array;
use std::ops::ControlFlow;

/// Time between positions of the tip in a throw (s); it moves straight in between.
const THROW_PERIOD_S: f64 = 1e-3;

/// What became of a rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Fate {
    /// Identification or planning refused, in these words.
    Refused(String),
    /// It was thrown.
    Thrown(Thrown),
}

/// A throw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Thrown {
    /// Closest approach of tip and target (m).
    pub miss_m: f64,
    /// The one that the plan predicted (m).
    pub predicted_m: f64,
    /// Length that it was planned with minus the true one (m).
    pub length_error_m: f64,
    /// How the film was fitted; none for a rope that was not identified.
    pub fit: Option<Fit>,
    pub forecast: Option<ErrorForecast>,
    /// Whether the plan was pointed out as poor or uncertain.
    pub warned: bool,
    /// Whether it began out of the swing that the wiggle left.
    #[serde(default)]
    pub out_of_swing: bool,
}

/// How a film was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Fit {
    pub residual_px: f64,
    pub out_of_distribution: f64,
    /// Whether the rope was flagged as out of distribution.
    pub flagged: bool,
}

impl Fate {
    pub fn thrown(&self) -> Option<&Thrown> {
        match self {
            Self::Thrown(thrown) => Some(thrown),
            Self::Refused(_) => None,
        }
    }

    /// A refusal of identification or planning is a result.
    fn refused(why: &anyhow::Error) -> Self {
        Self::Refused(format!("{why:#}"))
    }
}

impl Reality<'_> {
    /// Trial `index`: filmed, identified, planned for and thrown; then thrown again until there
    /// are `N` throws, each corrected by the miss of the one before. What follows a refusal is
    /// refused.
    ///
    /// # Errors
    /// MuJoCo fails. What identification or planning refuses is a fate.
    pub fn identified<const N: usize>(&self, index: u64, case: &Case) -> anyhow::Result<[Fate; N]> {
        let (wiggled, found) = match self.told(index, case) {
            Ok(told) => told,
            Err(Untold::Refused(refusal)) => {
                return Ok(array::from_fn(|_| Fate::refused(&refusal)));
            }
            Err(Untold::Failed(why)) => return Err(why),
        };
        let (rope, posterior) = (&found.params, &found.posterior);
        let seed = self.experiment.args.seed ^ index;
        let forecast = PosteriorEnsemble::FORECAST;
        let ensemble = PosteriorEnsemble::drawn(rope, posterior, self.robust, forecast, seed);
        ensure!(
            ensemble.optimised.len() == self.robust,
            "rope {index}: only {} of {} ropes could be drawn",
            ensemble.optimised.len(),
            self.robust
        );
        let fit = Fit {
            residual_px: found.residual_px,
            out_of_distribution: found.out_of_distribution.score,
            flagged: found.out_of_distribution.is_flagged(),
        };
        self.thrown(index, case, (rope, ensemble), Some((fit, &wiggled)))
    }

    /// Trial `index`: planned for `rope`, whichever it is, and thrown with the case's.
    ///
    /// # Errors
    /// MuJoCo fails.
    pub fn planned_for(&self, index: u64, case: &Case, rope: &RopeParams) -> anyhow::Result<Fate> {
        let [fate] = self.thrown(index, case, (rope, PosteriorEnsemble::default()), None)?;
        Ok(fate)
    }

    fn thrown<const N: usize>(
        &self,
        index: u64,
        case: &Case,
        (rope, ensemble): (&RopeParams, PosteriorEnsemble),
        filmed: Option<(Fit, &Wiggled)>,
    ) -> anyhow::Result<[Fate; N]> {
        let request = self.request(index, case, rope, ensemble);
        let (fit, wiggled) = filmed.unzip();
        let swinging = wiggled.filter(|wiggled| wiggled.short);
        let mut planned = planned(&request, swinging).context("planning");
        let mut rng = ChaCha12Rng::seed_from_u64(case.seed);
        let mut fates = Vec::with_capacity(N);
        for throw in 0..N as u64 {
            let plan = match planned {
                Ok(plan) => plan,
                Err(refusal) => {
                    fates.resize_with(N, || Fate::refused(&refusal));
                    break;
                }
            };
            let miss = self.throw(case, &plan, (throw, wiggled))?;
            fates.push(Fate::Thrown(Thrown {
                miss_m: miss.norm(),
                predicted_m: plan.predicted_error_m,
                length_error_m: rope.length_m - case.rope.params.length_m,
                fit,
                forecast: plan.forecast,
                warned: !warnings(&plan).is_empty(),
                out_of_swing: plan.start.is_some(),
            }));
            if fates.len() == N {
                break;
            }
            let mut error_m = || MISS_STD_M * rng.sample::<f64, _>(StandardNormal);
            let measured = miss + Vector3::from_fn(|_, _| error_m());
            planned = plan_again(&request, &plan, measured.into()).context("planning again");
        }
        fates
            .try_into()
            .map_err(|fates: Vec<Fate>| anyhow!("{} throws instead of {N}", fates.len()))
    }

    /// As `wag plan strike` does by default.
    fn request(
        &self,
        index: u64,
        case: &Case,
        rope: &RopeParams,
        ensemble: PosteriorEnsemble,
    ) -> PlanRequest {
        let Experiment { config, args, .. } = self.experiment;
        let seed = args.seed ^ index;
        let options = PlanOptions {
            seed,
            threads: 1,
            ..config.search
        };
        let goal = config.goal(Task::Strike, case.target_m);
        PlanRequest {
            ensemble,
            ..PlanRequest::new(goal, rope, options)
        }
    }

    /// Tip minus target at their closest (m) in throw `number`, watched as long as a plan is; one
    /// out of a swing after the wiggle that left it.
    fn throw(
        &self,
        case: &Case,
        planned: &Plan,
        (number, wiggled): (u64, Option<&Wiggled>),
    ) -> anyhow::Result<Vector3<f64>> {
        let config = &self.experiment.config;
        let goal = config.goal(Task::Strike, case.target_m);
        let (task, params) = (goal.task(), &case.rope.params);
        let simulator = simulator_for(task, params, &Cell::default(), &config.search);
        let reported = case.arm.reported(&planned.trajectory)?;
        let motion_s = reported.duration_s().max(simulator.motion_s_min);
        let watched_s = motion_s + task.config().observed_s;
        let mut times = FrameTimes {
            first_s: 0.0,
            period_s: THROW_PERIOD_S,
            count: (watched_s / THROW_PERIOD_S).floor() as usize + 1,
        };
        let mut rope = case.rope;
        let swings = wiggled.filter(|_| planned.start.is_some());
        let ends = if let Some(wiggled) = swings {
            times.first_s = wiggled.throw_begins_s();
            let motion = |t_s: f64| {
                let since_s = t_s - times.first_s;
                let (made, at_s) = if since_s < 0.0 {
                    (&wiggled.reported, t_s)
                } else {
                    (&reported, since_s)
                };
                case.arm.attach_frame(made, at_s)
            };
            self.mujoco.simulate(&rope, motion, case.seed, &times, 2)?
        } else {
            // It was left to come to rest.
            rope.sway = Sway::NONE;
            let motion = |t_s| case.arm.attach_frame(&reported, t_s);
            // And hangs in another of the shapes that friction holds.
            let seed = case.seed.wrapping_add(1 + number);
            self.mujoco.simulate(&rope, motion, seed, &times, 2)?
        };
        let tip: Vec<_> = ends.chunks_exact(2).map(|ends| ends[1]).collect();
        Ok(closest(&tip, &case.target_m.into()))
    }
}

/// The plan of a throw: out of the swing that a wiggle left, where there was one and that is
/// worth it.
fn planned(request: &PlanRequest, wiggled: Option<&Wiggled>) -> Result<Plan, PlanError> {
    let plan = |request: &PlanRequest| planner::plan(request, &mut |_| ControlFlow::Continue(()));
    let Some(wiggled) = wiggled else {
        return plan(request);
    };
    let swinging = plan(&PlanRequest {
        before: Some(wiggled.history()),
        ..request.clone()
    })?;
    let mut calm = None;
    let from_rest = || plan(request).inspect(|plan| calm = Some(plan.clone()));
    let is_worth = is_worth_swinging(&swinging, &mut None, from_rest)?;
    Ok(calm.filter(|_| !is_worth).unwrap_or(swinging))
}

/// From a point to the nearest place on the straight lines between the points of a path (m);
/// infinitely far without any.
fn closest(path: &[Vector3<f64>], point: &Vector3<f64>) -> Vector3<f64> {
    let from_line = |ends: &[Vector3<f64>]| {
        let (way, to) = (ends[1] - ends[0], point - ends[0]);
        let along = to.dot(&way) / way.norm_squared().max(1e-18);
        way * along.clamp(0.0, 1.0) - to
    };
    let near = |a: &Vector3<f64>, b: &Vector3<f64>| a.norm().total_cmp(&b.norm());
    let nearest = path.windows(2).map(from_line).min_by(near);
    nearest.unwrap_or_else(|| Vector3::repeat(f64::INFINITY))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_approach_lies_between_the_points_of_a_path() {
        let path = [[0.0, 1.0, 0.0], [2.0, 1.0, 0.0], [2.0, 5.0, 0.0]].map(Vector3::from);
        let from = |point: [f64; 3]| closest(&path, &point.into()).norm();
        assert_eq!(from([1.0, 0.0, 0.0]), 1.0);
        assert_eq!(from([-3.0, -3.0, 0.0]), 5.0);
        assert_eq!(from([2.0, 3.0, 0.5]), 0.5);
        assert_eq!(closest(&path, &[1.0, 0.0, 0.0].into()), Vector3::y());
        assert_eq!(closest(&[], &Vector3::zeros()).norm(), f64::INFINITY);
    }
}
