//! What each request of the controller's service leads to.

use super::answers::{ControllerCall, answer, refuse};
use super::{Awaited, Bridge, Open, REPORT_WAIT, SET_UP_TIMEOUT};
use crate::commander::CommanderLock;
use crate::control::{ControlCommand, Motion};
use crate::os::now_ns;
use crate::point_to_point::{plan_move, verify};
use crate::session::{ArmSession, SessionError};
use crate::set_up::{SetUp, SetUpError};
use crate::transport::tcp::{LinkSettings, TcpLink};
use arm_model::kinematics::tool_speed_m_s;
use arm_model::{JointTrajectory, JointVector};
use shared_types::ipc::ControllerMode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::plan::trajectory_hash;
use shared_types::{Arming, FaultCode, MonotonicNs, OperatingMode};
use std::collections::VecDeque;
use std::time::Instant;

/// Largest distance of the held pose from the start of a plan (rad): 0.5 deg.
const START_DISTANCE_MAX_RAD: f64 = 0.5 * core::f64::consts::PI / 180.0;
/// Smaller distances need no move to the start (rad).
const START_EQUAL_RAD: f64 = 1e-9;
/// Longest time that an arming for setting up or wiggling lasts (ns): ten minutes.
const ARMED_FOR_NS: u64 = 600_000_000_000;
/// What the loop judges by, differences over a cycle, may be this part less than the speed.
const SPEED_ROUNDING: f64 = 1e-3;
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
            // Whatever the newest record says: an engagement may be on its way to the loop.
            ControllerRequest::Stop => {
                self.pass_on(call, ControlCommand::Stop, None, Awaited::Stopped);
            }
            // The mode is that of before: what is on its way to the loop may undo a stop.
            ControllerRequest::Bringup | ControllerRequest::Acknowledge if self.settles() => {
                self.wrong_mode(&call, "a stop or a bring-up is under way; ask again");
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
                area_clear,
            } => self.serve_arming(call, operating_mode, area_clear),
            ControllerRequest::Disarm => match self.command(ControlCommand::Disarm, None) {
                Ok(()) => {
                    // With its next cycle.
                    self.operating_mode = None;
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
            ControllerRequest::ExecuteUploaded { sha256 } => {
                match self.uploads.plan(&sha256).copied() {
                    Some(trajectory) => self.serve_execute(call, &trajectory, &sha256),
                    None => self.wrong_mode(&call, "there is no uploaded plan with this hash"),
                }
            }
            ControllerRequest::Execute {
                ref trajectory,
                sha256,
            } => {
                let trajectory = trajectory.clone();
                self.serve_execute(call, &trajectory, &sha256);
            }
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
                operating_mode: self.operating_mode,
                warnings: [&self.warnings[..], &self.arm_warnings].concat(),
            },
        );
    }

    fn wrong_mode(&self, call: &ControllerCall, why: &str) {
        let message = format!("the controller is {:?}: {why}", self.mode());
        refuse(call, FaultCode::WrongMode, &message);
    }

    /// Hands an arming to the loop, which answers. Throws expire sooner there.
    fn serve_arming(
        &mut self,
        call: ControllerCall,
        operating_mode: OperatingMode,
        area_clear: bool,
    ) {
        if self.mode() != ControllerMode::Idle {
            return self.wrong_mode(&call, "it is armed when it is Idle");
        }
        let arming = Arming {
            operating_mode,
            expires_ns: now_ns().saturating_add(ARMED_FOR_NS),
            area_clear,
        };
        self.pass_on(call, ControlCommand::Arm(arming), None, Awaited::Armed);
    }

    /// Hands a command to the loop; what it `awaits` will answer the call.
    fn pass_on(
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
        let planned = plan_move(&self.newest.q_c, &q, speed_fraction, &self.limits)
            .map_err(|error| (error.fault, error.to_string()))
            .and_then(|motion| self.keeps_armed_speed(&motion).map(|()| motion));
        match planned {
            Ok(motion) => self.begin(call, Box::new(motion), VecDeque::new()),
            Err((fault, detail)) => refuse(&call, fault, &detail),
        }
    }

    /// Refuses a motion whose tool is faster than it is armed for: the loop would brake it on
    /// its way.
    fn keeps_armed_speed(&self, motion: &Motion) -> Result<(), (FaultCode, String)> {
        // What is not armed the loop refuses.
        let Some(armed) = self
            .operating_mode
            .filter(|_| self.settings.arming_required)
        else {
            return Ok(());
        };
        let is_move = matches!(motion, Motion::Move { .. });
        let limit_m_s = self.limits.tcp_speed_max_m_s;
        let most_m_s = self.settings.tool_speed_max_m_s(is_move, armed, limit_m_s);
        let period_s = self.limits.period_s();
        let cycles = (motion.duration_s() / period_s).ceil() as u32;
        let tool_m_s = |cycle: u32| {
            let t_s = f64::from(cycle) * period_s;
            let state = motion.state_at(t_s);
            let speed_m_s = tool_speed_m_s(&state.q, &state.qd, &self.limits.tcp_offset());
            (speed_m_s, t_s)
        };
        let fastest = (0..=cycles)
            .map(tool_m_s)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        match fastest {
            Some((top_m_s, at_s)) if top_m_s > most_m_s * (1.0 + SPEED_ROUNDING) => {
                let detail = format!(
                    "the tool would reach {top_m_s:.3} m/s after {at_s:.2} s, armed for {armed:?} it may move at {most_m_s:.3}: move more slowly, or arm for more"
                );
                Err((FaultCode::OperatingModeExceeded, detail))
            }
            _ => Ok(()),
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
        match self.admit_plan(trajectory, sha256) {
            Ok(mut motions) => match motions.pop_front() {
                Some(first) => self.begin(call, first, motions),
                None => refuse(&call, FaultCode::PlanOutOfLimits, ""),
            },
            Err((fault, detail)) => refuse(&call, fault, &detail),
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
        self.keeps_armed_speed(&motion)?;
        motions.push_back(Box::new(motion));
        Ok(motions)
    }
}
