//! What a run keeps of the shared-memory traffic: joint reports, control
//! cycles and keypoints.

use crate::files;
use anyhow::Context;
use arm_model::JointVector;
use shared_types::ipc::{
    Bus, CycleRecord, CycleSubscriber, IpcError, JointReport, JointSubscriber, KeypointSubscriber,
};
use shared_types::keypoints::{KeypointFrame, KeypointTrack};
use shared_types::{FaultCode, MonotonicNs};
use std::fmt::Write;
use std::path::Path;

/// Reports closer than this are one and the same (the fastest come every 4 ms).
const SAME_REPORT_NS: u64 = 1_000_000;

/// Collects records; drain it at least every second.
#[derive(Debug)]
pub struct Recorder {
    joint_subscriber: JointSubscriber,
    cycle_subscriber: CycleSubscriber,
    keypoint_subscriber: KeypointSubscriber,
    /// Joint reports in order of arrival.
    pub joints: Vec<JointReport>,
    /// Control cycles.
    pub cycles: Vec<CycleRecord>,
    /// Keypoint frames, newest recording only.
    pub keypoints: Vec<KeypointFrame>,
}

impl Recorder {
    /// Subscribes to everything worth keeping.
    pub fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            joint_subscriber: bus.joint_subscriber()?,
            cycle_subscriber: bus.cycle_subscriber()?,
            keypoint_subscriber: bus.keypoint_subscriber()?,
            joints: Vec::new(),
            cycles: Vec::new(),
            keypoints: Vec::new(),
        })
    }

    /// Takes in what has arrived.
    pub fn drain(&mut self) -> anyhow::Result<()> {
        let lost = "cannot receive records from shared memory";
        while let Some(sample) = self.joint_subscriber.receive().context(lost)? {
            self.joints.push(*sample);
        }
        while let Some(sample) = self.cycle_subscriber.receive().context(lost)? {
            self.cycles.push(*sample);
        }
        while let Some(sample) = self.keypoint_subscriber.receive().context(lost)? {
            self.keypoints.push(*sample);
        }
        Ok(())
    }

    /// Measured joints between two instants (CLOCK_MONOTONIC ns, rad), in order
    /// of time.
    pub fn joints_between(&self, from_ns: u64, to_ns: u64) -> Vec<(u64, JointVector)> {
        let mut out: Vec<(u64, JointVector)> = self
            .joints
            .iter()
            .filter(|r| (from_ns..=to_ns).contains(&r.stamp_ns))
            .map(|r| (r.stamp_ns, r.q))
            .collect();
        out.sort_by_key(|(t, _)| *t);
        // A report is sent at once to a new listener and may repeat the last one.
        out.dedup_by(|next, kept| next.0 - kept.0 < SAME_REPORT_NS);
        out
    }

    /// The keypoints as a track, time 0 at the first frame.
    pub fn track(&self) -> Option<KeypointTrack> {
        KeypointTrack::from_published(&self.keypoints)
    }

    /// Writes `joints.csv`, `cycles.csv` and `keypoints.json` into `folder`;
    /// times count from `epoch_ns`.
    pub fn write(&self, folder: &Path, epoch_ns: u64) -> anyhow::Result<()> {
        let since = |ns: u64| MonotonicNs(ns).since_s(MonotonicNs(epoch_ns));
        let measured = self.joints_between(0, u64::MAX);
        if measured.len() >= 2 {
            files::write_joints(
                &folder.join("joints.csv"),
                measured.iter().map(|(t, q)| (since(*t), *q)),
            )?;
        }
        let mut text = String::from(
            "cycle,deadline_s,mode,fault,sent,wake_late_us,compute_us,send_us,reply_us,missed,dropped,trajectory_s,\
             q1_c,q2_c,q3_c,q4_c,q5_c,q6_c,q7_c\n",
        );
        for c in &self.cycles {
            write!(
                text,
                "{},{:.6},{:?},{:?},{},{:.1},{:.1},{:.1},{:.1},{},{},{:.6}",
                c.cycle,
                since(c.deadline_ns),
                shared_types::ipc::ControllerMode::from_raw(c.mode),
                FaultCode::from_raw(c.fault).unwrap_or_default(),
                c.sent,
                f64::from(c.wake_late_ns) / 1e3,
                f64::from(c.compute_ns) / 1e3,
                f64::from(c.send_ns) / 1e3,
                f64::from(c.reply_ns) / 1e3,
                c.missed,
                c.dropped,
                c.trajectory_s,
            )?;
            for q in c.q_c.iter() {
                write!(text, ",{q:.9}")?;
            }
            text.push('\n');
        }
        files::write_atomic(&folder.join("cycles.csv"), text.as_bytes())?;
        if let Some(track) = self.track() {
            files::write_json(&folder.join("keypoints.json"), &track)?;
        }
        Ok(())
    }
}
