//! A rope that is known, simulated under the joints as they are reported.

use arm_model::kinematics::FrameMotion;
use rope_sim::{AttachMotion, LiveRope, MotionError, SimulateError};
use shared_types::MonotonicNs;
use shared_types::keypoints::TrackedFrame;

use super::arm::Arm;
use crate::frame::EyeFrame;
use crate::track::Known;

/// The newest reports change what is made of those just before them: the simulation stays
/// so far behind (s), and what is shown goes on from there.
const SETTLED_S: f64 = 0.04;
/// Reports before the simulation's time that its motion still depends on (ns).
const PAST_NS: u64 = 250_000_000;
/// The simulation's steps begin at multiples of this (s), so that they are equally long.
const GRID_S: f64 = 1e-3;

/// Why a rope cannot be followed on.
#[derive(Debug, thiserror::Error)]
pub(super) enum Gone {
    #[error("the joint reports are no motion: {0}")]
    Motion(#[from] MotionError),
    #[error("the rope cannot be simulated: {0}")]
    Simulate(#[from] SimulateError),
    #[error("the simulated rope is not before the camera")]
    OutOfSight,
}

/// The rope's state, and what is needed to see it.
#[derive(Debug)]
pub(super) struct Follower {
    known: Known,
    rope: LiveRope,
    /// The simulation's time 0 (CLOCK_MONOTONIC, ns).
    zero_ns: u64,
    /// The frame since which nothing of it is seen.
    lost_ns: Option<u64>,
}

impl Follower {
    /// A rope that hung still at `zero_ns`; the arm's reports since then are caught up
    /// with in the first frame.
    pub(super) fn new(known: Known, zero_ns: u64, arm: &Arm) -> Result<Self, Gone> {
        let attach = arm.motion(zero_ns)?.at(0.0);
        let rope = LiveRope::new(known.rope(), &attach, Known::step_s())?;
        Ok(Self {
            known,
            rope,
            zero_ns,
            lost_ns: None,
        })
    }

    /// Keypoints of a frame. Where the arm's reports end before its exposure, the arm comes
    /// to rest.
    pub(super) fn see(
        &mut self,
        frame: &EyeFrame,
        arm: &mut Arm,
        keypoints: usize,
    ) -> Result<TrackedFrame, Gone> {
        let since_s = |stamp_ns| MonotonicNs(stamp_ns).since_s(MonotonicNs(self.zero_ns));
        let motion = arm.motion(self.zero_ns)?;
        let motion = |t_s: f64| -> FrameMotion { motion.at(t_s) };
        let [first_s, last_s] = self.known.exposed_s(since_s(frame.stamp_ns));
        let settled_s = (since_s(arm.newest_ns()) - SETTLED_S).min(first_s);
        self.rope
            .advance(&motion, (settled_s / GRID_S).floor() * GRID_S);
        let reached_ns = self.zero_ns + (self.rope.time_s() * 1e9) as u64;
        arm.forget_before(reached_ns.saturating_sub(PAST_NS));
        let mut shown = self.rope.clone();
        shown.advance(&motion, first_s);
        let first = shown.nodes().to_vec();
        shown.advance(&motion, last_s);
        let seen = self
            .known
            .see(frame, [&first, shown.nodes()], keypoints)
            .filter(|_| shown.is_finite())
            .ok_or(Gone::OutOfSight)?;
        self.lost_ns = seen.lost.then_some(self.lost_ns.unwrap_or(frame.stamp_ns));
        Ok(seen)
    }

    /// The frame since which nothing of it is seen (CLOCK_MONOTONIC, ns).
    pub(super) fn lost_ns(&self) -> Option<u64> {
        self.lost_ns
    }
}
