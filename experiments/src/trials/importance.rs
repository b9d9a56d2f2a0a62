//! Which identified parameters matter: strikes planned with some of them identified and
//! the others random, thrown with the true rope.

use super::strike_case::StrikeCase;
use super::thrower::Thrower;
use super::trial_rope;
use planner::plan::{PlanError, PosteriorEnsemble};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use shared_types::rope::ROPE_PARAMETERS;

/// Random parameter sets per rope and condition, as many as the paper has.
const DRAWS: usize = 10;
/// Sets drawn at most to find those: the target may be out of a random rope's reach.
const ATTEMPTS: u64 = 40;
/// Keeps the random parameters apart from the ropes thrown.
const OTHER: u64 = 0x0072_6e64_0000;

/// Position of length and lead mass in [`RopeParams::to_array`].
const LENGTH: usize = 1;
const LEAD_MASS: usize = 6;

/// What is identified, in the order of `ImportanceTrial::partly_m`; the rest is random.
const CONDITIONS: [&[usize]; 4] = [&[LENGTH, LEAD_MASS], &[LENGTH], &[LEAD_MASS], &[]];

/// One rope and target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImportanceTrial {
    /// Index of the trial under its seed.
    pub index: u64,
    /// Target (m).
    pub target_m: [f64; 3],
    /// Error with all parameters identified (m).
    pub identified_m: f64,
    /// Errors with length and lead mass identified, with length, with lead mass, with
    /// none; by draw (m).
    pub partly_m: [Vec<f64>; CONDITIONS.len()],
}

/// Some parameters of one rope in another.
fn mixed(found: &RopeParams, identified: &[usize], other: &RopeParams) -> RopeParams {
    let (found, mut values): ([f64; ROPE_PARAMETERS], _) = (found.to_array(), other.to_array());
    for at in identified {
        values[*at] = found[*at];
    }
    RopeParams::from_array(values)
}

/// Errors of throws planned with random parameters besides the identified ones.
fn errors_with(
    thrower: &Thrower,
    found: &RopeParams,
    identified: &[usize],
    seed: u64,
) -> Result<Vec<f64>, PlanError> {
    let mut errors_m = Vec::with_capacity(DRAWS);
    for attempt in 0..ATTEMPTS {
        let rope = mixed(found, identified, &trial_rope(seed ^ OTHER, attempt));
        match thrower.plan(&rope, 1, PosteriorEnsemble::default()) {
            Err(PlanError::OnlyCollisions { .. } | PlanError::Unreachable { .. }) => {}
            planned => errors_m.push(thrower.throw(&planned?)?.error_m),
        }
        if errors_m.len() == DRAWS {
            break;
        }
    }
    Ok(errors_m)
}

impl ImportanceTrial {
    /// Plans and throws.
    ///
    /// # Errors
    /// What planning refuses.
    pub fn of(case: &StrikeCase) -> Result<Self, PlanError> {
        let (thrower, found) = (&case.thrower, &case.found.params);
        let whole = thrower.plan(found, 1, PosteriorEnsemble::default())?;
        let mut partly_m = [const { Vec::new() }; CONDITIONS.len()];
        for (errors_m, identified) in partly_m.iter_mut().zip(CONDITIONS) {
            let seed = case.seed.wrapping_add(case.index);
            *errors_m = errors_with(thrower, found, identified, seed)?;
        }
        Ok(Self {
            index: case.index,
            target_m: case.target_m,
            identified_m: thrower.throw(&whole)?.error_m,
            partly_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixed_rope_has_the_identified_length_and_lead_and_nothing_else() {
        let (found, other) = (trial_rope(1, 1), trial_rope(1, 2));
        let rope = mixed(&found, CONDITIONS[0], &other);
        let expected = RopeParams {
            length_m: found.length_m,
            lead_mass_kg: found.lead_mass_kg,
            ..other
        };
        assert_eq!(rope, expected);
        assert_eq!(mixed(&found, CONDITIONS[3], &other), other);
    }
}
