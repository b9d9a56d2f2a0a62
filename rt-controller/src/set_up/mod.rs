//! Bring-up and recovery: from whatever state the arm is in to one that follows
//! setpoints, step by step, each with its result.
//!
//! Nothing of the arm is trusted: its firmware, report layouts, joint ranges, tool,
//! speed limit and settings are read and compared with what the controller is configured
//! for, and the mode that it was asked for is read back. A difference is a refusal that
//! names both, unless the configuration says that the arm shall be set. Order of the
//! recovery as in the vendor's manual: clear error, enable, mode, state.

mod compare;
mod geometry;
mod reports;

pub use compare::{Headroom, ToolSpeed};
pub use reports::read_status;

use crate::config::ControllerConfig;
use crate::session::{ArmSession, SessionError};
use crate::xarm::{ArmState, ArmVersion, Command, JointQuery, Mode, ReplyData, StateRequest};
use arm_model::{JointVector, Limits};
use shared_types::{CommandInterface, FaultCode};
use std::time::{Duration, Instant};

/// The arm stands when two poses read this far apart in time ...
const STILL_INTERVAL: Duration = Duration::from_millis(30);
/// ... differ less than this (rad).
const STILL_RAD: f64 = 1e-4;
/// Longest wait for the arm to become ready and to stand still.
const READY_TIMEOUT: Duration = Duration::from_secs(3);
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

/// An arm that stands closer than this to what it is commanded holds it (deg): the step that it
/// takes if its own word for that is an old one.
const HELD_WITHIN_DEG: f64 = 0.1;

/// Takes every step that was done: its name and its result.
pub type OnStep<'a> = &'a mut dyn FnMut(&'static str, &str);

impl SetUp<'_> {
    /// Sets up the arm behind `session`; each step is `reported`. Where it stands (rad), and
    /// what the operator should know.
    ///
    /// # Errors
    /// [`SetUpError`]; the step that failed was not reported.
    pub fn run(
        &self,
        session: &mut ArmSession,
        reported: OnStep<'_>,
    ) -> Result<(JointVector, Vec<String>), SetUpError> {
        let mut warnings = Vec::new();
        let version = self.identify(session)?;
        reported(
            "identify",
            &format!("xArm 7, firmware {}", version.firmware),
        );
        reported("error before", &session.error_code()?.to_string());
        reported(
            "reports",
            &self.match_layout(version.firmware, &mut warnings)?,
        );
        reported("tool", &self.match_tool(session)?);
        reported(
            "tool speed",
            &self.match_tool_speed(session, version.firmware, &mut warnings)?,
        );
        reported("settings", &self.match_settings(session)?);
        self.read_settings_back()?;
        reported("settings read back", "tool and settings as above");
        reported("geometry", &self.match_geometry(session, &mut warnings)?);
        let enabled = self.enable(session, reported);
        if enabled.is_err() {
            // Nobody watches an arm that was refused: it must not stay ready.
            let _ = session.stop_arm();
        }
        enabled.map(|q| (q, warnings))
    }

    /// Enables the arm, which is set as it must be, until it stands ready in its mode.
    fn enable(
        &self,
        session: &mut ArmSession,
        reported: OnStep<'_>,
    ) -> Result<JointVector, SetUpError> {
        let mode = Mode::from_code(self.config.command_interface.arm_mode());
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
        self.read_all_back(mode)?;
        let effect = format!("ready, mode {mode:?}, all joints enabled");
        reported("read back", &effect);
        let stands = wait_still(session)?;
        reported("still", "the arm stands");
        let interface = self.config.command_interface;
        let (q, hold) = pose_to_hold(session, stands, interface)?;
        reported("hold", &hold);
        let violation = |q: &JointVector| self.limits.position_violation(q).map(|j| (j, q[j]));
        match violation(&stands).or_else(|| violation(&q)) {
            Some((j, q_rad)) => {
                let joint = j.saturating_add(1);
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
        if self.config.simulated && !session.proves_simulated()? {
            let arm = session.address();
            let message = format!(
                "the arm at {arm} does not prove that it is the simulated one, as `simulated = true` says: take that out for a real arm"
            );
            return refuse(FaultCode::ArmDiffers, message);
        }
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

/// The pose to hold (rad), in words too: by positions what the arm is commanded to hold if it
/// stands there, since a joint that droops would be let down by each bring-up that held the
/// measured pose; else where it stands. Joint velocities would draw the arm to any other pose.
fn pose_to_hold(
    session: &mut ArmSession,
    stands: JointVector,
    interface: CommandInterface,
) -> Result<(JointVector, String), SetUpError> {
    let asked = session.ask(&Command::JointPosition(JointQuery::Commanded))?;
    let ReplyData::Joints(commanded) = asked else {
        return Ok((stands, "where it stands".to_owned()));
    };
    let off_deg = (commanded - stands).max_abs().to_degrees();
    if interface == CommandInterface::ServoPosition && off_deg <= HELD_WITHIN_DEG {
        let hold = format!("as commanded, {off_deg:.3} deg from where it stands");
        return Ok((commanded, hold));
    }
    let hold = format!("where it stands, {off_deg:.3} deg from what it was commanded");
    Ok((stands, hold))
}
