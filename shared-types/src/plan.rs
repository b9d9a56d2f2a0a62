//! A planned throw, as written to `plan.json` and sent to the controller.

use crate::joint::JointVector;
use crate::limits::Margin;
use crate::rope::RopeParams;
use crate::trajectory::JointTrajectory;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What the throw is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// The tip passes through the target.
    Strike,
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
    /// Rope the throw was planned for.
    pub rope: RopeParams,
    /// The joint trajectory, start pose first.
    pub trajectory: JointTrajectory,
    /// Smallest tip-target distance in the planner's simulation (m).
    pub predicted_error_m: f64,
    /// When it occurs (s after the start).
    pub predicted_time_s: f64,
    /// Fitness of the best candidate.
    pub fitness: f64,
    /// Simulations used.
    pub simulations: u32,
    /// Candidates drawn again because they broke a limit.
    pub resampled: u32,
    /// Margins to every limit.
    pub margins: Vec<Margin>,
    /// Hex SHA-256 of the trajectory, see [`trajectory_hash`].
    pub trajectory_sha256: String,
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

/// Start pose of wiggle and throws: pole straight down in front of the robot
/// (rad).
pub const START_POSE: JointVector = JointVector([0.0, 0.8, 0.0, 2.4, 0.0, 1.6, 0.0]);

#[cfg(test)]
mod tests {
    use super::*;

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
        }
    }

    #[test]
    fn trajectory_survives_json() {
        let t = JointTrajectory::new(&[0.0, 0.7], &[START_POSE, JointVector::splat(0.3)]).unwrap();
        let back: JointTrajectory =
            serde_json::from_str(&serde_json::to_string(&t).unwrap()).unwrap();
        assert_eq!(t, back);
        let bad = r#"{"times_s":[0.0,0.0],"waypoints_rad":[[0,0,0,0,0,0,0],[0,0,0,0,0,0,0]]}"#;
        assert!(serde_json::from_str::<JointTrajectory>(bad).is_err());
    }
}
