//! One control cycle: [`ControlState::step`], a pure function of its input and
//! its own state.

use super::arming::ArmingState;
use super::brake::brake;
use super::exchange::{ArmCommand, ControlEvent, CycleInput, CycleOutput, Order};
use super::limiter::Limiter;
use super::mode::{Trigger, next_mode};
use super::monitor::Monitor;
use super::motion::Motion;
use super::phases::PhasedMotion;
use super::reaction::{Path, Reaction, reaction};
use super::settings::ControlSettings;
use crate::xarm::{StateRequest, Status};
use shared_types::ipc::{
    CauseRecord, ControllerMode, ControllerState, CycleRecord, PAYLOAD_VERSION,
};
use shared_types::{Arming, FaultCode, JointState, JointVector, Limits, MonotonicNs, MotionTier};

/// Starts closer than this are equal (rad); a larger difference would be a jump.
const START_TOLERANCE_RAD: f64 = 1e-9;

#[derive(Debug)]
struct Running {
    id: u64,
    start_ns: u64,
    motion: Box<Motion>,
}

#[derive(Debug, Clone, Copy)]
struct Brake {
    start_ns: u64,
    phases: PhasedMotion,
}

/// State of the control cycle. Sized once; stepping never allocates.
#[derive(Debug)]
pub struct ControlState {
    limits: Limits,
    settings: ControlSettings,
    mode: ControllerMode,
    fault: FaultCode,
    cause: CauseRecord,
    arming: ArmingState,
    cycle: u64,
    motions_done: u64,
    commanded: JointState,
    sent_ns: u64,
    limiter: Limiter,
    monitor: Monitor,
    running: Option<Running>,
    brake: Option<Brake>,
}

impl ControlState {
    /// Offline, nothing known.
    #[must_use]
    pub fn new(limits: Limits, settings: impl Into<ControlSettings>) -> Self {
        let q = JointVector::ZERO;
        let settings = settings.into();
        Self {
            limiter: Limiter::at_rest(q, &limits),
            limits,
            settings,
            mode: ControllerMode::Offline,
            fault: FaultCode::None,
            cause: CauseRecord::default(),
            arming: ArmingState::Disarmed,
            cycle: 0,
            motions_done: 0,
            commanded: JointState::at_rest(q),
            sent_ns: 0,
            monitor: Monitor::new(settings.thresholds),
            running: None,
            brake: None,
        }
    }

    /// Present mode.
    #[must_use]
    pub const fn mode(&self) -> ControllerMode {
        self.mode
    }

    /// Duration of a cycle (s).
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.limits.period_s()
    }

    /// State for the blackboard; stamp and real-time flag are the caller's.
    #[must_use]
    pub fn summary(&self) -> ControllerState {
        ControllerState {
            version: PAYLOAD_VERSION,
            mode: self.mode as u8,
            real_time: 0,
            fault: self.fault as u16,
            cycle: self.cycle,
            stamp_ns: 0,
            motions_done: self.motions_done,
            q_c: self.commanded.q,
            q: self.monitor.report().map_or(JointVector::ZERO, |r| r.q),
            tier: self.arming.raw_tier(),
            wire: self.settings.wire as u8,
            reserved: [0; 6],
        }
    }

    /// Number of the newest cycle.
    #[must_use]
    pub const fn cycle(&self) -> u64 {
        self.cycle
    }

    /// One cycle: observe, watch, obey, command. RT-safe; returns for any input.
    pub fn step(&mut self, input: CycleInput) -> CycleOutput {
        let mut out = CycleOutput::default();
        self.cycle = self.cycle.wrapping_add(1);
        if !self.mode.is_moving() {
            self.retire(&mut out);
        }
        self.monitor.observe(&input);
        self.watch(&input, &mut out);
        let deadline_ns = input.deadline_ns;
        if let Some(order) = input.order {
            self.obey(order, deadline_ns, input.link.lost, &mut out);
        }
        let trajectory_s = self.trajectory_s(deadline_ns);
        self.command(deadline_ns, &mut out);
        out.record = self.record(deadline_ns, input.missed, trajectory_s, &out);
        out.record.reply_ns = input.link.reply_ns;
        out
    }

    /// Time on the running motion (s), negative when none runs.
    fn trajectory_s(&self, deadline_ns: u64) -> f64 {
        self.running
            .as_ref()
            .filter(|_| self.mode.is_moving())
            .map_or(-1.0, |r| {
                MonotonicNs(deadline_ns).since_s(MonotonicNs(r.start_ns))
            })
    }

    fn record(
        &self,
        deadline_ns: u64,
        missed: u32,
        trajectory_s: f64,
        out: &CycleOutput,
    ) -> CycleRecord {
        let (q, q_stamp_ns) = self
            .monitor
            .report()
            .map_or((JointVector::ZERO, 0), |r| (r.q, r.stamp_ns));
        CycleRecord {
            version: PAYLOAD_VERSION,
            mode: self.mode as u8,
            sent: u8::from(out.command.is_some()),
            fault: self.fault as u16,
            cycle: self.cycle,
            deadline_ns,
            missed,
            trajectory_s,
            q_c: self.commanded.q,
            q,
            q_stamp_ns,
            ..CycleRecord::default()
        }
    }

    /// Asks the monitors and reacts.
    fn watch(&mut self, input: &CycleInput, out: &mut CycleOutput) {
        match self.mode {
            ControllerMode::Offline => {}
            ControllerMode::Faulted => {
                // The stop that an error causes may be seen before its error bit.
                let late = matches!(
                    self.fault,
                    FaultCode::ArmModeChanged | FaultCode::ArmNotReady
                );
                if late && input.link.status.is_some_and(Status::has_error) {
                    self.fault = FaultCode::ArmError;
                }
            }
            ControllerMode::Idle
            | ControllerMode::Moving
            | ControllerMode::Streaming
            | ControllerMode::Braking => {
                if let Some(fault) = self.monitor.fault(input, self.mode) {
                    self.react(fault, input.deadline_ns, out);
                }
            }
        }
    }

    fn obey(&mut self, order: Order, deadline_ns: u64, lost: bool, out: &mut CycleOutput) {
        match order {
            // A link that broke on its way here.
            Order::Adopt { .. } if lost => {
                let fault = FaultCode::LinkLost;
                emit(out, ControlEvent::Refused { id: None, fault });
            }
            Order::Adopt { hold } => match self.adopt(hold, deadline_ns) {
                Ok(()) => emit(out, ControlEvent::Adopted),
                Err(fault) => emit(out, ControlEvent::Refused { id: None, fault }),
            },
            Order::Run { id, motion } => match self.admit(&motion, deadline_ns) {
                Ok((mode, tier)) => {
                    self.mode = mode;
                    if self.settings.arming_required
                        && mode == ControllerMode::Streaming
                        && tier == MotionTier::Throw
                    {
                        self.arming = ArmingState::Spent;
                    }
                    self.monitor.motion_begins(deadline_ns);
                    self.running = Some(Running {
                        id,
                        start_ns: deadline_ns,
                        motion,
                    });
                    let start_ns = deadline_ns;
                    emit(out, ControlEvent::Started { id, start_ns });
                }
                Err(fault) => {
                    emit(
                        out,
                        ControlEvent::Refused {
                            id: Some(id),
                            fault,
                        },
                    );
                    give_back(out, motion);
                }
            },
            Order::Stop => self.react(FaultCode::OperatorStop, deadline_ns, out),
            Order::Arm(arming) => self.arm(arming, deadline_ns, out),
            Order::Disarm => {
                if self.mode.is_moving() {
                    self.react(FaultCode::Disarmed, deadline_ns, out);
                } else {
                    self.disarm(FaultCode::None, out);
                }
            }
        }
    }

    fn arm(&mut self, arming: Arming, deadline_ns: u64, out: &mut CycleOutput) {
        let taken = if self.mode == ControllerMode::Idle {
            self.arming.arm(arming, deadline_ns)
        } else {
            Err(FaultCode::WrongMode)
        };
        emit(
            out,
            match taken {
                Ok(arming) => ControlEvent::Armed(arming),
                Err(fault) => ControlEvent::Refused { id: None, fault },
            },
        );
    }

    fn disarm(&mut self, fault: FaultCode, out: &mut CycleOutput) {
        if core::mem::take(&mut self.arming) != ArmingState::Disarmed {
            emit(out, ControlEvent::Disarmed { fault });
        }
    }

    fn adopt(&mut self, hold: JointVector, deadline_ns: u64) -> Result<(), FaultCode> {
        let mode = next_mode(self.mode, Trigger::Adopt).ok_or(FaultCode::WrongMode)?;
        if !hold.is_finite() {
            return Err(FaultCode::SetpointNotFinite);
        }
        if self.limits.position_violation(&hold).is_some() {
            return Err(FaultCode::SetpointPosition);
        }
        self.mode = mode;
        self.fault = FaultCode::None;
        self.commanded = JointState::at_rest(hold);
        self.limiter = Limiter::at_rest(hold, &self.limits);
        self.sent_ns = MonotonicNs(deadline_ns).plus_s(-self.period_s()).0;
        self.monitor.adopt(deadline_ns, hold);
        Ok(())
    }

    /// Whether a motion may begin now, and the mode it runs in.
    fn admit(
        &self,
        motion: &Motion,
        deadline_ns: u64,
    ) -> Result<(ControllerMode, MotionTier), FaultCode> {
        let trigger = match motion {
            Motion::Spline(_) => Trigger::StreamBegun,
            Motion::Move { .. } => Trigger::MoveBegun,
        };
        let mode = next_mode(self.mode, trigger).ok_or(FaultCode::WrongMode)?;
        let off = motion.start().zip_with(self.commanded.q, |a, b| a - b);
        if !off.is_finite() || off.max_abs() > START_TOLERANCE_RAD {
            return Err(FaultCode::StartPoseMismatch);
        }
        if self.monitor.report_is_stale(deadline_ns) {
            return Err(FaultCode::ReportStale);
        }
        let tier = if self.settings.arming_required {
            self.arming.admit(deadline_ns)?
        } else {
            MotionTier::Throw
        };
        Ok((mode, tier))
    }

    /// Meets a fault by the table in [`reaction`]; the first cause is kept.
    fn react(&mut self, fault: FaultCode, deadline_ns: u64, out: &mut CycleOutput) {
        let how = reaction(fault);
        let trigger = if how.path == Path::Silence {
            Trigger::LatchFault
        } else {
            Trigger::BrakeFault
        };
        let Some(mode) = next_mode(self.mode, trigger) else {
            return;
        };
        if self.mode != ControllerMode::Braking {
            self.fault = fault;
            self.cause = self.cause_of(fault, how, deadline_ns);
        }
        self.mode = mode;
        if mode == ControllerMode::Braking {
            self.brake = Some(Brake {
                start_ns: self.sent_ns,
                phases: brake(&self.commanded, &self.limits),
            });
        } else {
            self.latch(how.stop_arm, out);
        }
    }

    /// The record of a cause that was just noticed.
    fn cause_of(&self, fault: FaultCode, how: Reaction, deadline_ns: u64) -> CauseRecord {
        CauseRecord {
            version: PAYLOAD_VERSION,
            code: fault as u16,
            mode: self.mode as u8,
            path: how.path as u8,
            stop_arm: u8::from(how.stop_arm),
            tier: self.arming.raw_tier(),
            cycle: self.cycle,
            stamp_ns: deadline_ns,
            motion_id: self.running.as_ref().map_or(0, |r| r.id),
            trajectory_s: self.trajectory_s(deadline_ns),
            ..CauseRecord::default()
        }
    }

    /// The end of every stop: no setpoints any more, the arm rests.
    fn latch(&mut self, stop_arm: bool, out: &mut CycleOutput) {
        self.commanded = JointState::at_rest(self.commanded.q);
        self.brake = None;
        if stop_arm {
            out.request = Some(StateRequest::Stop);
        }
        self.disarm(self.fault, out);
        self.cause.rest_cycle = self.cycle;
        emit(out, ControlEvent::Latched(self.cause));
    }

    /// Computes, checks and commands this cycle's setpoint.
    fn command(&mut self, deadline_ns: u64, out: &mut CycleOutput) {
        if self.mode == ControllerMode::Idle {
            let hold = JointState::at_rest(self.commanded.q);
            if let Err(fault) = self.try_send(hold, deadline_ns, out) {
                self.react(fault, deadline_ns, out);
            }
            return;
        }
        if matches!(
            self.mode,
            ControllerMode::Moving | ControllerMode::Streaming
        ) {
            match self.follow(deadline_ns, out) {
                Ok(()) => return,
                Err(fault) => self.react(fault, deadline_ns, out),
            }
        }
        if self.mode == ControllerMode::Braking {
            self.follow_brake(deadline_ns, out);
        }
    }

    fn follow(&mut self, deadline_ns: u64, out: &mut CycleOutput) -> Result<(), FaultCode> {
        let Some(running) = &self.running else {
            return Err(FaultCode::WrongMode);
        };
        let (id, start_ns) = (running.id, running.start_ns);
        let t_s = MonotonicNs(deadline_ns).since_s(MonotonicNs(start_ns));
        let done = t_s >= running.motion.duration_s();
        let target = running.motion.state_at(t_s);
        self.try_send(target, deadline_ns, out)?;
        if done && let Some(mode) = next_mode(self.mode, Trigger::MotionDone) {
            self.mode = mode;
            self.commanded = JointState::at_rest(self.commanded.q);
            self.motions_done = self.motions_done.wrapping_add(1);
            if self.arming == ArmingState::Spent {
                self.disarm(FaultCode::None, out);
            }
            let end_ns = deadline_ns;
            emit(
                out,
                ControlEvent::Finished {
                    id,
                    start_ns,
                    end_ns,
                },
            );
        }
        Ok(())
    }

    /// Follows the brake. If even that breaks a limit (a joint too close to the
    /// end of its range, say), nothing is sent and the arm stops itself.
    fn follow_brake(&mut self, deadline_ns: u64, out: &mut CycleOutput) {
        let Some(Brake { start_ns, phases }) = self.brake else {
            return;
        };
        let t_s = MonotonicNs(deadline_ns).since_s(MonotonicNs(start_ns));
        let sent = self.try_send(phases.state_at(t_s), deadline_ns, out);
        let ended = t_s >= phases.duration_s();
        let trigger = if sent.is_err() {
            Trigger::LatchFault
        } else {
            Trigger::BrakeDone
        };
        if (ended || sent.is_err())
            && let Some(mode) = next_mode(self.mode, trigger)
        {
            self.mode = mode;
            self.latch(sent.is_err() || reaction(self.fault).stop_arm, out);
        }
    }

    /// Passes a setpoint through the limiter and, if it passes, commands it.
    fn try_send(
        &mut self,
        target: JointState,
        deadline_ns: u64,
        out: &mut CycleOutput,
    ) -> Result<(), FaultCode> {
        let step_s = MonotonicNs(deadline_ns).since_s(MonotonicNs(self.sent_ns));
        if !target.is_finite() {
            return Err(FaultCode::SetpointNotFinite);
        }
        self.limiter.admit(&target.q, step_s, &self.limits)?;
        self.commanded = target;
        self.sent_ns = deadline_ns;
        self.monitor.sent(deadline_ns, target.q);
        out.command = Some(ArmCommand::Position(target.q));
        Ok(())
    }

    fn retire(&mut self, out: &mut CycleOutput) {
        if let Some(running) = self.running.take() {
            give_back(out, running.motion);
        }
    }
}

/// A cycle has at most four events (an order's, an end, a disarming, a latch): they fit.
fn emit(out: &mut CycleOutput, event: ControlEvent) {
    let _ = out.events.push(event);
}

/// A cycle retires at most two motions (the last one, a refused one): they fit.
fn give_back(out: &mut CycleOutput, motion: Box<Motion>) {
    let _ = out.retired.push(motion);
}

#[cfg(test)]
#[path = "cycle_tests.rs"]
mod tests;
