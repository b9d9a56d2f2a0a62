//! A rope that was found once, frame by frame.

use super::super::anew::{Anew, GAP, LOOK_EVERY, Look};
use super::super::clamp::ClampPath;
use super::super::curve::{norm, sub};
use super::super::plane::Point;
use super::super::sight::Sight;
use super::super::state::State;
use super::scene::Scene;
use super::{Newest, Rope};
use shared_types::StereoCamera;

/// Mean way of the rope's nodes between two samples of the scene (px).
const SAMPLE_APART_PX: f64 = 8.0;
/// Looks that must agree with the track one after the other to end a doubt.
const LOOKS: usize = 2;
/// Frames in a row without the rope after which all is learnt again.
const FORGET_AFTER: u64 = 600;

/// Doubt whether the track is on the rope.
#[derive(Debug, Clone, Copy)]
struct Doubt {
    next_look: u64,
    two_ropes: bool,
    agreed: usize,
}

/// A rope being followed.
#[derive(Debug)]
pub(super) struct Following {
    pub(super) rope: Rope,
    /// In the newest frame; times since the rope hung still.
    pub(super) state: State,
    doubt: Option<Doubt>,
    sight: Sight,
    /// Where it was found anew in the newest frame, to be confirmed in the next one.
    found: Option<State>,
    /// Frames in a row in which it is lost.
    lost_frames: u64,
    /// The curve when the scene was last sampled.
    sampled: Vec<Point>,
}

impl Following {
    /// Found in the `count`-th frame: one look of those that end a doubt.
    pub(super) fn begin(rope: Rope, state: State, count: u64) -> Self {
        Self {
            sampled: state.curve.clone(),
            rope,
            state,
            doubt: Some(Doubt {
                next_look: count + LOOK_EVERY as u64,
                two_ropes: false,
                agreed: 1,
            }),
            sight: Sight::default(),
            found: None,
            lost_frames: 0,
        }
    }

    /// Nothing of it was seen for long.
    pub(super) fn given_up(&self) -> bool {
        self.lost_frames > FORGET_AFTER
    }

    /// One step to the newest frame.
    pub(super) fn go_on(
        &mut self,
        camera: &StereoCamera,
        scene: &mut Scene,
        newest: &Newest,
        clamp: &ClampPath,
    ) {
        let clamp = clamp.since(self.rope.rest_s);
        let (Some(now), Some(background)) = (newest.since(self.rope.rest_s), scene.background())
        else {
            return;
        };
        let (frame, t_s) = now;
        let follower = self.rope.follower(camera, &clamp, background);
        let before_s = self.state.t_s;
        let mut state = follower.step(frame, t_s, &self.state);
        let gap = t_s - before_s > GAP * newest.usual_step_s;
        if gap || !state.is_clear() {
            self.doubt.get_or_insert(Doubt {
                next_look: newest.count,
                two_ropes: false,
                agreed: 0,
            });
        }
        if self.doubt.is_none() {
            self.sight.note(&state);
        }
        // While two ropes cross, looking anew would tell no more.
        let due = self.doubt.is_some_and(|d| newest.count >= d.next_look);
        let before = self.found.take();
        if before.is_some() || due && (!state.ambiguous || state.lost) {
            let anew = Anew {
                follower: &follower,
                usual_step_s: newest.usual_step_s,
                sight: &self.sight,
            };
            let Look { found, two_ropes } = anew.look(now, Some(&state));
            if let Some(doubt) = &mut self.doubt {
                doubt.two_ropes |= two_ropes;
                doubt.next_look = newest.count + LOOK_EVERY as u64;
            }
            match (before, found) {
                (None, found) => self.found = found,
                (Some(before), Some(found)) => {
                    let sure = anew.confirmed(now, before, &found).map(|[_, sure]| sure);
                    let agrees = sure.as_ref().map(|sure| anew.same(sure, &state));
                    self.settle(agrees);
                    if let (Some(sure), Some(false)) = (sure, agrees) {
                        state = sure;
                    }
                }
                (Some(_), None) => {}
            }
        }
        if let Some(doubt) = self.doubt.filter(|d| d.agreed == 0 || d.two_ropes) {
            state.distrust();
            state.lost |= doubt.two_ropes;
        }
        self.lost_frames = if state.lost { self.lost_frames + 1 } else { 0 };
        let px_per_m = self.rope.plane.px_per_m;
        if self.doubt.is_none() && way_px(&self.sampled, &state.curve, px_per_m) > SAMPLE_APART_PX {
            scene.take(frame, newest.count);
            self.sampled.clone_from(&state.curve);
        }
        self.state = state;
    }
}

impl Following {
    /// Takes note of a look that found the rope where the track has it, or elsewhere.
    fn settle(&mut self, agrees: Option<bool>) {
        self.doubt = self.doubt.and_then(|doubt| {
            let agreed = match agrees {
                Some(true) => doubt.agreed + 1,
                Some(false) => 1,
                None => doubt.agreed,
            };
            (agreed < LOOKS).then_some(Doubt { agreed, ..doubt })
        });
    }
}

/// Mean way of the nodes between two curves (px).
fn way_px(before: &[Point], now: &[Point], px_per_m: f64) -> f64 {
    let ways = before.iter().zip(now).map(|(a, b)| norm(sub(*a, *b)));
    ways.sum::<f64>() / now.len() as f64 * px_per_m
}
