//! Configuration of the planner.

use crate::identify::IdentifyOptions;
use crate::plan::{
    Drape, DrapeConfig, Lob, LobConfig, PlanOptions, Strike, ThrowConfig, ThrowGoal, start_pose_for,
};
use crate::settle::SettleConfig;
use crate::wiggle::WiggleConfig;
use arm_model::Cell;
use serde::{Deserialize, Serialize};
use shared_types::Task;

/// Everything the planner can be told. TOML form: keys as the fields; every
/// table may be left out. Whoever asks makes requests from it; of the planner process
/// it sets the domain alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlannerConfig {
    /// Shared-memory domain.
    pub domain: String,
    /// The pole, and what stands around the arm; of a process, its caller's.
    pub cell: Cell,
    /// Size and rules of identifications.
    pub identify: IdentifyOptions,
    /// Size of the search for a throw.
    pub search: PlanOptions,
    /// Tuned values of strikes.
    pub strike: ThrowConfig,
    /// Tuned values of lobs.
    pub lob: LobConfig,
    /// Tuned values of drapes.
    pub drape: DrapeConfig,
    /// The wiggle.
    pub wiggle: WiggleConfig,
    /// Moves that damp the rope's swing.
    pub settle: SettleConfig,
}

impl PlannerConfig {
    /// A task at a target (m), as configured.
    #[must_use]
    pub fn goal(&self, kind: Task, target_m: [f64; 3]) -> ThrowGoal {
        match kind {
            Task::Strike => ThrowGoal::Strike(Strike {
                target_m,
                config: self.strike.clone(),
            }),
            Task::Lob => ThrowGoal::Lob(Lob {
                target_m,
                config: self.lob.clone(),
            }),
            Task::Drape => ThrowGoal::Drape(Drape {
                target_m,
                config: self.drape.clone(),
            }),
        }
    }
}

impl PlannerConfig {
    /// The same with this seed for identifications. Nothing else may differ from what a user
    /// states where a simulated rig is identified: not how well its camera's place is known.
    #[must_use]
    pub fn with_identify_seed(mut self, seed: u64) -> Self {
        self.identify.seed = seed;
        self
    }

    /// A short wiggle in the start pose of a strike, which can begin out of the swing that is left.
    ///
    /// # Errors
    /// Another task: its search takes longer than a swing can be predicted for.
    pub fn short_wiggle(
        &self,
        task: Task,
        target_m: [f64; 3],
    ) -> Result<WiggleConfig, NotOutOfSwing> {
        if task != Task::Strike {
            return Err(NotOutOfSwing(task.name()));
        }
        Ok(self.wiggle.short(start_pose_for(target_m)))
    }
}

/// A task whose throw cannot begin out of a swing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "only a strike is thrown out of a swing: a {0} is searched for longer than the swing can be predicted; leave --fast out"
)]
pub struct NotOutOfSwing(&'static str);

impl Default for PlannerConfig {
    fn default() -> Self {
        Self {
            domain: "lab".to_owned(),
            cell: Cell::default(),
            identify: IdentifyOptions::default(),
            search: PlanOptions::default(),
            strike: ThrowConfig::default(),
            lob: LobConfig::default(),
            drape: DrapeConfig::default(),
            wiggle: WiggleConfig::default(),
            settle: SettleConfig::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demo_knows_no_more_about_its_camera_than_its_user_states() {
        let mut configured = PlannerConfig::default();
        configured.identify.camera_position_std_m = 0.005;
        let mut stated = configured.clone().with_identify_seed(7);
        assert_eq!(stated.identify.seed, 7);
        stated.identify.seed = configured.identify.seed;
        assert_eq!(stated, configured);
    }

    #[test]
    fn an_empty_file_is_the_default_and_unknown_keys_are_refused() {
        let empty: PlannerConfig = toml::from_str("").unwrap();
        assert_eq!(empty, PlannerConfig::default());
        let written = toml::to_string(&empty).unwrap();
        assert_eq!(toml::from_str::<PlannerConfig>(&written).unwrap(), empty);
        assert!(toml::from_str::<PlannerConfig>("[identify]\npopulaton = 3\n").is_err());
    }
}
