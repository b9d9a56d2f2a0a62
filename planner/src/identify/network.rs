//! The network's answer: as an estimate of its own, and as the start of a fit.

use super::clock::ClockWindow;
use super::coarse::{Comparer, INVISIBLE_PX};
use super::coordinates::{CLOCK, Reach, parameter, point_of};
use super::error::IdentifyError;
use super::film::Film;
use super::options::IdentifyOptions;
use super::posterior::{UNSEEN_FRACTION, prior_std};
use crate::observation::Observation;
use crate::phi::{PhiNet, PredictError, Prediction};
use shared_types::rope::{
    Ambiguity, FitCircumstances, LINK_COUNTS, OutOfDistribution, RANGES, ROPE_PARAMETERS,
    RopePosterior,
};
use shared_types::{RopeEstimate, RopeParams};

/// Half width of a central 90 % interval of a Gaussian, in its deviations.
const NINETY: f64 = 1.645;
/// Distance to the film of the simulated rope above which the network is not believed
/// (px): twice the largest tracking error.
const DISTANCE_MAX_PX: f64 = 6.0;

/// The rope that the network proposes for a film; none if it cannot judge such a film or
/// finds it out of its distribution.
pub(super) fn proposal(
    net: &PhiNet,
    observation: &Observation<'_>,
) -> Result<Option<RopeParams>, PredictError> {
    match net.look(observation) {
        Ok(found) if found.out_of_distribution < net.metadata().out_of_distribution_limit => {
            Ok(Some(RopeParams::from_array(found.parameters)))
        }
        Ok(found) => {
            tracing::info!(
                found.out_of_distribution,
                "the film is out of the network's distribution"
            );
            Ok(None)
        }
        Err(PredictError::Observe(reason)) => {
            tracing::info!(%reason, "the network cannot judge this film");
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// What the network says of the rope in an observation; its answer is simulated once, to
/// say how well it fits the film.
pub(super) fn estimate(
    net: &PhiNet,
    observation: &Observation<'_>,
    options: &IdentifyOptions,
) -> Result<RopeEstimate, IdentifyError> {
    let prediction = net.look(observation)?;
    let score = prediction.out_of_distribution / net.metadata().out_of_distribution_limit;
    let (mean, mut std_dev) = weighed(&prediction, options.lead_mass_kg);
    if options.lead_mass_kg.is_some() {
        std_dev[parameter::LEAD_MASS] = 0.0;
    }
    let params = RopeParams::from_array(mean);
    let film = Film::new(observation, options);
    let clock = film.clock_window();
    let distance_px = distance_px(&film, clock, &params)?;
    let mut covariance = [[0.0; ROPE_PARAMETERS]; ROPE_PARAMETERS];
    for i in 0..ROPE_PARAMETERS {
        covariance[i][i] = std_dev[i] * std_dev[i];
    }
    let seen = |i: usize| std_dev[i] < UNSEEN_FRACTION * prior_std(i);
    let ambiguity = |i: usize| Ambiguity {
        direction: core::array::from_fn(|k| f64::from(u8::from(k == i))),
        kept: std_dev[i] / prior_std(i),
    };
    let unseen = (0..ROPE_PARAMETERS).filter(|i| !seen(*i));
    Ok(RopeEstimate {
        params,
        std_dev: core::array::from_fn(|i| seen(i).then_some(std_dev[i])),
        residual_px: distance_px,
        method: "network".try_into().unwrap_or_default(),
        simulations: 1,
        seed: options.seed,
        time_offset_s: clock.offset_s,
        posterior: RopePosterior {
            mean,
            covariance,
            interval_90: core::array::from_fn(|i| interval(i, mean[i], std_dev[i])),
            links_probability: links_probability(mean[0], std_dev[0]),
            ambiguities: unseen.map(ambiguity).collect(),
            inflation: 1.0,
            residual_m: distance_px * film.viewer.pixel_m(),
            absorbed_m: 0.0,
        },
        // It fits neither noise nor camera.
        circumstances: FitCircumstances::default(),
        out_of_distribution: out_of_distribution(score, distance_px),
        warnings: Vec::new(),
    })
}

/// Root mean square (Huber) distance between seen keypoints and those of a simulated rope,
/// the camera's small misplacement taken out (px).
fn distance_px(
    film: &Film<'_>,
    clock: ClockWindow,
    rope: &RopeParams,
) -> Result<f64, IdentifyError> {
    let coordinates = film.coordinates(clock, Reach::Wide);
    let mut x = point_of(rope);
    x[CLOCK] = clock.offset_s;
    let found = Comparer::new(film, &coordinates).compare(&[x])?;
    let seen = found.first().filter(|c| c.distance_px < INVISIBLE_PX);
    seen.map(|c| c.distance_px)
        .ok_or(IdentifyError::NothingVisible)
}

/// Parameters and deviations, scaled to a weighed lead: the film tells ratios of
/// stiffness, damping and masses only.
fn weighed(
    prediction: &Prediction,
    lead_mass_kg: Option<f64>,
) -> ([f64; ROPE_PARAMETERS], [f64; ROPE_PARAMETERS]) {
    let (mut mean, mut std_dev) = (prediction.parameters, prediction.std_dev);
    if let Some(lead_mass_kg) = lead_mass_kg {
        let factor = lead_mass_kg / mean[parameter::LEAD_MASS];
        for i in [
            parameter::DAMPING,
            parameter::STIFFNESS,
            parameter::MASS_PER_LENGTH,
            parameter::LEAD_MASS,
        ] {
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

/// The network's score as a fraction of its limit, and a rope that misses the film.
fn out_of_distribution(score: f64, distance_px: f64) -> OutOfDistribution {
    let distance = distance_px / DISTANCE_MAX_PX;
    let mut reasons = Vec::new();
    if score >= 1.0 {
        reasons.push("the film is unlike those of the known ropes".to_owned());
    }
    if distance >= 1.0 {
        reasons.push(format!(
            "the simulated rope misses the keypoints by {distance_px:.1} px"
        ));
    }
    OutOfDistribution {
        score: score.max(distance),
        limit: 1.0,
        reasons,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prediction() -> Prediction {
        Prediction {
            parameters: [23.0, 0.55, 0.02, 0.4, 0.008, 0.06, 0.05, 0.03, 0.9],
            std_dev: [1.9, 0.006, 0.005, 0.1, 0.001, 0.012, 0.012, 0.001, 0.2],
            out_of_distribution: 1.0,
        }
    }

    #[test]
    fn a_weighed_lead_scales_what_shares_its_factor_and_nothing_else() {
        let (mean, std_dev) = weighed(&prediction(), Some(0.1));
        let plain = prediction();
        for i in 0..ROPE_PARAMETERS {
            let factor = if [2, 3, 5, 6].contains(&i) { 2.0 } else { 1.0 };
            let factors = [mean[i] / plain.parameters[i], std_dev[i] / plain.std_dev[i]];
            assert!(factors.iter().all(|f| (f - factor).abs() < 1e-12), "{i}");
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
    fn an_unusual_film_or_a_rope_that_misses_it_is_outside() {
        assert!(!out_of_distribution(0.8, 2.0).is_flagged());
        assert!(out_of_distribution(1.1, 2.0).is_flagged());
        assert!(out_of_distribution(0.8, 9.0).reasons[0].contains("9.0 px"));
    }
}
