//! Throws that are good for every rope it might be.

use super::finalists::Finalist;
use super::search::{Search, Valued};
use super::setup::{Count, Setup, at_start};
use super::{PlanError, RopeAtStart, ThrowOutcome};
use arm_model::kinematics::link_poses;
use arm_model::{JOINTS, JointTrajectory, JointVector};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use rope_sim::{ClosestApproach, Precision};
use shared_types::ErrorForecast;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Fraction of the ropes whose errors a robust plan looks at once more: the worst fifth.
const WORST_FRACTION: f64 = 0.2;
/// Weight of their mean beside the mean of all.
const WORST_WEIGHT: f64 = 3.0;
/// Spread of the first generation, relative to that of the search from scratch.
const SPREAD: f64 = 0.3;
const POPULATION: usize = 16;
const GENERATIONS: usize = 20;
/// Throws of each rope of a forecast that pass beside their simulated path.
const DRAWS_PER_ROPE: usize = 16;
/// How well it is known how far beside: deviation of the size's logarithm. Tuned in another
/// reality (`experiments full-pipeline`, odd seeds).
const SCALE_LOG_STD: f64 = 0.3;
/// Finalists of the plain searches whose risk is compared to choose where to begin.
const COMPARED: usize = 12;

/// Mean, and mean of the worst fifth (conditional value at risk) with its weight.
fn risk(mut values: Vec<f64>) -> f64 {
    values.sort_by(|a, b| b.total_cmp(a));
    let worst = (WORST_FRACTION * values.len() as f64).ceil() as usize;
    let mean = |v: &[f64]| {
        let count = v.len().max(1) as f64;
        v.iter().sum::<f64>() / count
    };
    mean(&values) + WORST_WEIGHT * mean(&values[..worst.min(values.len())])
}

impl Setup<'_> {
    /// The throw with the least risk over the ropes of the ensemble: the best of the
    /// finalists, or what a search around it finds if that is better.
    pub(super) fn robust(
        &self,
        finalists: Vec<Finalist>,
        count: &mut Count,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Option<Finalist>, PlanError> {
        let ropes = self.request.ensemble.optimised.len();
        let compared: Vec<Finalist> = finalists.into_iter().take(COMPARED).collect();
        let trajectories: Vec<_> = compared.iter().map(|f| f.trajectory).collect();
        let risks = self.risks(&trajectories)?;
        count.add(trajectories.len() * ropes);
        let best = compared.into_iter().zip(risks);
        let best = best.min_by(|(_, a), (_, b)| a.fitness.total_cmp(&b.fitness));
        let Some((around, risk_around)) = best else {
            return Ok(None);
        };
        let search = Search {
            start: &around.x,
            spread: SPREAD,
            population: POPULATION,
            generations: GENERATIONS,
            seed: self.request.options.seed ^ 0x0b57,
            stop_below_m: None,
            stop_success_fraction: None,
            keep: 1,
        };
        let (found, spent) = self.explore(&search, |t| self.risks(t), progress)?;
        count.add(ropes * spent.simulations as usize);
        count.interrupted |= spent.interrupted;
        let Some(best) = self.finalists(found, count)?.into_iter().next() else {
            return Ok(Some(around));
        };
        // The search draws around its start, which is polished and may stay the best.
        let risks = self.risks(&[best.trajectory])?;
        count.add(ropes);
        let is_better = risks.iter().all(|r| r.fitness < risk_around.fitness);
        Ok(Some(if is_better { best } else { around }))
    }

    /// Risk of each throw over the ropes of the ensemble.
    pub(super) fn risks(&self, trajectories: &[JointTrajectory]) -> Result<Vec<Valued>, PlanError> {
        let ropes = &self.request.ensemble.optimised;
        let states = self.led_to(ropes)?;
        let throws: Vec<_> = trajectories
            .iter()
            .flat_map(|t| at_start(ropes, &states).map(move |rope| (rope, t)))
            .collect();
        let outcomes = self.simulator.run(&throws)?;
        let of_throw = |(t, outcomes): (_, &[ThrowOutcome])| {
            let each = |(rope, o): (_, &ThrowOutcome)| self.fitness(rope, t, &self.widened(t, o));
            let errors = outcomes.iter().map(|o| self.task.error_m(o));
            Valued {
                fitness: risk(ropes.iter().zip(outcomes).map(each).collect()),
                error_m: risk(errors.collect()) / (1.0 + WORST_WEIGHT),
                success: false,
            }
        };
        let all = trajectories.iter().zip(outcomes.chunks(ropes.len().max(1)));
        Ok(all.map(of_throw).collect())
    }

    /// The outcome of a strike that is to be robust, as far from the target as is to be expected with
    /// this rope: zeros of the joints, and what the model leaves out, let the tip pass beside its
    /// simulated path. Any other outcome as it is.
    pub(super) fn widened(
        &self,
        trajectory: &JointTrajectory,
        outcome: &ThrowOutcome,
    ) -> ThrowOutcome {
        let ensemble = &self.request.ensemble;
        if ensemble.optimised.is_empty() || !self.task.polishes() {
            return outcome.clone();
        }
        let mut square_m2 = 2.0 * ensemble.discrepancy_m.powi(2);
        for joint in 0..JOINTS {
            let mut zeros = JointVector::splat(0.0);
            zeros[joint] = ensemble.joint_zero_std_rad;
            let beside = across(outcome, displaced_m(trajectory, &zeros, outcome));
            square_m2 += beside.norm_squared();
        }
        // The mean of the square of a size that is known to so much.
        square_m2 *= (2.0 * SCALE_LOG_STD.powi(2)).exp();
        ThrowOutcome {
            closest_m: outcome.closest_m.hypot(square_m2.sqrt()),
            ..outcome.clone()
        }
    }

    /// The error to expect of a throw over the ropes of the forecast.
    pub(super) fn forecast(
        &self,
        trajectory: &JointTrajectory,
    ) -> Result<Option<ErrorForecast>, PlanError> {
        let ensemble = &self.request.ensemble;
        let states = self.may_lead_to(&ensemble.forecast, Precision::F32)?;
        // One that diverged on the way counts as one that cannot be thrown.
        let known = |i: usize| states.get(i).is_none_or(Option::is_some);
        let ropes = ensemble.forecast.iter().enumerate();
        let ropes = ropes
            .filter(|(i, _)| known(*i))
            .map(|(i, rope)| RopeAtStart {
                rope,
                state: states.get(i).and_then(Option::as_ref),
            });
        let throws: Vec<_> = ropes.map(|rope| (rope, trajectory)).collect();
        let outcomes = if throws.is_empty() {
            Vec::new()
        } else {
            self.judging.run(&throws)?
        };
        let mut rng = ChaCha12Rng::seed_from_u64(self.request.options.seed ^ 0xd15c);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let mut errors = Vec::with_capacity(DRAWS_PER_ROPE * outcomes.len());
        for outcome in outcomes.iter().filter(|o| o.finite) {
            for _ in 0..DRAWS_PER_ROPE {
                let scale = (SCALE_LOG_STD * normal()).exp();
                let unexplained = ensemble.discrepancy_m * Vector3::from_fn(|_, _| normal());
                let zeros = JointVector(core::array::from_fn(|_| {
                    ensemble.joint_zero_std_rad * normal()
                }));
                let beside = unexplained + displaced_m(trajectory, &zeros, outcome);
                errors.push(self.error_beside_m(outcome, scale * beside));
            }
        }
        errors.retain(|e| e.is_finite());
        let drawn = ensemble.forecast.len() + ensemble.undrawn as usize;
        let failed = drawn - errors.len() / DRAWS_PER_ROPE;
        Ok(error_forecast(
            errors,
            [drawn, failed],
            self.request.rope.length_m,
        ))
    }
}

impl Setup<'_> {
    /// Error of a throw whose tip passes `beside` its simulated path (m).
    fn error_beside_m(&self, outcome: &ThrowOutcome, beside: Vector3<f64>) -> f64 {
        let closest = outcome.watched.to_point;
        let Some(closest) = closest.filter(|_| self.task.polishes()) else {
            return self.task.error_m(outcome).hypot(beside.norm());
        };
        let miss = Vector3::from(closest.tip_m) - Vector3::from(outcome.point_m);
        (miss + across(outcome, beside)).norm()
    }
}

/// The part of a displacement (m) that is across the tip's path at its closest: along it the tip
/// is early or late, and nothing else.
fn across(outcome: &ThrowOutcome, beside: Vector3<f64>) -> Vector3<f64> {
    let velocity = outcome.watched.to_point.map(|c| c.velocity_m_s);
    let velocity = Vector3::from(velocity.unwrap_or_default());
    beside - velocity * (beside.dot(&velocity) / velocity.norm_squared().max(1e-12))
}

/// How far joint zeros that are off by `zeros` (rad) put the tip, at its closest, elsewhere (m).
fn displaced_m(
    trajectory: &JointTrajectory,
    zeros: &JointVector,
    outcome: &ThrowOutcome,
) -> Vector3<f64> {
    let displaced = |closest: ClosestApproach| {
        let q = trajectory.state_at(closest.time_s).q;
        moved_by_zeros(&q, zeros, closest.tip_m.into())
    };
    outcome.watched.to_point.map(displaced).unwrap_or_default()
}

/// The same of a tip that moves with the flange, to first order.
fn moved_by_zeros(q: &JointVector, zeros: &JointVector, tip_m: Vector3<f64>) -> Vector3<f64> {
    let links = link_poses(q);
    let moved = |(zero, (origin_m, attitude)): (&f64, &(Vector3<f64>, Matrix3<f64>))| {
        // Each joint turns about its frame's z axis.
        attitude.column(2).cross(&(tip_m - origin_m)) * *zero
    };
    zeros.0.iter().zip(&links).map(moved).sum()
}

/// The forecast from equally many errors of each rope that was simulated, of so many drawn and
/// so many of them failed. These are misses, not nothing: as far off as the worst, and as the
/// rope is long.
fn error_forecast(
    mut errors_m: Vec<f64>,
    [drawn, failed]: [usize; 2],
    length_m: f64,
) -> Option<ErrorForecast> {
    let worst_m = errors_m.iter().copied().fold(length_m, f64::max);
    let of_each = errors_m.len() / (drawn - failed).max(1);
    errors_m.extend(core::iter::repeat_n(worst_m, failed * of_each.max(1)));
    if errors_m.is_empty() {
        return None;
    }
    errors_m.sort_by(f64::total_cmp);
    let at = |part: f64| errors_m[(part * (errors_m.len() - 1) as f64).round() as usize];
    Some(ErrorForecast {
        ropes: u32::try_from(drawn).unwrap_or(u32::MAX),
        failed: u32::try_from(failed).unwrap_or(u32::MAX),
        mean_m: errors_m.iter().sum::<f64>() / errors_m.len() as f64,
        median_m: at(0.5),
        interval_90_m: [at(0.05), at(0.95)],
    })
}

#[cfg(test)]
mod tests {
    use super::{error_forecast, moved_by_zeros, risk};
    use arm_model::JointVector;
    use arm_model::kinematics::flange_pose;
    use nalgebra::Vector3;

    /// Against the poses of an arm whose zeros are off, the tip being fixed to its flange.
    #[test]
    fn zeros_move_the_tip_as_the_arm_moves_it() {
        let q = JointVector([0.3, -0.5, 0.2, 0.9, -0.4, 1.1, 0.6]);
        let (origin_m, attitude) = flange_pose(&q);
        let tip_m = Vector3::new(0.9, 0.4, 0.2);
        let held_m = attitude.transpose() * (tip_m - origin_m);
        for joint in 0..q.0.len() {
            let mut zeros = JointVector::splat(0.0);
            zeros[joint] = 1e-6;
            let (origin_m, attitude) = flange_pose(&(q + zeros));
            let moved_m = origin_m + attitude * held_m - tip_m;
            let found_m = moved_by_zeros(&q, &zeros, tip_m);
            assert!(
                (found_m - moved_m).norm() < 1e-10,
                "{joint}: {found_m} {moved_m}"
            );
        }
    }

    #[test]
    fn the_worst_fifth_counts_four_times_as_much() {
        let values = vec![1.0, 2.0, 3.0, 4.0, 10.0];
        assert!((risk(values) - (4.0 + 3.0 * 10.0)).abs() < 1e-12);
        assert!((risk(vec![2.0]) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn ropes_that_cannot_be_simulated_are_misses_in_the_forecast() {
        let errors_m = vec![0.02, 0.01, 0.03, 0.01, 0.02, 0.01, 0.02, 0.01];
        let whole = error_forecast(errors_m.clone(), [8, 0], 0.5).unwrap();
        assert_eq!((whole.ropes, whole.failed), (8, 0));
        assert_eq!(whole.interval_90_m, [0.01, 0.03]);
        let with_failures = error_forecast(errors_m, [10, 2], 0.5).unwrap();
        assert_eq!((with_failures.ropes, with_failures.failed), (10, 2));
        assert_eq!(with_failures.interval_90_m, [0.01, 0.5]);
        assert!((with_failures.mean_m - 0.113).abs() < 1e-12);
        assert_eq!(error_forecast(vec![0.7], [2, 1], 0.5).unwrap().mean_m, 0.7);
        assert_eq!(
            error_forecast(Vec::new(), [3, 3], 0.5).unwrap().median_m,
            0.5
        );
        assert_eq!(error_forecast(Vec::new(), [0, 0], 0.5), None);
    }
}
