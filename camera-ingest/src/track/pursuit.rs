//! Following the rope through all frames, and being sure of it.
//!
//! From frame to frame the curve is predicted and measured. That can go wrong in
//! three ways: frames are missing, the rope is covered, or something that looks
//! like it comes so near that one is taken for the other. From such a frame on the
//! track is in doubt until the rope, looked for anew from the clamp as in the
//! first frame, is found where the track has it. That proves the frames before, as far
//! as they lead back from there to where the track came along. If the rope is found
//! elsewhere, it is followed back from there to where both ways agree. What stays in
//! doubt has no more than half confidence; if the ways don't meet, or there were two
//! ropes to choose from, it is lost.

use std::ops::Range;

use super::curve::{add, length, norm, resample, scale, smooth, sub};
use super::first_frame;
use super::first_frame::Place;
use super::follow::{Follower, NODES, RANGE_PX, SEEN, State};
use super::models::Moving;
use super::plane::Point;
use super::sight::Sight;
use crate::frame::EyeFrame;

/// A step longer than so many usual ones is a gap.
pub(super) const GAP: f64 = 3.5;
/// Frames between two looks while in doubt.
pub(super) const LOOK_EVERY: usize = 8;
/// Curves whose nodes lie within this of each other are the same (px).
const SAME_PX: f64 = 5.0;
/// The same where nobody saw the rope: so many times as far.
const BLIND: f64 = 4.0;
/// A lead further than this from the tracked one is another one (px).
const OTHER_PX: f64 = 15.0;
/// Part of the coverage that the rope had of late that a rope found anew must have.
const LEAST_FOUND: f64 = 0.6;
/// Part of the length by which a rope found anew may differ.
const LENGTH_TOLERANCE: f64 = 0.06;
/// Ways over pixels are longer than the rope by up to this factor.
const WAY_FACTOR: f64 = 1.15;
/// Frames before something was noticed that are in doubt, too.
const UNNOTICED: usize = 2;
/// Clear frames in a row in which no rope can go far from another one.
const UNSEEN_RUN: usize = 3;
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
        sight: Sight::default(),
    };
    for index in 1..frames.len() {
        pursuit.go_on(index);
    }
    if let Some(doubt) = pursuit.doubt {
        pursuit.give_up(doubt.since..frames.len(), doubt.two_ropes || doubt.torn);
    }
    pursuit.states
}

/// Frames that are not known to show the tracked rope.
#[derive(Debug, Clone, Copy)]
struct Doubt {
    since: usize,
    /// From here on every frame was clear; only these are proven when the rope is found.
    clear_since: usize,
    next_look: usize,
    /// More than one thing hung on the clamp that could be the rope, and the more
    /// likely one was not the tracked one.
    two_ropes: bool,
    /// The rope was found where the track can't come from.
    torn: bool,
}

struct Pursuit<'a> {
    follower: &'a Follower<'a>,
    frames: &'a [EyeFrame],
    times_s: &'a [f64],
    usual_step_s: f64,
    states: Vec<State>,
    doubt: Option<Doubt>,
    sight: Sight,
}

impl Pursuit<'_> {
    fn go_on(&mut self, index: usize) {
        let (frame, t_s) = (&self.frames[index], self.times_s[index]);
        let before = &self.states[index - 1];
        let state = self.follower.step(frame, t_s, before);
        let gap = t_s - before.t_s > GAP * self.usual_step_s;
        let clear = is_clear(&state);
        if gap || !clear {
            let doubt = self.doubt.get_or_insert(Doubt {
                // What is noticed now may have come a moment ago.
                since: if state.ambiguous {
                    index.saturating_sub(UNNOTICED).max(1)
                } else {
                    index
                },
                clear_since: index,
                next_look: index,
                two_ropes: false,
                torn: false,
            });
            doubt.clear_since = if clear { index } else { index + 1 };
        }
        if self.doubt.is_none() {
            self.sight.note(&state);
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
        let Some(doubt) = &mut self.doubt else { return };
        let limit_m = SAME_PX / self.follower.plane.px_per_m;
        if near(&found.curve, &self.states[index].curve, limit_m) {
            let doubt = *doubt;
            self.doubt = None;
            self.settle(doubt, index);
            return;
        }
        let since = doubt.since;
        doubt.clear_since = index;
        self.states[index] = found;
        let mut clear = true;
        for earlier in (since..index).rev() {
            let later = &self.states[earlier + 1];
            let back = self.back(earlier, later);
            if self.same(&back.curve, &self.states[earlier].curve) {
                return;
            }
            // The way back begins where the rope was found; but it may go wrong as
            // the way forth did, though not where nothing like the rope is near.
            clear &= is_clear(&back);
            self.states[earlier] = back;
        }
        if let Some(doubt) = &mut self.doubt {
            doubt.torn |= !clear;
        }
    }

    /// The rope in a frame from its state in the next one.
    fn back(&self, index: usize, later: &State) -> State {
        let (frame, t_s) = (&self.frames[index], self.times_s[index]);
        self.follower.step(frame, t_s, later)
    }

    /// The rope is proven where a look found it. The frames of the doubt before are where
    /// the way back from there agrees with the way forth, and nobody could change ropes
    /// meanwhile unseen.
    fn settle(&mut self, doubt: Doubt, proven_at: usize) {
        let mut torn = doubt.torn.then_some(doubt.clear_since);
        let mut later = self.states[proven_at].clone();
        let same_m = SAME_PX / self.follower.plane.px_per_m;
        for index in (doubt.since..proven_at).rev() {
            later = self.back(index, &later);
            let state = &mut self.states[index];
            let apart_m = |node: usize| norm(sub(later.curve[node], state.curve[node]));
            let unseen = |node: usize| {
                state.hidden && state.confidence[node].min(later.confidence[node]) < SEEN
            };
            let far_m = |node: usize| if unseen(node) { BLIND * same_m } else { same_m };
            if (0..NODES).any(|node| apart_m(node) > far_m(node)) {
                torn = torn.max(Some(index + 1));
                break;
            }
            if state.hidden {
                let sure = (0..NODES).all(|node| apart_m(node) <= same_m);
                // What nobody saw is known the better the nearer in time it was seen.
                let part = (index + 1 - doubt.since) as f64 / (proven_at + 1 - doubt.since) as f64;
                for (forth, back) in state.curve.iter_mut().zip(&later.curve) {
                    *forth = add(*forth, scale(sub(*back, *forth), part));
                }
                if !sure {
                    distrust(state);
                }
            }
        }
        let open = doubt.since..doubt.clear_since.max(doubt.since);
        let (mut run, mut longest_run) = (0, 0);
        for state in &self.states[open.clone()] {
            run = if is_clear(state) { run + 1 } else { 0 };
            longest_run = longest_run.max(run);
        }
        if let Some(end) = torn {
            self.give_up(doubt.since..end.max(open.end), true);
        } else if longest_run > UNSEEN_RUN {
            self.give_up(open, doubt.two_ropes);
        }
    }

    /// Nobody knows what these frames show; with `lost` it is not the rope, most likely.
    fn give_up(&mut self, open: Range<usize>, lost: bool) {
        for state in &mut self.states[open] {
            distrust(state);
            state.lost |= lost;
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
        here.velocity = speeds(&here, &there, dt);
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
        let place = Place {
            background: follower.background,
            camera: follower.camera,
            plane: follower.plane,
            clamp: follower.clamp.at(t_s + middle_s),
            lead_px: None,
        };
        let look = first_frame::find(
            frame,
            &place,
            &mut Moving,
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
            hidden: false,
            ambiguous: false,
            clamp: None,
        };
        let found = self.measured(frame, t_s, &resting);
        let off = (length(&found.curve) / known_m - 1.0).abs();
        let fits = off < LENGTH_TOLERANCE
            && found.score() > LEAST_FOUND * self.sight.usual()
            && is_clear(&found);
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
        near(a, b, SAME_PX / self.follower.plane.px_per_m)
    }
}

/// What looking anew gives.
#[derive(Debug)]
pub(super) struct Look {
    /// The rope at rest where it was found.
    pub(super) found: Option<State>,
    /// More than one thing could be the rope, the more likely one not the tracked one.
    pub(super) two_ropes: bool,
}

/// Looks for the rope in a frame as if nothing were known; `tracked` is where it is
/// taken to be, `sight` how well it was seen before.
pub(super) fn look(
    follower: &Follower<'_>,
    (frame, t_s): (&EyeFrame, f64),
    usual_step_s: f64,
    tracked: Option<&State>,
    sight: &Sight,
) -> Look {
    let mut pursuit = Pursuit {
        follower,
        frames: std::slice::from_ref(frame),
        times_s: &[t_s],
        usual_step_s,
        states: tracked.cloned().into_iter().collect(),
        doubt: Some(Doubt {
            since: 0,
            clear_since: 0,
            next_look: 0,
            two_ropes: false,
            torn: false,
        }),
        sight: sight.clone(),
    };
    Look {
        found: pursuit.find(0),
        two_ropes: pursuit.doubt.is_some_and(|doubt| doubt.two_ropes),
    }
}

/// The rope in a frame, found in it (`there`) and in the one before (`here`), if a step
/// from the one leads to the other.
pub(super) fn confirmed(
    follower: &Follower<'_>,
    (frame, t_s): (&EyeFrame, f64),
    usual_step_s: f64,
    mut here: State,
    there: &State,
) -> Option<State> {
    let dt = t_s - here.t_s;
    if dt > GAP * usual_step_s {
        return None;
    }
    here.velocity = speeds(&here, there, dt);
    let forth = follower.step(frame, t_s, &here);
    same(follower, &forth, there).then_some(forth)
}

/// Velocities of the nodes between two states `dt` apart (m/s).
fn speeds(here: &State, there: &State, dt: f64) -> Vec<Point> {
    there
        .curve
        .iter()
        .zip(&here.curve)
        .map(|(a, b)| scale(sub(*a, *b), 1.0 / dt))
        .collect()
}

/// Whether two states have the rope in the same place.
pub(super) fn same(follower: &Follower<'_>, a: &State, b: &State) -> bool {
    near(&a.curve, &b.curve, SAME_PX / follower.plane.px_per_m)
}

fn near(a: &[Point], b: &[Point], limit_m: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| norm(sub(*a, *b)) < limit_m)
}

/// Seen in all its length, and nothing like it near.
pub(super) fn is_clear(state: &State) -> bool {
    !state.lost && !state.hidden && !state.ambiguous
}

pub(super) fn distrust(state: &mut State) {
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
