//! A move that takes the sway out of the rope.
//!
//! A throw is planned for a rope at rest, but after the wiggle a weakly damped
//! rope sways for tens of seconds. Once the rope is identified its motion is
//! known: it is simulated from the moment it hung still, through the measured
//! joints, into a rest-to-rest move of the arm. Small offsets on the knots of
//! that move are chosen by least squares so that the rope hangs still at its
//! end: command shaping for zero residual vibration, with the identified
//! nonlinear model in the place of a list of frequencies.

mod chain;
mod clear;
mod descent;
mod shape;
mod sway;
#[cfg(test)]
mod tests;

use arm_model::{Cell, JointTrajectory, JointVector, Limits, TrajectoryError};
use chain::Prelude;
use descent::Calmest;
use rope_sim::sensitivity::SensitivityError;
use rope_sim::{MotionError, SimulateError};
use serde::{Deserialize, Serialize};
use shape::MoveShape;
use shared_types::RopeParams;
use shared_types::rope::RopeError;
use sway::{Sway, SwaySimulator};

/// Parts of the offsets found that are tried, largest first: where limits or
/// surroundings forbid the whole, a smaller part still takes out that part of
/// the sway.
const PARTS: [f64; 5] = [0.8, 0.6, 0.4, 0.2, 0.0];

/// What a calming move starts from and ends in.
#[derive(Debug, Clone, PartialEq)]
pub struct CalmRequest {
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
}

/// Size of a calming move and of the search for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalmConfig {
    /// Durations of the move (s), tried in order until one is calm enough.
    pub durations_s: Vec<f64>,
    /// Sway of the tip that is calm enough (m).
    pub wanted_m: f64,
    /// Time between the knots at which joints 1 and 6 may be offset (s), less
    /// than half a period of the fastest pendulum of the ranges, 1 Hz.
    pub knot_s: f64,
    /// Sway that an offset of 1 rad must save to be worth it (m/rad).
    pub offset_cost_m_per_rad: f64,
    /// Most Gauss-Newton steps.
    pub iterations: usize,
    /// Root mean square of the sway at which the search is content (m).
    pub content_m: f64,
    /// Smallest gap between rope and arm or column during the move (m).
    pub clearance_m: f64,
    /// Threads; the result does not depend on them.
    pub threads: usize,
}

impl Default for CalmConfig {
    fn default() -> Self {
        Self {
            durations_s: vec![3.5, 5.0],
            wanted_m: 3e-3,
            knot_s: 0.44,
            offset_cost_m_per_rad: 3e-3,
            iterations: 8,
            content_m: 5e-4,
            clearance_m: 0.03,
            threads: 2,
        }
    }
}

/// A calming move.
#[derive(Debug, Clone, PartialEq)]
pub struct CalmMove {
    /// The commanded motion, from `start_q` to `end_q`.
    pub trajectory: JointTrajectory,
    /// Largest distance of the tip from its place at rest after a plain move of
    /// the same duration, as simulated (m).
    pub plain_sway_m: f64,
    /// The same after this move (m).
    pub calm_sway_m: f64,
}

/// Why there is no calming move.
#[derive(Debug, thiserror::Error)]
pub enum CalmError {
    /// A value of the configuration is out of range.
    #[error("calm: `{key}` is {value}, but must be {expected}")]
    Value {
        /// Key in the configuration.
        key: &'static str,
        /// Value found.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// The configuration names no duration.
    #[error("calm: `durations_s` is empty; name at least one duration")]
    NoDuration,
    /// The rope's parameters are not physical.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// The measured joints make no motion.
    #[error("measured joints: {0}")]
    Joints(#[from] MotionError),
    /// The move would begin while the arm is still being measured.
    #[error(
        "the calming move would begin {start_s:.3} s after the rope hung still, but the joints were measured until {last_s:.3} s; begin it later"
    )]
    StartsTooEarly {
        /// Start asked for (s).
        start_s: f64,
        /// Last measured sample (s).
        last_s: f64,
    },
    /// The arm is not where the move begins.
    #[error(
        "joint {joint} stands {off_rad:.4} rad away from the start of the calming move; hold the start pose first"
    )]
    NotAtStart {
        /// Joint, 1-based.
        joint: usize,
        /// Measured minus commanded position (rad).
        off_rad: f64,
    },
    /// The knots make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// Even the plain move breaks a limit of the arm.
    #[error("a plain move to the end pose breaks a limit: {what}; use longer `durations_s`")]
    BreaksLimit {
        /// The limit, with value and time.
        what: String,
    },
    /// Even the plain move brings rope or tool too near to something.
    #[error(
        "every calming move brings the rope within {gap_m:.3} m of arm or column or lets the tool collide; let the rope settle or choose another end pose"
    )]
    TooClose {
        /// Smallest gap of the rope in the plain move (m).
        gap_m: f64,
    },
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Slopes of the rope's sway could not be taken.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// The simulated rope blew up.
    #[error("the simulation of the rope diverged; identify the rope again")]
    Diverged,
}

impl CalmConfig {
    fn check(&self) -> Result<(), CalmError> {
        if self.durations_s.is_empty() {
            return Err(CalmError::NoDuration);
        }
        let (shortest_s, longest_s) = self
            .durations_s
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(lo, hi), d| {
                (lo.min(*d), hi.max(*d))
            });
        let outside_s = if shortest_s < 1.0 {
            shortest_s
        } else {
            longest_s
        };
        let rules = [
            (
                "durations_s",
                outside_s,
                shortest_s >= 1.0
                    && longest_s <= 30.0
                    && self.durations_s.iter().all(|d| d.is_finite()),
                "from 1 to 30 s",
            ),
            (
                "knot_s",
                self.knot_s,
                self.knot_s >= 0.1 && 3.0 * self.knot_s <= shortest_s,
                "from 0.1 s to a third of the shortest duration",
            ),
            (
                "offset_cost_m_per_rad",
                self.offset_cost_m_per_rad,
                self.offset_cost_m_per_rad > 0.0 && self.offset_cost_m_per_rad < 10.0,
                "above 0 and below 10 m/rad",
            ),
            (
                "clearance_m",
                self.clearance_m,
                self.clearance_m >= 0.0 && self.clearance_m < 1.0,
                "from 0 to 1 m",
            ),
        ];
        match rules.into_iter().find(|(.., holds, _)| !holds) {
            Some((key, value, _, expected)) => Err(CalmError::Value {
                key,
                value,
                expected,
            }),
            None => Ok(()),
        }
    }
}

/// Plans a move from `start_q` to `end_q` after which the rope hangs still.
/// Deterministic, whatever the threads.
///
/// # Errors
/// See [`CalmError`].
pub fn calm(request: &CalmRequest, config: &CalmConfig) -> Result<CalmMove, CalmError> {
    config.check()?;
    request.rope.validate()?;
    let prelude = Prelude::new(request)?;
    let mut best: Option<CalmMove> = None;
    let mut refused = CalmError::NoDuration;
    for duration_s in &config.durations_s {
        match calm_within(request, config, &prelude, *duration_s) {
            Ok(found) => {
                let calmest = best.as_ref().map_or(f64::INFINITY, |b| b.calm_sway_m);
                if found.calm_sway_m < calmest {
                    best = Some(found);
                }
            }
            Err(error @ (CalmError::BreaksLimit { .. } | CalmError::TooClose { .. })) => {
                refused = error;
            }
            Err(error) => return Err(error),
        }
        if best
            .as_ref()
            .is_some_and(|b| b.calm_sway_m <= config.wanted_m)
        {
            break;
        }
    }
    best.ok_or(refused)
}

/// The calmest move of one duration.
fn calm_within(
    request: &CalmRequest,
    config: &CalmConfig,
    prelude: &Prelude,
    duration_s: f64,
) -> Result<CalmMove, CalmError> {
    let shape = MoveShape::new(request.start_q, request.end_q, duration_s, config.knot_s);
    let plain = shape.trajectory(&shape.no_offsets())?;
    if let Some(margin) = request.limits.worst_violation(&plain) {
        return Err(CalmError::BreaksLimit {
            what: margin.describe(),
        });
    }
    let simulator = SwaySimulator::new(&request.rope, prelude, &plain, config.threads)?;
    let found = descent::least_sway(&shape, &simulator, config)?;
    choose(request, config, &shape, &simulator, found)
}

/// Largest distance of the tip from its place at rest (m) when `trajectory` is
/// begun at `start_s` of the request: what a plan is worth for another rope or
/// another start than it was made for.
///
/// # Errors
/// As [`calm`]; the trajectory must begin where the arm stands.
pub fn sway_after(
    request: &CalmRequest,
    trajectory: &JointTrajectory,
    threads: usize,
) -> Result<f64, CalmError> {
    request.rope.validate()?;
    let prelude = Prelude::new(request)?;
    let simulator = SwaySimulator::new(&request.rope, &prelude, trajectory, threads)?;
    let sways = simulator.run(core::slice::from_ref(trajectory))?;
    match sways.first() {
        Some(sway) if sway.finite => Ok(sway.largest_m),
        _ => Err(CalmError::Diverged),
    }
}

/// The move with all offsets if limits and surroundings allow it, otherwise the
/// calmest of those with a part of them.
fn choose(
    request: &CalmRequest,
    config: &CalmConfig,
    shape: &MoveShape,
    simulator: &SwaySimulator<'_>,
    found: Calmest,
) -> Result<CalmMove, CalmError> {
    let plain_sway_m = found.plain_sway_m;
    let mut gap_m = f64::NAN;
    let mut allowed = |trajectory: &JointTrajectory, sway: &Sway| {
        if !sway.finite || request.limits.worst_violation(trajectory).is_some() {
            return false;
        }
        let room = clear::room(&request.rope, simulator, trajectory, sway);
        gap_m = room.rope_gap_m;
        gap_m >= config.clearance_m && !room.tool_touches
    };
    let whole = shape.trajectory(&found.offsets_rad)?;
    if allowed(&whole, &found.sway) {
        return Ok(CalmMove {
            trajectory: whole,
            plain_sway_m,
            calm_sway_m: found.sway.largest_m,
        });
    }
    let in_part = |part: f64| -> Vec<f64> { found.offsets_rad.iter().map(|o| part * o).collect() };
    let moves = PARTS
        .into_iter()
        .map(|part| shape.trajectory(&in_part(part)))
        .collect::<Result<Vec<_>, _>>()?;
    let sways = simulator.run(&moves)?;
    moves
        .into_iter()
        .zip(&sways)
        .filter(|(trajectory, sway)| allowed(trajectory, sway))
        .min_by(|(_, a), (_, b)| a.largest_m.total_cmp(&b.largest_m))
        .map(|(trajectory, sway)| CalmMove {
            trajectory,
            plain_sway_m,
            calm_sway_m: sway.largest_m,
        })
        .ok_or(CalmError::TooClose { gap_m })
}
