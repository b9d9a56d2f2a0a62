//! How well keypoints follow a rope whose place in every frame is known.

use experiments::trials::quantile;
use serde::{Deserialize, Serialize};
use shared_types::KeypointTrack;

/// Bounds within which a film is followed.
const MEDIAN_PX: f64 = 0.6;
const P95_PX: f64 = 2.5;
const TIP_P95_PX: f64 = 3.0;
const LOST_PART: f64 = 0.02;
/// A node this far off in which the tracker trusts is wrong (px, confidence).
const WRONG_PX: f64 = 10.0;
const TRUSTED: f64 = 0.5;
/// Frames with such a node that make a film wrong.
const WRONG_FRAMES: usize = 5;

/// Classes of confidence, and how near to the curve a keypoint of full confidence lies (px).
pub(super) const CONFIDENCES: usize = 10;
const NEAR_PX: f64 = 3.0;

/// Errors of one film.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Score {
    /// Distance of keypoints from the true curve (px).
    pub(super) median_px: f64,
    pub(super) p95_px: f64,
    pub(super) max_px: f64,
    /// Distance of the last keypoint from the centre of the tip weight (px).
    pub(super) tip_p95_px: f64,
    pub(super) frames: usize,
    pub(super) lost: usize,
    /// Frames with a trusted node far off.
    pub(super) wrong: usize,
    /// Keypoints of each class of confidence, and how many of them lie near the curve.
    pub(super) reliability: [[u64; 2]; CONFIDENCES],
}

impl Score {
    /// Scores keypoints against the true curve of each frame; `None` where the rope is
    /// lost in all of them.
    pub(super) fn of(track: &KeypointTrack, truth_px: &[Vec<[f64; 2]>]) -> Option<Self> {
        let (mut errors, mut tips, mut lost, mut wrong) = (Vec::new(), Vec::new(), 0, 0);
        let mut reliability = [[0; 2]; CONFIDENCES];
        for (frame, truth) in track.frames.iter().zip(truth_px) {
            if frame.lost {
                lost += 1;
                continue;
            }
            let off: Vec<f64> = frame.points.iter().map(|p| from_curve(*p, truth)).collect();
            let mut pairs = off.iter().zip(&frame.confidence);
            for (e, trust) in pairs.clone() {
                let class = ((trust * CONFIDENCES as f64) as usize).min(CONFIDENCES - 1);
                reliability[class][0] += 1;
                reliability[class][1] += u64::from(*e <= NEAR_PX);
            }
            wrong += usize::from(pairs.any(|(e, trust)| *e > WRONG_PX && *trust > TRUSTED));
            if let (Some(found), Some(tip)) = (frame.points.last(), truth.last()) {
                tips.push((found[0] - tip[0]).hypot(found[1] - tip[1]));
            }
            errors.extend(off);
        }
        (!errors.is_empty()).then(|| Self {
            median_px: quantile(errors.iter().copied(), 0.5),
            p95_px: quantile(errors.iter().copied(), 0.95),
            max_px: errors.iter().copied().fold(0.0, f64::max),
            tip_p95_px: quantile(tips, 0.95),
            frames: truth_px.len(),
            lost,
            wrong,
            reliability,
        })
    }

    /// Whether the rope was followed.
    pub(super) fn follows(&self) -> bool {
        self.median_px <= MEDIAN_PX
            && self.p95_px <= P95_PX
            && self.tip_p95_px <= TIP_P95_PX
            && self.lost as f64 <= LOST_PART * self.frames as f64
            && self.wrong == 0
    }

    /// Whether the tracker was sure of what is not so.
    pub(super) fn misleads(&self) -> bool {
        self.wrong >= WRONG_FRAMES
    }
}

/// Distance of a point from a curve of straight pieces (px).
fn from_curve([u, v]: [f64; 2], curve: &[[f64; 2]]) -> f64 {
    let pieces = curve.windows(2).map(|ends| {
        let [[au, av], [bu, bv]] = [ends[0], ends[1]];
        let (du, dv) = (bu - au, bv - av);
        let along = ((u - au) * du + (v - av) * dv) / (du * du + dv * dv).max(1e-9);
        let along = along.clamp(0.0, 1.0);
        (u - au - along * du).hypot(v - av - along * dv)
    });
    pieces.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::keypoints::TrackedFrame;

    /// A rope that hangs straight down, and keypoints beside it.
    fn scored(aside_px: f64, confidence: f64, lost: usize) -> Option<Score> {
        let truth: Vec<_> = (0..5).map(|i| [100.0, 20.0 * f64::from(i)]).collect();
        let frame = |i: usize| TrackedFrame {
            t_s: 0.1 * i as f64,
            points: truth.iter().map(|[u, v]| [u + aside_px, *v]).collect(),
            confidence: vec![confidence; 5],
            lost: i < lost,
        };
        let track = KeypointTrack {
            keypoints: 5,
            frames: (0..100).map(frame).collect(),
            unconfirmed: Vec::new(),
        };
        Score::of(&track, &vec![truth.clone(); 100])
    }

    #[test]
    fn keypoints_are_judged_by_their_distance_from_the_curve() {
        let scored = |a, c, l| scored(a, c, l).unwrap();
        let near = scored(0.5, 0.9, 0);
        assert!((near.median_px - 0.5).abs() < 1e-12 && (near.tip_p95_px - 0.5).abs() < 1e-12);
        assert!(near.follows() && !near.misleads());
        assert!(!scored(0.7, 0.9, 0).follows());
        assert!(scored(0.5, 0.9, 2).follows() && !scored(0.5, 0.9, 3).follows());
    }

    #[test]
    fn only_trusted_keypoints_mislead() {
        let scored = |a, c, l| scored(a, c, l).unwrap();
        assert!(scored(11.0, 0.9, 0).misleads());
        assert!(!scored(11.0, 0.4, 0).misleads());
        assert!(!scored(11.0, 0.9, 96).misleads());
    }

    #[test]
    fn nothing_found_has_no_score() {
        assert_eq!(scored(0.0, 1.0, 100), None);
    }
}
