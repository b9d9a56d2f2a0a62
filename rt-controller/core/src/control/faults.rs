//! How faults are met: the softest way to rest the table allows, made harder
//! when more goes wrong on the way, and one record of the first cause.

use super::cycle::{ControlState, emit};
use super::exchange::{ControlEvent, CycleOutput};
use super::mode::{Braking, ModeState, Trigger, next_mode};
use super::reaction::{Reaction, StopCategory, reaction};
use super::stopping::{Stop, StopFrom, choose_stop};
use super::violation::Violation;
use crate::xarm::StateRequest;
use arm_model::{JOINTS, JointState, kinematics};
use shared_types::ipc::{CauseRecord, ControllerMode, PAYLOAD_VERSION};
use shared_types::{CommandInterface, FaultCode, MonotonicNs};

impl ControlState {
    /// Meets a fault by the table in [`reaction`]; the first cause is kept.
    pub(super) fn react(&mut self, found: Violation, deadline_ns: u64, out: &mut CycleOutput) {
        let how = reaction(found.fault);
        if let ModeState::Braking(braking) = &mut self.state {
            braking.worsen(&found, how);
        }
        let trigger = if how.path == StopCategory::CutOff {
            Trigger::LatchFault
        } else {
            Trigger::BrakeFault
        };
        match next_mode(self.mode(), trigger) {
            Some(ControllerMode::Braking) => self.begin_braking(&found, how, deadline_ns),
            Some(_faulted) => {
                let (fault, cause) = match &self.state {
                    ModeState::Braking(braking) => (braking.fault, braking.cause),
                    _ => (found.fault, self.cause_of(&found, how, deadline_ns)),
                };
                self.latch(fault, cause, how.stop_arm || cause.stop_arm != 0, out);
            }
            None if how.path == StopCategory::JointSpace => self.brake_instead(),
            None => {}
        }
    }

    /// An arm that stops by an error of its own mostly does so for speed (C24,
    /// C60); its code comes later, so the cause shows the speed commanded last
    /// that was nearest to its limit.
    pub(super) fn with_speed(&self, found: Violation) -> Violation {
        if found.fault != FaultCode::ArmError || !self.mode().is_moving() {
            return found;
        }
        let qd = match self.settings.interface {
            CommandInterface::ServoPosition => self.limiter.speed(),
            CommandInterface::JointVelocity => self.velocity.newest(),
        };
        let (q, limits) = (&self.commanded.q, &self.limits);
        let tool_m_s = kinematics::tool_speed_m_s(q, &qd, &limits.tcp_offset());
        let of_tool = Violation::new(found.fault, tool_m_s, limits.tcp_speed_max_m_s);
        (0..JOINTS)
            .map(|j| {
                let speed = qd[j].abs();
                Violation::of_joint(found.fault, j, speed, limits.velocity_max_rad_s[j])
            })
            .fold(of_tool, |most, joint| {
                if joint.part() > most.part() {
                    joint
                } else {
                    most
                }
            })
    }

    /// Leaves the motion that runs.
    fn begin_braking(&mut self, found: &Violation, how: Reaction, deadline_ns: u64) {
        let Some(stop) = self.way_to_rest(how.path) else {
            return;
        };
        let cause = self.cause_of(found, how, deadline_ns);
        if let Some(running) = self.state.change_to(ModeState::Idle) {
            self.state = ModeState::Braking(Braking {
                running,
                start_ns: self.sent_ns,
                stop,
                fault: found.fault,
                cause,
            });
        }
    }

    /// Leaves the path, where a stop slows down along it.
    fn brake_instead(&mut self) {
        if let Some(Stop::OnPath(_)) = self.state.stop()
            && let Some(stop) = self.way_to_rest(StopCategory::JointSpace)
            && let ModeState::Braking(braking) = &mut self.state
        {
            (braking.stop, braking.start_ns) = (stop, self.sent_ns);
        }
    }

    /// The way to rest from the setpoint sent last, if something moves.
    fn way_to_rest(&self, path: StopCategory) -> Option<Stop> {
        let running = self.state.running()?;
        let motion_s = self.path_at(self.sent_ns).map_or(0.0, |(t_s, _)| t_s);
        let from = StopFrom {
            state: &self.commanded,
            motion: &running.motion,
            motion_s,
            limiter: &self.limiter,
            tcp_speed_max_m_s: self.tcp_speed_max_m_s,
        };
        // Slowing begins at rate 1, so it cannot follow another stop; nor can it
        // begin before the path.
        let before = MonotonicNs(self.sent_ns).since_s(MonotonicNs(running.start_ns)) < 0.0;
        let path = if before || self.state.stop().is_some() {
            StopCategory::JointSpace
        } else {
            path
        };
        Some(choose_stop(&from, path, &self.limits))
    }

    /// The record of a cause that was just noticed.
    fn cause_of(&self, found: &Violation, how: Reaction, deadline_ns: u64) -> CauseRecord {
        CauseRecord {
            version: PAYLOAD_VERSION,
            code: found.fault as u16,
            mode: self.mode() as u8,
            path: how.path as u8,
            stop_arm: u8::from(how.stop_arm),
            operating_mode: self.arming.raw_operating_mode(),
            cycle: self.cycle,
            stamp_ns: deadline_ns,
            motion_id: self.state.running().map_or(0, |r| r.id),
            trajectory_s: self.trajectory_s(deadline_ns),
            limit: found.limit_broken(),
            ..CauseRecord::default()
        }
    }

    /// The end of every stop: no setpoints any more, the arm rests.
    pub(super) fn latch(
        &mut self,
        fault: FaultCode,
        cause: CauseRecord,
        stop_arm: bool,
        out: &mut CycleOutput,
    ) {
        self.retire_to(ModeState::Faulted(fault), out);
        self.commanded = JointState::at_rest(self.commanded.q);
        if stop_arm {
            out.request = Some(StateRequest::Stop);
        }
        self.disarm(fault, out);
        let (arm_error, arm_warning) = self.monitor.arm_codes();
        let cause = CauseRecord {
            rest_cycle: self.cycle,
            stop_arm: u8::from(stop_arm),
            counts: self.monitor.counts(),
            arm_error,
            arm_warning,
            ..cause
        };
        emit(out, ControlEvent::Latched(cause));
    }
}

impl Braking {
    /// Notes what made it harder.
    fn worsen(&mut self, found: &Violation, how: Reaction) {
        if self.cause.second_code == 0 && found.fault as u16 != self.cause.code {
            self.cause.second_code = found.fault as u16;
        }
        self.cause.path = self.cause.path.max(how.path as u8);
        self.cause.stop_arm |= u8::from(how.stop_arm);
    }
}
