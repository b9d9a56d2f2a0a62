//! A move that damps the rope's swing.
//!
//! A throw is planned for a rope at rest, but after the wiggle a weakly damped
//! rope swings for tens of seconds. Once the rope is identified its motion is
//! known: it is simulated from the moment it hung still, through the measured
//! joints, into a rest-to-rest move of the arm. Small offsets on the knots of
//! that move are chosen by least squares so that the rope hangs still at its
//! end: command shaping for zero residual vibration, with the identified
//! nonlinear model in the place of a list of frequencies.

mod descent;
mod request;
mod residual;
mod shape;
#[cfg(test)]
mod tests;

pub use request::{SettleConfig, SettleError, SettleMove, SettleRequest};

use crate::history::Prelude;
use arm_model::JointTrajectory;
use descent::LeastResidual;
use residual::{Residual, ResidualSimulator};
use shape::MoveShape;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Fractions of the offsets found that are tried, largest first: where limits or
/// surroundings forbid the whole, a smaller one still takes out that much of the
/// vibration.
const FRACTIONS: [f64; 5] = [0.8, 0.6, 0.4, 0.2, 0.0];

/// Plans a move from `start_q` to `end_q` after which the rope hangs still.
/// Deterministic, whatever the threads. `progress` can end it.
///
/// # Errors
/// See [`SettleError`].
pub fn settle(
    request: &SettleRequest,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<SettleMove, SettleError> {
    let config = &request.config;
    config.check()?;
    request.rope.validate()?;
    let prelude = Prelude::new(&request.before, &request.cell)?;
    let mut best = Err(SettleError::NoDuration);
    for duration_s in &config.durations_s {
        match settle_within(request, &prelude, *duration_s, progress) {
            Ok(found) => {
                let least_m = best
                    .as_ref()
                    .map_or(f64::INFINITY, |b: &SettleMove| b.residual_m);
                if found.residual_m < least_m {
                    best = Ok(found);
                }
            }
            Err(error @ (SettleError::BreaksLimit(_) | SettleError::TooClose(_))) => {
                best = best.or(Err(error));
            }
            Err(error) => return Err(error),
        }
        let small_m = config.residual_max_m;
        if best.as_ref().is_ok_and(|b| b.residual_m <= small_m) {
            break;
        }
    }
    best
}

/// The move of one duration that leaves the least residual vibration.
fn settle_within(
    request: &SettleRequest,
    prelude: &Prelude,
    duration_s: f64,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<SettleMove, SettleError> {
    let config = &request.config;
    let shape = MoveShape::new(
        request.before.start_q,
        request.end_q,
        duration_s,
        config.knot_s,
    );
    let plain = shape.trajectory(&shape.no_offsets())?;
    if let Some(margin) = request.limits.worst_violation(&plain) {
        return Err(SettleError::BreaksLimit(margin.describe()));
    }
    let simulator = ResidualSimulator::new(&request.rope, prelude, &plain, config.threads)?;
    let found = descent::least_residual(&shape, &simulator, config, progress)?;
    choose(request, &shape, &simulator, found)
}

/// The move with all offsets if limits and surroundings allow it, otherwise the
/// best of those with a fraction of them.
fn choose(
    request: &SettleRequest,
    shape: &MoveShape,
    simulator: &ResidualSimulator<'_>,
    found: LeastResidual,
) -> Result<SettleMove, SettleError> {
    let plain_residual_m = found.plain_residual_m;
    let mut gap_m = f64::NAN;
    let mut allowed = |trajectory: &JointTrajectory, residual: &Residual| {
        if !residual.finite || request.limits.worst_violation(trajectory).is_some() {
            return false;
        }
        let touches;
        (gap_m, touches) = simulator.room(trajectory, residual);
        gap_m >= request.config.clearance_m && !touches
    };
    let whole = shape.trajectory(&found.offsets_rad)?;
    if allowed(&whole, &found.residual) {
        return Ok(SettleMove {
            trajectory: whole,
            plain_residual_m,
            residual_m: found.residual.largest_m,
        });
    }
    let scaled = |fraction: f64| -> Vec<f64> {
        let offsets = found.offsets_rad.iter();
        offsets.map(|offset| fraction * offset).collect()
    };
    let moves = FRACTIONS
        .into_iter()
        .map(|fraction| shape.trajectory(&scaled(fraction)))
        .collect::<Result<Vec<_>, _>>()?;
    let residuals = simulator.run(&moves)?;
    moves
        .into_iter()
        .zip(&residuals)
        .filter(|(trajectory, residual)| allowed(trajectory, residual))
        .min_by(|(_, a), (_, b)| a.largest_m.total_cmp(&b.largest_m))
        .map(|(trajectory, residual)| SettleMove {
            trajectory,
            plain_residual_m,
            residual_m: residual.largest_m,
        })
        .ok_or(SettleError::TooClose(gap_m))
}
