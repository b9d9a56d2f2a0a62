//! Patterns on a rope's surface.

use super::colour::{Ycc, mix};

/// What a surface shows along and around itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Weave {
    /// One colour.
    Plain,
    /// Rings of another colour.
    Rings { other: Ycc, period_m: f32 },
    /// Two strands of another colour that cross.
    Braid { other: Ycc, pitch_m: f32 },
    /// Strands laid side by side, turning around the axis.
    Twist { other: Ycc, pitch_m: f32 },
}

impl Weave {
    /// Colour at a place along the surface (m), `across` from -1 to 1 as it is seen.
    pub(crate) fn at(self, own: Ycc, arc_m: f32, across: f32) -> Ycc {
        let around = across.clamp(-1.0, 1.0).asin() / core::f32::consts::PI;
        let strand = |turns: f32| (turns.rem_euclid(1.0) - 0.5).abs() * 2.0;
        match self {
            Self::Plain => own,
            Self::Rings { other, period_m } => {
                let here = (arc_m / period_m).rem_euclid(1.0) < 0.4;
                if here { other } else { own }
            }
            Self::Braid { other, pitch_m } => {
                let place = arc_m / pitch_m;
                let crossing = strand(place + around).max(strand(place - around));
                mix(own, other, ((crossing - 0.6) * 5.0).clamp(0.0, 1.0))
            }
            Self::Twist { other, pitch_m } => {
                let groove = strand(arc_m / pitch_m + 0.7 * around);
                mix(own, other, ((groove - 0.5) * 3.0).clamp(0.0, 1.0))
            }
        }
    }
}
