//! Rope keypoints: pixels along the rope's centreline, frame by frame.

use crate::MonotonicNs;
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Most keypoints of one frame.
pub const MAX_KEYPOINTS: usize = 32;

/// Keypoints of one frame as published in shared memory. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[repr(C)]
pub struct KeypointFrame {
    /// Sequence number of the camera frame.
    pub sequence: u64,
    /// Start of exposure of row 0 (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Number of keypoints used.
    pub count: u32,
    /// 1 when the rope was lost in this frame.
    pub lost: u32,
    /// Raw left-eye pixels `[u, v]`, clamp first, lead centre last.
    pub points_px: [[f32; 2]; MAX_KEYPOINTS],
    /// Confidence of each point, 0 to 1.
    pub confidence: [f32; MAX_KEYPOINTS],
}

impl KeypointFrame {
    /// What the tracker found in the camera frame of this number and stamp (CLOCK_MONOTONIC
    /// ns); of more than [`MAX_KEYPOINTS`] the first ones.
    #[must_use]
    pub fn new(sequence: u64, stamp_ns: u64, tracked: &TrackedFrame) -> Self {
        let mut out = Self {
            sequence,
            stamp_ns,
            lost: u32::from(tracked.lost),
            ..Self::default()
        };
        let slots = out.points_px.iter_mut().zip(&mut out.confidence);
        for ((slot, confidence), (p, c)) in
            slots.zip(tracked.points.iter().zip(&tracked.confidence))
        {
            *slot = p.map(|v| v as f32);
            *confidence = *c as f32;
            out.count += 1;
        }
        out
    }

    /// Whether the rope was lost in this frame. RT-safe.
    #[must_use]
    pub const fn is_lost(&self) -> bool {
        self.lost != 0
    }

    /// The keypoints, as many as are used, never more than there can be. RT-safe.
    #[must_use]
    pub fn points(&self) -> &[[f32; 2]] {
        &self.points_px[..self.used()]
    }

    /// Their confidences. RT-safe.
    #[must_use]
    pub fn confidences(&self) -> &[f32] {
        &self.confidence[..self.used()]
    }

    fn used(&self) -> usize {
        usize::try_from(self.count).map_or(MAX_KEYPOINTS, |count| count.min(MAX_KEYPOINTS))
    }

    /// The same in a recording whose time 0 is `first_stamp_ns`.
    fn tracked(&self, first_stamp_ns: u64) -> TrackedFrame {
        TrackedFrame {
            t_s: MonotonicNs(self.stamp_ns).since_s(MonotonicNs(first_stamp_ns)),
            points: self.points().iter().map(|p| p.map(f64::from)).collect(),
            confidence: self.confidences().iter().copied().map(f64::from).collect(),
            lost: self.is_lost(),
        }
    }
}

/// One frame of a [`KeypointTrack`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackedFrame {
    /// Start of exposure of row 0 relative to the first frame's (s).
    pub t_s: f64,
    /// Raw left-eye pixels `[u, v]`, uniform in arc length, clamp first.
    pub points: Vec<[f64; 2]>,
    /// Confidence of each point, 0 to 1.
    pub confidence: Vec<f64>,
    /// Whether the rope was lost in this frame.
    pub lost: bool,
}

/// Keypoints of a whole recording. JSON form: `keypoints.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeypointTrack {
    /// Keypoints per frame.
    pub keypoints: usize,
    /// The frames in order of time.
    pub frames: Vec<TrackedFrame>,
    /// Why the track should not be relied on; none where it may be.
    #[serde(default, alias = "doubts", skip_serializing_if = "Vec::is_empty")]
    pub unconfirmed: Vec<String>,
}

/// Why a keypoint track is refused: what is wrong, and in which frame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("keypoints: {0}")]
pub struct KeypointError(String);

impl KeypointTrack {
    /// The track of published frames, time 0 at the first one; `None` without frames.
    pub fn from_published<'a>(frames: impl IntoIterator<Item = &'a KeypointFrame>) -> Option<Self> {
        let mut frames = frames.into_iter().peekable();
        let (first_stamp_ns, keypoints) = frames.peek().map(|f| (f.stamp_ns, f.used()))?;
        Some(Self {
            keypoints,
            frames: frames.map(|f| f.tracked(first_stamp_ns)).collect(),
            unconfirmed: Vec::new(),
        })
    }

    /// Checks sizes, numbers and order of time; the error is about the first frame that
    /// breaks a rule.
    pub fn validate(&self) -> Result<(), KeypointError> {
        let refused = |what: String| Err(KeypointError(what));
        let (expected, frames) = (self.keypoints, self.frames.len());
        for (what, found) in [("keypoints", expected), ("frames", frames)] {
            if found < 2 {
                return refused(format!("{what} is {found}, but at least 2 are needed"));
            }
        }
        let mut before = f64::NEG_INFINITY;
        for (frame, f) in self.frames.iter().enumerate() {
            for found in [f.points.len(), f.confidence.len()] {
                if found != expected {
                    return refused(format!(
                        "frame {frame} has {found} points or confidences, `keypoints` is {expected}"
                    ));
                }
            }
            let finite = f
                .points
                .iter()
                .flatten()
                .chain(&f.confidence)
                .all(|v| v.is_finite());
            if !finite || !f.t_s.is_finite() || f.t_s <= before {
                return refused(format!(
                    "frame {frame} has a number that is not finite, or its `t_s` does not increase"
                ));
            }
            before = f.t_s;
        }
        Ok(())
    }

    /// Part of the frames in which the rope was lost (0 to 1).
    #[must_use]
    pub fn lost_fraction(&self) -> f64 {
        let lost = self.frames.iter().filter(|f| f.lost).count();
        lost as f64 / self.frames.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track() -> KeypointTrack {
        let frame = |t_s| TrackedFrame {
            t_s,
            points: vec![[1.0, 2.0]; 3],
            confidence: vec![1.0; 3],
            lost: false,
        };
        KeypointTrack {
            keypoints: 3,
            frames: vec![frame(0.0), frame(0.5)],
            unconfirmed: Vec::new(),
        }
    }

    #[test]
    fn rules_are_checked() {
        assert_eq!(track().validate(), Ok(()));
        let refused = |spoil: fn(&mut KeypointTrack)| {
            let mut spoilt = track();
            spoil(&mut spoilt);
            spoilt.validate().unwrap_err().to_string()
        };
        let said = refused(|t| t.frames[1].points.truncate(2));
        assert!(said.contains("frame 1 has 2 points"), "{said}");
        let said = refused(|t| t.frames[1].t_s = 0.0);
        assert!(said.contains("frame 1 has a number"), "{said}");
        let said = refused(|t| t.frames[0].points[0][1] = f64::NAN);
        assert!(said.contains("frame 0 has a number"), "{said}");
        let said = refused(|t| t.frames.truncate(1));
        assert!(said.contains("frames is 1"), "{said}");
    }

    #[test]
    fn a_track_that_was_published_comes_back() {
        let published: Vec<KeypointFrame> = (0..)
            .zip(&track().frames)
            .map(|(i, f)| KeypointFrame::new(i, 7_000_000_000 + i * 500_000_000, f))
            .collect();
        assert_eq!(KeypointTrack::from_published(&published), Some(track()));
        assert_eq!(KeypointTrack::from_published([]), None);
    }

    #[test]
    fn a_count_beyond_the_points_there_are_is_cut() {
        let damaged = KeypointFrame {
            count: u32::MAX,
            ..KeypointFrame::default()
        };
        assert_eq!(damaged.points().len(), MAX_KEYPOINTS);
        assert_eq!(damaged.confidences().len(), MAX_KEYPOINTS);
    }

    #[test]
    fn json_form_is_the_contract() {
        let json = serde_json::to_value(track()).unwrap();
        assert_eq!(json["keypoints"], 3);
        assert_eq!(json["frames"][1]["t_s"], 0.5);
        assert_eq!(
            json["frames"][1]["points"][2],
            serde_json::json!([1.0, 2.0])
        );
        assert_eq!(json["frames"][1]["lost"], false);
    }
}
