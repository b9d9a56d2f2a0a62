//! What the faults of the script do when they begin and end.

use super::client::{Client, Service};
use super::{ArmEndpoint, ArmEvent};
use crate::fault::{FaultKind, ForeignRequest, Progress};
use rt_controller::xarm::{Command, Mode, StateRequest};
use shared_types::MonotonicNs;

/// Number under which the second commander shows in events.
pub(super) const SECOND_COMMANDER: u32 = u32::MAX;
/// How far beside the arm's pose its setpoints lie (rad).
const FOREIGN_OFFSET_RAD: f64 = 1e-3;

impl ArmEndpoint {
    /// Begins and ends what is due at `at`, the arm having taken up `setpoints`
    /// motion commands.
    pub(super) fn run_faults(&mut self, at: MonotonicNs, setpoints: u64) {
        let progress = Progress {
            elapsed_s: at.since_s(self.start),
            setpoints,
            speed_rad_s: self.model.reference_motion().qd.max_abs(),
        };
        for (entry, kind, begins) in self.faults.update(at, progress) {
            let event = ArmEvent::Fault {
                entry,
                kind,
                begins,
            };
            self.log(at, event);
            self.change_wire(at, &kind, begins);
            self.model.change(at, &kind, begins);
        }
    }

    fn change_wire(&mut self, at: MonotonicNs, kind: &FaultKind, begins: bool) {
        let every = self.clients.values_mut();
        match *kind {
            FaultKind::ConnectionReset { ports } => every
                .filter(|c| ports.covers(c.is_commands()))
                .for_each(Client::reset),
            FaultKind::HalfOpen { ports } => every
                .filter(|c| ports.covers(c.is_commands()))
                .for_each(|c| c.deaf = true),
            FaultKind::CablePull if begins => every.for_each(Client::forget),
            FaultKind::CablePull => every.for_each(Client::reset),
            FaultKind::PowerCycle if begins => every.for_each(Client::reset),
            FaultKind::Stall if !begins => self.release(at),
            FaultKind::SecondCommander { .. } if begins => self.foreign_due = at,
            FaultKind::ReportTruncated { port, frames, .. }
            | FaultKind::ReportLength { port, frames, .. }
            | FaultKind::ReportNan { port, frames, .. }
            | FaultKind::ReportInfinity { port, frames, .. }
            | FaultKind::ReportGarbage { port, frames } => {
                for client in every {
                    if let Service::Reports(report) = client.service
                        && port.covers(report as usize)
                    {
                        client.damage.push_back((*kind, frames));
                    }
                }
            }
            _ => {}
        }
    }

    /// Sends what the second commander sends at `now`, if there is one.
    pub(super) fn run_second_commander(&mut self, now: MonotonicNs) {
        let found = self.faults.active().find_map(|fault| match fault {
            FaultKind::SecondCommander { request, rate_hz } => Some((*request, *rate_hz)),
            _ => None,
        });
        let Some((request, rate_hz)) = found.filter(|_| now >= self.foreign_due) else {
            return;
        };
        self.foreign_due = self.foreign_due.plus_s(1.0 / rate_hz);
        let command = match request {
            ForeignRequest::Setpoints => {
                let mut q = self.model.measured_motion().q;
                q[6] += FOREIGN_OFFSET_RAD;
                Command::ServoJoint(q)
            }
            ForeignRequest::Stop => Command::SetState(StateRequest::Stop),
            ForeignRequest::Mode => Command::SetMode(Mode::Position),
        };
        self.model.command_from(SECOND_COMMANDER, now, &command);
    }
}
