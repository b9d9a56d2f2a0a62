//! Following the rope through all frames, and being sure of it.
//!
//! From frame to frame the curve is predicted and measured. That can go wrong in
//! three ways: frames are missing, the rope is covered, or something that looks
//! like it comes so near that one is taken for the other. From such a frame on the
//! track is in doubt until the rope, looked for anew from the clamp as in the
//! first frame, is found twice where the track has it. If it is found elsewhere, it is
//! followed back from there to where both ways agree. What stays in doubt has
//! no more than half confidence; if there were two ropes to choose from, it is
//! lost.

use super::curve::{length, norm, resample, scale, smooth, sub};
use super::first_frame;
use super::follow::{Follower, NODES, RANGE_PX, State};
use super::plane::Point;
use crate::frame::EyeFrame;

/// A step longer than so many usual ones is a gap.
const GAP: f64 = 3.5;
/// Frames between two looks while in doubt.
const LOOK_EVERY: usize = 8;
/// Looks that must agree with the track one after the other.
const LOOKS: usize = 2;
/// Curves whose nodes lie within this of each other are the same (px).
const SAME_PX: f64 = 5.0;
/// A lead further than this from the tracked one is another one (px).
const OTHER_PX: f64 = 15.0;
/// Part of a fully visible rope's coverage that a rope found anew must have.
const LEAST_FOUND: f64 = 0.6;
/// Part of the length by which a rope found anew may differ.
const LENGTH_TOLERANCE: f64 = 0.06;
/// Ways over pixels are longer than the rope by up to this factor.
const WAY_FACTOR: f64 = 1.15;
/// Confidence of what is in doubt, at most.
const DOUBTFUL: f64 = 0.5;

/// The rope in every frame, from its state in the first one.
pub(super) fn pursue(
    follower: &Follower<'_>,
    frames: &[EyeFrame],
    times_s: &[f64],
    first: State,
) -> Vec<State> {
    let mut pursuit = Pursuit {
        follower,
        frames,
        times_s,
        usual_step_s: usual_step(times_s),
        states: vec![first],
        doubt: None,
    };
    for index in 1..frames.len() {
        pursuit.go_on(index);
    }
    if let Some(doubt) = pursuit.doubt.filter(|d| d.agreed == 0 || d.two_ropes) {
        for state in &mut pursuit.states[doubt.since..] {
            distrust(state);
            state.lost |= doubt.two_ropes;
        }
    }
    pursuit.states
}

/// Frames that are not known to show the tracked rope.
#[derive(Debug, Clone, Copy)]
struct Doubt {
    since: usize,
    next_look: usize,
    /// More than one thing hung on the clamp that could be the rope, and the more
    /// likely one was not the tracked one.
    two_ropes: bool,
    /// Looks in a row that found the rope where the track has it.
    agreed: usize,
}

struct Pursuit<'a> {
    follower: &'a Follower<'a>,
    frames: &'a [EyeFrame],
    times_s: &'a [f64],
    usual_step_s: f64,
    states: Vec<State>,
    doubt: Option<Doubt>,
}

impl Pursuit<'_> {
    fn go_on(&mut self, index: usize) {
        let (frame, t_s) = (&self.frames[index], self.times_s[index]);
        let before = &self.states[index - 1];
        let state = self.follower.step(frame, t_s, before);
        let gap = t_s - before.t_s > GAP * self.usual_step_s;
        let clear = !state.lost && !state.ambiguous;
        if gap || !clear {
            self.doubt.get_or_insert(Doubt {
                since: index,
                next_look: index,
                two_ropes: false,
                agreed: 0,
            });
        }
        // While two ropes cross, looking anew would tell no more.
        let look =
            (!state.ambiguous || state.lost) && self.doubt.is_some_and(|d| index >= d.next_look);
        self.states.push(state);
        if look {
            self.look_anew(index);
        }
    }

    /// Looks for the rope in this frame and the next as if nothing were known.
    fn look_anew(&mut self, index: usize) {
        if let Some(doubt) = &mut self.doubt {
            doubt.next_look = index + LOOK_EVERY;
        }
        let Some(found) = self.find_moving(index) else {
            return;
        };
        let Some(doubt) = self.doubt else { return };
        let agrees = self.same(&found.curve, &self.states[index].curve);
        let agreed = if agrees { doubt.agreed + 1 } else { 1 };
        self.doubt = (agreed < LOOKS).then_some(Doubt { agreed, ..doubt });
        if agrees {
            return;
        }
        self.states[index] = found;
        for earlier in (doubt.since..index).rev() {
            let later = &self.states[earlier + 1];
            let back = self
                .follower
                .step(&self.frames[earlier], self.times_s[earlier], later);
            if self.same(&back.curve, &self.states[earlier].curve) {
                return;
            }
            // The way back begins where the rope was found; but it may go wrong as
            // the way forth did.
            self.states[earlier] = back;
            distrust(&mut self.states[earlier]);
        }
    }

    /// The rope found anew in a frame, its velocity from where it is found in
    /// the next one.
    fn find_moving(&mut self, index: usize) -> Option<State> {
        let next = index + 1;
        let dt = self.times_s.get(next)? - self.times_s[index];
        let mut here = self.find(index)?;
        if dt > GAP * self.usual_step_s {
            return None;
        }
        let there = self.find(next)?;
        here.velocity = there
            .curve
            .iter()
            .zip(&here.curve)
            .map(|(a, b)| scale(sub(*a, *b), 1.0 / dt))
            .collect();
        // Measured again, now with the blur it has, and found where it must be.
        let forth = self
            .follower
            .step(&self.frames[next], self.times_s[next], &here);
        self.same(&forth.curve, &there.curve).then_some(here)
    }

    /// The rope found from the clamp in one frame.
    fn find(&mut self, index: usize) -> Option<State> {
        let (frame, t_s) = (&self.frames[index], self.times_s[index]);
        let follower = self.follower;
        let known_m = follower.model.length_m;
        let middle_s = follower
            .camera
            .row_time_s(f64::from(follower.camera.height_px) / 2.0);
        let look = first_frame::find(
            frame,
            follower.background,
            follower.camera,
            follower.plane,
            &follower.clamp.at(t_s + middle_s),
            Some([known_m * (1.0 - LENGTH_TOLERANCE), known_m * WAY_FACTOR]),
        )
        .ok()?;
        if !look.sole {
            let tracked = self.states.last().map(|s| s.curve[NODES - 1]);
            let other = tracked
                .zip(look.path.last())
                .is_some_and(|(a, b)| norm(sub(a, *b)) * follower.plane.px_per_m > OTHER_PX);
            if let Some(doubt) = &mut self.doubt {
                doubt.two_ropes |= other;
            }
            return None;
        }
        let curve = smooth(&look.path, &vec![0.05; look.path.len()], 20.0);
        let resting = State {
            t_s: t_s - self.usual_step_s,
            curve: resample(&curve, length(&curve), NODES),
            velocity: vec![[0.0; 2]; NODES],
            confidence: vec![1.0; NODES],
            lost: false,
            ambiguous: false,
            clamp: None,
        };
        let found = self.measured(frame, t_s, &resting);
        let off = (length(&found.curve) / known_m - 1.0).abs();
        let fits = off < LENGTH_TOLERANCE && found.score() > LEAST_FOUND && !found.lost;
        fits.then_some(found)
    }

    /// A curve found roughly, measured twice: the first time pulls it near.
    fn measured(&self, frame: &EyeFrame, t_s: f64, rough: &State) -> State {
        let gain = self.follower.background.gain(frame);
        let locate = |curve: &[Point]| {
            self.follower
                .locate(frame, gain, t_s, curve, rough, RANGE_PX)
        };
        locate(&locate(&rough.curve).curve)
    }

    fn same(&self, a: &[Point], b: &[Point]) -> bool {
        let limit_m = SAME_PX / self.follower.plane.px_per_m;
        a.iter().zip(b).all(|(a, b)| norm(sub(*a, *b)) < limit_m)
    }
}

fn distrust(state: &mut State) {
    for confidence in &mut state.confidence {
        *confidence = confidence.min(DOUBTFUL);
    }
}

/// Median time between two frames (s).
fn usual_step(times_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0 / 60.0)
}
