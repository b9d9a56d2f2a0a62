//! What the live preview of the rope publishes, frame by frame.

use super::PAYLOAD_VERSION;
use crate::keypoints::KeypointFrame;
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
    pub fn from_raw(raw: u8) -> Self {
        let all = [Self::NoArm, Self::Unfit, Self::Looking, Self::Following];
        let mut all = all.into_iter();
        all.find(|state| *state as u8 == raw).unwrap_or_default()
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
    /// [`super::PAYLOAD_VERSION`].
    pub version: u32,
    /// Raw [`PreviewState`].
    pub state: u8,
    /// Zero.
    pub reserved: [u8; 3],
    /// Frames looked at since the process began.
    pub seen: u64,
    /// Frames of the camera that passed by meanwhile.
    pub skipped: u64,
    /// Times it forgot scene and rope and began anew.
    pub restarts: u32,
    /// Wall time spent on this frame (µs).
    pub took_us: u32,
    /// The camera frame, and the keypoints in it; none unless the rope is followed.
    pub rope: KeypointFrame,
}

impl Default for PreviewFrame {
    fn default() -> Self {
        Self {
            version: PAYLOAD_VERSION,
            state: PreviewState::NoCamera as u8,
            reserved: [0; 3],
            seen: 0,
            skipped: 0,
            restarts: 0,
            took_us: 0,
            rope: KeypointFrame::default(),
        }
    }
}

impl PreviewFrame {
    /// What the preview is doing. RT-safe.
    #[must_use]
    pub fn state(&self) -> PreviewState {
        PreviewState::from_raw(self.state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::{Bus, DomainSweep};

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
                ..PreviewFrame::default()
            };
            frame.rope.count = 2;
            frame.rope.sequence = sequence;
            frame.rope.points_px[1] = [sequence as f32, 0.5];
            frame.rope.confidence[1] = 0.25;
            publisher.send_copy(frame).unwrap();
            assert_eq!(*quick.receive().unwrap().unwrap(), frame);
        }
        let first = slow.receive().unwrap().unwrap().rope;
        assert!(first.sequence > 100, "{}", first.sequence);
        assert_eq!(first.points()[1], [first.sequence as f32, 0.5]);
        let mut last = first.sequence;
        while let Some(frame) = slow.receive().unwrap() {
            assert_eq!(frame.rope.sequence, last + 1);
            last = frame.rope.sequence;
        }
        assert_eq!(last, 199);
    }
}
