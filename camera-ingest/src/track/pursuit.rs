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

use super::anew::{Anew, GAP, LOOK_EVERY, Look, SAME_PX};
use super::follow::Follower;
use super::sight::Sight;
use super::state::State;
use super::ways::{Ways, between};
use crate::frame::EyeFrame;

/// Frames before something was noticed that are in doubt, too.
const UNNOTICED: usize = 2;
/// Clear frames in a row in which no rope can go far from another one.
const UNSEEN_RUN: usize = 3;

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
    /// Never the first frame, in which the rope was found at rest.
    since: usize,
    /// The first frame that was not clear; those before were taken for clear.
    noticed: usize,
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
        let gap = self.is_gap(index);
        let clear = state.is_clear();
        if gap || !clear {
            let doubt = self.doubt.get_or_insert(Doubt {
                // What is noticed now may have come a moment ago.
                since: if state.ambiguous {
                    index.saturating_sub(UNNOTICED).max(1)
                } else {
                    index
                },
                noticed: index,
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

    /// Frames are missing before this one.
    fn is_gap(&self, index: usize) -> bool {
        self.times_s[index] - self.times_s[index - 1] > GAP * self.usual_step_s
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
        if found.near(&self.states[index], limit_m) {
            let doubt = *doubt;
            self.doubt = None;
            self.settle(doubt, index);
            return;
        }
        let since = doubt.since;
        doubt.clear_since = index;
        self.states[index] = found;
        // The frame before the doubt is not to be mended, but the way back may lead to it;
        // over missing frames it would only be guessed.
        let first = if self.is_gap(since) { since } else { since - 1 };
        for earlier in (first..index).rev() {
            let later = &self.states[earlier + 1];
            let back = self.back(earlier, later);
            if back.near(&self.states[earlier], limit_m) {
                return;
            }
            if earlier >= since {
                self.states[earlier] = back;
            }
        }
        if let Some(doubt) = &mut self.doubt {
            doubt.torn = true;
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
        // Whether the way back parted from the way forth; then both must meet before the
        // doubt at the latest.
        let mut parted = false;
        for index in (doubt.since..proven_at).rev() {
            later = self.back(index, &later);
            let ways = Ways::of(&self.states[index], &later, same_m);
            parted = ways == Ways::Mistaken || parted && ways != Ways::Same;
            let state = &mut self.states[index];
            match ways {
                Ways::Same if state.hidden => {
                    // What nobody saw is known the better the nearer in time it was seen.
                    let part =
                        (index + 1 - doubt.since) as f64 / (proven_at + 1 - doubt.since) as f64;
                    between(state, &later, part, same_m);
                }
                Ways::Same => {}
                Ways::Close => {
                    between(state, &later, 0.5, same_m);
                }
                Ways::Mistaken => {
                    state.clone_from(&later);
                    state.distrust();
                }
                // Nothing was noticed yet: these frames were taken for good. Where the
                // ways had parted after them, nobody knows which is right, and the frames
                // stay in doubt.
                Ways::Blind if index < doubt.noticed => {
                    self.give_up(doubt.since..index + 1, false);
                    parted = false;
                    break;
                }
                Ways::Blind | Ways::Apart => {
                    torn = torn.max(Some(index + 1));
                    parted = false;
                    break;
                }
            }
        }
        if parted && !self.is_gap(doubt.since) {
            later = self.back(doubt.since - 1, &later);
            if Ways::of(&self.states[doubt.since - 1], &later, same_m) != Ways::Same {
                torn = torn.max(Some(doubt.clear_since));
            }
        }
        let open = doubt.since..doubt.clear_since.max(doubt.since);
        let (mut run, mut longest_run) = (0, 0);
        for state in &self.states[open.clone()] {
            run = if state.is_clear() { run + 1 } else { 0 };
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
            state.distrust();
            state.lost |= lost;
        }
    }

    /// The rope found anew in a frame, its velocity from where it is found in
    /// the next one.
    fn find_moving(&mut self, index: usize) -> Option<State> {
        let next_s = *self.times_s.get(index + 1)?;
        let here = self.find(index)?;
        if next_s - here.t_s > GAP * self.usual_step_s {
            return None;
        }
        let there = self.find(index + 1)?;
        let next = (&self.frames[index + 1], next_s);
        let [here, _] = self.anew().confirmed(next, here, &there)?;
        Some(here)
    }

    /// The rope found from the clamp in one frame.
    fn find(&mut self, index: usize) -> Option<State> {
        let now = (&self.frames[index], self.times_s[index]);
        let Look { found, two_ropes } = self.anew().look(now, self.states.last());
        if let Some(doubt) = &mut self.doubt {
            doubt.two_ropes |= two_ropes;
        }
        found
    }

    fn anew(&self) -> Anew<'_> {
        Anew {
            follower: self.follower,
            usual_step_s: self.usual_step_s,
            sight: &self.sight,
        }
    }
}

/// Median time between two frames (s).
fn usual_step(times_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0 / 60.0)
}
