//! An input of which every model file knows the answer.
//!
//! The trained network's outputs for it are kept in the file, and computed again when
//! the file is loaded: weights that give something else show before they are believed.

use crate::features::{FeatureDefinition, WiggleFeatures};

/// Largest difference between a file's and the trained network's outputs;
/// relative where the output is above 1.
pub const PARITY: f32 = 1e-5;

/// The test input: numbers of a wiggle's size without meaning, some frames unseen.
#[must_use]
pub fn probe(definition: FeatureDefinition) -> WiggleFeatures {
    let channels = definition.channels();
    // Whole-number arithmetic, so that it is the same everywhere.
    let number = |i: usize| f32::from((i * 7919 % 997) as u16) / 997.0 * 0.4 - 0.2;
    let mut motion: Vec<f32> = (0..definition.frames * channels).map(number).collect();
    for frame in motion.chunks_mut(channels) {
        frame[channels - 1] = 1.0;
    }
    let mut features = WiggleFeatures {
        definition,
        motion,
        widths: [0.008, 1.0, 0.03, 1.0],
        seen: definition.frames,
    };
    features.mask(definition.frames / 4..definition.frames / 3);
    features
}

/// Largest difference between two outputs, relative where they are above 1;
/// infinite if they cannot be compared.
#[must_use]
pub fn difference(expected: &[f32], found: &[f32]) -> f32 {
    if expected.len() != found.len() {
        return f32::INFINITY;
    }
    let apart = expected
        .iter()
        .zip(found)
        .map(|(a, b)| (a - b).abs() / a.abs().max(1.0));
    // NaN counts as infinitely far.
    apart
        .map(|d| if d.is_nan() { f32::INFINITY } else { d })
        .fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_test_input_is_what_it_always_was() {
        let probe = probe(FeatureDefinition::default());
        assert_eq!(probe.motion.len(), 400 * 48);
        assert_eq!(probe.seen, 400 - 33);
        assert!((probe.motion[1] - (7919 % 997) as f32 / 997.0 * 0.4 + 0.2).abs() < 1e-6);
        assert!(probe.motion[100 * 48..133 * 48].iter().all(|x| *x == 0.0));
    }

    #[test]
    fn differences_are_relative_for_large_numbers_and_never_nan() {
        assert!((difference(&[0.5, 100.0], &[0.5, 101.0]) - 0.01).abs() < 1e-6);
        assert!((difference(&[0.5, 0.2], &[0.5, 0.3]) - 0.1).abs() < 1e-6);
        assert_eq!(difference(&[0.5], &[f32::NAN]), f32::INFINITY);
        assert_eq!(difference(&[0.5], &[]), f32::INFINITY);
    }
}
