//! A planned throw, as written to `plan.json` and sent to the controller.

use crate::rope::RopeParams;
use crate::rope_state::RopeState;
use arm_model::cell::Cell;
use arm_model::limits::Margin;
use arm_model::trajectory::JointTrajectory;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What the throw is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// The tip passes through the target.
    #[default]
    Strike,
    /// The tip fells a domino on a board and comes to lie there.
    Lob,
    /// The rope comes to hang over a wall.
    Drape,
}

impl Task {
    /// Name as in commands and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Strike => "strike",
            Self::Lob => "lob",
            Self::Drape => "drape",
        }
    }
}

/// One condition of a task's success.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// What must be so.
    pub name: String,
    /// Whether it is.
    pub met: bool,
}

/// What a task makes of one simulated throw.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    /// Whether the task succeeded.
    pub success: bool,
    /// Its conditions, in the task's order.
    pub conditions: Vec<Condition>,
    /// Conditions of a throw that was made of which nobody saw whether they were met; with any,
    /// it did not surely succeed.
    #[serde(default)]
    pub unseen: Vec<String>,
}

impl core::fmt::Display for Verdict {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let named = |met: bool| {
            let conditions = self.conditions.iter().filter(|c| c.met == met);
            conditions
                .map(|c| c.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        let has_failed = self.conditions.iter().any(|c| !c.met);
        match (self.success, has_failed) {
            (true, _) => write!(f, "succeeded ({})", named(true)),
            (false, true) => write!(f, "failed (not met: {})", named(false)),
            (false, false) => {
                write!(f, "not known (met: {}; not seen: ", named(true))?;
                write!(f, "{})", self.unseen.join(", "))
            }
        }
    }
}

/// What keeps a plan from being better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitedBy {
    /// Nothing: it is as good as was asked for.
    Nothing,
    /// A limit of the arm's speed or acceleration is used to the full.
    ArmSpeed,
    /// A joint is at the end of its range.
    JointRange,
    /// Contacts of rope or tool.
    Contact,
    /// The search was not longer.
    Budget,
}

/// Error to expect when the rope is only known as well as it was identified.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorForecast {
    /// Ropes drawn from what is known about the rope.
    pub ropes: u32,
    /// How many of them could not be simulated; they count as misses by the rope's length or
    /// by the largest error, whichever is more.
    #[serde(default)]
    pub failed: u32,
    /// Mean error over them (m).
    pub mean_m: f64,
    /// Median error (m).
    pub median_m: f64,
    /// Interval that holds the error with a probability of 90 % (m).
    pub interval_90_m: [f64; 2],
}

/// Where a corrected throw aims.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aim {
    /// The place in the world (m).
    pub point_m: [f64; 3],
    /// How many misses have moved it.
    pub corrections: u32,
    /// The last of them (m), tip minus target at the closest approach; none in files of before.
    #[serde(default)]
    pub miss_m: Option<[f64; 3]>,
}

/// A planned throw. JSON form: `plan.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Version of the program that made it.
    pub version: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Task.
    pub task: Task,
    /// Target in the world (m).
    pub target_m: [f64; 3],
    /// Where the simulated tip passes instead, of a throw corrected by the misses before.
    #[serde(default)]
    pub aim: Option<Aim>,
    /// Rope the throw was planned for.
    pub rope: RopeParams,
    /// State of the rope when the throw begins, if it still swings then; none for a rope that
    /// hangs still.
    #[serde(default)]
    pub start: Option<RopeState>,
    /// Cell it was planned for; plans of older versions do not tell it.
    #[serde(default)]
    pub cell: Option<Cell>,
    /// The joint trajectory, start pose first.
    pub trajectory: JointTrajectory,
    /// Smallest tip-target distance in the planner's simulation (m).
    pub predicted_error_m: f64,
    /// When it occurs (s after the start).
    pub predicted_time_s: f64,
    /// Fitness of the best candidate.
    pub fitness: f64,
    /// Whether the search was broken off: the best throw up to then.
    #[serde(default)]
    pub interrupted: bool,
    /// What keeps it from being better.
    #[serde(default)]
    pub limited_by: Option<LimitedBy>,
    /// What the task makes of the simulated throw.
    #[serde(default)]
    pub verdict: Verdict,
    /// Error to expect over ropes drawn from the posterior.
    #[serde(default)]
    pub forecast: Option<ErrorForecast>,
    /// Where the response of the arm that it is planned for was measured; none for an arm
    /// that does exactly what it is told.
    #[serde(default)]
    pub arm_response: Option<String>,
    /// Why the track that its rope was identified from should not be relied on.
    #[serde(default, alias = "doubts")]
    pub unconfirmed: Vec<String>,
    /// Simulations used.
    pub simulations: u32,
    /// Candidates drawn again because they broke a limit.
    pub resampled: u32,
    /// Margins to every limit.
    pub margins: Vec<Margin>,
    /// Hex SHA-256 of the trajectory, see [`trajectory_hash`].
    pub trajectory_sha256: String,
}

/// A plan that is good for one instant only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the plan is for a rope that still swung when its throw began, as no other throw will: plan it anew for this rope at rest (`wag run --from plan RUN`, or `wag plan strike --rope`)"
)]
pub struct NotAtRest;

impl Plan {
    /// Refuses a plan that cannot be thrown later.
    ///
    /// # Errors
    /// The rope did not hang still when its throw began.
    pub fn require_at_rest(&self) -> Result<(), NotAtRest> {
        self.start.as_ref().map_or(Ok(()), |_| Err(NotAtRest))
    }

    /// Upper end of the forecast of the error (m); infinite without one.
    #[must_use]
    pub fn reaches_m(&self) -> f64 {
        self.forecast.map_or(f64::INFINITY, |f| f.interval_90_m[1])
    }
}

/// SHA-256 of a trajectory's waypoints and times, little-endian, in order. The
/// controller recomputes it before it accepts a plan.
#[must_use]
pub fn trajectory_hash(trajectory: &JointTrajectory) -> [u8; 32] {
    let mut hash = Sha256::new();
    for (t, q) in trajectory.times_s().iter().zip(trajectory.waypoints()) {
        hash.update(t.to_le_bytes());
        for v in q.iter() {
            hash.update(v.to_le_bytes());
        }
    }
    hash.finalize().into()
}

/// [`trajectory_hash`] as lower-case hexadecimal.
#[must_use]
pub fn trajectory_hash_hex(trajectory: &JointTrajectory) -> String {
    trajectory_hash(trajectory)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::{JointVector, START_POSE};

    #[test]
    fn hash_sees_every_waypoint() {
        let make = |last: f64| {
            JointTrajectory::new(&[0.0, 1.0], &[JointVector::ZERO, JointVector::splat(last)])
                .unwrap()
        };
        assert_ne!(
            trajectory_hash(&make(0.1)),
            trajectory_hash(&make(0.100_000_001))
        );
        assert_eq!(trajectory_hash_hex(&make(0.1)).len(), 64);
    }

    proptest::proptest! {
        #[test]
        fn the_hash_survives_json(q in proptest::array::uniform7(-3.0f64..3.0), t in 0.01f64..2.0) {
            let one = JointTrajectory::new(&[0.0, t], &[START_POSE, JointVector(q)]).unwrap();
            let back: JointTrajectory =
                serde_json::from_str(&serde_json::to_string_pretty(&one).unwrap()).unwrap();
            proptest::prop_assert_eq!(trajectory_hash(&back), trajectory_hash(&one));
            proptest::prop_assert_eq!(back, one);
        }
    }

    #[test]
    fn a_trajectory_whose_times_stand_still_is_refused() {
        let bad = r#"{"times_s":[0.0,0.0],"waypoints_rad":[[0,0,0,0,0,0,0],[0,0,0,0,0,0,0]]}"#;
        assert!(serde_json::from_str::<JointTrajectory>(bad).is_err());
    }
}
