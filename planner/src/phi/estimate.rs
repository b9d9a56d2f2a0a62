//! The network's answer as an estimate like any other method's.

use super::net::{PhiNet, PredictError, Prediction};
use crate::observation::ObserveError;
use crate::sysid::{Compared, IdentifyError, IdentifyOptions, Observation, compare};
use shared_types::rope::{
    Ambiguity, FitCircumstances, KeypointNoise, LINK_COUNTS, Novelty, RANGES, ROPE_PARAMETERS,
    RopePosterior,
};
use shared_types::{RopeEstimate, RopeParams};

/// Half width of a central 90 % interval of a Gaussian, in its deviations.
const NINETY: f64 = 1.645;
/// Part of the prior's deviation above which a parameter was not seen.
const UNSEEN_PART: f64 = 0.7;
/// Distance to the film of the simulated rope above which the network is not believed
/// (px): twice the largest tracking error.
const DISTANCE_MAX_PX: f64 = 6.0;
const DAMPING: usize = 2;
const STIFFNESS: usize = 3;
const MASS_PER_LENGTH: usize = 5;
const LEAD_MASS: usize = 6;

/// Why the network identified no rope.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// The film is none that the network can judge.
    #[error(transparent)]
    Observe(#[from] ObserveError),
    /// The network gave no answer.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// The observation or an option cannot be used.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

impl NetworkError {
    /// Whether another film or other options would help.
    #[must_use]
    pub fn is_input(&self) -> bool {
        match self {
            Self::Observe(_) => true,
            Self::Predict(_) => false,
            Self::Identify(error) => !matches!(error, IdentifyError::Simulate(_)),
        }
    }
}

/// What the network says of the rope in an observation; its answer is simulated once, to
/// say how well it fits the film.
///
/// # Errors
/// See [`NetworkError`].
pub fn identify_by_network(
    net: &PhiNet,
    observation: &Observation<'_>,
    options: &IdentifyOptions,
) -> Result<RopeEstimate, NetworkError> {
    let prediction = net.look(observation)?;
    let limit = net.metadata().oddity_limit;
    estimate(&prediction, limit, observation, options)
}

fn estimate(
    prediction: &Prediction,
    oddity_limit: f64,
    observation: &Observation<'_>,
    options: &IdentifyOptions,
) -> Result<RopeEstimate, NetworkError> {
    let (mean, mut std_dev) = weighed(prediction, options.lead_mass_kg);
    if options.lead_mass_kg.is_some() {
        std_dev[LEAD_MASS] = 0.0;
    }
    let params = RopeParams::from_array(mean);
    let fit = compare(observation, options, &params)?;
    let mut covariance = [[0.0; ROPE_PARAMETERS]; ROPE_PARAMETERS];
    for i in 0..ROPE_PARAMETERS {
        covariance[i][i] = std_dev[i] * std_dev[i];
    }
    let prior_std = |i: usize| (RANGES[i].max - RANGES[i].min) / 12.0_f64.sqrt();
    let seen = |i: usize| std_dev[i] < UNSEEN_PART * prior_std(i);
    Ok(RopeEstimate {
        params,
        std_dev: core::array::from_fn(|i| seen(i).then_some(std_dev[i])),
        residual_px: fit.distance_px,
        method: "network".try_into().unwrap_or_default(),
        simulations: 1,
        seed: options.seed,
        time_offset_s: fit.time_offset_s,
        posterior: RopePosterior {
            mean,
            covariance,
            interval_90: core::array::from_fn(|i| interval(i, mean[i], std_dev[i])),
            links_probability: links_probability(mean[0], std_dev[0]),
            ambiguities: (0..ROPE_PARAMETERS)
                .filter(|i| !seen(*i))
                .map(|i| Ambiguity {
                    direction: core::array::from_fn(|k| f64::from(u8::from(k == i))),
                    kept: std_dev[i] / prior_std(i),
                })
                .collect(),
            inflation: 1.0,
        },
        circumstances: nothing_fitted(),
        novelty: novelty(prediction.oddity / oddity_limit, &fit),
    })
}

/// Parameters and deviations, scaled to a weighed lead: the film tells ratios of
/// stiffness, damping and masses only.
fn weighed(
    prediction: &Prediction,
    lead_mass_kg: Option<f64>,
) -> ([f64; ROPE_PARAMETERS], [f64; ROPE_PARAMETERS]) {
    let (mut mean, mut std_dev) = (prediction.parameters, prediction.std_dev);
    if let Some(lead_mass_kg) = lead_mass_kg {
        let factor = lead_mass_kg / mean[LEAD_MASS];
        for i in [DAMPING, STIFFNESS, MASS_PER_LENGTH, LEAD_MASS] {
            mean[i] *= factor;
            std_dev[i] *= factor;
        }
    }
    (mean, std_dev)
}

/// The Gaussian's interval, inside the range where the parameter is.
fn interval(i: usize, mean: f64, std_dev: f64) -> [f64; 2] {
    let low = (mean - NINETY * std_dev).max(RANGES[i].min.min(mean));
    let high = (mean + NINETY * std_dev).min(RANGES[i].max.max(mean));
    [low, high]
}

/// Probability of each link count of the ranges.
fn links_probability(mean: f64, std_dev: f64) -> [f64; LINK_COUNTS] {
    let mut links = RANGES[0].min - 1.0;
    let weights: [f64; LINK_COUNTS] = core::array::from_fn(|_| {
        links += 1.0;
        (-0.5 * ((links - mean) / std_dev.max(0.1)).powi(2)).exp()
    });
    let total: f64 = weights.iter().sum();
    weights.map(|w| w / total)
}

/// Oddity in parts of its limit, and a rope that misses the film.
fn novelty(oddity: f64, fit: &Compared) -> Novelty {
    let distance = fit.distance_px / DISTANCE_MAX_PX;
    let mut reasons = Vec::new();
    if oddity >= 1.0 {
        reasons.push("the film is unlike those of the known ropes".to_owned());
    }
    if distance >= 1.0 {
        reasons.push(format!(
            "the simulated rope misses the keypoints by {:.1} px",
            fit.distance_px
        ));
    }
    Novelty {
        score: oddity.max(distance),
        limit: 1.0,
        reasons,
    }
}

/// The network fits neither noise nor camera.
fn nothing_fitted() -> FitCircumstances {
    let noise = KeypointNoise {
        sigma_px: 0.0,
        in_time: 0.0,
        along_rope: 0.0,
    };
    FitCircumstances {
        noise_along: noise,
        noise_across: noise,
        camera_position_m: [0.0; 3],
        camera_rotation_rad: [0.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prediction() -> Prediction {
        Prediction {
            parameters: [23.0, 0.55, 0.02, 0.4, 0.008, 0.06, 0.05, 0.03, 0.9],
            std_dev: [1.9, 0.006, 0.005, 0.1, 0.001, 0.012, 0.012, 0.001, 0.2],
            oddity: 1.0,
        }
    }

    #[test]
    fn a_weighed_lead_scales_what_shares_its_factor_and_nothing_else() {
        let (mean, std_dev) = weighed(&prediction(), Some(0.1));
        let plain = prediction();
        for i in 0..ROPE_PARAMETERS {
            let factor = if [2, 3, 5, 6].contains(&i) { 2.0 } else { 1.0 };
            assert!(
                (mean[i] / plain.parameters[i] - factor).abs() < 1e-12,
                "{i}"
            );
            assert!(
                (std_dev[i] / plain.std_dev[i] - factor).abs() < 1e-12,
                "{i}"
            );
        }
    }

    #[test]
    fn intervals_end_at_the_ranges_and_link_counts_add_up() {
        assert_eq!(interval(1, 0.64, 0.02)[1], 0.65);
        // Outside its range, a parameter still lies in its own interval.
        let [low, high] = interval(5, 0.3, 0.01);
        assert!(low < 0.3 && high >= 0.3);
        let probability = links_probability(23.2, 1.0);
        assert!((probability.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let most = probability.iter().copied().fold(0.0, f64::max);
        assert_eq!(probability[3], most);
    }

    #[test]
    fn an_odd_film_or_a_rope_that_misses_it_is_outside() {
        let fit = |distance_px| Compared {
            distance_px,
            time_offset_s: 0.0,
        };
        assert!(!novelty(0.8, &fit(2.0)).is_outside());
        assert!(novelty(1.1, &fit(2.0)).is_outside());
        assert!(novelty(0.8, &fit(9.0)).reasons[0].contains("9.0 px"));
    }
}
