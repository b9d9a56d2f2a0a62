//! Whether a track may be relied on.

use shared_types::keypoints::TrackedFrame;
use std::fmt;

/// Confidence below which a keypoint is in doubt.
pub(super) const DOUBT: f64 = 0.5;
/// Part of a film's keypoints that may be in doubt.
const DOUBTED_MOST: f64 = 0.25;
/// How far the tip weight must stand out from what surrounds it, in the middle frame.
const TIP_LEAST: f64 = 0.25;
/// Part of the rope that the second image must show where the first one says.
const CONFIRMED_LEAST: f64 = 0.8;

/// What speaks for a track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confirmation {
    /// Part of the keypoints of all frames that are in doubt.
    pub doubted: f64,
    /// How far the tip weight stands out from what surrounds it: 0 not at all, 1 in full
    /// (median of the frames).
    pub tip: f64,
    /// Part of the rope, over all frames looked at, that the second image shows where the
    /// first one says; `None` for a film of one eye.
    pub second_image: Option<f64>,
}

/// One reason not to rely on a track.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doubt {
    Doubted(f64),
    Tip(f64),
    SecondImage(f64),
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |part: f64| (100.0 * part).round();
        match self {
            Self::Doubted(part) => write!(
                f,
                "{} % of the keypoints are in doubt (at most {} % may be)",
                percent(*part),
                percent(DOUBTED_MOST)
            ),
            Self::Tip(tip) => write!(
                f,
                "the rope's end is not confirmed: its tip weight stands out by {tip:.2} from what \
                 surrounds it (at least {TIP_LEAST})"
            ),
            Self::SecondImage(part) => write!(
                f,
                "the second image shows {} % of the rope where the first one says (at least {} %)",
                percent(*part),
                percent(CONFIRMED_LEAST)
            ),
        }
    }
}

impl Confirmation {
    /// Why the track should not be relied on; empty where it may be.
    #[must_use]
    pub fn doubts(&self) -> Vec<String> {
        let doubted = (self.doubted > DOUBTED_MOST).then_some(Doubt::Doubted(self.doubted));
        let tip = (self.tip < TIP_LEAST).then_some(Doubt::Tip(self.tip));
        let second = self.second_image.filter(|part| *part < CONFIRMED_LEAST);
        [doubted, tip, second.map(Doubt::SecondImage)]
            .into_iter()
            .flatten()
            .map(|doubt| doubt.to_string())
            .collect()
    }
}

/// Part of all keypoints that are in doubt.
pub(super) fn doubted(frames: &[TrackedFrame]) -> f64 {
    let all = frames.iter().flat_map(|f| &f.confidence);
    let doubted = all.clone().filter(|c| **c < DOUBT).count();
    doubted as f64 / all.count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_doubt_is_named() {
        let sure = Confirmation {
            doubted: 0.02,
            tip: 0.8,
            second_image: Some(0.95),
        };
        assert!(sure.doubts().is_empty());
        let alone = Confirmation {
            second_image: None,
            ..sure
        };
        assert!(alone.doubts().is_empty());
        let wrong = Confirmation {
            doubted: 0.4,
            tip: 0.1,
            second_image: Some(0.2),
        };
        let doubts = wrong.doubts().join("; ");
        for word in [
            "40 % of the keypoints",
            "end is not confirmed",
            "20 % of the rope",
        ] {
            assert!(doubts.contains(word), "{doubts}");
        }
    }
}
