//! Whether a track may be relied on.

use super::sway::Before;
use shared_types::keypoints::TrackedFrame;

/// Confidence below which a keypoint is unconfirmed.
pub(super) const UNCONFIRMED: f64 = 0.5;
/// Part of a film's keypoints that may be unconfirmed.
const MAX_UNCONFIRMED: f64 = 0.25;
/// How far the tip weight must stand out from what surrounds it, in the middle frame.
const MIN_TIP: f64 = 0.25;
/// Part of the rope that the second image must show where the first one says.
const MIN_CONFIRMED: f64 = 0.8;
/// Amplitude of a swing before the wiggle: the ropes that are compared with the film hang still
/// at its beginning. Twelve ropes were followed up to 0.17 rad and lost from 0.14 on.
const MAX_SWAY_RAD: f64 = 0.1;

/// What speaks for a track, beside its keypoints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Confirmation {
    /// How far the tip weight stands out from what surrounds it: 0 not at all, 1 in full
    /// (median of the frames).
    pub(super) tip: f64,
    /// Part of the rope, over all frames looked at, that the second image shows where the
    /// first one says; `None` for a film of one eye.
    pub(super) second_image: Option<f64>,
    /// The part of the film in which the rope should hang still.
    pub(super) before: Before,
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
        let swung_rad = self.before.amplitude_rad(frames);
        if let Some(swung_rad) = swung_rad.filter(|swung_rad| *swung_rad > MAX_SWAY_RAD) {
            unconfirmed.push(format!(
                "the rope swings before the arm moves, by {:.0} degrees to either side (at most {:.0}): \
                 hold it until it hangs still, then film again",
                swung_rad.to_degrees(),
                MAX_SWAY_RAD.to_degrees()
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
        let unconfirmed = |weak: usize, tip, second_image| {
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
                before: Before {
                    until_s: 0.0,
                    length_m: 0.5,
                },
            };
            confirmation.unconfirmed(&[frame])
        };
        assert!(unconfirmed(2, 0.8, Some(0.95)).is_empty());
        assert!(unconfirmed(2, 0.8, None).is_empty());
        let named = unconfirmed(40, 0.1, Some(0.2));
        let words = [
            "40 % of the keypoints",
            "end is not confirmed",
            "20 % of the rope",
        ];
        for (reason, word) in named.iter().zip(words) {
            assert!(reason.contains(word), "{named:?}");
        }
        assert_eq!(named.len(), 3);
    }
}
