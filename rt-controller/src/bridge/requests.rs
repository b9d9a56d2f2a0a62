//! What each request of the controller's service leads to.

use super::answers::{ControllerCall, answer, refuse};
use super::{Awaited, Bridge, Open, REPORT_WAIT, SET_UP_TIMEOUT};
use crate::commander::CommanderLock;
use crate::config::ControllerConfig;
use crate::control::monitor::SETTLE_NS;
use crate::control::{ControlCommand, Motion};
use crate::os::now_ns;
use crate::point_to_point::{plan_move, verify};
use crate::session::{ArmSession, SessionError};
use crate::set_up::{SetUp, SetUpError};
use crate::transport::tcp::{LinkSettings, TcpLink};
use arm_model::{JointTrajectory, JointVector};
use shared_types::ipc::ControllerMode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::plan::trajectory_hash;
use shared_types::{FaultCode, MonotonicNs};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::Instant;

/// Why nothing begins yet.
pub(super) const SETTLES: &str = "a stop or a bring-up is under way; ask again";
/// Largest distance of the held pose from the start of a plan (rad): 0.5 deg.
const START_DISTANCE_MAX_RAD: f64 = 0.5 * core::f64::consts::PI / 180.0;
/// Smaller distances need no move to the start (rad).
const START_EQUAL_RAD: f64 = 1e-9;
/// Part of the limits used for that move.
const TO_START_SPEED_PART: f64 = 0.05;

impl Bridge {
    pub(super) fn serve(&mut self, call: ControllerCall) {
        match call.request {
            ControllerRequest::Status => self.status(&call),
            ControllerRequest::Latency => {
                let report = Box::new(self.latencies.take());
                answer(&call, &ControllerEvent::Latency(report));
            }
            ControllerRequest::Configuration => match toml::to_string(&self.in_force()) {
                Ok(config) => answer(&call, &ControllerEvent::Configuration(config)),
                Err(reason) => refuse(&call, FaultCode::WrongMode, &reason.to_string()),
            },
            // Whatever the newest record says: an engagement may be on its way to the loop.
            ControllerRequest::Stop => {
                self.pass_on(call, ControlCommand::Stop, None, Awaited::Stopped);
            }
            // The mode is that of before: what is on its way to the loop may undo a stop.
            ControllerRequest::Bringup | ControllerRequest::Acknowledge if self.settles() => {
                self.wrong_mode(&call, SETTLES);
            }
            ControllerRequest::Bringup => match self.mode() {
                ControllerMode::Idle => answer(&call, &ControllerEvent::Done),
                ControllerMode::Offline => self.set_up(call),
                _ => self.wrong_mode(&call, "a stopped controller wants an acknowledgement"),
            },
            ControllerRequest::Acknowledge => match self.mode() {
                ControllerMode::Idle => answer(&call, &ControllerEvent::Done),
                ControllerMode::Faulted => self.set_up(call),
                _ => self.wrong_mode(&call, "there is no fault to acknowledge"),
            },
            ControllerRequest::MoveTo { q, speed_fraction } => {
                self.serve_move(call, q, speed_fraction)
            }
            ControllerRequest::Arm {
                operating_mode,
                confirmed_ns,
                begins_by_ns,
            } => self.serve_arming(call, operating_mode, (confirmed_ns, begins_by_ns)),
            ControllerRequest::Disarm => match self.command(ControlCommand::Disarm, None) {
                Ok(()) => {
                    // With its next cycle.
                    self.armed = Err(FaultCode::NotArmed);
                    answer(&call, &ControllerEvent::Done);
                }
                Err(fault) => refuse(&call, fault, "the control loop takes no commands"),
            },
            ControllerRequest::Announce { sha256 } => {
                self.uploads.serve_announcement(call, sha256);
            }
            ControllerRequest::Upload {
                ref trajectory,
                sha256,
            } => self.uploads.serve_upload(&call, trajectory, sha256),
            ControllerRequest::ExecuteUploaded { sha256 } => match self.uploads.take(&sha256) {
                Some(trajectory) => self.serve_execute(call, &trajectory, &sha256),
                None => self.wrong_mode(&call, "there is no uploaded plan with this hash"),
            },
            ControllerRequest::Execute {
                ref trajectory,
                sha256,
            } => {
                let trajectory = trajectory.clone();
                self.serve_execute(call, &trajectory, &sha256);
            }
        }
    }

    /// The configuration with the limits that it names, and with files as any process finds them.
    fn in_force(&self) -> ControllerConfig {
        let found = |file: &PathBuf| std::path::absolute(file).unwrap_or_else(|_| file.clone());
        ControllerConfig {
            limits_file: None,
            limits: Some(self.limits.clone()),
            arm_response_file: self.config.arm_response_file.as_ref().map(found),
            ..self.config.clone()
        }
    }

    fn status(&self, call: &ControllerCall) {
        answer(
            call,
            &ControllerEvent::Status {
                mode: self.mode(),
                fault: FaultCode::from_raw(self.newest.fault).unwrap_or_default(),
                arm_error: self.arm_error.0,
                q_c: self.newest.q_c,
                operating_mode: self.armed.ok(),
                warnings: [&self.warnings[..], &self.arm_warnings].concat(),
            },
        );
    }

    pub(super) fn wrong_mode(&self, call: &ControllerCall, why: &str) {
        let message = format!("the controller is {:?}: {why}", self.mode());
        refuse(call, FaultCode::WrongMode, &message);
    }

    /// Hands a command to the loop; what it `awaits` will answer the call.
    pub(super) fn pass_on(
        &mut self,
        call: ControllerCall,
        command: ControlCommand,
        link: Option<Box<TcpLink>>,
        awaits: Awaited,
    ) {
        match self.command(command, link) {
            Ok(()) => self.open.push(Open { call, awaits }),
            Err(fault) => refuse(&call, fault, "the control loop takes no commands"),
        }
    }

    /// Sets the arm up on a connection of its own and hands a fresh command
    /// link to the loop. Nothing moves meanwhile, so waiting is harmless.
    fn set_up(&mut self, call: ControllerCall) {
        match self.prepare(&call) {
            Ok((hold, link)) => {
                let until = Instant::now() + REPORT_WAIT;
                let awaits = Awaited::Engaged { held: false, until };
                self.pass_on(call, ControlCommand::Engage { hold }, Some(link), awaits);
            }
            Err((fault, detail)) => refuse(&call, fault, &detail),
        }
    }

    /// Answers bring-ups whose arm is held and reports its joints.
    pub(super) fn settle_engagements(&mut self) {
        let stale_ns = self.settings.thresholds.report_stale_ns;
        // Before, a report says nothing of the mode that the arm was brought into.
        let counts_ns = self.at_rest_ns.saturating_add(SETTLE_NS);
        let fresh = self.newest_report.is_some_and(|r| {
            r.arrival_ns > counts_ns && now_ns().saturating_sub(r.arrival_ns) < stale_ns
        });
        let held = |a: &Awaited| matches!(a, Awaited::Engaged { held: true, .. });
        let guarded = self.guarded || !self.config.guardian.required;
        for open in self.take(|awaits| held(awaits) && fresh && guarded) {
            answer(&open.call, &ControllerEvent::Done);
        }
        let now = Instant::now();
        let late = |a: &Awaited| matches!(a, Awaited::Engaged { until, .. } if now > *until);
        for open in self.take(late) {
            let fault = if fresh {
                FaultCode::GuardianLost
            } else {
                FaultCode::ReportStale
            };
            refuse(&open.call, fault, "");
        }
    }

    /// Locks the arm for this process, sets it up step by step, connects.
    fn prepare(
        &mut self,
        call: &ControllerCall,
    ) -> Result<(JointVector, Box<TcpLink>), (FaultCode, String)> {
        let command = self.command_port();
        if self.commander.is_none() {
            let lock = CommanderLock::take(command)
                .map_err(|e| (FaultCode::SecondCommander, e.to_string()))?;
            self.commander = Some(lock);
        }
        let plan = SetUp {
            config: &self.config,
            limits: &self.limits,
        };
        let period_ns = MonotonicNs(0).plus_s(self.limits.period_s()).0;
        let link = LinkSettings::new(self.settings.thresholds.unanswered_max, period_ns);
        let mut step_done = |name: &'static str, result: &str| {
            tracing::info!(step = name, result, "setting up the arm");
            let step = ControllerEvent::Step {
                name: name.to_owned(),
                result: result.to_owned(),
            };
            answer(call, &step);
        };
        let prepared = ArmSession::connect(command, SET_UP_TIMEOUT)
            .map_err(SetUpError::from)
            .and_then(|mut session| {
                let (q, warnings) = plan.run(&mut session, &mut step_done)?;
                let link = TcpLink::connect(command, SET_UP_TIMEOUT, link);
                let link = link.map_err(|reason| SessionError::Connect(command, reason))?;
                Ok((q, Box::new(link), warnings))
            })
            .map_err(|error| (error.fault, error.to_string()));
        let (q, link, warnings) = prepared?;
        self.arm_warnings = warnings;
        Ok((q, link))
    }

    /// Whether a motion may be asked for; refuses the call otherwise.
    fn may_move(&self, call: &ControllerCall) -> bool {
        if self.mode() != ControllerMode::Idle {
            self.wrong_mode(call, "motions begin when it is Idle");
        } else if self.settles() {
            self.wrong_mode(call, SETTLES);
        } else if self.moves() {
            refuse(call, FaultCode::WrongMode, "another motion is under way");
        } else {
            return true;
        }
        false
    }

    fn serve_move(&mut self, call: ControllerCall, q: JointVector, speed_fraction: f64) {
        if !self.may_move(&call) {
            return;
        }
        let Some(armed) = self.require_armed(&call) else {
            return;
        };
        let from = self.newest.q_c;
        let planned = match self.armed_speed(armed) {
            Some(speed) => speed.plan_move(&from, &q, speed_fraction),
            None => plan_move(&from, &q, speed_fraction, &self.limits)
                .map_err(|error| (error.fault, error.to_string())),
        };
        match planned {
            Ok(motion) => self.begin(call, Box::new(motion), VecDeque::new()),
            Err((fault, detail)) => refuse(&call, fault, &detail),
        }
    }

    fn serve_execute(
        &mut self,
        call: ControllerCall,
        trajectory: &JointTrajectory,
        sha256: &[u8; 32],
    ) {
        if !self.may_move(&call) {
            return;
        }
        let mut motions = match self.admit_plan(trajectory, sha256) {
            Ok(motions) => motions,
            Err((fault, detail)) => return refuse(&call, fault, &detail),
        };
        let Some(armed) = self.require_armed(&call) else {
            return;
        };
        let speed = self.armed_speed(armed);
        let fits = self.still_confirmed(armed).and_then(|()| {
            let kept = speed.map_or(Ok(()), |speed| speed.check(&Motion::Spline(*trajectory)));
            kept.map_err(|detail| (FaultCode::OperatingModeExceeded, detail))
        });
        match (fits, motions.pop_front()) {
            (Ok(()), Some(first)) => self.begin(call, first, motions),
            (Ok(()), None) => refuse(&call, FaultCode::PlanOutOfLimits, ""),
            (Err((fault, detail)), _) => refuse(&call, fault, &detail),
        }
    }

    /// Checks a plan; the motions it takes, a small move to its start included.
    fn admit_plan(
        &self,
        trajectory: &JointTrajectory,
        sha256: &[u8; 32],
    ) -> Result<VecDeque<Box<Motion>>, (FaultCode, String)> {
        if trajectory_hash(trajectory) != *sha256 {
            return Err((FaultCode::PlanHashMismatch, String::new()));
        }
        if let Some(margin) = self.limits.worst_violation(trajectory) {
            let detail = format!("the plan breaks a limit: {}", margin.describe());
            return Err((FaultCode::PlanOutOfLimits, detail));
        }
        let motion = Motion::Spline(*trajectory);
        if let Err(fault) = verify(&motion, &self.limits) {
            return Err((FaultCode::PlanOutOfLimits, fault.explain().to_owned()));
        }
        let held = self.newest.q_c;
        let off_rad = (trajectory.start() - held).max_abs();
        if off_rad > START_DISTANCE_MAX_RAD {
            let detail = format!(
                "the arm stands {:.2} deg from the start of the plan, allowed are {:.1}; move it there first",
                off_rad.to_degrees(),
                START_DISTANCE_MAX_RAD.to_degrees()
            );
            return Err((FaultCode::StartPoseMismatch, detail));
        }
        let mut motions = VecDeque::new();
        if off_rad > START_EQUAL_RAD && self.begins_by_ns.is_some() {
            let detail = "the arm does not stand at the start of the plan, and a move there would make it late; move it there before it is armed";
            return Err((FaultCode::StartPoseMismatch, detail.to_owned()));
        }
        if off_rad > START_EQUAL_RAD {
            let to_start = plan_move(
                &held,
                &trajectory.start(),
                TO_START_SPEED_PART,
                &self.limits,
            )
            .map_err(|e| (FaultCode::StartPoseMismatch, e.to_string()))?;
            motions.push_back(Box::new(to_start));
        }
        motions.push_back(Box::new(motion));
        Ok(motions)
    }
}
