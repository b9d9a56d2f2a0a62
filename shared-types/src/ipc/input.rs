//! Everything a control cycle received, as plain data: recorded, published and
//! stepped again.
//!
//! Motions are named by number and fingerprint and stored once, elsewhere.
//! [`InputRecord`] serialises with postcard; files add their own CRC.

use super::payload::{GuardianBeat, JointReport, OperatorBeat};
use arm_model::joint::JointVector;
#[cfg(feature = "std")]
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Joint reports one cycle takes in at most: at equal rates one comes, two when
/// the phases drift past each other, three after a hiccup. Older ones are
/// counted as skipped.
pub const REPORTS_PER_CYCLE: usize = 3;

/// The joint reports of one cycle, oldest first. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct Reports {
    len: u64,
    items: [JointReport; REPORTS_PER_CYCLE],
}

impl Reports {
    /// Adds a report; when full, the oldest is lost and true returned. RT-safe.
    pub fn push(&mut self, report: JointReport) -> bool {
        let full = self.as_slice().len() == REPORTS_PER_CYCLE;
        if full {
            self.items.rotate_left(1);
        } else {
            self.len = self.len.saturating_add(1);
        }
        if let Some(slot) = usize::try_from(self.len.saturating_sub(1))
            .ok()
            .and_then(|last| self.items.get_mut(last))
        {
            *slot = report;
        }
        full
    }

    /// The reports, oldest first. RT-safe.
    #[must_use]
    pub fn as_slice(&self) -> &[JointReport] {
        let len = usize::try_from(self.len).map_or(REPORTS_PER_CYCLE, |n| n.min(REPORTS_PER_CYCLE));
        self.items.get(..len).unwrap_or_default()
    }

    /// All reports, for changing them in tests and fault injection. RT-safe.
    pub fn as_mut_slice(&mut self) -> &mut [JointReport] {
        let len = self.as_slice().len();
        self.items.get_mut(..len).unwrap_or_default()
    }
}

impl From<Option<JointReport>> for Reports {
    fn from(report: Option<JointReport>) -> Self {
        let mut reports = Self::default();
        if let Some(report) = report {
            reports.push(report);
        }
        reports
    }
}

impl Serialize for Reports {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.as_slice().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Reports {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let list = heapless::Vec::<JointReport, REPORTS_PER_CYCLE>::deserialize(deserializer)?;
        let mut reports = Self::default();
        for report in list {
            reports.push(report);
        }
        Ok(reports)
    }
}

/// What kind of command a cycle got. Numbers are part of recorded runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[repr(u8)]
pub enum CommandKind {
    /// None.
    #[default]
    None = 0,
    /// Hold the pose `hold`.
    Engage = 1,
    /// Begin motion `motion_id`.
    Run = 2,
    /// Brake and latch.
    Stop = 3,
    /// Arm for `operating_mode` until `expires_ns`.
    Arm = 4,
    /// Withdraw the arming.
    Disarm = 5,
}

impl CommandKind {
    /// The kind of a raw number, if there is one. RT-safe.
    #[must_use]
    pub fn from_raw(raw: u8) -> Option<Self> {
        use CommandKind::{Arm, Disarm, Engage, None, Run, Stop};
        let all = [None, Engage, Run, Stop, Arm, Disarm];
        all.into_iter().find(|kind| *kind as u8 == raw)
    }
}

/// A command as plain data; what its kind does not use is zero. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct CommandRecord {
    /// Raw [`CommandKind`].
    pub kind: u8,
    /// Raw [`crate::OperatingMode`].
    pub operating_mode: u8,
    /// 1 when the area was declared clear.
    pub area_clear: u8,
    /// Zero.
    pub reserved: u8,
    /// Zero.
    pub reserved_2: u32,
    /// Motion to run.
    pub motion_id: u64,
    /// Fingerprint of that motion.
    pub motion_hash: u64,
    /// Expiry of an arming (CLOCK_MONOTONIC, ns).
    pub expires_ns: u64,
    /// Pose to hold (rad).
    pub hold: JointVector,
}

/// What the command link showed, as plain data. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct LinkRecord {
    /// Age of the oldest setpoint without a reply (ns).
    pub unanswered_ns: u64,
    /// Round trip of the newest reply, 0 if none came (ns).
    pub reply_ns: u32,
    /// Setpoints without a reply.
    pub unanswered: u16,
    /// Replies that came a second time.
    pub duplicates: u16,
    /// Replies that came out of order.
    pub out_of_order: u16,
    /// Replies to commands never sent here.
    pub foreign: u16,
    /// Commands that were not sent.
    pub skipped: u16,
    /// Status bits, or-ed.
    pub status: u8,
    /// Bit 0: a reply came; bit 1: the connection is gone.
    pub flags: u8,
}

/// What the arm says about itself five times a second, as plain data. RT-safe
/// to copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct ArmCodesRecord {
    /// 1 when one came since the last cycle; the rest is zero otherwise.
    pub present: u8,
    /// Error code, 0 for none.
    pub error: u8,
    /// Warning code, 0 for none.
    pub warning: u8,
    /// State.
    pub state: u8,
    /// Mode.
    pub mode: u8,
    /// Zero.
    pub reserved: [u8; 3],
    /// When it arrived (CLOCK_MONOTONIC, ns).
    pub arrival_ns: u64,
}

/// Everything one cycle received. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "std", derive(ZeroCopySend))]
#[repr(C)]
pub struct InputRecord {
    /// [`super::PAYLOAD_VERSION`].
    pub version: u32,
    /// Cycles missed before this one.
    pub missed: u32,
    /// Number of the cycle, as in its [`super::CycleRecord`].
    pub cycle: u64,
    /// Planned wake-up (CLOCK_MONOTONIC, ns).
    pub deadline_ns: u64,
    /// Joint reports dropped as broken since the last cycle.
    pub broken_reports: u32,
    /// How much later than the deadline the instant of the setpoint is, 0 when
    /// the cycle was punctual (ns).
    pub late_ns: u32,
    /// Command.
    pub command: CommandRecord,
    /// Newest heartbeat of the operator.
    pub operator: OperatorBeat,
    /// Newest heartbeat of the guardian.
    pub guardian: GuardianBeat,
    /// Command link.
    pub link: LinkRecord,
    /// The arm's own codes.
    pub codes: ArmCodesRecord,
    /// Joint reports since the last cycle.
    pub reports: Reports,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_reports_that_came_are_written_and_they_come_back() {
        let mut record = InputRecord {
            cycle: 7,
            ..InputRecord::default()
        };
        let empty = postcard::to_allocvec(&record).unwrap();
        for k in 0..5_u64 {
            let full = record.reports.push(JointReport {
                stamp_ns: k,
                ..JointReport::default()
            });
            assert_eq!(full, k >= 3);
        }
        let stamps: Vec<u64> = record
            .reports
            .as_slice()
            .iter()
            .map(|r| r.stamp_ns)
            .collect();
        assert_eq!(stamps, [2, 3, 4]);
        let bytes = postcard::to_allocvec(&record).unwrap();
        assert!(empty.len() + 3 * 160 < bytes.len());
        assert_eq!(postcard::from_bytes::<InputRecord>(&bytes).unwrap(), record);
    }
}
