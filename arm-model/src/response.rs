//! How an arm follows its setpoints, as measured: `arm-response.toml`.
//!
//! Each joint is described by silence, then a second-order lag of gain one:
//! `q'' = w² (u(t - dead time) - q) - 2 z w q'`, where `u` is the staircase of
//! setpoints at the instants they left this machine. A joint whose motion told
//! too little has no numbers at all, never guessed ones.
//!
//! ```toml
//! format = 1
//! version = "0.1.0"                  # of the program that measured
//! source = "arm 192.168.1.215:502"   # or the run folder
//! command_to_target_s = [0.0002, 0.0011]   # left out when it was not seen
//! [excitation]                       # left out when a recorded run was used
//! seed = 1
//! # ... see [`Excitation`]
//! [[joints]]                         # seven, joint 1 first
//! joint = 1
//! excited = true
//! dead_time_s = 0.0214
//! dead_time_interval_s = [0.0209, 0.0216]
//! natural_frequency_hz = 11.3
//! natural_frequency_interval_hz = [11.1, 11.5]
//! damping_ratio = 0.82
//! damping_ratio_interval = [0.80, 0.84]
//! residual_rad = 1.1e-5
//! samples = 900
//! [[joints]]
//! joint = 2
//! excited = false
//! why = "still"
//! ```

mod file;

use crate::joint::START_POSE;
use crate::joint::{JOINTS, JointVector};
use file::ArmResponseForm;
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

/// A measured value with an interval that holds the true one in 95 of 100
/// measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Most likely value.
    pub value: f64,
    /// Interval, lower end first.
    pub interval: [f64; 2],
}

/// How one joint follows its setpoints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrackingLag {
    /// From the sending of a setpoint until it has any effect (s).
    pub dead_time_s: Estimate,
    /// Natural frequency of the lag (Hz).
    pub natural_frequency_hz: Estimate,
    /// Damping ratio of the lag; 1 is critical.
    pub damping_ratio: Estimate,
    /// Root mean square of what the lag leaves unexplained (rad).
    pub residual_rad: f64,
    /// Joint reports used.
    pub samples: u32,
}

impl TrackingLag {
    /// Frequency at which amplitude has fallen by 3 dB (Hz).
    #[must_use]
    pub fn bandwidth_hz(&self) -> f64 {
        let b = 1.0 - 2.0 * self.damping_ratio.value.powi(2);
        self.natural_frequency_hz.value * (b + b.hypot(1.0)).sqrt()
    }

    /// How late the joint is in slow motion (s): dead time and lag together.
    #[must_use]
    pub fn slow_delay_s(&self) -> f64 {
        let w_rad_s = core::f64::consts::TAU * self.natural_frequency_hz.value;
        self.dead_time_s.value + 2.0 * self.damping_ratio.value / w_rad_s
    }
}

/// Why a joint has no numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NotExcited {
    /// It was hardly told to move.
    Still,
    /// It moved too slowly or too little to tell dead time and lag apart.
    Indistinct,
    /// No dead time and second-order lag explain its motion.
    Unexplained,
}

impl NotExcited {
    /// In words.
    #[must_use]
    pub const fn explain(self) -> &'static str {
        match self {
            Self::Still => "did not move",
            Self::Indistinct => "moved too slowly to tell dead time and lag apart",
            Self::Unexplained => "does not follow as a second-order lag would",
        }
    }
}

/// What is known about one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointResponse {
    /// It moved enough.
    Excited(TrackingLag),
    /// It did not; nothing is known.
    NotExcited(NotExcited),
}

impl JointResponse {
    /// The lag, if the joint moved enough.
    #[must_use]
    pub const fn lag(&self) -> Option<&TrackingLag> {
        match self {
            Self::Excited(lag) => Some(lag),
            Self::NotExcited(_) => None,
        }
    }
}

/// The motion an arm is measured with: every joint on its own swings about a
/// pose, ever faster (an exponential sine sweep).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Excitation {
    /// Seed of the phase each joint's sweep begins with.
    pub seed: u64,
    /// Pose about which the joints swing (rad).
    pub pose_rad: JointVector,
    /// Duration of a joint's sweep (s).
    pub duration_s: f64,
    /// Frequency at the start (Hz).
    pub lowest_hz: f64,
    /// Frequency at the end (Hz).
    pub highest_hz: f64,
    /// Largest amplitude (rad).
    pub amplitude_max_rad: f64,
    /// Part of the arm's joint speed, acceleration and jerk that is used.
    pub limits_part: f64,
    /// Largest speed of flange and pole (m/s).
    pub tool_speed_max_m_s: f64,
}

impl Default for Excitation {
    /// 3 s per joint, within the tool speed allowed for setting up.
    fn default() -> Self {
        Self {
            seed: 1,
            pose_rad: START_POSE,
            duration_s: 3.0,
            lowest_hz: 0.8,
            highest_hz: 18.0,
            amplitude_max_rad: 0.05,
            limits_part: 0.5,
            tool_speed_max_m_s: 0.25,
        }
    }
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

#[cfg(test)]
mod tests;
