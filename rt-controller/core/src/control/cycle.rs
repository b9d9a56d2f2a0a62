//! One control cycle: [`ControlState::step`], a pure function of its input and
//! its own state. Commands are handled in `commands`, faults met in
//! `faults`.

use super::arming::ArmingState;
use super::exchange::{ArmCommand, ControlEvent, CycleInput, CycleOutput};
use super::limiter::{Allowance, Limiter};
use super::mode::{ModeState, Trigger, next_mode};
use super::monitor::Monitor;
use super::monitor::prediction::{MeasuredLags, Prediction};
use super::motion::Motion;
use super::reaction::{StopCategory, reaction};
use super::settings::ControlSettings;
use super::stopping::Stop;
use super::velocity_interface::VelocityInterface;
use super::violation::Violation;
use crate::xarm::Status;
use alloc::boxed::Box;
use arm_model::{JointState, JointVector, Limits};
use serde::{Deserialize, Serialize};
use shared_types::ipc::{ControllerMode, ControllerState, CycleRecord, PAYLOAD_VERSION, RunCounts};
use shared_types::{CommandInterface, FaultCode, MonotonicNs};

/// State of the control cycle. Sized once; stepping never allocates. An engagement
/// makes it anew, apart from its counters and the heartbeats.
#[derive(Debug, Serialize, Deserialize)]
pub struct ControlState {
    pub(super) limits: Limits,
    pub(super) settings: ControlSettings,
    /// It holds the motion, which has a fingerprint in its place when written.
    #[serde(skip)]
    pub(super) state: ModeState,
    pub(super) arming: ArmingState,
    pub(super) cycle: u64,
    pub(super) motions_done: u64,
    pub(super) commanded: JointState,
    pub(super) sent_ns: u64,
    pub(super) limiter: Limiter,
    pub(super) tcp_speed_max_m_s: f64,
    pub(super) velocity: VelocityInterface,
    pub(super) monitor: Monitor,
}

impl ControlState {
    /// Offline, nothing known.
    #[must_use]
    pub fn new(limits: Limits, settings: impl Into<ControlSettings>) -> Self {
        let q = JointVector::ZERO;
        let settings = settings.into();
        Self {
            limiter: Limiter::at_rest(q, &limits),
            tcp_speed_max_m_s: limits.tcp_speed_max_m_s,
            limits,
            settings,
            state: ModeState::Offline,
            arming: ArmingState::Disarmed,
            cycle: 0,
            motions_done: 0,
            commanded: JointState::at_rest(q),
            sent_ns: 0,
            velocity: VelocityInterface::default(),
            monitor: Monitor::new(settings, 0, q),
        }
    }

    /// The same for an arm whose joints follow setpoints as measured: where they are is compared
    /// with where they should be by then. Joint velocities move the arm otherwise: by them
    /// nothing is predicted.
    #[must_use]
    pub fn measured(mut self, lags: &MeasuredLags) -> Self {
        let known = lags.iter().any(Option::is_some)
            && self.settings.interface == CommandInterface::ServoPosition;
        self.monitor.reports.prediction = known.then(|| Prediction::new(lags));
        self
    }

    /// The same for the arm of another controller.
    #[must_use]
    pub fn measured_as(mut self, other: &Self) -> Self {
        self.monitor
            .reports
            .prediction
            .clone_from(&other.monitor.reports.prediction);
        self
    }

    /// Present mode.
    #[must_use]
    pub fn mode(&self) -> ControllerMode {
        self.state.mode()
    }

    /// Duration of a cycle (s).
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.limits.period_s()
    }

    /// Number of the newest cycle.
    #[must_use]
    pub const fn cycle(&self) -> u64 {
        self.cycle
    }

    /// State for the blackboard; stamp, process and real-time flag are the
    /// caller's.
    #[must_use]
    pub fn summary(&self) -> ControllerState {
        ControllerState {
            version: PAYLOAD_VERSION,
            mode: self.mode() as u8,
            real_time: 0,
            fault: self.state.fault() as u16,
            cycle: self.cycle,
            stamp_ns: 0,
            motions_done: self.motions_done,
            q_c: self.commanded.q,
            q: self
                .monitor
                .reports
                .newest()
                .map_or(JointVector::ZERO, |r| r.q),
            operating_mode: self.arming.raw_operating_mode(),
            interface: self.settings.interface as u8,
            link_failed: u8::from(self.monitor.link_failed),
            reserved: 0,
            pid: 0,
        }
    }

    /// What marked the run since the engagement.
    #[must_use]
    pub const fn counts(&self) -> RunCounts {
        self.monitor.counts()
    }

    /// One cycle: observe, watch, handle the command, send a setpoint. RT-safe; returns for any input.
    pub fn step(&mut self, input: CycleInput) -> CycleOutput {
        let mut out = CycleOutput::default();
        let mut input = input;
        let planned_ns = input.deadline_ns;
        // From here on the deadline is the instant that the setpoint is for.
        input.deadline_ns = planned_ns.saturating_add(input.late_ns.into());
        self.cycle = self.cycle.wrapping_add(1);
        self.monitor.observe(&input, &self.limits);
        let before = self.mode();
        self.watch(&input, &mut out);
        if let Some(command) = input.command.take() {
            self.handle(command, before, &input, &mut out);
        }
        let deadline_ns = input.deadline_ns;
        let trajectory_s = self.trajectory_s(deadline_ns);
        if input.link.unanswered < self.settings.thresholds.unanswered_max {
            self.command(deadline_ns, &mut out);
        } else {
            // Nothing may queue up behind a stall and burst out after it.
            self.monitor.held_back();
        }
        out.record = CycleRecord {
            deadline_ns: planned_ns,
            ..self.record(&input, trajectory_s, &out)
        };
        out
    }

    /// Time on the running motion (s) and the rate at which it is followed,
    /// from the last setpoint's or this cycle's instant.
    pub(super) fn path_at(&self, at_ns: u64) -> Option<(f64, f64)> {
        let since_s = |begin_ns| MonotonicNs(at_ns).since_s(MonotonicNs(begin_ns));
        match &self.state {
            ModeState::Offline | ModeState::Idle | ModeState::Faulted(_) => None,
            ModeState::Following(running) => Some((since_s(running.start_ns), 1.0)),
            ModeState::Braking(braking) => Some(match braking.stop {
                Stop::OnPath(slow) => {
                    let (path_s, rate, _) = slow.at(since_s(braking.start_ns));
                    (path_s, rate)
                }
                Stop::JointSpace(_) => (since_s(braking.running.start_ns), 0.0),
            }),
        }
    }

    /// Time on the running motion (s), negative when none runs.
    pub(super) fn trajectory_s(&self, deadline_ns: u64) -> f64 {
        self.path_at(deadline_ns).map_or(-1.0, |(path_s, _)| path_s)
    }

    fn record(&self, input: &CycleInput, trajectory_s: f64, out: &CycleOutput) -> CycleRecord {
        let (q, q_stamp_ns) = self
            .monitor
            .reports
            .newest()
            .map_or((JointVector::ZERO, 0), |r| (r.q, r.stamp_ns));
        CycleRecord {
            version: PAYLOAD_VERSION,
            mode: self.mode() as u8,
            sent: u8::from(out.command.is_some()),
            fault: self.state.fault() as u16,
            cycle: self.cycle,
            deadline_ns: input.deadline_ns,
            reply_ns: input.link.reply_ns,
            missed: input.missed,
            trajectory_s,
            q_c: self.commanded.q,
            q,
            q_stamp_ns,
            speed_override: self
                .path_at(input.deadline_ns)
                .map_or(0.0, |(_, rate)| rate),
            qd_sent: match out.command {
                Some(ArmCommand::Velocity { qd, .. }) => qd,
                Some(ArmCommand::Position(_)) | None => JointVector::ZERO,
            },
            ..CycleRecord::default()
        }
    }

    /// Asks the monitors and reacts; an arming ends where it must.
    fn watch(&mut self, input: &CycleInput, out: &mut CycleOutput) {
        match self.mode() {
            ControllerMode::Offline => {}
            ControllerMode::Faulted => {
                // The stop that an error causes may be seen before its error bit.
                let late = matches!(
                    self.state.fault(),
                    FaultCode::ArmModeChanged | FaultCode::ArmNotReady
                );
                if late && input.link.status.is_some_and(Status::has_error) {
                    self.state = ModeState::Faulted(FaultCode::ArmError);
                }
            }
            ControllerMode::Idle
            | ControllerMode::Moving
            | ControllerMode::Streaming
            | ControllerMode::Braking => {
                let than = self.state.stop().map_or(StopCategory::Continue, Stop::path);
                let missed = self.missed(input);
                if let Some(found) = self.monitor.violation(input, missed, self.mode(), than) {
                    self.react(self.with_speed(found), input.deadline_ns, out);
                }
            }
        }
        if self.mode() == ControllerMode::Idle {
            if input.operator.released != 0 {
                self.disarm(FaultCode::DeadManReleased, out);
            } else if self.arming.is_expired(input.deadline_ns) {
                self.disarm(FaultCode::ArmingExpired, out);
            }
        }
    }

    /// Cycles without a setpoint before this one, as the caller counts them or as
    /// the deadlines show; the larger number, so that a jump of time is never
    /// taken for a step of a cycle.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates"
    )]
    fn missed(&self, input: &CycleInput) -> u32 {
        let gap_s = MonotonicNs(input.deadline_ns).since_s(MonotonicNs(self.sent_ns));
        let cycles = arm_model::exact::round(gap_s / self.period_s()) as u32;
        input.missed.max(cycles.saturating_sub(1))
    }

    /// Computes, checks and commands this cycle's setpoint.
    fn command(&mut self, deadline_ns: u64, out: &mut CycleOutput) {
        if self.mode() == ControllerMode::Idle {
            let hold = JointState::at_rest(self.commanded.q);
            if let Err(found) = self.try_send(hold, false, deadline_ns, out) {
                self.react(found, deadline_ns, out);
            }
            return;
        }
        if matches!(
            self.mode(),
            ControllerMode::Moving | ControllerMode::Streaming
        ) {
            match self.follow(deadline_ns, out) {
                Ok(()) => return,
                Err(found) => self.react(found, deadline_ns, out),
            }
        }
        if self.mode() == ControllerMode::Braking {
            self.follow_stop(deadline_ns, out);
        }
    }

    fn follow(&mut self, deadline_ns: u64, out: &mut CycleOutput) -> Result<(), Violation> {
        let ModeState::Following(running) = &self.state else {
            return Ok(());
        };
        let (id, start_ns) = (running.id, running.start_ns);
        let t_s = MonotonicNs(deadline_ns).since_s(MonotonicNs(start_ns));
        let done = t_s >= running.motion.duration_s();
        let target = running.motion.state_at(t_s);
        let streamed = running.motion.mode() == ControllerMode::Streaming;
        if let Some((joint, q_rad, end_rad)) = super::brake::unstoppable(&target, &self.limits) {
            let fault = FaultCode::SetpointUnstoppable;
            return Err(Violation::of_joint(fault, joint, q_rad, end_rad));
        }
        if let Some(found) = super::brake::too_fast(&target, &self.limits) {
            return Err(found);
        }
        self.try_send(target, streamed, deadline_ns, out)?;
        if done && next_mode(self.mode(), Trigger::MotionDone).is_some() {
            self.retire_to(ModeState::Idle, out);
            self.commanded = JointState::at_rest(self.commanded.q);
            self.motions_done = self.motions_done.wrapping_add(1);
            if self.arming == ArmingState::Spent {
                self.disarm(FaultCode::None, out);
            }
            let finished = ControlEvent::Finished {
                id,
                start_ns,
                end_ns: deadline_ns,
            };
            emit(out, finished);
        }
        Ok(())
    }

    /// Follows the way to rest. If even that breaks a limit, nothing is sent and
    /// the arm stops itself.
    fn follow_stop(&mut self, deadline_ns: u64, out: &mut CycleOutput) {
        let ModeState::Braking(braking) = &self.state else {
            return;
        };
        let t_s = MonotonicNs(deadline_ns).since_s(MonotonicNs(braking.start_ns));
        let target = braking.stop.state_at(&braking.running.motion, t_s);
        let ended = t_s >= braking.stop.duration_s();
        let (fault, mut cause) = (braking.fault, braking.cause);
        let sent = self.try_send(target, true, deadline_ns, out);
        let trigger = if sent.is_err() {
            Trigger::LatchFault
        } else {
            Trigger::BrakeDone
        };
        if let Err(found) = sent {
            cause.second_code = found.fault as u16;
        }
        if (ended || sent.is_err()) && next_mode(ControllerMode::Braking, trigger).is_some() {
            let stop_arm = sent.is_err() || cause.stop_arm != 0 || reaction(fault).stop_arm;
            self.latch(fault, cause, stop_arm, out);
        }
    }

    /// Passes a setpoint through the limiter and, if it passes, commands it.
    fn try_send(
        &mut self,
        target: JointState,
        streamed: bool,
        deadline_ns: u64,
        out: &mut CycleOutput,
    ) -> Result<(), Violation> {
        let step_s = MonotonicNs(deadline_ns).since_s(MonotonicNs(self.sent_ns));
        if !target.is_finite() {
            return Err(Violation::plain(FaultCode::SetpointNotFinite));
        }
        let allowed = Allowance {
            tcp_speed_max_m_s: self.tcp_speed_max_m_s,
            streamed,
        };
        self.limiter
            .admit(&target.q, step_s, &self.limits, &allowed)?;
        self.commanded = target;
        self.sent_ns = deadline_ns;
        self.monitor.reports.sent(deadline_ns, target.q);
        out.command = Some(match self.settings.interface {
            CommandInterface::ServoPosition => ArmCommand::Position(target.q),
            CommandInterface::JointVelocity => self.velocity.command(
                &target,
                &self.monitor.deviation(deadline_ns),
                step_s,
                &self.limits,
                self.tcp_speed_max_m_s,
            ),
        });
        Ok(())
    }

    /// Changes to a mode without a motion; the one that ran goes back.
    pub(super) fn retire_to(&mut self, state: ModeState, out: &mut CycleOutput) {
        if let Some(running) = self.state.change_to(state) {
            give_back(out, running.motion);
        }
    }
}

/// A cycle has at most five events (a command's, an end, two disarmings, a latch):
/// they fit.
pub(super) fn emit(out: &mut CycleOutput, event: ControlEvent) {
    let _ = out.events.push(event);
}

/// A cycle retires at most two motions (the last one, a refused one): they fit.
pub(super) fn give_back(out: &mut CycleOutput, motion: Box<Motion>) {
    let _ = out.retired.push(motion);
}

#[cfg(test)]
#[path = "cycle_bench.rs"]
mod bench;

#[cfg(test)]
#[path = "cycle_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "random_tests.rs"]
mod random_tests;
