//! Whether a track may be relied on.

use shared_types::keypoints::TrackedFrame;

/// Confidence below which a keypoint is unconfirmed.
pub(super) const UNCONFIRMED: f64 = 0.5;
/// Part of a film's keypoints that may be unconfirmed.
const MAX_UNCONFIRMED: f64 = 0.25;
/// How far the tip weight must stand out from what surrounds it, in the middle frame.
const MIN_TIP: f64 = 0.25;
/// Part of the rope that the second image must show where the first one says.
const MIN_CONFIRMED: f64 = 0.8;
/// Swing before the wiggle, as a part of the rope's length: the ropes that are compared with
/// the film hang still at its beginning. Twelve ropes were followed up to 0.24, and lost from
/// there on.
const MAX_SWAY: f64 = 0.15;

/// What speaks for a track, beside its keypoints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Confirmation {
    /// How far the tip weight stands out from what surrounds it: 0 not at all, 1 in full
    /// (median of the frames).
    pub(super) tip: f64,
    /// Part of the rope, over all frames looked at, that the second image shows where the
    /// first one says; `None` for a film of one eye.
    pub(super) second_image: Option<f64>,
    /// How far the rope swings before the clamp moves, to and fro, as a part of its length;
    /// `None` where too little was filmed before.
    pub(super) sway: Option<f64>,
}

impl Confirmation {
    /// Why these keypoints should not be relied on; empty where they may be.
    pub(super) fn unconfirmed(&self, frames: &[TrackedFrame]) -> Vec<String> {
        let all = frames.iter().flat_map(|f| &f.confidence);
        let weak = all.clone().filter(|c| **c < UNCONFIRMED).count() as f64;
        let weak = weak / all.count().max(1) as f64;
        let percent = |part: f64| (100.0 * part).round();
        let mut unconfirmed = Vec::new();
        if weak > MAX_UNCONFIRMED {
            unconfirmed.push(format!(
                "{} % of the keypoints have little evidence (at most {} % may)",
                percent(weak),
                percent(MAX_UNCONFIRMED)
            ));
        }
        if self.tip < MIN_TIP {
            unconfirmed.push(format!(
                "the rope's end is not confirmed: its tip weight stands out by {:.2} from what \
                 surrounds it (at least {MIN_TIP})",
                self.tip
            ));
        }
        if let Some(part) = self.second_image.filter(|part| *part < MIN_CONFIRMED) {
            unconfirmed.push(format!(
                "the second image shows {} % of the rope where the first one says (at least {} %)",
                percent(part),
                percent(MIN_CONFIRMED)
            ));
        }
        if let Some(part) = self.sway.filter(|part| *part > MAX_SWAY) {
            unconfirmed.push(format!(
                "the rope swings before the arm moves, by {} % of its length to and fro (at most \
                 {} %): hold it until it hangs still, then film again",
                percent(part),
                percent(MAX_SWAY)
            ));
        }
        unconfirmed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_is_named() {
        let unconfirmed = |weak: usize, tip, second_image, sway| {
            let mut confidence = vec![0.9; 100];
            confidence[..weak].fill(0.4);
            let frame = TrackedFrame {
                t_s: 0.0,
                points: vec![[0.0; 2]; 100],
                confidence,
                lost: false,
            };
            let confirmation = Confirmation {
                tip,
                second_image,
                sway,
            };
            confirmation.unconfirmed(&[frame])
        };
        assert!(unconfirmed(2, 0.8, Some(0.95), Some(0.01)).is_empty());
        assert!(unconfirmed(2, 0.8, None, None).is_empty());
        let named = unconfirmed(40, 0.1, Some(0.2), Some(0.3));
        let words = [
            "40 % of the keypoints",
            "end is not confirmed",
            "20 % of the rope",
            "swings before the arm moves, by 30 %",
        ];
        for (reason, word) in named.iter().zip(words) {
            assert!(reason.contains(word), "{named:?}");
        }
        assert_eq!(named.len(), 4);
    }
}
