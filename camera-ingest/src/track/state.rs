//! What is known of the rope in one frame.

use super::curve::{norm, sub};
use super::follow::mean;
use super::plane::Point;

/// Confidence of what is in doubt, at most.
const DOUBTFUL: f64 = 0.5;

/// The rope in one frame.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) t_s: f64,
    /// Uniform in arc length, clamp first, lead centre last (m).
    pub(super) curve: Vec<Point>,
    /// Velocity of the nodes (m/s).
    pub(super) velocity: Vec<Point>,
    /// Coverage found at each node, 0 to 1.
    pub(super) confidence: Vec<f64>,
    pub(super) lost: bool,
    /// A good part of it is covered by something, or leaves the picture.
    pub(super) hidden: bool,
    /// Something that looks like the rope or its lead is so near that one may
    /// have been taken for the other.
    pub(super) ambiguous: bool,
}

impl State {
    /// Mean coverage along the curve.
    pub(super) fn score(&self) -> f64 {
        mean(&self.confidence)
    }

    /// A rope at rest, all of it seen.
    pub(super) fn resting(t_s: f64, curve: Vec<Point>) -> Self {
        Self {
            t_s,
            velocity: vec![[0.0; 2]; curve.len()],
            confidence: vec![1.0; curve.len()],
            curve,
            lost: false,
            hidden: false,
            ambiguous: false,
        }
    }

    /// Seen in all its length, and nothing like it near.
    pub(super) fn is_clear(&self) -> bool {
        !self.lost && !self.hidden && !self.ambiguous
    }

    /// Nobody knows whether it is the rope.
    pub(super) fn distrust(&mut self) {
        for confidence in &mut self.confidence {
            *confidence = confidence.min(DOUBTFUL);
        }
    }

    /// Whether every node is within a distance of the other's.
    pub(super) fn near(&self, other: &Self, limit_m: f64) -> bool {
        let mut nodes = self.curve.iter().zip(&other.curve);
        nodes.all(|(a, b)| norm(sub(*a, *b)) < limit_m)
    }
}
