//! What a settling move is planned from, what comes of it, and why there is none.

use crate::OutOfRange;
use crate::history::{ArmHistory, HistoryError};
use arm_model::{Cell, JointTrajectory, JointVector, Limits, TrajectoryError};
use rope_sim::SimulateError;
use rope_sim::sensitivity::SensitivityError;
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use shared_types::rope::RopeError;

/// What a settling move starts from and ends in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SettleRequest {
    /// The rope, as identified.
    pub rope: RopeParams,
    /// What the arm did before.
    pub before: ArmHistory,
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
        const KNOT: &str = "from 0.1 s to a third of the shortest duration";
        const COST: &str = "above 0 and below 10 m/rad";
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
        let shortest_s = self
            .durations_s
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        let (knot_s, gap_m) = (self.knot_s, self.clearance_m);
        let cost = self.offset_cost_m_per_rad;
        let knots_fit = knot_s >= 0.1 && 3.0 * knot_s <= shortest_s;
        let gap_fits = (0.0..1.0).contains(&gap_m);
        Ok(OutOfRange::check([
            ("knot_s", knot_s, knots_fit, KNOT),
            (
                "offset_cost_m_per_rad",
                cost,
                cost > 0.0 && cost < 10.0,
                COST,
            ),
            ("clearance_m", gap_m, gap_fits, "from 0 to 1 m"),
        ])?)
    }
}

/// Why there is no settling move.
#[derive(Debug, thiserror::Error)]
pub enum SettleError {
    /// A value of the configuration is out of range.
    #[error("settle: {0}")]
    Value(#[from] OutOfRange),
    /// The configuration names no duration.
    #[error("settle: `durations_s` is empty; name at least one duration")]
    NoDuration,
    /// The rope's parameters are not physical.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// What the arm did before leads nowhere.
    #[error(transparent)]
    History(#[from] HistoryError),
    /// The knots make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// Even the plain move breaks a limit of the arm.
    #[error("a plain move to the end pose breaks a limit: {0}; use longer `durations_s`")]
    BreaksLimit(String),
    /// Even the plain move brings rope or tool too near to something: gap of the rope (m).
    #[error(
        "every settling move brings the rope within {0:.3} m of arm or column or lets the tool collide; let the rope settle or choose another end pose"
    )]
    TooClose(f64),
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Slopes of the residual vibration could not be taken.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// The caller broke off after so many Gauss-Newton steps.
    #[error("the settling move was cancelled after step {0}")]
    Cancelled(usize),
    /// The simulated rope blew up.
    #[error("the simulation of the rope diverged; identify the rope again")]
    Diverged,
}
