//! Configuration of the controller process.

use crate::control::Thresholds;
use crate::os::RealTimeSettings;
use crate::xarm::{COMMAND_PORT, REPORT_PORTS};
use serde::{Deserialize, Serialize};
use shared_types::Limits;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};

/// Why a configuration is refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A file cannot be read.
    #[error("cannot read {path}: {reason}")]
    Read {
        /// File.
        path: PathBuf,
        /// What the system said.
        reason: std::io::Error,
    },
    /// A file is no configuration.
    #[error("{path} is not a valid configuration: {reason}")]
    Parse {
        /// File.
        path: PathBuf,
        /// What is wrong, with line and key.
        reason: Box<toml::de::Error>,
    },
    /// Limits given twice.
    #[error("give either `limits_file` or a table `[limits]`, not both")]
    LimitsTwice,
    /// A threshold makes no sense.
    #[error("`thresholds.{key}` is {found}, it must be {allowed}")]
    Threshold {
        /// Key.
        key: &'static str,
        /// Value found.
        found: f64,
        /// What would be allowed.
        allowed: &'static str,
    },
    /// A priority that does not exist.
    #[error("`real_time.priority` is {found}, it must be 11 to 99 (absent for none)")]
    Priority {
        /// Value found.
        found: u8,
    },
}

/// Configuration of the controller; TOML keys as the fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    /// Shared-memory domain of the installation.
    pub domain: String,
    /// Address of the arm.
    pub arm: IpAddr,
    /// Command port of the arm.
    pub command_port: u16,
    /// Real-time report port of the arm (250 Hz).
    pub report_port: u16,
    /// Report port used when the other one refuses (100 Hz).
    pub fallback_report_port: u16,
    /// File with the limits, relative to this file.
    pub limits_file: Option<PathBuf>,
    /// Limits given here; without either, those of an xArm 7.
    pub limits: Option<Limits>,
    /// What the control thread asks of the machine.
    pub real_time: RealTimeSettings,
    /// When the monitors give up.
    pub thresholds: ThresholdSettings,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        let [report_port, _, _, fallback_report_port] = REPORT_PORTS;
        Self {
            domain: "wag".to_owned(),
            arm: IpAddr::V4(Ipv4Addr::LOCALHOST),
            command_port: COMMAND_PORT,
            report_port,
            fallback_report_port,
            limits_file: None,
            limits: None,
            real_time: RealTimeSettings::default(),
            thresholds: ThresholdSettings::default(),
        }
    }
}

/// When the monitors give up. The defaults tolerate a shared machine and an
/// ordinary network; tighten them on a real-time machine with a direct cable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThresholdSettings {
    /// Longest silence of the operator's heartbeat while the arm moves (ms).
    pub operator_timeout_ms: f64,
    /// Longest wait for the reply to a setpoint (ms).
    pub reply_stall_ms: f64,
    /// Largest age of the newest joint report while the arm moves (ms).
    pub report_stale_ms: f64,
    /// Largest distance of a measured joint from everything it was told in the
    /// last `tracking_window_ms` (rad).
    pub tracking_error_max_rad: f64,
    /// Longest lag of the arm that counts as normal (ms).
    pub tracking_window_ms: f64,
    /// Most cycles missed at once while the arm moves.
    pub missed_cycles_max: u32,
}

impl Default for ThresholdSettings {
    fn default() -> Self {
        Self {
            operator_timeout_ms: 500.0,
            reply_stall_ms: 100.0,
            report_stale_ms: 100.0,
            tracking_error_max_rad: 0.05,
            tracking_window_ms: 100.0,
            missed_cycles_max: 5,
        }
    }
}

impl ThresholdSettings {
    /// Checked thresholds.
    ///
    /// # Errors
    /// [`ConfigError::Threshold`].
    pub fn checked(&self) -> Result<Thresholds, ConfigError> {
        let span = |key, found: f64| {
            if (4.0..=10_000.0).contains(&found) {
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "checked to be 4 to 10 000 just above"
                )]
                Ok((found * 1e6) as u64)
            } else {
                Err(ConfigError::Threshold {
                    key,
                    found,
                    allowed: "4 to 10000 ms",
                })
            }
        };
        let error = self.tracking_error_max_rad;
        if !(error > 0.0 && error <= 1.0) {
            return Err(ConfigError::Threshold {
                key: "tracking_error_max_rad",
                found: error,
                allowed: "above 0 and at most 1 rad",
            });
        }
        Ok(Thresholds {
            operator_timeout_ns: span("operator_timeout_ms", self.operator_timeout_ms)?,
            reply_stall_ns: span("reply_stall_ms", self.reply_stall_ms)?,
            report_stale_ns: span("report_stale_ms", self.report_stale_ms)?,
            tracking_error_max_rad: error,
            tracking_window_ns: span("tracking_window_ms", self.tracking_window_ms)?,
            missed_cycles_max: self.missed_cycles_max,
            ..Thresholds::relaxed()
        })
    }
}

impl ControllerConfig {
    /// Reads a file; a relative `limits_file` is looked for beside it.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let mut config: Self = read_toml(path)?;
        if let (Some(file), Some(folder)) = (&config.limits_file, path.parent()) {
            config.limits_file = Some(folder.join(file));
        }
        Ok(config)
    }

    /// The limits that this configuration names.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn resolve_limits(&self) -> Result<Limits, ConfigError> {
        match (&self.limits_file, &self.limits) {
            (Some(_), Some(_)) => Err(ConfigError::LimitsTwice),
            (Some(path), None) => read_toml(path),
            (None, Some(limits)) => Ok(limits.clone()),
            (None, None) => Ok(Limits::default()),
        }
    }

    /// Checks what cannot be wrong by type alone.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn check(&self) -> Result<(), ConfigError> {
        self.thresholds.checked()?;
        match self.real_time.priority {
            Some(found) if !(11..=99).contains(&found) => Err(ConfigError::Priority { found }),
            _ => Ok(()),
        }
    }
}

fn read_toml<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, ConfigError> {
    let text = std::fs::read_to_string(path).map_err(|reason| ConfigError::Read {
        path: path.to_owned(),
        reason,
    })?;
    toml::from_str(&text).map_err(|reason| ConfigError::Parse {
        path: path.to_owned(),
        reason: Box::new(reason),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_file_is_the_default_and_survives_writing() {
        let config: ControllerConfig = toml::from_str("").unwrap();
        assert_eq!(config, ControllerConfig::default());
        config.check().unwrap();
        let text = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<ControllerConfig>(&text).unwrap(), config);
        assert_eq!(config.resolve_limits().unwrap(), Limits::default());
    }

    #[test]
    fn mistakes_are_named() {
        let parse = toml::from_str::<ControllerConfig>;
        assert!(
            parse("comand_port = 5")
                .unwrap_err()
                .to_string()
                .contains("comand_port")
        );
        let mut config = parse("[thresholds]\nreply_stall_ms = 0.0").unwrap();
        assert!(
            config
                .check()
                .unwrap_err()
                .to_string()
                .contains("thresholds.reply_stall_ms")
        );
        config = parse("[real_time]\npriority = 5").unwrap();
        assert!(matches!(
            config.check(),
            Err(ConfigError::Priority { found: 5 })
        ));
        config.limits = Some(Limits::default());
        config.limits_file = Some("x".into());
        assert!(matches!(
            config.resolve_limits(),
            Err(ConfigError::LimitsTwice)
        ));
    }
}
