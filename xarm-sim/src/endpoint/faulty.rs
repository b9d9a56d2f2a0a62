//! What the faults of the script do when they begin and end.

use super::client::{Client, Damage, Service};
use super::{ArmEndpoint, ArmEvent};
use crate::fault::{FaultKind, ForeignWish, Progress, ReportPort, Transition};
use rt_controller::xarm::{ArmState, Command, ErrorCode, Mode, StateRequest};
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
        for Transition {
            entry,
            kind,
            begins,
        } in self.faults.update(at, progress)
        {
            self.log(
                at,
                ArmEvent::Fault {
                    entry,
                    kind,
                    begins,
                },
            );
            self.change_wire(at, &kind, begins);
            self.change_arm(at, &kind, begins);
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
            FaultKind::ReportTorn {
                port,
                frames,
                keep_bytes,
            } => {
                let keep_bytes = usize::from(keep_bytes);
                self.damage(port, frames, Damage::Torn { keep_bytes });
            }
            FaultKind::ReportLength {
                port,
                frames,
                claim_bytes,
            } => self.damage(port, frames, Damage::Length { claim_bytes }),
            FaultKind::ReportNan {
                port,
                frames,
                joint,
            } => self.damage(port, frames, angle(joint, f32::NAN)),
            FaultKind::ReportInfinity {
                port,
                frames,
                joint,
            } => self.damage(port, frames, angle(joint, f32::INFINITY)),
            FaultKind::ReportGarbage { port, frames } => {
                self.damage(port, frames, Damage::Garbage);
            }
            _ => {}
        }
    }

    fn change_arm(&mut self, at: MonotonicNs, kind: &FaultKind, begins: bool) {
        let model = &mut self.model;
        let sign = if begins { 1.0 } else { -1.0 };
        match *kind {
            FaultKind::Warning { code } => model.warn(code),
            FaultKind::RaiseError { code } => model.raise(ErrorCode(code)),
            FaultKind::ServoError { joint, code } if begins => model.break_drive(joint, code),
            FaultKind::ServoError { .. } => model.mend_drives(),
            FaultKind::EmergencyStop { code } if begins => model.press_stop(ErrorCode(code)),
            FaultKind::EmergencyStop { .. } => model.release_stop(),
            FaultKind::Collision => model.collide(),
            FaultKind::StateChanged { state } => model.change_state(ArmState::from_code(state)),
            FaultKind::ModeChanged { mode } => model.change_mode(Mode::from_code(mode)),
            FaultKind::PowerCycle if begins => model.switch_off(),
            FaultKind::PowerCycle => model.switch_on(at),
            FaultKind::FirmwareChanged { version } => model.set_firmware(version),
            FaultKind::ReportTimeJump { by_s } => model.clock_mut().jump(by_s),
            FaultKind::ReportTimeWrap => model.clock_mut().restart(at),
            FaultKind::ReportTimeDrift { ppm } => {
                let ppm = if begins { ppm } else { 0.0 };
                model.clock_mut().set_stamp_rate(at, ppm);
            }
            FaultKind::ClockRate { ppm } => {
                let ppm = if begins {
                    ppm
                } else {
                    model.config().clock_ppm
                };
                model.clock_mut().set_rate(at, ppm);
            }
            FaultKind::TrackingLag { lag_s } => {
                model.delay_joints(if begins { lag_s } else { 0.0 });
            }
            FaultKind::JointStuck { joint } => model.hold_joint(joint, begins),
            FaultKind::EncoderJump { joint, by_rad } => model.shift_encoder(joint, sign * by_rad),
            _ => {}
        }
    }

    fn damage(&mut self, port: ReportPort, frames: u32, damage: Damage) {
        for client in self.clients.values_mut() {
            if let Service::Reports(kind) = client.service
                && port.covers(kind as usize)
            {
                client.damage.push_back((damage, frames));
            }
        }
    }

    /// Sends what the second commander sends at `now`, if there is one.
    pub(super) fn run_second_commander(&mut self, now: MonotonicNs) {
        let found = self.faults.active().find_map(|fault| match fault {
            FaultKind::SecondCommander { wish, rate_hz } => Some((*wish, *rate_hz)),
            _ => None,
        });
        let Some((wish, rate_hz)) = found.filter(|_| now >= self.foreign_due) else {
            return;
        };
        self.foreign_due = self.foreign_due.plus_s(1.0 / rate_hz);
        let command = match wish {
            ForeignWish::Setpoints => {
                let mut q = self.model.measured_motion().q;
                q[6] += FOREIGN_OFFSET_RAD;
                Command::ServoJoint(q)
            }
            ForeignWish::Stop => Command::SetState(StateRequest::Stop),
            ForeignWish::Mode => Command::SetMode(Mode::Position),
        };
        self.model.command_from(SECOND_COMMANDER, now, &command);
    }
}

fn angle(joint: u8, value: f32) -> Damage {
    Damage::Angle {
        joint: usize::from(joint).saturating_sub(1),
        value,
    }
}
