//! A measured arm, the form in which it lies in its file, and what is refused.

use super::measured::{Estimate, Excitation, JointResponse, NotExcited, TrackingLag};
use crate::joint::JOINTS;
use serde::{Deserialize, Serialize};

/// Version of the file's layout.
pub const RESPONSE_FORMAT: u32 = 1;

/// Why a file is no arm response.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ArmResponseError {
    /// Written by another version.
    #[error("`format` is {found}, this version reads {RESPONSE_FORMAT}: measure the arm again")]
    Format {
        /// Number found.
        found: u32,
    },
    /// Not seven joints.
    #[error("`joints` has {found} entries, it needs one for each of the {JOINTS} joints")]
    JointCount {
        /// Entries found.
        found: usize,
    },
    /// Entries out of order.
    #[error("entry {place} of `joints` is for joint {found}: list them from 1 to {JOINTS}")]
    JointOrder {
        /// Place in the list, 1-based.
        place: usize,
        /// Joint named there.
        found: u8,
    },
    /// An excited joint lacks a value, or one at rest has some.
    #[error("joint {joint}: `{key}` must be given exactly when `excited` is {expected}")]
    Presence {
        /// Joint, 1-based.
        joint: u8,
        /// Key in the file.
        key: &'static str,
        /// Value of `excited` that it belongs to.
        expected: bool,
    },
    /// A value makes no sense.
    #[error("joint {joint}: `{key}` is {value}, but must be {expected}")]
    Value {
        /// Joint, 1-based; 0 for the whole arm.
        joint: u8,
        /// Key in the file.
        key: &'static str,
        /// Value found.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    command_to_target_s: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    excitation: Option<Excitation>,
    joints: Vec<JointForm>,
}

/// One joint of the file.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointForm {
    joint: u8,
    excited: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    why: Option<NotExcited>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dead_time_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dead_time_interval_s: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    natural_frequency_hz: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    natural_frequency_interval_hz: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    damping_ratio: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    damping_ratio_interval: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    residual_rad: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
                why: None,
                dead_time_s: Some(lag.dead_time_s.value),
                dead_time_interval_s: Some(lag.dead_time_s.interval),
                natural_frequency_hz: Some(lag.natural_frequency_hz.value),
                natural_frequency_interval_hz: Some(lag.natural_frequency_hz.interval),
                damping_ratio: Some(lag.damping_ratio.value),
                damping_ratio_interval: Some(lag.damping_ratio.interval),
                residual_rad: Some(lag.residual_rad),
                samples: Some(lag.samples),
            },
        }
    }

    fn response(&self) -> Result<JointResponse, ArmResponseError> {
        if self.excited {
            self.lag().map(JointResponse::Excited)
        } else if self.dead_time_s.is_some() || self.natural_frequency_hz.is_some() {
            Err(self.presence("dead_time_s", true))
        } else {
            self.why
                .map(JointResponse::NotExcited)
                .ok_or(self.presence("why", false))
        }
    }

    fn lag(&self) -> Result<TrackingLag, ArmResponseError> {
        let finite_range = |key, given: Option<f64>, low: f64, high: f64, expected| {
            let value = given.ok_or(self.presence(key, true))?;
            if (low..=high).contains(&value) {
                Ok(value)
            } else {
                Err(self.value(key, value, expected))
            }
        };
        let with = |key, value: f64, interval: Option<[f64; 2]>| {
            let [low, high] = interval.ok_or(self.presence(key, true))?;
            if (low..=high).contains(&value) && low.is_finite() && high.is_finite() {
                Ok(Estimate {
                    value,
                    interval: [low, high],
                })
            } else {
                Err(self.value(key, low, "an interval, lower end first, around the value"))
            }
        };
        let dead_time_s = finite_range("dead_time_s", self.dead_time_s, 0.0, 1.0, "from 0 to 1 s")?;
        let natural_frequency_hz = finite_range(
            "natural_frequency_hz",
            self.natural_frequency_hz,
            0.1,
            500.0,
            "from 0.1 to 500 Hz",
        )?;
        let damping_ratio = finite_range(
            "damping_ratio",
            self.damping_ratio,
            0.01,
            10.0,
            "from 0.01 to 10",
        )?;
        Ok(TrackingLag {
            dead_time_s: with(
                "dead_time_interval_s",
                dead_time_s,
                self.dead_time_interval_s,
            )?,
            natural_frequency_hz: with(
                "natural_frequency_interval_hz",
                natural_frequency_hz,
                self.natural_frequency_interval_hz,
            )?,
            damping_ratio: with(
                "damping_ratio_interval",
                damping_ratio,
                self.damping_ratio_interval,
            )?,
            residual_rad: finite_range(
                "residual_rad",
                self.residual_rad,
                0.0,
                1.0,
                "from 0 to 1 rad",
            )?,
            samples: self.samples.ok_or(self.presence("samples", true))?,
        })
    }

    const fn presence(&self, key: &'static str, expected: bool) -> ArmResponseError {
        ArmResponseError::Presence {
            joint: self.joint,
            key,
            expected,
        }
    }

    const fn value(
        &self,
        key: &'static str,
        value: f64,
        expected: &'static str,
    ) -> ArmResponseError {
        ArmResponseError::Value {
            joint: self.joint,
            key,
            value,
            expected,
        }
    }
}

impl TryFrom<ArmResponseForm> for ArmResponse {
    type Error = ArmResponseError;
    fn try_from(form: ArmResponseForm) -> Result<Self, ArmResponseError> {
        if form.format != RESPONSE_FORMAT {
            return Err(ArmResponseError::Format { found: form.format });
        }
        if let Some([low, high]) = form.command_to_target_s
            && !(low.is_finite() && high.is_finite() && low <= high)
        {
            return Err(ArmResponseError::Value {
                joint: 0,
                key: "command_to_target_s",
                value: low,
                expected: "a finite interval, lower end first",
            });
        }
        let mut joints = [JointResponse::NotExcited(NotExcited::Still); JOINTS];
        if form.joints.len() != JOINTS {
            return Err(ArmResponseError::JointCount {
                found: form.joints.len(),
            });
        }
        for ((place, slot), given) in (1..).zip(&mut joints).zip(&form.joints) {
            if usize::from(given.joint) != place {
                return Err(ArmResponseError::JointOrder {
                    place,
                    found: given.joint,
                });
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
