//! Looking for the rope anew: from the clamp, as in the first frame, as if nothing were
//! known but what it looks like.

use super::curve::{length, norm, resample, scale, smooth, sub};
use super::first_frame::{self, Place};
use super::follow::{Follower, NODES, RANGE_PX};
use super::models::Moving;
use super::plane::Point;
use super::sight::Sight;
use super::state::State;
use crate::frame::EyeFrame;

/// A step longer than so many usual ones is a gap.
pub(super) const GAP: f64 = 3.5;
/// Frames between two looks while in doubt.
pub(super) const LOOK_EVERY: usize = 8;
/// Curves whose nodes lie within this of each other are the same (px).
pub(super) const SAME_PX: f64 = 5.0;
/// A lead further than this from the tracked one is another one (px).
const OTHER_PX: f64 = 15.0;
/// Part of the coverage that the rope had of late that a rope found anew must have.
const LEAST_FOUND: f64 = 0.6;
/// Part of the length by which a rope found anew may differ.
const LENGTH_TOLERANCE: f64 = 0.06;
/// Ways over pixels are longer than the rope by up to this factor.
const WAY_FACTOR: f64 = 1.15;

/// What looking anew gives.
#[derive(Debug, Default)]
pub(super) struct Look {
    /// The rope at rest where it was found.
    pub(super) found: Option<State>,
    /// More than one thing could be the rope, the more likely one not the tracked one.
    pub(super) two_ropes: bool,
}

/// Looks for the rope.
#[derive(Clone, Copy)]
pub(super) struct Anew<'a> {
    pub(super) follower: &'a Follower<'a>,
    /// Usual time between two frames (s).
    pub(super) usual_step_s: f64,
    /// How well it was seen before.
    pub(super) sight: &'a Sight,
}

impl Anew<'_> {
    /// Looks for the rope in a frame; `tracked` is where it is taken to be.
    pub(super) fn look(&self, (frame, t_s): (&EyeFrame, f64), tracked: Option<&State>) -> Look {
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
        let lengths_m = [known_m * (1.0 - LENGTH_TOLERANCE), known_m * WAY_FACTOR];
        let Ok(look) = first_frame::find(frame, &place, &mut Moving, Some(lengths_m)) else {
            return Look::default();
        };
        if !look.sole {
            let apart = tracked
                .zip(look.path.last())
                .map(|(tracked, end)| norm(sub(tracked.curve[NODES - 1], *end)));
            let other_m = OTHER_PX / follower.plane.px_per_m;
            return Look {
                found: None,
                two_ropes: apart.is_some_and(|apart| apart > other_m),
            };
        }
        let curve = smooth(&look.path, &vec![0.05; look.path.len()], 20.0);
        let resting = State::resting(
            t_s - self.usual_step_s,
            resample(&curve, length(&curve), NODES),
        );
        let found = self.measured(frame, t_s, &resting);
        let off = (length(&found.curve) / known_m - 1.0).abs();
        let fits = off < LENGTH_TOLERANCE
            && found.score() > LEAST_FOUND * self.sight.usual()
            && found.is_clear();
        Look {
            found: fits.then_some(found),
            two_ropes: false,
        }
    }

    /// The rope found in a frame (`there`) and in the one before (`here`), if a step from
    /// the one leads to the other: both, now moving.
    pub(super) fn confirmed(
        &self,
        (frame, t_s): (&EyeFrame, f64),
        mut here: State,
        there: &State,
    ) -> Option<[State; 2]> {
        let dt = t_s - here.t_s;
        if dt > GAP * self.usual_step_s {
            return None;
        }
        let ways = there.curve.iter().zip(&here.curve);
        here.velocity = ways.map(|(a, b)| scale(sub(*a, *b), 1.0 / dt)).collect();
        // Measured again, now with the blur it has, and found where it must be.
        let forth = self.follower.step(frame, t_s, &here);
        self.same(&forth, there).then_some([here, forth])
    }

    /// Whether two states have the rope in the same place.
    pub(super) fn same(&self, a: &State, b: &State) -> bool {
        a.near(b, SAME_PX / self.follower.plane.px_per_m)
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
}
