//! What the live preview of the rope publishes, frame by frame.

use super::PAYLOAD_VERSION;
use crate::keypoints::MAX_KEYPOINTS;
use iceoryx2::prelude::ZeroCopySend;

/// What the preview is doing. Numbers are part of the shared layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum PreviewState {
    /// No camera frame comes.
    #[default]
    NoCamera = 0,
    /// Frames come, but nobody tells where the arm is.
    NoArm = 1,
    /// The camera's frames are not of the size or form that its calibration says.
    Unfit = 2,
    /// The scene is being learnt, or the rope is looked for; it must move to be found.
    Looking = 3,
    /// The rope was found and is followed.
    Following = 4,
}

impl PreviewState {
    /// The state of a raw number from shared memory; unknown ones read as
    /// [`PreviewState::NoCamera`]. RT-safe.
    #[must_use]
    pub const fn from_raw(raw: u8) -> Self {
        match raw {
            1 => Self::NoArm,
            2 => Self::Unfit,
            3 => Self::Looking,
            4 => Self::Following,
            _ => Self::NoCamera,
        }
    }

    /// What it waits for or does, in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::NoCamera => "waits for a camera's frames",
            Self::NoArm => "waits for the arm's joints",
            Self::Unfit => "the camera's frames do not fit its calibration",
            Self::Looking => "looks for the rope, which must move to be found",
            Self::Following => "follows the rope",
        }
    }
}

/// The rope in one camera frame, as far as it was known when the frame came. While there
/// are no frames, a sign of life. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct PreviewFrame {
    /// [`PAYLOAD_VERSION`].
    pub version: u32,
    /// Raw [`PreviewState`].
    pub state: u8,
    /// 1 when the rope was lost in this frame.
    pub lost: u8,
    /// Keypoints used; none unless the rope is followed.
    pub count: u8,
    /// Zero.
    pub reserved: u8,
    /// Sequence number of the camera frame.
    pub sequence: u64,
    /// Start of exposure of row 0 (CLOCK_MONOTONIC, ns).
    pub stamp_ns: u64,
    /// Frames looked at since the process began.
    pub seen: u64,
    /// Frames of the camera that passed by meanwhile.
    pub skipped: u64,
    /// Times it forgot scene and rope and began anew.
    pub restarts: u32,
    /// Wall time spent on this frame (µs).
    pub took_us: u32,
    /// Raw left-eye pixels `[u, v]`, clamp first, lead centre last.
    pub points_px: [[f32; 2]; MAX_KEYPOINTS],
    /// Confidence of each point, 0 to 1.
    pub confidence: [f32; MAX_KEYPOINTS],
}

impl Default for PreviewFrame {
    fn default() -> Self {
        Self {
            version: PAYLOAD_VERSION,
            state: PreviewState::NoCamera as u8,
            lost: 0,
            count: 0,
            reserved: 0,
            sequence: 0,
            stamp_ns: 0,
            seen: 0,
            skipped: 0,
            restarts: 0,
            took_us: 0,
            points_px: [[0.0; 2]; MAX_KEYPOINTS],
            confidence: [0.0; MAX_KEYPOINTS],
        }
    }
}

impl PreviewFrame {
    /// What the preview is doing. RT-safe.
    #[must_use]
    pub const fn state(&self) -> PreviewState {
        PreviewState::from_raw(self.state)
    }

    /// The keypoints, as many as are used, never more than there can be. RT-safe.
    #[must_use]
    pub fn points(&self) -> &[[f32; 2]] {
        &self.points_px[..usize::from(self.count).min(MAX_KEYPOINTS)]
    }

    /// Their confidences. RT-safe.
    #[must_use]
    pub fn confidences(&self) -> &[f32] {
        &self.confidence[..usize::from(self.count).min(MAX_KEYPOINTS)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::{Bus, DomainSweep};

    #[test]
    fn states_come_back_from_their_numbers_and_unknown_ones_mean_nothing_is_seen() {
        use PreviewState::{Following, Looking, NoArm, NoCamera, Unfit};
        for state in [NoCamera, NoArm, Unfit, Looking, Following] {
            assert_eq!(PreviewState::from_raw(state as u8), state);
        }
        assert_eq!(PreviewState::from_raw(77), NoCamera);
    }

    #[test]
    fn a_count_beyond_the_points_there_are_is_cut() {
        let damaged = PreviewFrame {
            count: u8::MAX,
            ..PreviewFrame::default()
        };
        assert_eq!(damaged.points().len(), MAX_KEYPOINTS);
        assert_eq!(damaged.confidences().len(), MAX_KEYPOINTS);
    }

    #[test]
    fn one_publishes_many_receive_and_who_is_slow_loses_the_oldest() {
        let domain = format!("test_preview_{}", std::process::id());
        let _sweep = DomainSweep::new(&domain);
        let bus = Bus::join(&domain).unwrap();
        let publisher = bus.preview_publisher().unwrap();
        assert!(bus.preview_publisher().is_err(), "one preview only");
        let (quick, slow) = (
            bus.preview_subscriber().unwrap(),
            bus.preview_subscriber().unwrap(),
        );
        for sequence in 0..200_u64 {
            let mut frame = PreviewFrame {
                state: PreviewState::Following as u8,
                count: 2,
                sequence,
                ..PreviewFrame::default()
            };
            frame.points_px[1] = [sequence as f32, 0.5];
            frame.confidence[1] = 0.25;
            publisher.send_copy(frame).unwrap();
            assert_eq!(*quick.receive().unwrap().unwrap(), frame);
        }
        let first = slow.receive().unwrap().unwrap();
        assert!(first.sequence > 100, "{}", first.sequence);
        assert_eq!(first.points()[1], [first.sequence as f32, 0.5]);
        let mut last = first.sequence;
        drop(first);
        while let Some(frame) = slow.receive().unwrap() {
            assert_eq!(frame.sequence, last + 1);
            last = frame.sequence;
        }
        assert_eq!(last, 199);
    }
}
