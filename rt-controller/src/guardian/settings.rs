//! Settings of the guardian.

use serde::{Deserialize, Serialize};

/// How the guardian watches; table `[guardian]` of the controller's file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuardianSettings {
    /// Silence of a moving controller after which the arm is stopped (ms); three
    /// cycles at 250 Hz. A controller whose process ends is met at once.
    pub silence_ms: f64,
    /// `SCHED_FIFO` priority of the guardian, 1 to 99, above the control thread.
    /// Absent: ordinary scheduling.
    pub priority: Option<u8>,
    /// Whether the controller moves only while a guardian watches.
    pub required: bool,
}

impl Default for GuardianSettings {
    fn default() -> Self {
        Self {
            silence_ms: 12.0,
            priority: Some(85),
            required: true,
        }
    }
}

impl GuardianSettings {
    /// The silence (ns).
    #[must_use]
    pub const fn silence_ns(&self) -> u64 {
        (self.silence_ms * 1e6) as u64
    }
}
