//! When the monitors give up: a profile, and what a file sets otherwise.

use super::{ConfigError, require};
use crate::control::Thresholds;
use crate::control::settings::TRACKING_WINDOW_MAX_MS;
use serde::{Deserialize, Serialize};

/// Key of the one time that has a maximum of its own.
const WINDOW_KEY: &str = "tracking_window_ms";

/// A set of thresholds that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// For a real arm on a direct cable and a real-time machine.
    Strict,
    /// For a simulated arm on a machine shared with other programs.
    Relaxed,
}

/// When the monitors give up. What is left out comes from the profile, and the
/// profile, when left out, is relaxed for the simulated arm and strict for any other.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThresholdSettings {
    /// Where all the others come from.
    pub profile: Option<Profile>,
    /// Longest silence of the operator's heartbeat while the arm moves (ms).
    pub operator_timeout_ms: Option<f64>,
    /// Longest silence of the guardian's heartbeat (ms).
    pub guardian_timeout_ms: Option<f64>,
    /// Longest wait for the reply to a setpoint (ms).
    pub reply_stall_ms: Option<f64>,
    /// Most setpoints that may wait for their reply; no more are sent meanwhile.
    pub unanswered_max: Option<u16>,
    /// Largest age of the newest joint report while the arm moves (ms).
    pub report_stale_ms: Option<f64>,
    /// Longest time in which joint reports may repeat their values while the arm
    /// is commanded to move (ms).
    pub report_frozen_ms: Option<f64>,
    /// Largest distance of a measured joint from everything commanded in the
    /// last `tracking_window_ms` (rad).
    pub tracking_error_max_rad: Option<f64>,
    /// Longest lag of the arm that counts as normal (ms), 250 at most.
    pub tracking_window_ms: Option<f64>,
    /// Most cycles missed at once without slowing the motion down.
    pub late_cycles_max: Option<u32>,
    /// Most cycles missed at once while the arm moves.
    pub missed_cycles_max: Option<u32>,
}

impl ThresholdSettings {
    /// Checked thresholds for an arm, `simulated` or not.
    pub fn checked(&self, simulated: bool) -> Result<Thresholds, ConfigError> {
        let profile = self.profile.unwrap_or(if simulated {
            Profile::Relaxed
        } else {
            Profile::Strict
        });
        let base = match profile {
            Profile::Strict => Thresholds::strict(),
            Profile::Relaxed => Thresholds::relaxed(),
        };
        for (key, found_ms) in [
            ("operator_timeout_ms", self.operator_timeout_ms),
            ("guardian_timeout_ms", self.guardian_timeout_ms),
            ("reply_stall_ms", self.reply_stall_ms),
            ("report_stale_ms", self.report_stale_ms),
            ("report_frozen_ms", self.report_frozen_ms),
            (WINDOW_KEY, self.tracking_window_ms),
        ] {
            let Some(ms) = found_ms else {
                continue;
            };
            // The window is no longer than what is remembered of the setpoints.
            let (most_ms, allowed) = if key == WINDOW_KEY {
                (TRACKING_WINDOW_MAX_MS, "4 to 250 ms")
            } else {
                (10_000.0, "4 to 10000 ms")
            };
            let key = format!("thresholds.{key}");
            require((4.0..=most_ms).contains(&ms), &key, ms, allowed)?;
        }
        let ns = |found_ms: Option<f64>, base_ns| found_ms.map_or(base_ns, |ms| (ms * 1e6) as u64);
        let checked = Thresholds {
            operator_timeout_ns: ns(self.operator_timeout_ms, base.operator_timeout_ns),
            guardian_timeout_ns: ns(self.guardian_timeout_ms, base.guardian_timeout_ns),
            reply_stall_ns: ns(self.reply_stall_ms, base.reply_stall_ns),
            unanswered_max: self.unanswered_max.unwrap_or(base.unanswered_max),
            report_stale_ns: ns(self.report_stale_ms, base.report_stale_ns),
            report_frozen_ns: ns(self.report_frozen_ms, base.report_frozen_ns),
            tracking_error_max_rad: self
                .tracking_error_max_rad
                .unwrap_or(base.tracking_error_max_rad),
            tracking_window_ns: ns(self.tracking_window_ms, base.tracking_window_ns),
            late_cycles_max: self.late_cycles_max.unwrap_or(base.late_cycles_max),
            missed_cycles_max: self.missed_cycles_max.unwrap_or(base.missed_cycles_max),
            ..base
        };
        let (error, unanswered) = (checked.tracking_error_max_rad, checked.unanswered_max);
        let key = "thresholds.tracking_error_max_rad";
        let allowed = "above 0 and at most 1 rad";
        require(error > 0.0 && error <= 1.0, key, error, allowed)?;
        let key = "thresholds.missed_cycles_max";
        let missed = checked.missed_cycles_max;
        require(missed <= 100, key, missed, "at most 100")?;
        let key = "thresholds.unanswered_max";
        require(unanswered > 0, key, unanswered, "at least 1")?;
        Ok(checked)
    }
}
