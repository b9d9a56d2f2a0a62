//! Whether a plan that keeps every limit is worth throwing.

use super::plausible::far_outside;
use shared_types::{Plan, Task};

/// Predicted distances of tip and target above which a plan is reported to be poor, and
/// above which it should not be thrown (m).
const MISS_WARN_M: f64 = 0.01;
const MISS_MAX_M: f64 = 0.05;

/// Upper end of a forecast above which the throw is pointed out as uncertain (m).
const FORECAST_WARN_M: f64 = 0.015;

/// What is wrong with a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shortcoming {
    /// In words, and what to do about it.
    pub message: String,
    /// Whether the throw would not do what it is for.
    pub is_severe: bool,
}

/// What is wrong with a plan: a strike that misses, or is as likely to as not for what is known
/// of the rope; another task that fails.
#[must_use]
pub fn shortcoming(plan: &Plan) -> Option<Shortcoming> {
    if plan.task == Task::Strike {
        let guess = plan.forecast.and_then(|f| guess(f.median_m));
        return guess.or_else(|| miss(plan.predicted_error_m));
    }
    let unmet = plan.verdict.conditions.iter().filter(|c| !c.met);
    let unmet: Vec<&str> = unmet.map(|c| c.name.as_str()).collect();
    (!plan.verdict.success).then(|| Shortcoming {
        message: format!(
            "the {} is predicted to fail (not met: {}); try another --seed or target",
            plan.task.name(),
            unmet.join(", ")
        ),
        is_severe: true,
    })
}

/// Most by which the swing may widen a forecast (1).
const SWING_MAX: f64 = 1.3;

/// Whether a throw out of a swing is as good as the same rope's from rest, of which the upper end
/// of the forecast is `resting_m` (m); it is asked for once, where that is in doubt. Never
/// without a forecast, or with one that reaches 5 cm.
///
/// # Errors
/// As those of what is asked for.
pub fn is_worth_swinging<E>(
    swinging: &Plan,
    resting_m: &mut Option<f64>,
    from_rest: impl FnOnce() -> Result<Plan, E>,
) -> Result<bool, E> {
    let reaches_m = swinging.reaches_m();
    if reaches_m <= FORECAST_WARN_M || reaches_m > MISS_MAX_M {
        return Ok(reaches_m <= FORECAST_WARN_M);
    }
    let resting_m = match *resting_m {
        Some(known_m) => known_m,
        None => *resting_m.insert(from_rest()?.reaches_m()),
    };
    Ok(reaches_m <= SWING_MAX * resting_m)
}

fn guess(median_m: f64) -> Option<Shortcoming> {
    (median_m > MISS_MAX_M).then(|| Shortcoming {
        message: format!(
            "the throw would be a guess (forecast {:.0} cm in the median): the film leaves open, or the model does not explain, how this rope moves; film and identify it again, or throw it all the same and correct it by its miss (`wag plan again`)",
            100.0 * median_m
        ),
        is_severe: true,
    })
}

fn miss(predicted_error_m: f64) -> Option<Shortcoming> {
    (predicted_error_m > MISS_WARN_M).then(|| Shortcoming {
        message: format!(
            "the tip is predicted to miss the target by {:.1} cm; try another --seed or a target closer to the middle of the reach",
            100.0 * predicted_error_m
        ),
        is_severe: predicted_error_m > MISS_MAX_M,
    })
}

/// Everything that a person should know before the throw.
#[must_use]
pub fn warnings(plan: &Plan) -> Vec<String> {
    let interrupted = plan
        .interrupted
        .then(|| "the search was interrupted: this is the best throw up to then".to_owned());
    let poor = shortcoming(plan).map(|s| s.message);
    let failed = plan.forecast.filter(|f| f.failed > 0).map(|f| {
        format!(
            "{} of {} ropes it might be could not be simulated: they count as misses in the forecast",
            f.failed, f.ropes
        )
    });
    let wide = plan
        .forecast
        .filter(|f| f.interval_90_m[1] > FORECAST_WARN_M);
    let wide = wide.map(|f| {
        let cause = match (plan.aim, plan.task) {
            (Some(_), _) => "so much may be left of the last miss; correct it once more",
            (None, _) if plan.start.is_some() => {
                "the short film leaves open, or the model does not explain, how this rope moves; identify it by the whole wiggle (without `--fast`), with its tip weighed (`--lead-mass`) or its length measured (`--length`)"
            }
            (None, Task::Strike) => {
                "the film leaves open, or the model does not explain, how this rope moves; identify it with its tip weighed (`wag identify --lead-mass`), its length measured (`--length`) or a gentler wiggle, or correct the throw by its miss (`wag plan again`)"
            }
            (None, Task::Lob | Task::Drape) => {
                "the film leaves open, or the model does not explain, how this rope moves; identify it with its tip weighed (`wag identify --lead-mass`), its length measured (`--length`) or a gentler wiggle"
            }
        };
        let high_cm = 100.0 * f.interval_90_m[1];
        format!("the forecast reaches up to {high_cm:.1} cm: {cause}")
    });
    let failed = failed.into_iter().chain(wide);
    let first = poor.into_iter().chain(interrupted).chain(failed);
    first.chain(far_outside(&plan.rope)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_may_widen_a_forecast_by_a_third_of_what_is_uncertain_at_rest() {
        let goal = crate::PlannerConfig::default().goal(Task::Strike, [0.95, 0.0, 0.2]);
        let rope = crate::ropes::trial_rope(9_401, 0);
        let request = crate::plan::PlanRequest::new(goal, &rope, Default::default());
        let found = crate::plan(&request, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
        let reaching = |high_m: f64| Plan {
            forecast: Some(shared_types::ErrorForecast {
                ropes: 64,
                failed: 0,
                mean_m: 0.01,
                median_m: 0.01,
                interval_90_m: [0.0, high_m],
            }),
            ..found.clone()
        };
        let is_worth = |swinging_m, resting_m| {
            let from_rest = || Ok::<_, ()>(reaching(resting_m));
            is_worth_swinging(&reaching(swinging_m), &mut None, from_rest)
        };
        assert_eq!(is_worth(0.025, 0.02), Ok(true));
        assert_eq!(is_worth(0.027, 0.02), Ok(false));
        // What is certain enough needs no comparison; what was compared is not asked for again.
        let fails = |swinging_m, mut known| {
            is_worth_swinging(&reaching(swinging_m), &mut known, || Err(()))
        };
        assert_eq!(fails(0.014, None), Ok(true));
        assert_eq!(fails(0.03, None), Err(()));
        assert_eq!(fails(0.03, Some(0.02)), Ok(false));
        assert_eq!(is_worth(0.051, 1.0), Ok(false));
        // Nothing is known of a plan without a forecast.
        assert_eq!(
            is_worth_swinging(&found, &mut None, || Ok::<_, ()>(found.clone())),
            Ok(false)
        );
    }

    #[test]
    fn a_miss_is_reported_and_a_large_one_is_severe() {
        assert_eq!(miss(0.004), None);
        let small = miss(0.03).unwrap();
        assert!(small.message.contains("3.0 cm") && !small.is_severe);
        assert!(miss(0.06).unwrap().is_severe);
        assert_eq!(guess(0.04), None);
        let guess = guess(0.2).unwrap();
        assert!(guess.message.contains("20 cm") && guess.is_severe);
    }
}
