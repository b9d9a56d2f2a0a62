//! Configuration of the planner process.

use crate::calm::CalmConfig;
use crate::sysid::IdentifyOptions;
use crate::tasks::{StrikeConfig, StrikeOptions};
use crate::wiggle::WiggleConfig;
use serde::{Deserialize, Serialize};

/// Everything the planner can be told. TOML form: keys as the fields; every
/// table may be left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerConfig {
    /// Shared-memory domain.
    #[serde(default = "default_domain")]
    pub domain: String,
    /// Size and rules of identifications.
    #[serde(default)]
    pub identify: IdentifyOptions,
    /// Size of the search for a throw.
    #[serde(default)]
    pub search: StrikeOptions,
    /// Tuned values of strikes.
    #[serde(default)]
    pub strike: StrikeConfig,
    /// The wiggle.
    #[serde(default)]
    pub wiggle: WiggleConfig,
    /// Moves that take the sway out of the rope.
    #[serde(default)]
    pub calm: CalmConfig,
}

fn default_domain() -> String {
    "lab".to_owned()
}

impl Default for PlannerConfig {
    fn default() -> Self {
        Self {
            domain: default_domain(),
            identify: IdentifyOptions::default(),
            search: StrikeOptions::default(),
            strike: StrikeConfig::default(),
            wiggle: WiggleConfig::default(),
            calm: CalmConfig::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_file_is_the_default_and_unknown_keys_are_refused() {
        let empty: PlannerConfig = toml::from_str("").unwrap();
        assert_eq!(empty, PlannerConfig::default());
        let written = toml::to_string(&empty).unwrap();
        assert_eq!(toml::from_str::<PlannerConfig>(&written).unwrap(), empty);
        assert!(toml::from_str::<PlannerConfig>("[identify]\npopulaton = 3\n").is_err());
    }
}
