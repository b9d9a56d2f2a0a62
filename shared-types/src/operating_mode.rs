//! How fast and how often an armed controller may move the arm.
//!
//! In the spirit of ISO 10218 and TS 15066, but **not a safety function**: the
//! emergency stop, the arm's own limits and distance are.

use serde::{Deserialize, Serialize};

/// What the operator armed the controller for. Numbers are part of the shared
/// layout; 0 stands for not armed.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum OperatingMode {
    /// Setting up and teaching: at most 250 mm/s at the tool.
    #[default]
    SetUp = 1,
    /// Wiggles: at most 500 mm/s at the tool unless configured otherwise, begun within ten
    /// seconds of the confirmation that the area is clear.
    Wiggle = 2,
    /// One throw at the full limits, begun within ten seconds of that confirmation.
    Throw = 3,
}

impl OperatingMode {
    /// The operating mode of a raw number, `None` for 0 (not armed) and unknown ones. RT-safe.
    #[must_use]
    pub fn from_raw(raw: u8) -> Option<Self> {
        let mut all = [Self::SetUp, Self::Wiggle, Self::Throw].into_iter();
        all.find(|mode| *mode as u8 == raw)
    }
}

/// An arming, as ordered. Nothing renews it: it ends with its shot (throw), its
/// expiry, a disarming, a released dead-man switch, or any stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Arming {
    /// What for.
    pub operating_mode: OperatingMode,
    /// Motions must begin before this instant (CLOCK_MONOTONIC, ns). For throws
    /// the controller allows ten seconds at most.
    pub expires_ns: u64,
    /// The operator confirmed that nobody is within reach of arm and rope; throws need it.
    /// When that was is checked where the arming is requested.
    pub area_clear: bool,
}
