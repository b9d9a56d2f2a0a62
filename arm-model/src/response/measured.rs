//! What is measured of a joint, and with what motion.

use crate::joint::{JointVector, START_POSE};
use serde::{Deserialize, Serialize};

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
    #[serde(alias = "limits_part")]
    pub limits_fraction: f64,
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
            limits_fraction: 0.5,
            tool_speed_max_m_s: 0.25,
        }
    }
}
