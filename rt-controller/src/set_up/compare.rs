//! What an arm is set to, compared with what it is driven for, and read back.

use super::reports::read_status;
use super::{READY_TIMEOUT, SetUp, SetUpError, refuse};
use crate::arm_settings::{near, summary};
use crate::config::OnDifference;
use crate::session::{ArmSession, SessionError};
use crate::xarm::report::{NormalReport, RichReport};
use crate::xarm::{Command, Firmware, Mode, ReplyData, TcpPose};
use arm_model::JOINTS;
use arm_model::limits::TOOL_SPEED_RATED_M_S;
use shared_types::FaultCode;
use std::fmt;
use std::time::{Duration, Instant};

/// The arm checks tool speed against this times its factor (m/s).
const SPEED_AT_FACTOR_ONE_M_S: f64 = 1.0;
/// Speed limits closer than this are equal: they are f32 on the wire (m/s).
const SPEED_EQUAL_M_S: f64 = 1e-4;
/// Largest ratio of the arm's own speed limit (C60) to that of the plans: a higher one guards
/// nothing.
const HEADROOM_MAX: f64 = 1.5;
/// A setpoint that is late by 0.2 ms looks 5 % too fast to the arm: with less, jitter may stop
/// a throw that keeps its limit.
const HEADROOM_FOR_JITTER: f64 = 1.05;
/// What the arm is set to.
const HEADROOM_SET: f64 = 1.1;
/// Tool offsets closer than this are equal (m).
const OFFSET_EQUAL_M: f64 = 1e-4;
/// Status reports lag by so much at most; also the time between two looks at them.
const REPORT_LAG: Duration = Duration::from_millis(200);
/// What to do about a difference that is refused.
const SET_ONE: &str =
    "set one to the other (`on_difference = \"set\"` in rt-controller.toml sets the arm)";

/// How the arm's own tool speed limit fits that of the plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Headroom {
    /// Setpoints may come a little late.
    Enough,
    /// Jitter may stop a throw that keeps its limit.
    Little,
    /// It stops throws that keep their limit, or guards nothing.
    Unfit,
}

/// The arm's own tool speed limit (C60), and that of the plans.
#[derive(Debug, Clone, Copy)]
pub struct ToolSpeed {
    arm_m_s: f64,
    plans_m_s: f64,
    /// Whether the firmware lets it be set.
    is_settable: bool,
}

impl ToolSpeed {
    /// Asks an arm of this firmware; plans keep `plans_m_s`.
    pub fn read(
        session: &mut ArmSession,
        firmware: Firmware,
        plans_m_s: f64,
    ) -> Result<Self, SessionError> {
        let is_settable = firmware >= Firmware::SPEED_FACTOR;
        let factor = if is_settable {
            match session.ask(&Command::GetSpeedLimitFactor)? {
                ReplyData::SpeedLimitFactor(factor) => factor,
                _ => f64::NAN,
            }
        } else {
            1.0
        };
        Ok(Self {
            arm_m_s: factor * SPEED_AT_FACTOR_ONE_M_S,
            plans_m_s,
            is_settable,
        })
    }

    fn most_m_s(&self) -> f64 {
        if self.is_settable {
            within_rating(HEADROOM_MAX * self.plans_m_s)
        } else {
            f64::INFINITY
        }
    }

    /// How both fit.
    #[must_use]
    pub fn headroom(&self) -> Headroom {
        let has = |headroom: f64| {
            let least_m_s = within_rating(headroom * self.plans_m_s);
            let (low, high) = (
                least_m_s - SPEED_EQUAL_M_S,
                self.most_m_s() + SPEED_EQUAL_M_S,
            );
            (low..=high).contains(&self.arm_m_s)
        };
        if has(HEADROOM_FOR_JITTER) {
            Headroom::Enough
        } else if has(1.0) {
            Headroom::Little
        } else {
            Headroom::Unfit
        }
    }

    /// What is wrong, and what to do.
    #[must_use]
    pub fn remedy(&self) -> String {
        let (plans_m_s, set_m_s) = (self.plans_m_s, within_rating(HEADROOM_SET * self.plans_m_s));
        match self.headroom() {
            Headroom::Enough => String::new(),
            Headroom::Little => format!(
                "the arm stops with C60 at {self}: a setpoint that is a little late may stop a throw; set {set_m_s:.3} m/s in the arm, or lower `tcp_speed_max_m_s`"
            ),
            Headroom::Unfit if self.is_settable => format!(
                "the arm limits the tool's speed to {:.3} m/s, which must be {plans_m_s:.3} to {:.3} m/s for plans that keep {plans_m_s:.3} m/s: {SET_ONE}",
                self.arm_m_s,
                self.most_m_s()
            ),
            Headroom::Unfit => format!(
                "this firmware limits the tool's speed to {:.3} m/s for good, the limits say {plans_m_s:.3} m/s: lower `tcp_speed_max_m_s`",
                self.arm_m_s
            ),
        }
    }
}

impl fmt::Display for ToolSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (arm_m_s, plans_m_s) = (self.arm_m_s, self.plans_m_s);
        write!(f, "{arm_m_s:.3} m/s, plans keep {plans_m_s:.3} m/s")
    }
}

/// A tool speed, the arm's rating at most (m/s).
fn within_rating(speed_m_s: f64) -> f64 {
    TOOL_SPEED_RATED_M_S.min(speed_m_s)
}

impl SetUp<'_> {
    pub(super) fn match_tool(&self, session: &mut ArmSession) -> Result<String, SetUpError> {
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

    /// The arm's own tool speed limit beside that of the plans; a warning is added where it is
    /// too close.
    pub(super) fn match_tool_speed(
        &self,
        session: &mut ArmSession,
        firmware: Firmware,
        warnings: &mut Vec<String>,
    ) -> Result<String, SetUpError> {
        let plans_m_s = self.limits.tcp_speed_max_m_s;
        let found = ToolSpeed::read(session, firmware, plans_m_s)?;
        let headroom = found.headroom();
        if headroom == Headroom::Enough {
            return Ok(found.to_string());
        }
        let set_m_s = within_rating(HEADROOM_SET * plans_m_s);
        if self.config.on_difference == OnDifference::Set && found.is_settable {
            session.ask(&Command::SetSpeedLimitFactor(
                set_m_s / SPEED_AT_FACTOR_ONE_M_S,
            ))?;
            let read_back_m_s = ToolSpeed::read(session, firmware, plans_m_s)?.arm_m_s;
            let is_set = (read_back_m_s - set_m_s).abs() <= SPEED_EQUAL_M_S;
            if !is_set {
                let message = format!(
                    "the arm was asked to limit the tool's speed to {set_m_s:.3} m/s but says {read_back_m_s:.3} m/s: set it with the vendor's tool"
                );
                return refuse(FaultCode::ArmDiffers, message);
            }
            return Ok(format!("{found}: set to {set_m_s:.3} m/s"));
        }
        if headroom == Headroom::Unfit {
            return refuse(FaultCode::ArmDiffers, found.remedy());
        }
        warnings.push(found.remedy());
        Ok(found.to_string())
    }

    /// Compares what decides how the arm moves and when it stops by itself. Nothing is set
    /// when something else would be refused.
    pub(super) fn match_settings(&self, session: &mut ArmSession) -> Result<String, SetUpError> {
        let (normal, rich) = read_status(self.status())?;
        let (wanted, tool_m) = (&self.config.arm_settings, self.limits.tcp_offset_m);
        let differences = wanted.differences(&normal, rich.as_ref(), tool_m);
        for difference in &differences {
            let message = difference.message.clone();
            if difference.mend.is_none() {
                return refuse(FaultCode::ArmDiffers, message);
            }
            if self.config.on_difference == OnDifference::Refuse {
                return refuse(FaultCode::ArmDiffers, format!("{message}: {SET_ONE}"));
            }
        }
        let mut result = summary(&normal, rich.as_ref());
        for difference in differences {
            if let Some(command) = difference.mend {
                session.ask(&command)?;
                result = format!("{result}; {}: set", difference.message);
            }
        }
        Ok(result)
    }

    /// Waits until the arm reports the tool and the settings that it must have.
    pub(super) fn read_settings_back(&self) -> Result<(), SetUpError> {
        self.wait_for_report(|_| None)
    }

    /// Waits until the arm reports that it is ready in `mode`, enabled, and still set as it
    /// must be. In another mode it would make a motion of its own of every setpoint.
    pub(super) fn read_all_back(&self, mode: Mode) -> Result<(), SetUpError> {
        // A report that was made before the last command proves nothing.
        std::thread::sleep(REPORT_LAG);
        self.wait_for_report(|normal| without_effect(mode, normal))
    }

    /// Asks until nothing is `missing` and all settings have effect; after 3 s that is the error.
    fn wait_for_report(
        &self,
        missing: impl Fn(&NormalReport) -> Option<SetUpError>,
    ) -> Result<(), SetUpError> {
        let began = Instant::now();
        loop {
            let (normal, rich) = read_status(self.status())?;
            let found = missing(&normal);
            match found.or_else(|| self.settings_without_effect(&normal, rich.as_ref())) {
                None => return Ok(()),
                Some(error) if began.elapsed() > READY_TIMEOUT => return Err(error),
                Some(_) => std::thread::sleep(REPORT_LAG),
            }
        }
    }

    fn settings_without_effect(
        &self,
        normal: &NormalReport,
        rich: Option<&RichReport>,
    ) -> Option<SetUpError> {
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
        let fault = FaultCode::ArmDiffers;
        Some(SetUpError { fault, message })
    }
}

/// What keeps the arm from following setpoints in `mode`, by its report.
fn without_effect(mode: Mode, report: &NormalReport) -> Option<SetUpError> {
    let (state, error) = (report.basic.state, report.error);
    let disabled = (0..JOINTS).find(|j| report.enabled & (1 << j) == 0);
    let message = if !error.is_none() || !state.can_move() {
        format!("the arm was ready and is so no more (state {state:?}, {error})")
    } else if report.basic.mode != mode {
        format!(
            "the arm was asked for mode {mode:?} but says {:?}: stop other programs that use it",
            report.basic.mode
        )
    } else {
        let joint = disabled?.saturating_add(1);
        format!("joint {joint} does not become enabled: use the vendor's tool to see why")
    };
    let fault = FaultCode::ArmNotReady;
    Some(SetUpError { fault, message })
}
