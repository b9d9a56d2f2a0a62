//! What the core is configured to do, and when its monitors give up.

use serde::{Deserialize, Serialize};
use shared_types::{CommandInterface, OperatingMode};

const MS: u64 = 1_000_000;

/// Longest `tracking_window` (ms): what was commanded longer ago is forgotten.
pub const TRACKING_WINDOW_MAX_MS: f64 = 250.0;

/// When the monitors give up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    /// Longest silence of the operator's heartbeat while moving (ns).
    pub operator_timeout_ns: u64,
    /// Longest silence of the guardian's heartbeat (ns).
    pub guardian_timeout_ns: u64,
    /// Longest wait for the reply to a setpoint (ns).
    pub reply_stall_ns: u64,
    /// Most setpoints that may wait for their reply; no more are sent meanwhile.
    pub unanswered_max: u16,
    /// Largest age of the newest joint report while moving (ns).
    pub report_stale_ns: u64,
    /// Longest time in which joint reports may repeat one value while the arm is
    /// commanded to move (ns).
    pub report_frozen_ns: u64,
    /// Most broken joint reports in a row.
    pub report_broken_max: u32,
    /// Most times the arm's clock may be followed anew during a motion.
    pub clock_resyncs_max: u32,
    /// Distance of a measured joint from what was commanded within
    /// `tracking_window_ns` (rad).
    pub tracking_error_max_rad: f64,
    /// Longest lag of the arm that is normal (ns).
    pub tracking_window_ns: u64,
    /// Most cycles missed at once while moving without slowing down.
    pub late_cycles_max: u32,
    /// Most cycles missed at once while moving; beyond, the arm has already
    /// stood still in the gap.
    pub missed_cycles_max: u32,
}

impl Thresholds {
    /// For a real arm on a direct cable and a real-time machine: a stall is
    /// noticed two cycles of 4 ms after the setpoint that met it; what it takes
    /// to compute and send that setpoint is less than the millisecond left.
    #[must_use]
    pub const fn strict() -> Self {
        Self {
            operator_timeout_ns: 300 * MS,
            guardian_timeout_ns: 50 * MS,
            reply_stall_ns: 7 * MS,
            unanswered_max: 3,
            report_stale_ns: 80 * MS,
            report_frozen_ns: 60 * MS,
            report_broken_max: 5,
            clock_resyncs_max: 3,
            tracking_error_max_rad: 0.05,
            tracking_window_ns: 80 * MS,
            late_cycles_max: 2,
            missed_cycles_max: 5,
        }
    }

    /// For a simulated arm on a machine shared with others, where the scheduler
    /// alone may hold a thread up for tens of milliseconds.
    #[must_use]
    pub const fn relaxed() -> Self {
        Self {
            operator_timeout_ns: 500 * MS,
            guardian_timeout_ns: 500 * MS,
            reply_stall_ns: 100 * MS,
            unanswered_max: 25,
            report_stale_ns: 100 * MS,
            report_frozen_ns: 100 * MS,
            report_broken_max: 5,
            clock_resyncs_max: 10,
            tracking_error_max_rad: 0.05,
            tracking_window_ns: 100 * MS,
            late_cycles_max: 5,
            missed_cycles_max: 5,
        }
    }
}

/// Largest tool speed of each operating mode (m/s); a throw's is that of the limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OperatingModeSpeeds {
    /// Setting up.
    pub set_up_m_s: f64,
    /// Wiggles.
    pub wiggle_m_s: f64,
}

impl Default for OperatingModeSpeeds {
    fn default() -> Self {
        Self {
            set_up_m_s: 0.25,
            wiggle_m_s: 0.5,
        }
    }
}

impl OperatingModeSpeeds {
    /// Largest tool speed of an operating mode (m/s), `limit_m_s` at most. RT-safe.
    #[must_use]
    pub const fn of(&self, armed: OperatingMode, limit_m_s: f64) -> f64 {
        match armed {
            OperatingMode::SetUp => self.set_up_m_s.min(limit_m_s),
            OperatingMode::Wiggle => self.wiggle_m_s.min(limit_m_s),
            OperatingMode::Throw => limit_m_s,
        }
    }
}

/// What the core is configured to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ControlSettings {
    /// When the monitors give up.
    pub thresholds: Thresholds,
    /// How setpoints reach the arm.
    pub interface: CommandInterface,
    /// Motions need an arming; without this, every motion runs as a throw would.
    pub arming_required: bool,
    /// Motions need a living guardian.
    pub guardian_required: bool,
    /// Tool speeds of the operating modes.
    pub speeds: OperatingModeSpeeds,
}

impl ControlSettings {
    /// Tool speed that a motion of the controller's own (`is_move`), or one that was given to
    /// it, may show when armed for `armed` (m/s), `limit_m_s` at most. Its own motions never go
    /// faster than a wiggle once arming is in force, whatever is armed. RT-safe.
    #[must_use]
    pub fn tool_speed_max_m_s(&self, is_move: bool, armed: OperatingMode, limit_m_s: f64) -> f64 {
        let armed = if is_move && self.arming_required {
            armed.min(OperatingMode::Wiggle)
        } else {
            armed
        };
        self.speeds.of(armed, limit_m_s)
    }
}

impl From<Thresholds> for ControlSettings {
    /// Servo positions, neither arming nor guardian needed.
    fn from(thresholds: Thresholds) -> Self {
        Self {
            thresholds,
            interface: CommandInterface::ServoPosition,
            arming_required: false,
            guardian_required: false,
            speeds: OperatingModeSpeeds::default(),
        }
    }
}
