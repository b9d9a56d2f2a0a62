//! A measured arm, the form in which it lies in its file, and what is refused.

use super::measured::{Estimate, Excitation, JointResponse, NotExcited, TrackingLag};
use crate::joint::JOINTS;
use serde::{Deserialize, Serialize};

/// Version of the file's layout.
pub const RESPONSE_FORMAT: u32 = 1;

/// Why a file is no arm response: which joint and key, and what it must be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct ArmResponseError(String);

fn refused<T>(why: String) -> Result<T, ArmResponseError> {
    Err(ArmResponseError(why))
}

/// A measured arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ArmResponseForm", into = "ArmResponseForm")]
pub struct ArmResponse {
    /// Version of the program that measured.
    pub version: String,
    /// Arm or run the measurement is from.
    pub source: String,
    /// From the sending of a setpoint until the arm reports it as its target
    /// (s): the interval most setpoints agree on, when the arm's reports show it.
    pub command_to_target_s: Option<[f64; 2]>,
    /// The motion it was measured with; none for a recorded run.
    pub excitation: Option<Excitation>,
    /// Joint 1 first.
    pub joints: [JointResponse; JOINTS],
}

/// The file form.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArmResponseForm {
    format: u32,
    version: String,
    source: String,
    command_to_target_s: Option<[f64; 2]>,
    excitation: Option<Excitation>,
    joints: Vec<JointForm>,
}

/// One joint of the file.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointForm {
    joint: u8,
    excited: bool,
    why: Option<NotExcited>,
    dead_time_s: Option<f64>,
    dead_time_interval_s: Option<[f64; 2]>,
    natural_frequency_hz: Option<f64>,
    natural_frequency_interval_hz: Option<[f64; 2]>,
    damping_ratio: Option<f64>,
    damping_ratio_interval: Option<[f64; 2]>,
    residual_rad: Option<f64>,
    samples: Option<u32>,
}

impl JointForm {
    fn of(joint: u8, response: &JointResponse) -> Self {
        match response {
            JointResponse::NotExcited(why) => Self {
                joint,
                why: Some(*why),
                ..Self::default()
            },
            JointResponse::Excited(lag) => Self {
                joint,
                excited: true,
                dead_time_s: Some(lag.dead_time_s.value),
                dead_time_interval_s: Some(lag.dead_time_s.interval),
                natural_frequency_hz: Some(lag.natural_frequency_hz.value),
                natural_frequency_interval_hz: Some(lag.natural_frequency_hz.interval),
                damping_ratio: Some(lag.damping_ratio.value),
                damping_ratio_interval: Some(lag.damping_ratio.interval),
                residual_rad: Some(lag.residual_rad),
                samples: Some(lag.samples),
                ..Self::default()
            },
        }
    }

    fn response(&self) -> Result<JointResponse, ArmResponseError> {
        if self.excited {
            self.lag().map(JointResponse::Excited)
        } else if self.dead_time_s.is_some() || self.natural_frequency_hz.is_some() {
            self.exactly_when("dead_time_s", true)
        } else {
            let why = self.why.map(JointResponse::NotExcited);
            why.map_or_else(|| self.exactly_when("why", false), Ok)
        }
    }

    fn lag(&self) -> Result<TrackingLag, ArmResponseError> {
        let (hz, hz_interval) = (
            self.natural_frequency_hz,
            self.natural_frequency_interval_hz,
        );
        let (damping, damping_interval) = (self.damping_ratio, self.damping_ratio_interval);
        let dead_time_s = self.within("dead_time_s", self.dead_time_s, [0.0, 1.0], " s")?;
        let hz = self.within("natural_frequency_hz", hz, [0.1, 500.0], " Hz")?;
        let damping = self.within("damping_ratio", damping, [0.01, 10.0], "")?;
        let Some(samples) = self.samples else {
            return self.exactly_when("samples", true);
        };
        Ok(TrackingLag {
            dead_time_s: self.around(
                "dead_time_interval_s",
                dead_time_s,
                self.dead_time_interval_s,
            )?,
            natural_frequency_hz: self.around("natural_frequency_interval_hz", hz, hz_interval)?,
            damping_ratio: self.around("damping_ratio_interval", damping, damping_interval)?,
            residual_rad: self.within("residual_rad", self.residual_rad, [0.0, 1.0], " rad")?,
            samples,
        })
    }

    /// A number that an excited joint has, in its range.
    fn within(
        &self,
        key: &str,
        given: Option<f64>,
        [low, high]: [f64; 2],
        unit: &str,
    ) -> Result<f64, ArmResponseError> {
        let Some(value) = given else {
            return self.exactly_when(key, true);
        };
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            self.wrong(key, value, &format!("from {low} to {high}{unit}"))
        }
    }

    /// A value with the interval that an excited joint has.
    fn around(
        &self,
        key: &str,
        value: f64,
        given: Option<[f64; 2]>,
    ) -> Result<Estimate, ArmResponseError> {
        let Some(interval @ [low, high]) = given else {
            return self.exactly_when(key, true);
        };
        if (low..=high).contains(&value) && low.is_finite() && high.is_finite() {
            Ok(Estimate { value, interval })
        } else {
            self.wrong(key, low, "an interval, lower end first, around the value")
        }
    }

    fn exactly_when<T>(&self, key: &str, excited: bool) -> Result<T, ArmResponseError> {
        let joint = self.joint;
        refused(format!(
            "joint {joint}: `{key}` must be given exactly when `excited` is {excited}"
        ))
    }

    fn wrong<T>(&self, key: &str, value: f64, expected: &str) -> Result<T, ArmResponseError> {
        let joint = self.joint;
        refused(format!(
            "joint {joint}: `{key}` is {value}, but must be {expected}"
        ))
    }
}

impl TryFrom<ArmResponseForm> for ArmResponse {
    type Error = ArmResponseError;
    fn try_from(form: ArmResponseForm) -> Result<Self, ArmResponseError> {
        if form.format != RESPONSE_FORMAT {
            return refused(format!(
                "`format` is {}, this version reads {RESPONSE_FORMAT}: measure the arm again",
                form.format
            ));
        }
        if let Some([low, high]) = form.command_to_target_s
            && !(low.is_finite() && high.is_finite() && low <= high)
        {
            return refused(format!(
                "`command_to_target_s` is {low} to {high}, but must be a finite interval, lower end first"
            ));
        }
        let found = form.joints.len();
        if found != JOINTS {
            return refused(format!(
                "`joints` has {found} entries, it needs one for each of the {JOINTS} joints"
            ));
        }
        let mut joints = [JointResponse::NotExcited(NotExcited::Still); JOINTS];
        for ((place, slot), given) in (1..).zip(&mut joints).zip(&form.joints) {
            if usize::from(given.joint) != place {
                return refused(format!(
                    "entry {place} of `joints` is for joint {}: list them from 1 to {JOINTS}",
                    given.joint
                ));
            }
            *slot = given.response()?;
        }
        Ok(Self {
            version: form.version,
            source: form.source,
            command_to_target_s: form.command_to_target_s,
            excitation: form.excitation,
            joints,
        })
    }
}

impl From<ArmResponse> for ArmResponseForm {
    fn from(response: ArmResponse) -> Self {
        Self {
            format: RESPONSE_FORMAT,
            version: response.version,
            source: response.source,
            command_to_target_s: response.command_to_target_s,
            excitation: response.excitation,
            joints: (1..)
                .zip(&response.joints)
                .map(|(joint, r)| JointForm::of(joint, r))
                .collect(),
        }
    }
}
