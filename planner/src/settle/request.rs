//! What a settling move is planned from, and what comes of it.

use super::error::SettleError;
use crate::OutOfRange;
use arm_model::{Cell, JointTrajectory, JointVector, Limits};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;

/// What a settling move starts from and ends in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SettleRequest {
    /// The rope, as identified.
    pub rope: RopeParams,
    /// Times of the measured joints (s); the rope hangs still at time 0.
    pub times_s: Vec<f64>,
    /// Measured joints (rad). After the last one the arm holds.
    pub q: Vec<JointVector>,
    /// When the arm will begin to move (s).
    pub start_s: f64,
    /// Commanded pose the arm holds until then (rad).
    pub start_q: JointVector,
    /// Commanded pose at the end (rad).
    pub end_q: JointVector,
    /// What the arm may do.
    pub limits: Limits,
    /// The pole, and what stands around the arm.
    pub cell: Cell,
    /// Size of the move and of the search for it.
    pub config: SettleConfig,
}

/// Size of a settling move and of the search for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SettleConfig {
    /// Durations of the move (s), tried in order until one leaves little enough.
    pub durations_s: Vec<f64>,
    /// Residual vibration of the tip that is small enough (m).
    pub residual_max_m: f64,
    /// Time between the knots at which joints 1 and 6 may be offset (s), less
    /// than half a period of the fastest pendulum of the ranges, 1 Hz.
    pub knot_s: f64,
    /// Residual vibration that an offset of 1 rad must save to be worth it (m/rad).
    pub offset_cost_m_per_rad: f64,
    /// Most Gauss-Newton steps.
    pub iterations: usize,
    /// Root mean square of the residual vibration at which the search stops (m).
    pub stop_below_rms_m: f64,
    /// Smallest gap between rope and arm or column during the move (m).
    pub clearance_m: f64,
    /// Threads; the result does not depend on them.
    pub threads: usize,
}

impl Default for SettleConfig {
    fn default() -> Self {
        Self {
            durations_s: vec![3.5, 5.0],
            residual_max_m: 3e-3,
            knot_s: 0.44,
            offset_cost_m_per_rad: 3e-3,
            iterations: 8,
            stop_below_rms_m: 5e-4,
            clearance_m: 0.03,
            threads: 2,
        }
    }
}

/// A settling move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SettleMove {
    /// The commanded motion, from `start_q` to `end_q`.
    pub trajectory: JointTrajectory,
    /// Largest distance of the tip from its place at rest after a plain move of
    /// the same duration, as simulated (m).
    pub plain_residual_m: f64,
    /// The same after this move (m).
    pub residual_m: f64,
}

impl SettleConfig {
    pub(super) fn check(&self) -> Result<(), SettleError> {
        if self.durations_s.is_empty() {
            return Err(SettleError::NoDuration);
        }
        let within = OutOfRange::unless_within;
        let durations = [("durations_s", self.durations_s.len() as f64)];
        within(0.0..=10.0, "at most 10 durations", &durations)?;
        let iterations = [("iterations", self.iterations as f64)];
        within(0.0..=1000.0, "at most 1000", &iterations)?;
        let durations_s: Vec<_> = self
            .durations_s
            .iter()
            .map(|d| ("durations_s", *d))
            .collect();
        within(1.0..=30.0, "from 1 to 30 s", &durations_s)?;
        let clearance = [("clearance_m", self.clearance_m)];
        within(0.0..=1.0, "from 0 to 1 m", &clearance)?;
        let cost = [("offset_cost_m_per_rad", self.offset_cost_m_per_rad)];
        let range = f64::MIN_POSITIVE..=10.0;
        within(range, "above 0 and at most 10 m/rad", &cost)?;
        let shortest_s = self
            .durations_s
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        let knot_s = [("knot_s", self.knot_s)];
        let expected = "from 0.1 s to a third of the shortest duration";
        Ok(within(0.1..=shortest_s / 3.0, expected, &knot_s)?)
    }
}
