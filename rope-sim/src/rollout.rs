//! What is simulated, how, and what comes back.

use crate::error::{SimulateError, refuse_unless, refuse_unless_finite, refuse_unless_positive};
use crate::frames::{FrameTimes, NodeTrack};
use crate::lanes::Precision;
use crate::motion::AttachMotion;
use crate::scene::{ContactSummary, DominoOutcome};
use crate::watch::{Watch, Watched};
use shared_types::rope_state::Sway;
use shared_types::{RopeParams, RopeState};

/// Most steps of one rollout, and most frames; more is a mistake in step or horizon.
const MAX_STEPS: f64 = 1e8;

/// State of the rope at t = 0, at rest in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Straight along -z of the attach frame, joint 0 turned.
    Straight {
        /// Rotation vector of joint 0 in the attach frame (rad).
        joint0_rotvec: [f64; 3],
    },
    /// Hanging still below the attach frame's first pose.
    Equilibrium,
}

/// How to simulate; the same for all candidates of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimOptions {
    /// Longest time step (s); 0.5 ms for throws, 1 ms for wiggles.
    pub step_s: f64,
    /// Number type.
    pub precision: Precision,
    /// State at t = 0.
    pub start: Start,
    /// When to record node positions.
    pub frames: FrameTimes,
    /// What to measure on the way.
    pub watch: Watch,
    /// End of the simulation (s), from t = 0.
    pub horizon_s: f64,
    /// Whether the ropes' states at the end are kept.
    pub keeps_end: bool,
    /// Worker threads; results do not depend on it.
    pub threads: usize,
}

impl SimOptions {
    /// From equilibrium on one thread, with nothing recorded.
    #[must_use]
    pub const fn new(step_s: f64, precision: Precision, horizon_s: f64) -> Self {
        Self {
            step_s,
            precision,
            start: Start::Equilibrium,
            frames: FrameTimes::NONE,
            watch: Watch::NOTHING,
            horizon_s,
            keeps_end: false,
            threads: 1,
        }
    }
}

/// One rope on one motion.
#[derive(Debug, Clone, Copy)]
pub struct Candidate<'a> {
    /// The rope.
    pub rope: &'a RopeParams,
    /// Motion of its attach frame. Candidates with the very same motion (the same
    /// reference) share its evaluation.
    pub motion: &'a dyn AttachMotion,
    /// How it swings at the start, which must be [`Start::Equilibrium`].
    pub sway: Sway,
    /// State that it starts from, whatever [`SimOptions::start`] says.
    pub state: Option<&'a RopeState>,
    /// Point that its lead's closest approach to is measured (m, world); without one
    /// [`Watch::point_m`], which also says where positions are resolved best.
    pub point_m: Option<[f64; 3]>,
}

impl<'a> Candidate<'a> {
    /// A rope on a motion, at rest before it.
    #[must_use]
    pub fn new(rope: &'a RopeParams, motion: &'a dyn AttachMotion) -> Self {
        Self {
            rope,
            motion,
            sway: Sway::NONE,
            state: None,
            point_m: None,
        }
    }

    /// The same, swinging at the start.
    #[must_use]
    pub fn with_sway(self, sway: Sway) -> Self {
        Self { sway, ..self }
    }

    /// The same from a state of the rope, where there is one.
    #[must_use]
    pub fn from_state(self, state: Option<&'a RopeState>) -> Self {
        Self { state, ..self }
    }

    /// The same, watching a point of its own (m, world) in the place of [`Watch::point_m`].
    #[must_use]
    pub fn watching(self, point_m: [f64; 3]) -> Self {
        Self {
            point_m: Some(point_m),
            ..self
        }
    }
}

/// How a rollout went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Within the steps asked for.
    Clean,
    /// It blew up and was repeated in steps of a quarter, which went well.
    RerunAtQuarterStep,
    /// It blew up both times: the numbers are finite but mean nothing.
    Diverged,
}

/// One simulated motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    /// Node positions at the frame times. After [`Outcome::Diverged`] the last finite
    /// frame is repeated.
    pub nodes: NodeTrack,
    /// What [`SimOptions::watch`] asked for; nothing after [`Outcome::Diverged`].
    pub watched: Watched,
    /// Highest speed of the lead at step ends (m/s); 0 after [`Outcome::Diverged`].
    pub peak_tip_speed_m_s: f64,
    /// How it went.
    pub outcome: Outcome,
    /// What it did with each obstacle of the scene, in their order; nothing after
    /// [`Outcome::Diverged`].
    pub contacts: Vec<ContactSummary>,
    /// What became of the scene's domino.
    pub domino: Option<DominoOutcome>,
    /// The rope's state at the horizon, where [`SimOptions::keeps_end`] asked for it; none
    /// after [`Outcome::Diverged`].
    pub end: Option<RopeState>,
}

/// Checks options and candidates, by name.
pub(crate) fn check(candidates: &[Candidate], options: &SimOptions) -> Result<(), SimulateError> {
    let option = |unusable| SimulateError::new(format_args!("simulation option {unusable}"));
    check_numbers(options).map_err(option)?;
    let horizon_s = options.horizon_s;
    if options.frames.count > 0 {
        let first_s = options.frames.first_s;
        let last_s = options.frames.time_s(options.frames.count - 1);
        if !(first_s >= 0.0 && last_s <= horizon_s + 1e-9) {
            return Err(SimulateError::new(format_args!(
                "frames from {first_s} s to {last_s} s do not fit into the simulated 0 s to {horizon_s} s"
            )));
        }
    }
    for (index, candidate) in candidates.iter().enumerate() {
        let rope = candidate.rope.validate();
        rope.map_err(|e| SimulateError::of(index, e))?;
        let sway = candidate.sway;
        let numbers = [sway.angle_rad, sway.rate_rad_s].concat();
        refuse_unless_finite("sway", numbers).map_err(|e| SimulateError::of(index, e))?;
        refuse_unless_finite("point_m", candidate.point_m.into_iter().flatten())
            .map_err(|e| SimulateError::of(index, e))?;
        if sway != Sway::NONE && options.start != Start::Equilibrium {
            let reason = "it swings at the start, but is to start straight; give it one start";
            return Err(SimulateError::of(index, reason));
        }
        if let Some(state) = candidate.state {
            let fits = state.check(candidate.rope.links);
            fits.map_err(|e| SimulateError::of(index, e))?;
            if sway != Sway::NONE {
                let reason = "it has a state and a swing at the start; give it one of them";
                return Err(SimulateError::of(index, reason));
            }
        }
        let ends_s = candidate.motion.duration_s();
        if !candidate.motion.holds_after_end() && ends_s < horizon_s - 1e-9 {
            return Err(SimulateError::of(
                index,
                format_args!("its motion ends at {ends_s} s, before the horizon of {horizon_s} s"),
            ));
        }
    }
    Ok(())
}

fn check_numbers(options: &SimOptions) -> Result<(), String> {
    refuse_unless_positive("step_s", options.step_s)?;
    refuse_unless_positive("horizon_s", options.horizon_s)?;
    let need = "gives more than 1e8 steps; shorten the horizon or lengthen the step";
    let few = |step_s| options.horizon_s / step_s <= MAX_STEPS;
    refuse_unless("step_s", need, [options.step_s], few)?;
    if options.frames.count > 0 {
        refuse_unless_positive("frames.period_s", options.frames.period_s)?;
        let need = "more than 1e8 frames; lengthen their period";
        let count = options.frames.count as f64;
        refuse_unless("frames.count", need, [count], |count| count <= MAX_STEPS)?;
    }
    options.watch.check(options.horizon_s)?;
    if let Start::Straight { joint0_rotvec } = options.start {
        refuse_unless_finite("start.joint0_rotvec", joint0_rotvec)?;
    }
    Ok(())
}
