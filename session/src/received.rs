//! What a session received over shared memory and its stages work with meanwhile.

use anyhow::Context;
use run_log::{Cycles, files};
use shared_types::ipc::{Bus, CycleSubscriber, IpcError, JointSubscriber, KeypointSubscriber};
use shared_types::keypoints::{KeypointFrame, KeypointTrack};
use std::path::Path;

/// Collects records; drain it at least every second.
#[derive(Debug)]
pub struct Received {
    joint_subscriber: JointSubscriber,
    cycle_subscriber: CycleSubscriber,
    keypoint_subscriber: KeypointSubscriber,
    /// Control cycles and joint reports in order of arrival.
    pub cycles: Cycles,
    /// Keypoint frames, newest recording only.
    pub keypoints: Vec<KeypointFrame>,
}

impl Received {
    /// Subscribes to everything.
    ///
    /// # Errors
    /// Shared memory cannot be used.
    pub fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            joint_subscriber: bus.joint_subscriber()?,
            cycle_subscriber: bus.cycle_subscriber()?,
            keypoint_subscriber: bus.keypoint_subscriber()?,
            cycles: Cycles::default(),
            keypoints: Vec::new(),
        })
    }

    /// Takes what has come.
    ///
    /// # Errors
    /// Shared memory cannot be used.
    pub fn drain(&mut self) -> anyhow::Result<()> {
        let lost = "cannot receive records from shared memory";
        while let Some(sample) = self.joint_subscriber.receive().context(lost)? {
            self.cycles.joints.push(*sample);
        }
        while let Some(sample) = self.cycle_subscriber.receive().context(lost)? {
            self.cycles.cycles.push(*sample);
        }
        while let Some(sample) = self.keypoint_subscriber.receive().context(lost)? {
            self.keypoints.push(*sample);
        }
        Ok(())
    }

    /// Writes the keypoints into a run folder, if there are any; time 0 is at the first
    /// frame.
    pub fn keep_keypoints(&self, run: &Path) -> anyhow::Result<()> {
        if let Some(track) = KeypointTrack::from_published(&self.keypoints) {
            files::write_json(&run.join(files::KEYPOINTS), &track)?;
        }
        Ok(())
    }
}
