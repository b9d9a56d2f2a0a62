//! Strikes planned for one identified rope compared with strikes planned for its
//! posterior, and whether the forecast holds.

use super::strike_case::StrikeCase;
use super::thrower::Strikes;
use planner::plan::{PlanError, PosteriorEnsemble};
use serde::{Deserialize, Serialize};
use shared_types::ErrorForecast;

/// Ropes that a robust plan is optimised over, and that a forecast is made with.
const OPTIMISED: usize = 16;
const FORECAST: usize = 64;
/// Searches of a plan.
const SEARCHES: usize = 3;

/// One strike and what was to be expected of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Foreseen {
    /// What it did.
    pub strike: Strikes,
    /// What the posterior of the rope let expect; `None` where no drawn rope could be
    /// simulated.
    pub forecast: Option<ErrorForecast>,
}

impl Foreseen {
    /// Whether the error lies within its forecast interval.
    #[must_use]
    pub fn is_covered(&self) -> bool {
        self.forecast.is_some_and(|f| {
            let [low, high] = f.interval_90_m;
            (low..=high).contains(&self.strike.error_m)
        })
    }
}

/// One rope and target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobustTrial {
    /// Index of the trial under its seed.
    pub index: u64,
    /// Target (m).
    pub target_m: [f64; 3],
    /// Planned with the identified parameters.
    pub plain: Foreseen,
    /// Planned with sixteen ropes of the posterior.
    pub robust: Foreseen,
}

impl RobustTrial {
    /// Plans and throws.
    ///
    /// # Errors
    /// What planning refuses.
    pub fn of(case: &StrikeCase) -> Result<Self, PlanError> {
        let (thrower, found) = (&case.thrower, &case.found);
        let foreseen = |optimised: usize| -> Result<Foreseen, PlanError> {
            let seed = thrower.options.seed;
            let drawn = PosteriorEnsemble::drawn(
                &found.params,
                &found.posterior,
                optimised,
                FORECAST,
                seed,
            );
            let planned = thrower.plan(&found.params, SEARCHES, drawn)?;
            Ok(Foreseen {
                strike: thrower.throw(&planned)?,
                forecast: planned.forecast,
            })
        };
        Ok(Self {
            index: case.index,
            target_m: case.target_m,
            plain: foreseen(0)?,
            robust: foreseen(OPTIMISED)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_covered_within_its_interval_only() {
        let of = |error_m: f64| Foreseen {
            strike: Strikes {
                error_m,
                predicted_m: 0.0,
                simulations: 1,
            },
            forecast: Some(ErrorForecast {
                ropes: 64,
                mean_m: 0.01,
                median_m: 0.01,
                interval_90_m: [0.002, 0.02],
            }),
        };
        assert!(of(0.002).is_covered() && of(0.02).is_covered());
        assert!(!of(0.0019).is_covered() && !of(0.021).is_covered());
        let blind = Foreseen {
            forecast: None,
            ..of(0.01)
        };
        assert!(!blind.is_covered());
    }
}
