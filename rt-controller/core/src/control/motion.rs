//! What the arm is commanded to follow: an uploaded spline or a planned move.

use super::phases::PhasedMotion;
use arm_model::{JointState, JointTrajectory, JointVector};
use serde::{Deserialize, Serialize};
use shared_types::ipc::ControllerMode;

/// A whole motion, complete before it begins; nothing is computed or fetched
/// for it on the way except its value at an instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "always boxed, made once per motion; one allocation is enough"
)]
pub enum Motion {
    /// An uploaded trajectory.
    Spline(JointTrajectory),
    /// A jerk-limited move from pose to pose.
    Move {
        /// Phases of every joint.
        phases: PhasedMotion,
        /// Where it ends, exactly (rad).
        end: JointVector,
    },
}

impl Motion {
    /// Joint state at `t_s` after the start. RT-safe.
    #[must_use]
    pub fn state_at(&self, t_s: f64) -> JointState {
        match self {
            Self::Spline(trajectory) => trajectory.state_at(t_s),
            Self::Move { phases, end } if t_s >= phases.duration_s() => JointState::at_rest(*end),
            Self::Move { phases, .. } => phases.state_at(t_s),
        }
    }

    /// Duration (s). RT-safe.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Spline(trajectory) => trajectory.duration_s(),
            Self::Move { phases, .. } => phases.duration_s(),
        }
    }

    /// Pose at the start (rad). RT-safe.
    #[must_use]
    pub fn start(&self) -> JointVector {
        self.state_at(0.0).q
    }

    /// Number that tells motions apart: FNV-1a over every bit that decides what
    /// they do. RT-safe.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |value: f64| {
            for byte in value.to_bits().to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        match self {
            Self::Spline(trajectory) => {
                for (time_s, q) in trajectory.times_s().iter().zip(trajectory.waypoints()) {
                    add(*time_s);
                    q.iter().for_each(|v| add(*v));
                }
            }
            Self::Move { phases, end } => {
                phases.each_number(&mut add);
                end.iter().for_each(|v| add(*v));
            }
        }
        hash
    }

    /// Mode of the controller while it runs. RT-safe.
    #[must_use]
    pub const fn mode(&self) -> ControllerMode {
        match self {
            Self::Spline(_) => ControllerMode::Streaming,
            Self::Move { .. } => ControllerMode::Moving,
        }
    }
}
