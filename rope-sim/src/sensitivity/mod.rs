//! Slopes of rollouts with respect to ropes and motions.
//!
//! One-sided finite differences with every neighbour in a lane: bases and neighbours of
//! one call are one batch, so that lanes are full. A base and its neighbours always take
//! the same steps; otherwise the time-discretisation error would not cancel and the
//! slopes would be wrong by its size over the step of the difference.

mod family;

pub use family::{Family, Perturbation, SensitivityError};

use crate::batch::{REPEAT_DIVISOR, roll_out};
use crate::error::SimulateError;
use crate::rollout::{Candidate, Outcome, Rollout, SimOptions, check};
use family::{Member, common_step_s};

/// Largest difference between the times of two closest approaches for them to be the
/// same one (s); beyond it a neighbour passes the target on another part of its way.
const SAME_APPROACH_S: f64 = 0.01;

/// A simulated neighbour of a base.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbour {
    /// Its rollout.
    pub rollout: Rollout,
    /// Its distance from the base.
    pub distance: f64,
    /// Whether neither it nor the base blew up: their difference is a slope.
    pub valid: bool,
}

/// A base with its neighbours, all simulated in the same steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The base itself. [`Outcome::RerunAtQuarterStep`] means that it or a neighbour
    /// blew up at first, and that all of them took steps of a quarter.
    pub base: Rollout,
    /// Its neighbours, in the order of [`Family::perturbations`].
    pub neighbours: Vec<Neighbour>,
}

/// Slopes around one base; see [`sensitivities`].
///
/// # Errors
/// See [`SensitivityError`].
pub fn sensitivity(family: &Family, options: &SimOptions) -> Result<Sensitivity, SensitivityError> {
    let mut all = sensitivities(core::slice::from_ref(family), options)?;
    all.pop()
        .ok_or_else(|| SimulateError::worker_panicked().into())
}

/// Simulates every base with its neighbours, as one batch; results in the order of
/// `families`. A family in which anything blows up is repeated as a whole in steps of a
/// quarter. Results do not depend on the other families or on the number of threads,
/// except that motions with moved acceleration jumps may shorten everybody's steps a
/// little.
///
/// # Errors
/// The first option, base or neighbour that cannot be simulated.
pub fn sensitivities(
    families: &[Family],
    options: &SimOptions,
) -> Result<Vec<Sensitivity>, SensitivityError> {
    let bases: Vec<Candidate> = families.iter().map(|f| f.base).collect();
    check(&bases, options)?;
    let mut members = Vec::new();
    for (index, family) in families.iter().enumerate() {
        members.extend(family.members(index)?);
    }
    let everyone: Vec<&Member> = members.iter().collect();
    let mut rollouts = simulate(&everyone, &members, options)?;
    let mut blew_up = vec![false; families.len()];
    for (member, rollout) in members.iter().zip(&rollouts) {
        blew_up[member.family] |= rollout.outcome != Outcome::Clean;
    }
    let quarter = SimOptions {
        step_s: options.step_s / REPEAT_DIVISOR,
        ..*options
    };
    let again = || {
        members
            .iter()
            .enumerate()
            .filter(|(_, m)| blew_up[m.family])
    };
    let repeated: Vec<&Member> = again().map(|(_, member)| member).collect();
    if !repeated.is_empty() {
        for ((at, _), rollout) in again().zip(simulate(&repeated, &members, &quarter)?) {
            rollouts[at] = rollout;
        }
    }
    let mut all: Vec<Sensitivity> = Vec::with_capacity(families.len());
    for (member, rollout) in members.iter().zip(rollouts) {
        match (member.neighbour, all.last_mut()) {
            (Some((_, distance)), Some(of)) => of.neighbours.push(Neighbour {
                distance,
                valid: [&of.base, &rollout]
                    .iter()
                    .all(|r| r.outcome == Outcome::Clean),
                rollout,
            }),
            _ => all.push(Sensitivity {
                base: rollout,
                neighbours: Vec::new(),
            }),
        }
    }
    for (sensitivity, repeated) in all.iter_mut().zip(blew_up) {
        if repeated {
            sensitivity.mark_repeated();
        }
    }
    Ok(all)
}

/// Simulates some of the members in steps of at most [`SimOptions::step_s`] with which all
/// of them step like their bases.
fn simulate(
    some: &[&Member<'_>],
    all: &[Member<'_>],
    options: &SimOptions,
) -> Result<Vec<Rollout>, SensitivityError> {
    let options = SimOptions {
        step_s: common_step_s(all, options.step_s, options.horizon_s)?,
        ..*options
    };
    let candidates: Vec<Candidate> = some.iter().map(|member| member.candidate).collect();
    roll_out(&candidates, &options).map_err(|error| {
        match error.candidate.and_then(|at| some.get(at)) {
            Some(member) => member.blame(error),
            None => SensitivityError::Base(error),
        }
    })
}

impl Sensitivity {
    /// Slopes of anything that can be read off a rollout, one row per neighbour, or
    /// `None` there if it is not valid. `observe` must give equally many numbers for each
    /// rollout.
    #[must_use]
    pub fn slopes(&self, observe: impl Fn(&Rollout) -> Vec<f64>) -> Vec<Option<Vec<f64>>> {
        let base = observe(&self.base);
        let slope = |n: &Neighbour| {
            let to = observe(&n.rollout);
            let pairs = to.iter().zip(&base);
            pairs.map(|(b, a)| (b - a) / n.distance).collect()
        };
        self.neighbours
            .iter()
            .map(|n| n.valid.then(|| slope(n)))
            .collect()
    }

    /// Slope towards one neighbour of the lead's place at its closest approach to
    /// [`crate::Watch::point_m`] (m per unit); `None` if it was not watched, the neighbour
    /// is not valid, or it comes closest at quite another time, so that there is no slope.
    #[must_use]
    pub fn closest_tip_m(&self, neighbour: usize) -> Option<[f64; 3]> {
        let to = self.neighbours.get(neighbour).filter(|n| n.valid)?;
        let (b, a) = (to.rollout.watched.to_point?, self.base.watched.to_point?);
        ((b.time_s - a.time_s).abs() < SAME_APPROACH_S)
            .then(|| core::array::from_fn(|i| (b.tip_m[i] - a.tip_m[i]) / to.distance))
    }

    /// Notes that everything took steps of a quarter.
    fn mark_repeated(&mut self) {
        let beside = self.neighbours.iter_mut().map(|n| &mut n.rollout);
        for rollout in core::iter::once(&mut self.base).chain(beside) {
            if rollout.outcome == Outcome::Clean {
                rollout.outcome = Outcome::RerunAtQuarterStep;
            }
        }
    }
}
