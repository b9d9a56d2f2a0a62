//! What every stop, and every fault that is no stop, must look like.

use super::limits::{self, EVER};
use super::stage::{INTERFACES, Stage};
use arm_model::JointVector;
use rt_controller::control::reaction::StopCategory;
use rt_controller::control::{ControlCommand, ControlEvent};
use shared_types::ipc::{CauseRecord, ControllerMode, RunCounts};
use shared_types::{FaultCode, MonotonicNs};
use xarm_sim::JointSample;

/// Speed under which the arm stands (rad/s).
const STANDING_RAD_S: f64 = 1e-3;
/// Longest time from the cause to standstill (s).
const STOP_WITHIN_S: f64 = 1.5;

/// What a stop is expected to be: for which fault, how, and whether the arm is asked to stop.
pub(crate) type Stop = (FaultCode, StopCategory, bool);

/// Slowed along the path.
pub(crate) const fn slowed(fault: FaultCode) -> Stop {
    (fault, StopCategory::OnPath, false)
}

/// Braked in joint space.
pub(crate) const fn braked(fault: FaultCode) -> Stop {
    (fault, StopCategory::JointSpace, false)
}

/// Braked, then the arm asked to stop.
pub(crate) const fn braked_and_stopped(fault: FaultCode) -> Stop {
    (fault, StopCategory::JointSpace, true)
}

/// No setpoints any more, the arm asked to stop.
pub(crate) const fn stopped(fault: FaultCode) -> Stop {
    (fault, StopCategory::CutOff, true)
}

/// No setpoints any more; the arm has stopped by itself or cannot hear.
pub(crate) const fn silenced(fault: FaultCode) -> Stop {
    (fault, StopCategory::CutOff, false)
}

/// A throw by each interface with a fault of a script: it stops as wanted, is noticed
/// within `noticed_s`, and after `lasts_s` more the arm works again.
pub(crate) fn assert_stopped_by(
    script: &str,
    want: Stop,
    [noticed_s, lasts_s]: [f64; 2],
    also: impl Fn(&mut Stage, &CauseRecord),
) {
    for via in INTERFACES {
        let mut stage = Stage::thrown(via, script);
        let cause = stage.assert_stop(want);
        let took_s = MonotonicNs(cause.stamp_ns).since_s(stage.fault_began(1));
        assert!(took_s < noticed_s, "{via:?}, {script}: {took_s} s");
        also(&mut stage, &cause);
        stage.rig.run_for(lasts_s);
        stage.assert_works_again();
    }
}

/// A throw by each interface with a fault of a script: nothing comes of it but counts.
pub(crate) fn assert_borne(script: &str, counted: impl Fn(&RunCounts) -> bool) {
    for via in INTERFACES {
        let stage = Stage::thrown(via, script);
        stage.assert_undisturbed();
        let counts = stage.rig.counts();
        assert!(counted(&counts), "{via:?}, {script}: {counts:?}");
    }
}

impl Stage {
    /// Asserts all there is to a stop that has happened, and that nothing moves
    /// the arm for two seconds, whatever is ordered; gives the cause.
    pub(crate) fn assert_stop(&mut self, want: Stop) -> CauseRecord {
        let cause = self.assert_one_cause(want);
        let (_, path, stop_arm) = want;
        // What a dead link delivers later is no setpoint any more.
        let wire_until = match path {
            StopCategory::CutOff => MonotonicNs(cause.stamp_ns),
            _ => EVER,
        };
        limits::assert_kept(self, wire_until, 0.0);
        self.assert_standstill(&cause);
        self.assert_nothing_moves_it();
        let requests = self.state_requests_since(MonotonicNs(cause.stamp_ns));
        // A dead link may carry none.
        assert!(requests <= usize::from(stop_arm), "{requests}");
        assert_eq!(
            self.rig.log.causes,
            [cause],
            "one cause, whatever came later"
        );
        cause
    }

    fn assert_one_cause(&self, want: Stop) -> CauseRecord {
        let (fault, path, stop_arm) = want;
        let causes = &self.rig.log.causes;
        let [cause] = causes[..] else {
            panic!("{:?} {fault:?}: {causes:?}", self.via);
        };
        let said = (cause.fault(), cause.path, cause.stop_arm != 0);
        let wanted = (fault, path as u8, stop_arm);
        assert_eq!(said, wanted, "{:?}: {cause:?}", self.via);
        assert!(cause.cycle <= cause.rest_cycle && cause.motion_id > 0);
        // A brake that itself breaks a limit ends at once, too, and says by which.
        let at_once = cause.cycle == cause.rest_cycle && cause.second_code == 0;
        // Before the path begins there is nothing to brake.
        let cut_off = at_once && cause.trajectory_s > 0.0;
        assert_eq!(path == StopCategory::CutOff, cut_off, "{cause:?}");
        let (value, limit) = (cause.limit.value, cause.limit.limit);
        // Codes that are no excess: an error shows how near the speed limit was.
        let excess = !matches!(fault, FaultCode::ArmError | FaultCode::ArmModeChanged);
        assert!(!excess || value >= limit, "{value} of {limit}: {cause:?}");
        cause
    }

    fn assert_standstill(&self, cause: &CauseRecord) {
        assert_eq!(self.rig.mode(), ControllerMode::Faulted);
        let truth = &self.rig.log.truth;
        let moving = |q: &JointVector| q.max_abs() > STANDING_RAD_S;
        // Some plans are stopped before they begin.
        let Some(last) = truth.iter().rfind(|s| moving(&s.state.qd)) else {
            return;
        };
        let took_s = last.at.since_s(MonotonicNs(cause.stamp_ns));
        assert!(took_s < STOP_WITHIN_S, "{took_s} s after {cause:?}");
        assert!(self.rig.now().since_s(last.at) > 0.1, "it still moves");
    }

    /// Two seconds of commands of every kind without an acknowledgement.
    pub(crate) fn assert_nothing_moves_it(&mut self) {
        let (commands, refusals) = (self.commands(), self.refusals().len());
        let stood = self.rig.log.truth.len();
        let mut ordered = 0;
        for k in 0..20 {
            self.rig.dead_man_released = k % 3 == 1;
            self.arm();
            self.start_nod();
            self.rig.command(ControlCommand::Disarm);
            self.rig.command(ControlCommand::Stop);
            self.rig.run_for(0.1);
            ordered += 2;
        }
        self.rig.dead_man_released = false;
        assert_eq!(self.commands(), commands, "commands after the stop");
        let refused = &self.refusals()[refusals..];
        assert_eq!(refused.len(), ordered);
        assert!(
            refused.iter().all(|(_, why)| *why == FaultCode::WrongMode),
            "{refused:?}"
        );
        let still = |s: &JointSample| s.state.qd.max_abs() < STANDING_RAD_S;
        assert!(
            self.rig.log.truth[stood..].iter().all(still),
            "it moved after the stop"
        );
    }

    /// Asserts that the operator's acknowledgement, and nothing less, brings the
    /// arm back: it moves again once it is armed.
    pub(crate) fn assert_works_again(&mut self) {
        let (finished, causes) = (self.finished(), self.rig.log.causes.len());
        self.rig.bring_up().unwrap();
        self.rig.run_for(0.5);
        self.assert_mode(ControllerMode::Idle);
        self.start_nod();
        self.rig.run_cycles(2);
        let (_, refused) = *self.refusals().last().unwrap();
        assert_eq!(refused, FaultCode::NotArmed, "nothing re-arms by itself");
        self.arm();
        self.start_nod();
        let stood = self.rig.log.truth.len();
        self.rig.run_for(1.2);
        assert_eq!(self.finished(), finished + 1, "{:?}", self.rig.log.causes);
        assert_eq!(self.rig.log.causes.len(), causes);
        let moves = |s: &JointSample| s.state.qd[6].abs() > 0.3;
        assert!(
            self.rig.log.truth[stood..].iter().any(moves),
            "it does not move"
        );
    }

    /// Asserts that the throw went on to its end, within all limits, as if
    /// nothing had happened.
    pub(crate) fn assert_undisturbed(&self) {
        self.assert_finished(0.0);
        self.assert_same_path();
    }

    /// Asserts that the same was commanded as if nothing had happened.
    pub(crate) fn assert_same_path(&self) {
        let undisturbed = Self::thrown(self.via, "");
        let path = |stage: &Self| -> Vec<(f64, JointVector)> {
            stage.on_path().map(|r| (r.trajectory_s, r.q_c)).collect()
        };
        assert!(path(self) == path(&undisturbed), "another path");
    }

    /// Asserts that the throw went on to its end, within all limits; setpoints may arrive
    /// `jitter_s` beside the instant they are for.
    pub(crate) fn assert_finished(&self, jitter_s: f64) {
        self.assert_one_motion(jitter_s);
        assert_eq!(self.arm_errors(), [0_u8; 0]);
        let off = self.rig.with_arm(|arm| arm.model().true_motion().q) - self.throw.end();
        assert!(off.max_abs() < 2e-3, "{:?}: ends {off:?} off", self.via);
        assert!(self.speed() < STANDING_RAD_S);
    }

    /// Asserts that one motion went on to its end, within all limits.
    pub(crate) fn assert_one_motion(&self, jitter_s: f64) {
        self.assert_mode(ControllerMode::Idle);
        let found = (self.finished(), self.rig.log.causes.len());
        assert_eq!(found, (1, 0), "{:?} {:?}", self.via, self.rig.log.causes);
        limits::assert_kept(self, EVER, jitter_s);
    }

    /// Asserts that nothing moved and that the last motion was refused for
    /// `fault`.
    pub(crate) fn assert_refused(&self, fault: FaultCode) {
        let (id, why) = *self.refusals().last().expect("nothing was refused");
        assert_eq!((id.is_some(), why), (true, fault));
        let started = |e: &(u64, ControlEvent)| matches!(e.1, ControlEvent::Started { .. });
        assert!(!self.rig.log.events.iter().any(started));
        assert!(self.on_path().next().is_none());
        assert!(self.rig.log.causes.is_empty(), "{:?}", self.rig.log.causes);
    }
}
