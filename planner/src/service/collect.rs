//! Keypoint frames as they are published, kept until asked for.

use shared_types::ipc::{Bus, IpcError, KEYPOINT_SERVICE, KeypointSubscriber};
use shared_types::keypoints::{KeypointFrame, KeypointTrack};
use std::collections::VecDeque;

/// Most frames kept; older ones are forgotten.
const KEEP: usize = 4096;

pub(super) struct Collector {
    subscriber: KeypointSubscriber,
    frames: VecDeque<KeypointFrame>,
}

impl Collector {
    pub(super) fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            subscriber: bus.keypoint_subscriber()?,
            frames: VecDeque::new(),
        })
    }

    /// Takes in what was published.
    pub(super) fn drain(&mut self) -> Result<(), IpcError> {
        loop {
            let failed = IpcError::transfer(KEYPOINT_SERVICE);
            let sample = self.subscriber.receive().map_err(failed)?;
            let Some(sample) = sample else { return Ok(()) };
            if self.frames.len() == KEEP {
                self.frames.pop_front();
            }
            self.frames.push_back(*sample);
        }
    }

    /// The `wanted` frames from the last one stamped `first_stamp_ns` on, time 0
    /// at that one.
    pub(super) fn track(&self, first_stamp_ns: u64, wanted: u32) -> Result<KeypointTrack, String> {
        let wanted = wanted as usize;
        let start = self
            .frames
            .iter()
            .rposition(|f| f.stamp_ns == first_stamp_ns)
            .unwrap_or(self.frames.len());
        let found = (self.frames.len() - start).min(wanted);
        let frames = self.frames.range(start..start + found);
        (found == wanted)
            .then(|| KeypointTrack::from_published(frames))
            .flatten()
            .ok_or_else(|| {
                format!(
                    "{found} of {wanted} keypoint frames are here, the first stamped {first_stamp_ns} ns; track the recording first"
                )
            })
    }
}
