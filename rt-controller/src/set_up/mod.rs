//! Bring-up and recovery: from whatever state the arm is in to one that follows
//! setpoints, step by step, each with its result.
//!
//! Nothing of the arm is trusted: its firmware, report layouts, joint ranges, tool,
//! speed limit and settings are read and compared with what the controller is configured
//! for, and the mode that it was asked for is read back. A difference is a refusal that
//! names both, unless the configuration says that the arm shall be set. Order of the
//! recovery as in the vendor's manual: clear error, enable, mode, state.

mod reports;

pub use reports::read_status;

use crate::arm_settings::{near, summary};
use crate::config::{ControllerConfig, OnDifference};
use crate::session::{ArmSession, SessionError};
use crate::xarm::report::{NormalReport, RichReport};
use crate::xarm::{
    ArmState, ArmVersion, Command, Firmware, JointQuery, Mode, ReplyData, StateRequest, TcpPose,
};
use arm_model::{JOINTS, JointVector, Limits};
use shared_types::FaultCode;
use std::time::{Duration, Instant};

/// The arm checks tool speed against this times its factor (m/s).
const SPEED_AT_FACTOR_ONE_M_S: f64 = 1.0;
/// Speed limits closer than this are equal: they are f32 on the wire (m/s).
const SPEED_EQUAL_M_S: f64 = 1e-4;
/// Tool offsets closer than this are equal (m).
const OFFSET_EQUAL_M: f64 = 1e-4;
/// The arm stands when two poses read this far apart in time ...
const STILL_INTERVAL: Duration = Duration::from_millis(30);
/// ... differ less than this (rad).
const STILL_RAD: f64 = 1e-4;
/// Longest wait for the arm to become ready and to stand still.
const READY_TIMEOUT: Duration = Duration::from_secs(3);
/// Time between two looks at the status report, which lags by up to 0.2 s.
const STATUS_INTERVAL: Duration = Duration::from_millis(100);

/// What to do about a difference that is refused.
const SET_ONE: &str = "set one to the other (`on_difference = \"set\"` sets the arm)";

/// Why the arm could not be set up: what was found, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct SetUpError {
    /// The fault code nearest to it.
    pub fault: FaultCode,
    message: String,
}

/// Refuses an arm.
fn refuse<T>(fault: FaultCode, message: String) -> Result<T, SetUpError> {
    Err(SetUpError { fault, message })
}

impl From<SessionError> for SetUpError {
    fn from(error: SessionError) -> Self {
        Self {
            fault: FaultCode::LinkLost,
            message: error.to_string(),
        }
    }
}

/// What an arm is set up for.
#[derive(Debug, Clone, Copy)]
pub struct SetUp<'a> {
    /// A checked configuration.
    pub config: &'a ControllerConfig,
    /// The limits that it names.
    pub limits: &'a Limits,
}

/// Takes every step that was done: its name and its result.
pub type OnStep<'a> = &'a mut dyn FnMut(&'static str, &str);

impl SetUp<'_> {
    /// Sets up the arm behind `session`; each step is `reported`. Where it stands (rad).
    ///
    /// # Errors
    /// [`SetUpError`]; the step that failed was not reported.
    pub fn run(
        &self,
        session: &mut ArmSession,
        reported: OnStep<'_>,
    ) -> Result<JointVector, SetUpError> {
        let version = self.identify(session)?;
        reported(
            "identify",
            &format!("xArm 7, firmware {}", version.firmware),
        );
        reported("reports", &self.match_layout(version.firmware)?);
        reported("tool", &self.match_tool(session)?);
        reported(
            "tool speed",
            &self.match_tool_speed(session, version.firmware)?,
        );
        reported("settings", &self.match_settings(session)?);
        let mode = Mode::from_code(self.config.command_interface.arm_mode());
        let found = session.error_code()?;
        reported("error before", &found.to_string());
        let enable = Command::MotionEnable {
            joint: Command::ALL_JOINTS,
            enable: true,
        };
        for (name, command) in [
            ("clear error", Command::CleanError),
            ("clear warning", Command::CleanWarning),
            ("enable", enable),
            ("mode", Command::SetMode(mode)),
            ("state", Command::SetState(StateRequest::Ready)),
        ] {
            session.ask(&command)?;
            reported(name, "taken");
        }
        reported("ready", &format!("{:?}", wait_ready(session)?));
        self.wait_effect(mode)?;
        let effect = format!("mode {mode:?}, all joints enabled, tool and settings as above");
        reported("read back", &effect);
        let q = wait_still(session)?;
        reported("still", "the arm stands");
        match self.limits.position_violation(&q) {
            Some(j) => {
                let (joint, q_rad) = (j.saturating_add(1), q[j]);
                let message = format!(
                    "joint {joint} stands at {q_rad:.4} rad, outside its range: move it back with the vendor's tool"
                );
                refuse(FaultCode::SetpointPosition, message)
            }
            None => Ok(q),
        }
    }

    /// Reads the version and refuses what cannot be driven.
    fn identify(&self, session: &mut ArmSession) -> Result<ArmVersion, SetUpError> {
        let text = match session.ask(&Command::Version)? {
            ReplyData::Text(text) => text.as_str().to_owned(),
            _ => String::new(),
        };
        let checked = ArmVersion::parse(&text).and_then(|v| v.check().map(|()| v));
        let version = checked.or_else(|reason| {
            let arm = session.address();
            let message = format!("the arm at {arm} says `{text}`: {reason}");
            refuse(FaultCode::UnsupportedFirmware, message)
        })?;
        // Every firmware that passes is new enough for protocol 3.
        session.keep_heartbeat();
        match version.wider_than_the_arm(self.limits) {
            Some((j, limit_rad)) => {
                let joint = j.saturating_add(1);
                let message = format!(
                    "joint {joint} may move to {limit_rad:.4} rad by the configured limits, but this arm's range ends earlier: use limits of 1305 arms"
                );
                refuse(FaultCode::ArmDiffers, message)
            }
            None => Ok(version),
        }
    }

    /// Compares what decides how the arm moves and when it stops by itself.
    fn match_settings(&self, session: &mut ArmSession) -> Result<String, SetUpError> {
        let (normal, rich) = read_status(self.status())?;
        let (wanted, tool_m) = (&self.config.arm_settings, self.limits.tcp_offset_m);
        let mut result = summary(&normal, rich.as_ref());
        for difference in wanted.differences(&normal, rich.as_ref(), tool_m) {
            match (self.config.on_difference, difference.mend) {
                (OnDifference::Set, Some(command)) => {
                    session.ask(&command)?;
                    result.push_str("; ");
                    result.push_str(&difference.message);
                    result.push_str(": set");
                }
                (OnDifference::Refuse, Some(_)) => {
                    let message = format!("{}: {SET_ONE}", difference.message);
                    return refuse(FaultCode::ArmDiffers, message);
                }
                (_, None) => return refuse(FaultCode::ArmDiffers, difference.message),
            }
        }
        Ok(result)
    }

    /// Waits until the arm reports what it was set to. In another mode than `mode`, for one,
    /// it would make a motion of its own of every setpoint.
    fn wait_effect(&self, mode: Mode) -> Result<(), SetUpError> {
        let began = Instant::now();
        loop {
            let (normal, rich) = read_status(self.status())?;
            match self.without_effect(mode, &normal, rich.as_ref()) {
                None => return Ok(()),
                Some(_) if began.elapsed() < READY_TIMEOUT => {
                    std::thread::sleep(STATUS_INTERVAL);
                }
                Some((fault, message)) => return refuse(fault, message),
            }
        }
    }

    /// What the arm was set to and does not report.
    fn without_effect(
        &self,
        mode: Mode,
        normal: &NormalReport,
        rich: Option<&RichReport>,
    ) -> Option<(FaultCode, String)> {
        if normal.basic.mode != mode {
            let message = format!(
                "the arm was asked for mode {mode:?} but says {:?}: stop other programs that use it",
                normal.basic.mode
            );
            return Some((FaultCode::ArmNotReady, message));
        }
        if let Some(j) = (0..JOINTS).find(|j| normal.enabled & (1 << j) == 0) {
            let joint = j.saturating_add(1);
            let message =
                format!("joint {joint} does not become enabled: use the vendor's tool to see why");
            return Some((FaultCode::ArmNotReady, message));
        }
        let (wanted, tool_m) = (&self.config.arm_settings, self.limits.tcp_offset_m);
        let mut differ = wanted.differences(normal, rich, tool_m).into_iter();
        let message = differ.next().map(|difference| difference.message);
        let message = message.or_else(|| {
            let arm_m = normal.tcp_offset.position_m;
            let told =
                format!("the arm has its tool centre point at {arm_m:?} m, not {tool_m:?} m");
            (!near(&arm_m, &tool_m, OFFSET_EQUAL_M)).then_some(told)
        })?;
        let message = format!(
            "{message}, though it agreed or was set a moment ago: stop other programs that set the arm"
        );
        Some((FaultCode::ArmDiffers, message))
    }

    fn match_tool(&self, session: &mut ArmSession) -> Result<String, SetUpError> {
        let configured_m = self.limits.tcp_offset_m;
        let (report, _) = read_status(self.status())?;
        let arm_m = report.tcp_offset.position_m;
        if near(&arm_m, &configured_m, OFFSET_EQUAL_M) {
            return Ok(format!("{configured_m:?} m as configured"));
        }
        match self.config.on_difference {
            OnDifference::Refuse => {
                let message = format!(
                    "the arm has its tool centre point at {arm_m:?} m, the limits say {configured_m:?} m: {SET_ONE}"
                );
                refuse(FaultCode::ArmDiffers, message)
            }
            OnDifference::Set => {
                session.ask(&Command::TcpOffset(TcpPose {
                    position_m: configured_m,
                    rpy_rad: [0.0; 3],
                }))?;
                Ok(format!("set from {arm_m:?} to {configured_m:?} m"))
            }
        }
    }

    fn match_tool_speed(
        &self,
        session: &mut ArmSession,
        firmware: Firmware,
    ) -> Result<String, SetUpError> {
        let configured_m_s = self.limits.tcp_speed_max_m_s;
        let settable = firmware >= Firmware::SPEED_FACTOR;
        let factor = match settable.then(|| session.ask(&Command::GetSpeedLimitFactor)) {
            Some(reply) => match reply? {
                ReplyData::SpeedLimitFactor(factor) => factor,
                _ => f64::NAN,
            },
            None => 1.0,
        };
        let arm_m_s = factor * SPEED_AT_FACTOR_ONE_M_S;
        if (arm_m_s - configured_m_s).abs() <= SPEED_EQUAL_M_S {
            return Ok(format!("{configured_m_s:.3} m/s as configured"));
        }
        if self.config.on_difference == OnDifference::Refuse || !settable {
            let message = format!(
                "the arm limits the tool's speed to {arm_m_s:.3} m/s, the limits say {configured_m_s:.3} m/s: {SET_ONE}"
            );
            return refuse(FaultCode::ArmDiffers, message);
        }
        let factor = configured_m_s / SPEED_AT_FACTOR_ONE_M_S;
        session.ask(&Command::SetSpeedLimitFactor(factor))?;
        Ok(format!("set from {arm_m_s:.3} to {configured_m_s:.3} m/s"))
    }
}

fn wait_ready(session: &mut ArmSession) -> Result<ArmState, SetUpError> {
    let began = Instant::now();
    loop {
        let error = session.error_code()?;
        let state = session.state()?;
        if error.is_none() && state.can_move() {
            return Ok(state);
        }
        if began.elapsed() > READY_TIMEOUT {
            if !error.is_none() {
                let message = format!("the arm keeps its error {error}");
                return refuse(FaultCode::ArmError, message);
            }
            let message = format!(
                "the arm does not become ready (state {state:?}): release its emergency stop, or use the vendor's tool to see why"
            );
            return refuse(FaultCode::ArmNotReady, message);
        }
        std::thread::sleep(STILL_INTERVAL);
    }
}

fn wait_still(session: &mut ArmSession) -> Result<JointVector, SetUpError> {
    let began = Instant::now();
    let mut before: Option<JointVector> = None;
    while began.elapsed() < READY_TIMEOUT {
        let q = match session.ask(&Command::JointPosition(JointQuery::MEASURED))? {
            ReplyData::JointMotion { position, .. } => position,
            _ => continue,
        };
        if before.is_some_and(|b| (b - q).max_abs() < STILL_RAD) {
            return Ok(q);
        }
        before = Some(q);
        std::thread::sleep(STILL_INTERVAL);
    }
    let message = "the arm does not stand still: stop other programs that move it";
    refuse(FaultCode::ArmNotReady, message.to_owned())
}
