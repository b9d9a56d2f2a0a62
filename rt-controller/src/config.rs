//! Configuration of the controller process.

mod thresholds;

pub use thresholds::{Profile, ThresholdSettings};

use crate::arm_settings::ArmSettings;
use crate::control::ControlSettings;
use crate::control::monitor::prediction::{DEAD_TIME_MAX_S, MeasuredLag, MeasuredLags};
use crate::os::RealTimeSettings;
use crate::xarm::{COMMAND_PORT, REPORT_PORTS};
use arm_model::{ArmResponse, Limits, Pole};
use serde::{Deserialize, Deserializer, Serialize};
use shared_types::CommandInterface;
use shared_types::file_error::why;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};

/// Longest time awake before a deadline: a quarter of the period (us).
const WARM_UP_MAX_US: u32 = 1000;
/// Why a configuration is refused: the file or the key, what is wrong and what would be
/// allowed.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ConfigError(String);

/// What is done about an arm that is configured otherwise than the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnDifference {
    /// Refuse and name both values. For a real arm: somebody configured it, and
    /// somebody should look.
    #[default]
    Refuse,
    /// Set the arm to what the controller is configured for.
    Set,
}

/// Configuration of the controller; TOML keys as the fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    /// Shared-memory domain of the installation.
    pub domain: String,
    /// Address of the arm.
    pub arm: IpAddr,
    /// Whether it is the simulated arm, which must prove it. Any other arm is driven with
    /// real-time properties, guardian and arming, or not at all.
    pub simulated: bool,
    /// Command port of the arm.
    pub command_port: u16,
    /// Real-time report port of the arm (250 Hz).
    pub report_port: u16,
    /// Report port used when the other one refuses (100 Hz).
    pub fallback_report_port: u16,
    /// Ports with the arm's status (5 Hz), in the order in which they are tried.
    pub status_ports: [u16; 2],
    /// What to do when the arm's tool or its tool speed limit does not fit
    /// the limits, or load or collision sensitivity not those of `arm_settings`.
    pub on_difference: OnDifference,
    /// What the arm must be set to.
    pub arm_settings: ArmSettings,
    /// The pole, as the cell has it; its end is what set-up motions and wiggles keep slow.
    pub pole: Pole,
    /// How setpoints reach the arm.
    pub command_interface: CommandInterface,
    /// Whether motions need an arming. Without, every motion runs as a throw
    /// would; for tests of other things.
    pub arming_required: bool,
    /// The operator's enabling switch, where one is wired to the arm.
    pub enabling_input: Option<EnablingInput>,
    /// File with the limits, relative to this file.
    pub limits_file: Option<PathBuf>,
    /// Limits given here; without either, those of an xArm 7.
    pub limits: Option<Limits>,
    /// How the arm follows its setpoints, as `wag latency` measured it; relative to this file.
    /// Its joints are then compared with where they should be by that, not with all that was
    /// commanded within the tracking window.
    pub arm_response_file: Option<PathBuf>,
    /// What the control thread asks of the machine.
    pub real_time: RealTimeSettings,
    /// When the monitors give up.
    pub thresholds: ThresholdSettings,
    /// How the guardian watches the controller.
    pub guardian: GuardianSettings,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        let [report_port, normal, rich, fallback_report_port] = REPORT_PORTS;
        Self {
            domain: "wag".to_owned(),
            arm: IpAddr::V4(Ipv4Addr::LOCALHOST),
            simulated: false,
            command_port: COMMAND_PORT,
            report_port,
            fallback_report_port,
            status_ports: [rich, normal],
            on_difference: OnDifference::default(),
            arm_settings: ArmSettings::default(),
            limits_file: None,
            limits: None,
            arm_response_file: None,
            real_time: RealTimeSettings::default(),
            thresholds: ThresholdSettings::default(),
            pole: Pole::default(),
            command_interface: CommandInterface::default(),
            arming_required: true,
            enabling_input: None,
            guardian: GuardianSettings::default(),
        }
    }
}

/// An enabling switch at a digital input of the arm's control box: nothing is armed unless it
/// is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnablingInput {
    /// Number of the input: 0 to 7 for CI0 to CI7, 8 to 15 for DI0 to DI7.
    #[serde(deserialize_with = "input_number")]
    pub number: u8,
    /// Level of the input while the switch is held. A broken wire must give the other one.
    pub held_high: bool,
}

fn input_number<'de, D: Deserializer<'de>>(from: D) -> Result<u8, D::Error> {
    let number = u8::deserialize(from)?;
    if number < 16 {
        return Ok(number);
    }
    let refused = format_args!("the number of an input is {number}, it must be 0 to 15");
    Err(serde::de::Error::custom(refused))
}

impl EnablingInput {
    /// Whether the switch is held at these levels of all inputs.
    #[must_use]
    pub const fn is_held(self, levels: u16) -> bool {
        let high = levels.unbounded_shr(self.number as u32) & 1 != 0;
        self.number < 16 && high == self.held_high
    }
}

/// How the guardian watches; table `[guardian]` of the controller's file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuardianSettings {
    /// Silence of a moving controller after which the arm is stopped (ms). Absent: two
    /// cycles more than the controller may miss (`thresholds.missed_cycles_max`), so that
    /// what it meets itself is left to it. A controller whose process ends is met at once.
    pub silence_ms: Option<f64>,
    /// `SCHED_FIFO` priority of the guardian, 1 to 99, above the control thread.
    /// Absent: ordinary scheduling.
    pub priority: Option<u8>,
    /// Whether the controller moves only while a guardian watches.
    pub required: bool,
}

impl Default for GuardianSettings {
    fn default() -> Self {
        Self {
            silence_ms: None,
            priority: Some(85),
            required: true,
        }
    }
}

/// Refuses the value found under a key unless it is allowed.
fn require(
    holds: bool,
    key: &str,
    found: impl Into<f64>,
    allowed: &'static str,
) -> Result<(), ConfigError> {
    if holds {
        return Ok(());
    }
    let found = found.into();
    Err(ConfigError(format!(
        "`{key}` is {found}, it must be {allowed}"
    )))
}

impl ControllerConfig {
    /// Reads a file; relative files that it names are looked for beside it.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let mut config: Self = read_toml(path)?;
        let files = [&mut config.limits_file, &mut config.arm_response_file];
        for file in files.into_iter().flatten() {
            if let Some(folder) = path.parent() {
                *file = folder.join(&*file);
            }
        }
        Ok(config)
    }

    /// The limits that this configuration names.
    pub fn resolve_limits(&self) -> Result<Limits, ConfigError> {
        let limits = match (&self.limits_file, &self.limits) {
            (Some(_), Some(_)) => {
                let twice = "give either `limits_file` or a table `[limits]`, not both";
                return Err(ConfigError(twice.to_owned()));
            }
            (Some(path), None) => read_toml(path)?,
            (None, Some(limits)) => limits.clone(),
            (None, None) => Limits::default(),
        };
        let rated = limits.check_rating();
        rated.map_err(|reason| ConfigError(format!("limits: {reason}")))?;
        Ok(limits)
    }

    /// The lags of the joints that `arm_response_file` tells of; none without.
    ///
    /// # Errors
    /// The file cannot be read or used.
    pub fn measured_lags(&self) -> Result<MeasuredLags, ConfigError> {
        let Some(path) = &self.arm_response_file else {
            return Ok(MeasuredLags::default());
        };
        let lags = measured_lags(&read_toml(path)?);
        lags.map_err(|ConfigError(why)| ConfigError(format!("{}: {why}", path.display())))
    }

    /// Whether real-time properties that cannot be had are a refusal.
    pub(crate) const fn requires_real_time(&self) -> bool {
        self.real_time.require || !self.simulated
    }

    /// Settings of the control core.
    pub fn control_settings(&self) -> Result<ControlSettings, ConfigError> {
        Ok(ControlSettings {
            interface: self.command_interface,
            arming_required: self.arming_required,
            guardian_required: self.guardian.required,
            ..ControlSettings::from(self.thresholds.checked(self.simulated)?)
        })
    }

    /// Silence of a moving controller after which the guardian stops the arm (ns).
    ///
    /// # Errors
    /// It is shorter than the longest gap that the controller meets itself, or no number.
    pub fn guardian_silence_ns(&self) -> Result<u64, ConfigError> {
        let missed = self.thresholds.checked(self.simulated)?.missed_cycles_max;
        let cycle_ms = 1e3 * self.resolve_limits()?.period_s();
        let least_ms = cycle_ms * f64::from(missed.saturating_add(2));
        let found_ms = self.guardian.silence_ms.unwrap_or(least_ms);
        if (least_ms - 1e-9..=5000.0).contains(&found_ms) {
            return Ok((found_ms * 1e6).round() as u64);
        }
        Err(ConfigError(format!(
            "`guardian.silence_ms` is {found_ms}, it must be {least_ms:.0} (two cycles of {cycle_ms:.3} ms more than `thresholds.missed_cycles_max`) to 5000 ms; left out, it is that"
        )))
    }

    /// Checks what cannot be wrong by type alone.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.guardian_silence_ns()?;
        if let Some((key, found, allowed)) = self.arm_settings.impossible() {
            require(false, key, found, allowed)?;
        }
        for (key, holds) in [
            ("arming_required", self.arming_required),
            ("guardian.required", self.guardian.required),
            ("guardian.priority", self.guardian.priority.is_some()),
            ("real_time.lock_memory", self.real_time.lock_memory),
            ("real_time.priority", self.real_time.priority.is_some()),
            (
                "thresholds.profile",
                self.thresholds.profile != Some(Profile::Relaxed),
            ),
        ] {
            if !holds && !self.simulated {
                return Err(ConfigError(format!(
                    "`{key}` is as only the simulated arm may be driven (`simulated = true`)"
                )));
            }
        }
        let warm_up_us = self.real_time.warm_up_us;
        let holds = warm_up_us <= WARM_UP_MAX_US;
        require(holds, "real_time.warm_up_us", warm_up_us, "0 to 1000 us")?;
        match self.real_time.priority {
            Some(found) if !(11..=99).contains(&found) => Err(ConfigError(format!(
                "`real_time.priority` is {found}, it must be 11 to 99 (absent for none)"
            ))),
            _ => Ok(()),
        }
    }
}

/// The lags of an arm's joints, as the controller predicts by them.
///
/// # Errors
/// A dead time is longer than setpoints are remembered.
pub fn measured_lags(response: &ArmResponse) -> Result<MeasuredLags, ConfigError> {
    let lags = response.joints.map(|joint| {
        joint.lag().map(|lag| MeasuredLag {
            dead_time_s: lag.dead_time_s.value,
            natural_frequency_rad_s: core::f64::consts::TAU * lag.natural_frequency_hz.value,
            damping_ratio: lag.damping_ratio.value,
        })
    });
    let dead_s = lags.iter().flatten().map(|lag| lag.dead_time_s);
    let longest_s = dead_s.fold(0.0, f64::max);
    if longest_s <= DEAD_TIME_MAX_S {
        return Ok(lags);
    }
    Err(ConfigError(format!(
        "a dead time is {longest_s:.3} s, longer than the {DEAD_TIME_MAX_S} s that the controller can watch: measure the arm again on a direct cable"
    )))
}

fn read_toml<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, ConfigError> {
    let path_of = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|reason| ConfigError(format!("cannot read {path_of}: {}", why(&reason))))?;
    toml::from_str(&text)
        .map_err(|reason| ConfigError(format!("{path_of} is not a valid configuration: {reason}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Thresholds;

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
        let unknown = parse("comand_port = 5").unwrap_err().to_string();
        assert!(unknown.contains("comand_port"), "{unknown}");
        for (text, allowed) in [
            ("thresholds.reply_stall_ms = 0.0", "10000"),
            ("thresholds.tracking_window_ms = 251.0", "250"),
            ("thresholds.tracking_error_max_rad = nan", "1 rad"),
            ("thresholds.unanswered_max = 0", "at least 1"),
            ("guardian.silence_ms = 27.0", "28 (two"),
            ("real_time.priority = 5", "11 to 99"),
            ("real_time.warm_up_us = 1001", "1000"),
            ("arm_settings.collision_sensitivity = 6", "off"),
        ] {
            let said = parse(text).unwrap().check().unwrap_err().to_string();
            let (key, _) = text.split_once(' ').unwrap();
            assert!(said.contains(key) && said.contains(allowed), "{said}");
        }
        let input = parse("enabling_input = { number = 16, held_high = false }");
        let input = input.unwrap_err().to_string();
        assert!(input.contains("16, it must be 0 to 15"), "{input}");
        let config = ControllerConfig {
            limits: Some(Limits::default()),
            limits_file: Some("x".into()),
            ..ControllerConfig::default()
        };
        let twice = config.resolve_limits().unwrap_err().to_string();
        assert!(twice.contains("not both"), "{twice}");
    }

    #[test]
    fn only_the_simulated_arm_is_held_to_relaxed_thresholds_or_may_do_without_watch() {
        let shipped = ThresholdSettings::default();
        assert_eq!(shipped.checked(true).unwrap(), Thresholds::relaxed());
        assert_eq!(shipped.checked(false).unwrap(), Thresholds::strict());
        let parse = |text: &str| toml::from_str::<ControllerConfig>(text).unwrap();
        for text in [
            "arming_required = false",
            "guardian.required = false",
            "real_time.lock_memory = false",
            "thresholds.profile = 'relaxed'",
        ] {
            let said = parse(text).check().unwrap_err().to_string();
            let (key, _) = text.split_once(' ').unwrap();
            assert!(said.contains(key) && said.contains("simulated"), "{said}");
            let simulated = format!("simulated = true\n{text}");
            parse(&simulated).check().unwrap();
        }
        for (text, required) in [
            ("", true),
            ("simulated = true", false),
            ("simulated = true\nreal_time.require = true", true),
        ] {
            assert_eq!(parse(text).requires_real_time(), required, "{text}");
        }
        let own = ThresholdSettings {
            profile: Some(Profile::Strict),
            reply_stall_ms: Some(20.0),
            ..shipped
        };
        let thresholds = own.checked(true).unwrap();
        assert_eq!(thresholds.reply_stall_ns, 20_000_000);
        assert_eq!(thresholds.late_cycles_max, 2);
    }
}
