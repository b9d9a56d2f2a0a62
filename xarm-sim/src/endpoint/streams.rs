//! The report ports: a frame per period and client, or what the faults make of
//! it.

use super::ArmEndpoint;
use super::client::{Client, Service};
use crate::fault::{FaultKind, ReportPort};
use crate::reports::ReportKind;
use rand::Rng;
use shared_types::MonotonicNs;

/// Offset of the time stamp in the real-time report (bytes).
const STAMP: core::ops::Range<usize> = 4..12;

impl ArmEndpoint {
    /// Queues the reports that are due at `now`.
    pub(super) fn publish(&mut self, now: MonotonicNs) {
        let mut clients = core::mem::take(&mut self.clients);
        for client in clients.values_mut() {
            if let Service::Reports(kind) = client.service
                && now >= client.due
            {
                self.publish_to(client, kind, now);
            }
        }
        self.clients = clients;
    }

    fn publish_to(&mut self, client: &mut Client, kind: ReportKind, now: MonotonicNs) {
        let period_s = self.model.clock().span_s(kind.period_s());
        client.due = client.due.plus_s(period_s);
        if client.due <= now {
            client.due = now.plus_s(period_s);
        }
        let own = |port: &ReportPort| port.covers(kind as usize);
        let stops =
            |fault: &FaultKind| matches!(fault, FaultKind::ReportStop { port } if own(port));
        let freezes =
            |fault: &FaultKind| matches!(fault, FaultKind::ReportFreeze { port } if own(port));
        if self.is_dark() || self.faults.any(stops) {
            return;
        }
        let frozen = self.faults.any(freezes) && !client.last_report.is_empty();
        let mut frame = if frozen {
            client.last_report.clone()
        } else {
            kind.frame(&self.model, client.firmware, client.counter)
        };
        if frozen && kind == ReportKind::Realtime {
            frame[STAMP].copy_from_slice(&self.model.time_us().to_be_bytes());
        }
        client.counter = client.counter.wrapping_add(1);
        client.last_report.clone_from(&frame);
        if let Some(damage) = client.next_damage() {
            self.spoil(&mut frame, damage, kind);
        }
        client.push(now, frame);
    }

    fn spoil(&mut self, frame: &mut Vec<u8>, damage: FaultKind, kind: ReportKind) {
        let mut put_angle = |joint: u8, value: f32| {
            let at = kind.joint_offset(usize::from(joint).saturating_sub(1));
            frame[at..at + 4].copy_from_slice(&value.to_le_bytes());
        };
        match damage {
            FaultKind::ReportNan { joint, .. } => put_angle(joint, f32::NAN),
            FaultKind::ReportInfinity { joint, .. } => put_angle(joint, f32::INFINITY),
            FaultKind::ReportTruncated { keep_bytes, .. } => frame.truncate(keep_bytes.into()),
            FaultKind::ReportLength { claim_bytes, .. } => {
                frame[..4].copy_from_slice(&claim_bytes.to_be_bytes());
            }
            FaultKind::ReportGarbage { .. } => self.rng.fill_bytes(&mut frame[4..]),
            _ => {}
        }
    }
}
