//! From the fit's coordinates to the nine parameters: what film, ranges and a weighed
//! lead say together.
//!
//! The fit is Gaussian in its coordinates; the ranges are a box in the parameters, and
//! the common factor of stiffness, damping and masses has no coordinate at all. So
//! ropes are drawn from the fit, weighed by the ranges, and given a factor drawn from
//! its own density (see [`super::scale`]). Moments and quantiles are those of the
//! drawn ropes.

use super::centre::{Centre, Vector};
use super::coordinates::{LINKS, Square, extras_of, link_range, parameter};
use super::film::Film;
use super::refine::Refined;
use super::reliance::absorbed_m;
use super::scale;
use crate::observation::Appearance;
use nalgebra::SMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;
use shared_types::RopeParams;
use shared_types::rope::{Ambiguity, LINK_COUNTS, RANGES, ROPE_PARAMETERS, RopePosterior};

/// Ropes drawn.
const DRAWS: usize = 4096;
/// Effective draws below which no rope of the ranges fits.
const EFFECTIVE_MIN: f64 = 40.0;
/// Error of taking the film for linear in the link count (1).
const LINKS_STD: f64 = 0.5;
/// Probability of an interval.
const NINE_TENTHS: f64 = 0.9;
/// Fraction of the prior's deviation above which a direction was not seen.
pub(super) const UNSEEN_FRACTION: f64 = 0.7;

/// One drawn rope.
struct Draw {
    values: [f64; ROPE_PARAMETERS],
    coordinates: Vector,
    /// Where the fit is likeliest with its link count.
    centre: Vector,
    /// Whether it could be a rope at all.
    is_possible: bool,
    weight: f64,
}

/// The parameters' posterior with its likeliest rope, from ropes drawn from a fit.
pub(super) fn posterior(fit: &Refined, film: &Film<'_>) -> (RopeParams, RopePosterior) {
    let centre = Centre::of(fit, film);
    let mut draws = draw(fit, &centre, film);
    let total: f64 = draws.iter().map(|d| d.weight).sum();
    let squares: f64 = draws.iter().map(|d| d.weight * d.weight).sum();
    let within_ranges = total > 0.0 && total * total / squares >= EFFECTIVE_MIN;
    if !within_ranges {
        // The ranges are no part of what is known about a rope outside them.
        for d in &mut draws {
            d.weight = f64::from(u8::from(d.is_possible));
        }
    }
    let total: f64 = draws.iter().map(|d| d.weight).sum();
    for d in &mut draws {
        d.weight /= total;
    }
    let posterior = summarise(&draws, fit, film);
    let params = likeliest(
        &draws,
        &posterior,
        film.options.lead_mass_kg,
        (&centre, fit),
    );
    (params, posterior)
}

/// Probability of each link count of the ranges where they are normally distributed.
fn count_probabilities(mean: f64, variance: f64) -> [f64; LINK_COUNTS] {
    let (low, _) = link_range();
    let mut count = f64::from(low) - 1.0;
    let logs: [f64; LINK_COUNTS] = core::array::from_fn(|_| {
        count += 1.0;
        -(count - mean).powi(2) / (2.0 * variance)
    });
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights = logs.map(|l| (l - top).exp());
    let total: f64 = weights.iter().sum();
    weights.map(|w| w / total)
}

fn draw(fit: &Refined, centre: &Centre, film: &Film<'_>) -> Vec<Draw> {
    use parameter as p;
    let (appearance, pixel_m) = (film.observation.appearance, film.viewer.pixel_m());
    let mut rng = ChaCha12Rng::seed_from_u64(film.options.seed ^ 0x9057_e210);
    let root = centre.root(fit.inflation);
    let (low, _) = link_range();
    // The variance of the count from the fit alone.
    let variance = |of: &Square| of[(LINKS, LINKS)];
    let counts_variance =
        variance(&fit.covariance) * fit.inflation + variance(&fit.lasting) + LINKS_STD.powi(2);
    let counts = count_probabilities(fit.x[LINKS], counts_variance);
    let uniform = |rng: &mut ChaCha12Rng, i: usize| rng.random_range(RANGES[i].min..=RANGES[i].max);
    (0..DRAWS)
        .map(|_| {
            let mut at = rng.random_range(0.0..1.0);
            let mut links = f64::from(low);
            for probability in &counts[..LINK_COUNTS - 1] {
                if at < *probability {
                    break;
                }
                at -= probability;
                links += 1.0;
            }
            let normal = Vector::from_fn(|_, _| rng.sample(StandardNormal));
            let centre = centre.given(links);
            let x = centre + root * normal;
            let s = x[0].max(1e-3) / links;
            let ratios = [x[1].exp() / s, x[2].exp() / s, x[3].exp()];
            let drawn = scale::draw(
                film.options.lead_mass_kg,
                ratios,
                rng.random_range(0.0..1.0),
            );
            let mu = drawn.mass_per_length;
            let radius_m = match appearance.rope_radius_m {
                Some(seen) => {
                    let std_dev = Appearance::std_dev_m(seen, pixel_m);
                    seen + std_dev * rng.sample::<f64, _>(StandardNormal)
                }
                None => uniform(&mut rng, p::RADIUS),
            };
            let values = [
                links,
                x[0],
                ratios[1] * mu,
                ratios[0] * mu,
                radius_m.max(1e-4),
                mu,
                ratios[2] * mu,
                x[4],
                uniform(&mut rng, p::EXTRA_SCALE),
            ];
            let inside = |i: usize| values[i] >= RANGES[i].min && values[i] <= RANGES[i].max;
            let inside = [p::LENGTH, p::RADIUS, p::LEAD_RADIUS]
                .into_iter()
                .all(inside);
            Draw {
                values,
                coordinates: x,
                centre,
                is_possible: RopeParams::from_array(values).validate().is_ok(),
                weight: if inside { drawn.density } else { 0.0 },
            }
        })
        .collect()
}

fn links_of(draws: &[Draw]) -> [f64; LINK_COUNTS] {
    let (low, _) = link_range();
    let mut out = [0.0; LINK_COUNTS];
    for d in draws {
        let index = (d.values[0] - f64::from(low)).round() as usize;
        out[index.min(LINK_COUNTS - 1)] += d.weight;
    }
    out
}

/// Weighted quantiles of one parameter.
fn quantiles<const N: usize>(
    draws: &[Draw],
    value: impl Fn(&Draw) -> f64,
    at: [f64; N],
) -> [f64; N] {
    let mut sorted: Vec<(f64, f64)> = draws
        .iter()
        .filter(|d| d.weight > 0.0)
        .map(|d| (value(d), d.weight))
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    at.map(|part| {
        let mut sum = 0.0;
        for (value, weight) in &sorted {
            sum += weight;
            if sum >= part {
                return *value;
            }
        }
        sorted.last().map_or(f64::NAN, |s| s.0)
    })
}

fn summarise(draws: &[Draw], fit: &Refined, film: &Film<'_>) -> RopePosterior {
    let mut mean = [0.0; ROPE_PARAMETERS];
    for d in draws {
        for (m, v) in mean.iter_mut().zip(d.values) {
            *m += d.weight * v;
        }
    }
    let mut covariance = [[0.0; ROPE_PARAMETERS]; ROPE_PARAMETERS];
    for d in draws {
        for i in 0..ROPE_PARAMETERS {
            for j in 0..ROPE_PARAMETERS {
                covariance[i][j] += d.weight * (d.values[i] - mean[i]) * (d.values[j] - mean[j]);
            }
        }
    }
    let mut interval_90 = core::array::from_fn(|i| quantiles(draws, |d| d.values[i], [0.05, 0.95]));
    let links_probability = links_of(draws);
    interval_90[parameter::LINKS] = count_interval(&links_probability);
    RopePosterior {
        mean,
        covariance,
        interval_90,
        links_probability,
        ambiguities: ambiguities(&covariance),
        inflation: fit.inflation,
        residual_m: fit.at.distance_px * film.viewer.pixel_m(),
        absorbed_m: absorbed_m(fit, film),
    }
}

/// First and last of the likeliest link counts whose probability is as close to nine
/// tenths as whole counts allow: with one count more it would be farther off, above or
/// below. The fewest counts with nine tenths or more would hold the truth too often.
fn count_interval(probability: &[f64; LINK_COUNTS]) -> [f64; 2] {
    let (mut first, mut sum) = (0, 0.0);
    for (i, p) in probability.iter().enumerate() {
        if *p > sum {
            (first, sum) = (i, *p);
        }
    }
    let mut last = first;
    loop {
        let below = first.checked_sub(1).map_or(-1.0, |i| probability[i]);
        let above = probability.get(last + 1).copied().unwrap_or(-1.0);
        let next = below.max(above);
        if next < 0.0 || (sum + next - NINE_TENTHS).abs() >= (sum - NINE_TENTHS).abs() {
            break;
        }
        sum += next;
        if above >= below {
            last += 1;
        } else {
            first -= 1;
        }
    }
    let (low, _) = link_range();
    [first, last].map(|i| f64::from(low) + i as f64)
}

/// Deviation of the ranges as a prior.
pub(super) fn prior_std(i: usize) -> f64 {
    (RANGES[i].max - RANGES[i].min) / 12.0_f64.sqrt()
}

/// Directions, in prior deviations, along which the film left most of the prior.
fn ambiguities(covariance: &[[f64; ROPE_PARAMETERS]; ROPE_PARAMETERS]) -> Vec<Ambiguity> {
    let scaled = SMatrix::<f64, ROPE_PARAMETERS, ROPE_PARAMETERS>::from_fn(|i, j| {
        covariance[i][j] / (prior_std(i) * prior_std(j))
    });
    let eigen = scaled.symmetric_eigen();
    let mut out: Vec<Ambiguity> = (0..ROPE_PARAMETERS)
        .map(|k| Ambiguity {
            direction: core::array::from_fn(|i| eigen.eigenvectors[(i, k)]),
            kept: eigen.eigenvalues[k].max(0.0).sqrt(),
        })
        .filter(|a| a.kept > UNSEEN_FRACTION)
        .collect();
    out.sort_by(|a, b| b.kept.total_cmp(&a.kept));
    out
}

/// One rope whose ratios are those of the fit: means of the coordinates, medians of the
/// link count and of the common factor, and what it has beyond the nine parameters.
fn likeliest(
    draws: &[Draw],
    posterior: &RopePosterior,
    lead_mass_kg: Option<f64>,
    (centre, fit): (&Centre, &Refined),
) -> RopeParams {
    let mean = |of: fn(&Draw) -> Vector| -> Vector { draws.iter().map(|d| of(d) * d.weight).sum() };
    let x = centre.near(mean(|d| d.coordinates), mean(|d| d.centre));
    // The median, like that of the common factor: the least mean error.
    let [links] = quantiles(draws, |d| d.values[parameter::LINKS], [0.5]);
    let [median] = quantiles(draws, |d| d.values[parameter::MASS_PER_LENGTH], [0.5]);
    let mu = lead_mass_kg.map_or(median, |m| m / x[3].exp());
    let s = x[0] / links;
    let plain = RopeParams::from_array([
        links,
        x[0],
        mu * x[2].exp() / s,
        mu * x[1].exp() / s,
        posterior.mean[parameter::RADIUS],
        mu,
        mu * x[3].exp(),
        x[4],
        posterior.mean[parameter::EXTRA_SCALE],
    ]);
    let beyond = Centre::with_extras(fit, &x, links);
    RopeParams {
        extras: fit
            .at
            .is_beyond()
            .then(|| extras_of(&beyond, mu * x[1].exp()))
            .flatten(),
        ..plain
    }
}

/// One standard deviation per parameter, `None` where the film says next to nothing.
pub(super) fn std_dev(posterior: &RopePosterior) -> [Option<f64>; ROPE_PARAMETERS] {
    core::array::from_fn(|i| {
        let deviation = posterior.covariance[i][i].max(0.0).sqrt();
        (deviation < UNSEEN_FRACTION * prior_std(i)).then_some(deviation)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_of_the_count_hold_what_is_closest_to_nine_tenths() {
        let sure = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        assert_eq!(count_interval(&sure), [23.0, 23.0]);
        // Six of seven even counts are 86 %, all of them 100 %.
        let [low, high] = count_interval(&[1.0 / 7.0; LINK_COUNTS]);
        assert_eq!(high - low, 5.0);
        // 80 %, or 95 %.
        let sloping = [0.5, 0.3, 0.15, 0.05, 0.0, 0.0, 0.0];
        assert_eq!(count_interval(&sloping), [20.0, 22.0]);
        // 85 %, or 98 %.
        let steep = [0.0, 0.0, 0.01, 0.01, 0.13, 0.45, 0.4];
        assert_eq!(count_interval(&steep), [25.0, 26.0]);
        // Equal on both sides: one of them, and the middle always.
        let even = [0.02, 0.06, 0.12, 0.6, 0.12, 0.06, 0.02];
        assert_eq!(count_interval(&even)[0], 22.0);
    }
}
