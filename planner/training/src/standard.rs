//! Features as deviations from the mean film, and the few numbers that tell most.
//!
//! Films of the same wiggle are all but the same; the rope is in the difference. So
//! each channel is taken relative to its mean over all ropes at that frame, and
//! scaled to deviation 1. Beside the motion itself the network sees its principal
//! components ([`Standard::principal`]). The written network contains these numbers,
//! so that its input is in metres and radians.

use crate::principal::{PRINCIPAL, Principal};
use planner::features::{FeatureDefinition, WIDTHS, WiggleFeatures};
use serde::{Deserialize, Serialize};

/// Mean and scale of every channel and width.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Standard {
    /// Mean of each frame's channels over the films in which it was seen.
    pub(crate) mean: Vec<f32>,
    /// One over the deviation of each channel from these means.
    pub(crate) scale: Vec<f32>,
    /// Mean of rope and lead half width (m).
    pub(crate) width_mean: [f32; 2],
    /// One over their deviation (1/m).
    pub(crate) width_scale: [f32; 2],
    /// What tells most of the motion.
    pub(crate) principal: Principal,
}

impl Standard {
    /// Measures films with all their errors, and without any.
    pub(crate) fn measure(films: &[WiggleFeatures], clean: &[WiggleFeatures]) -> Self {
        let definition = films
            .first()
            .map_or_else(Default::default, |f| f.definition);
        let channels = definition.channels();
        let mut mean = mean_film(films, &definition);
        let mut scale: Vec<f32> = (0..channels)
            .map(|channel| deviation(films, &mean, channels, channel))
            .map(|deviation| (1.0 / deviation.max(1e-3)) as f32)
            .collect();
        // The mark of a seen frame stays what it is.
        for frame in mean.chunks_mut(channels) {
            frame[channels - 1] = 0.0;
        }
        scale[channels - 1] = 1.0;
        let width = |i: usize| {
            let known = films.iter().filter(|f| f.widths[2 * i + 1] > 0.0);
            let (mean, deviation) = moments(known.map(|f| f64::from(f.widths[2 * i])));
            (mean as f32, (1.0 / deviation.max(1e-4)) as f32)
        };
        let (rope, lead) = (width(0), width(1));
        let mut standard = Self {
            mean,
            scale,
            width_mean: [rope.0, lead.0],
            width_scale: [rope.1, lead.1],
            principal: Principal::default(),
        };
        let standardised = |films: &[WiggleFeatures]| -> Vec<Vec<f32>> {
            let one = |f: &WiggleFeatures| {
                let mut motion = f.motion.clone();
                standard.motion(&mut motion);
                motion
            };
            films.iter().map(one).collect()
        };
        let (films, clean) = (standardised(films), standardised(clean));
        standard.principal = Principal::measure(&films, &clean, &standard.scale, &definition);
        standard
    }

    /// Standardises the motion; frames not seen stay 0.
    pub(crate) fn motion(&self, motion: &mut [f32]) {
        let channels = self.scale.len();
        let frames = motion.chunks_mut(channels).zip(self.mean.chunks(channels));
        for (frame, mean) in frames {
            let mask = frame[channels - 1];
            for ((x, mean), scale) in frame.iter_mut().zip(mean).zip(&self.scale) {
                *x = (*x - mean) * scale * mask;
            }
        }
    }

    /// Principal components of standardised motion.
    pub(crate) fn principal(&self, motion: &[f32]) -> [f32; PRINCIPAL] {
        self.principal.of(motion, self.scale.len())
    }

    /// Standardises the widths; those not seen stay 0.
    pub(crate) fn widths(&self, widths: [f32; WIDTHS]) -> [f32; WIDTHS] {
        let value = |i: usize| {
            let (width, seen) = (widths[2 * i], widths[2 * i + 1]);
            width * self.width_scale[i] - self.width_mean[i] * self.width_scale[i] * seen
        };
        [value(0), widths[1], value(1), widths[3]]
    }
}

/// Mean of every frame's channels over the films in which it was seen.
fn mean_film(films: &[WiggleFeatures], definition: &FeatureDefinition) -> Vec<f32> {
    let channels = definition.channels();
    let mut sums = vec![0.0_f64; definition.frames * channels];
    for film in films {
        for (sum, x) in sums.iter_mut().zip(&film.motion) {
            *sum += f64::from(*x);
        }
    }
    for frame in sums.chunks_mut(channels) {
        // The sum of the marks is the number of films in which it was seen.
        let seen = frame[channels - 1].max(1.0);
        frame.iter_mut().for_each(|sum| *sum /= seen);
    }
    sums.into_iter().map(|x| x as f32).collect()
}

/// Deviation of a channel from the mean film, over all frames seen.
fn deviation(films: &[WiggleFeatures], mean: &[f32], channels: usize, channel: usize) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for film in films {
        let frames = film.motion.chunks(channels).zip(mean.chunks(channels));
        for (frame, mean) in frames.filter(|(frame, _)| frame[channels - 1] > 0.0) {
            squares += f64::from(frame[channel] - mean[channel]).powi(2);
            count += 1.0;
        }
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

/// Mean and standard deviation; 0 and 1 of nothing.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let (mut count, mut sum) = (0.0, 0.0);
    for value in values.clone() {
        count += 1.0;
        sum += value;
    }
    if count == 0.0 {
        return (0.0, 1.0);
    }
    let mean = sum / count;
    let variance = values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seen_frames_become_deviations_from_the_mean_film_and_others_stay_0() {
        let definition = FeatureDefinition {
            frames: 100,
            keypoints: 2,
            ..FeatureDefinition::default()
        };
        let film = |shift: f32| {
            let frame = |i: u16| {
                let x = f32::from(i) * 1e-3;
                let seen = f32::from(u8::from(i >= 20));
                let values = [x, x * 0.5 + shift, 3.0 - x, 0.1 * x - shift, 7.0 * x, 1.0];
                values.map(|v| v * seen)
            };
            WiggleFeatures {
                definition,
                motion: (0..100).flat_map(frame).collect(),
                widths: [0.01 + shift, 1.0, 0.0, 0.0],
                seen: 80,
            }
        };
        let films = [film(0.0), film(0.02)];
        let standard = Standard::measure(&films, &films);
        let mut motion = films[0].motion.clone();
        standard.motion(&mut motion);
        assert!(motion[..20 * 6].iter().all(|x| *x == 0.0));
        // The two films differ in channels 1 and 3 only, by one deviation each way.
        for frame in motion[20 * 6..].chunks(6) {
            assert!((frame[1] + 1.0).abs() < 2e-3 && (frame[3] - 1.0).abs() < 2e-3);
            assert!(frame[0].abs() < 1e-3 && frame[2].abs() < 1e-3 && frame[5] == 1.0);
        }
        // One number tells the two apart.
        let found = standard.principal(&motion);
        assert!((found[0].abs() - 1.0).abs() < 0.01, "{found:?}");
        assert!(found[1..].iter().all(|x| x.abs() < 0.05), "{found:?}");
        let widths = standard.widths(films[0].widths);
        assert!((widths[0] + 1.0).abs() < 1e-3, "{widths:?}");
        assert_eq!(widths[1..], [1.0, 0.0, 0.0]);
        assert_eq!(standard.widths([0.0; 4]), [0.0; 4]);
    }
}
