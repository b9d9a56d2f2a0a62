//! Features shifted and scaled to mean 0 and deviation 1.
//!
//! A keypoint's height, say, is half a metre with a deviation of centimetres; the
//! motion is in the deviation. The written network contains these numbers, so that
//! its input is in metres and radians.

use planner::observation::{WIDTHS, WiggleFeatures};
use serde::{Deserialize, Serialize};

/// Mean and scale of every channel and width.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standard {
    /// Mean of each channel over the frames that were seen.
    pub mean: Vec<f32>,
    /// One over the deviation of each channel.
    pub scale: Vec<f32>,
    /// Mean of rope and lead half width (m).
    pub width_mean: [f32; 2],
    /// One over their deviation (1/m).
    pub width_scale: [f32; 2],
}

impl Standard {
    /// Measures films.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "single precision is plenty for means and deviations"
    )]
    pub fn measure(films: &[WiggleFeatures]) -> Self {
        let channels = films.first().map_or(1, |f| f.definition.channels());
        let seen = |f: &WiggleFeatures| -> Vec<Vec<f32>> {
            let frames = f.motion.chunks(channels);
            frames
                .filter(|c| c[channels - 1] > 0.0)
                .map(<[f32]>::to_vec)
                .collect()
        };
        let frames: Vec<Vec<f32>> = films.iter().flat_map(seen).collect();
        let (mut mean, mut scale): (Vec<f32>, Vec<f32>) = (0..channels)
            .map(|c| moments(frames.iter().map(|f| f64::from(f[c]))))
            .map(|(mean, deviation)| (mean as f32, (1.0 / deviation.max(1e-3)) as f32))
            .unzip();
        // The mark of a seen frame stays what it is.
        mean[channels - 1] = 0.0;
        scale[channels - 1] = 1.0;
        let width = |i: usize| {
            let known = films.iter().filter(|f| f.widths[2 * i + 1] > 0.0);
            let (mean, deviation) = moments(known.map(|f| f64::from(f.widths[2 * i])));
            (mean as f32, (1.0 / deviation.max(1e-4)) as f32)
        };
        let (rope, lead) = (width(0), width(1));
        Self {
            mean,
            scale,
            width_mean: [rope.0, lead.0],
            width_scale: [rope.1, lead.1],
        }
    }

    /// Standardises the motion; frames not seen stay 0.
    pub fn motion(&self, motion: &mut [f32]) {
        let channels = self.mean.len();
        for frame in motion.chunks_mut(channels) {
            let mask = frame[channels - 1];
            let numbers = self.mean.iter().zip(&self.scale);
            for (x, (mean, scale)) in frame.iter_mut().zip(numbers) {
                *x = (*x - mean) * scale * mask;
            }
        }
    }

    /// Standardises the widths; those not seen stay 0.
    #[must_use]
    pub fn widths(&self, widths: [f32; WIDTHS]) -> [f32; WIDTHS] {
        let value = |i: usize| {
            let (width, seen) = (widths[2 * i], widths[2 * i + 1]);
            width * self.width_scale[i] - self.width_mean[i] * self.width_scale[i] * seen
        };
        [value(0), widths[1], value(1), widths[3]]
    }
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
    use planner::observation::FeatureDefinition;

    #[test]
    fn seen_frames_get_mean_0_and_deviation_1_and_others_stay_0() {
        let definition = FeatureDefinition {
            frames: 100,
            keypoints: 2,
            ..FeatureDefinition::default()
        };
        let film = |shift: f32| {
            let frame = |i: u16| {
                let x = f32::from(i);
                let seen = f32::from(u8::from(i >= 20));
                [x, x * 0.5 + shift, 3.0 - x, 0.1 * x, 7.0 * x, 1.0].map(|v| v * seen)
            };
            WiggleFeatures {
                definition,
                motion: (0..100).flat_map(frame).collect(),
                widths: [0.01 + shift, 1.0, 0.0, 0.0],
                seen: 80,
            }
        };
        let films = [film(0.0), film(0.02)];
        let standard = Standard::measure(&films);
        let mut motion = films[0].motion.clone();
        standard.motion(&mut motion);
        assert!(motion[..20 * 6].iter().all(|x| *x == 0.0));
        let seen: Vec<f32> = motion[20 * 6..].chunks(6).map(|f| f[2]).collect();
        let mean = seen.iter().sum::<f32>() / 80.0;
        let square = seen.iter().map(|x| x * x).sum::<f32>() / 80.0;
        assert!(mean.abs() < 1e-3 && (square - 1.0).abs() < 1e-3);
        assert_eq!(motion[20 * 6 + 5], 1.0);
        let widths = standard.widths(films[0].widths);
        assert!((widths[0] + 1.0).abs() < 1e-3, "{widths:?}");
        assert_eq!(widths[1..], [1.0, 0.0, 0.0]);
        assert_eq!(standard.widths([0.0; 4]), [0.0; 4]);
    }
}
