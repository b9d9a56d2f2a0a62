//! The tracker for frames that come one by one and are seen once.
//!
//! What [`track`](super::track()) does in two passes over a film is done here as it
//! goes: the scene without rope grows while something moves; then the rope is learnt
//! from the last frame in which it hung still, found in two frames that follow each
//! other, and followed by the same steps. What is lost is looked for anew from the
//! clamp, but nobody goes back: a frame keeps what was known when it came.

mod following;
mod scene;

use super::anew::Anew;
use super::clamp::ClampPath;
use super::first_frame::{self, FirstLook, Place};
use super::follow::{Follower, RopeModel};
use super::models::Moving;
use super::plane::RopePlane;
use super::refusal::{TrackError, check_frame, check_keypoints};
use super::sight::Sight;
use super::state::State;
use super::{keypoints, learn};
use crate::frame::EyeFrame;
use following::Following;
use nalgebra::Vector3;
use scene::Scene;
use shared_types::StereoCamera;
use shared_types::keypoints::TrackedFrame;

/// Frames between two attempts at finding a rope that was not found yet.
const TRY_EVERY: u64 = 4;

/// A rope that was learnt.
#[derive(Debug)]
struct Rope {
    plane: RopePlane,
    model: RopeModel,
    /// When it hung still (s).
    rest_s: f64,
}

/// How far it has come. Each step is one frame's work.
#[derive(Debug)]
enum Stage {
    /// The scene is being learnt.
    Scene,
    /// The rope was found in the frame in which it hung still.
    AtRest(RopePlane, Box<FirstLook>),
    /// Its looks are known; it must be found where it is now, in two
    /// frames that follow each other; the state in the first of them.
    Known(Box<Rope>, Option<State>),
    /// It is being followed.
    Following(Box<Following>),
}

/// The newest frame and when it was taken.
#[derive(Debug, Default)]
struct Newest {
    frame: Option<EyeFrame>,
    /// Since the first one (s).
    t_s: f64,
    first_stamp_ns: u64,
    /// Frames seen so far.
    count: u64,
    /// Usual time between two frames (s).
    usual_step_s: f64,
}

impl Newest {
    fn put(&mut self, frame: EyeFrame) {
        if self.count == 0 {
            self.first_stamp_ns = frame.stamp_ns;
        }
        let t_s = frame.stamp_ns.saturating_sub(self.first_stamp_ns) as f64 * 1e-9;
        let step_s = t_s - self.t_s;
        // Frames are left out, never doubled: the shortest step is the usual one.
        if self.count == 1 || self.count > 1 && step_s < self.usual_step_s {
            self.usual_step_s = step_s;
        }
        self.t_s = t_s;
        self.frame = Some(frame);
        self.count += 1;
    }

    /// The frame and its time since `zero_s`.
    fn since(&self, zero_s: f64) -> Option<(&EyeFrame, f64)> {
        Some((self.frame.as_ref()?, self.t_s - zero_s))
    }
}

/// Follows the rope frame by frame.
#[derive(Debug)]
pub struct OnePass {
    camera: StereoCamera,
    keypoints: usize,
    scene: Option<Scene>,
    stage: Stage,
    newest: Newest,
    /// The next frame is to be the one from which the rope is learnt.
    rest_is_next: bool,
}

impl OnePass {
    /// A tracker that gives so many keypoints a frame, clamp and lead centre included.
    ///
    /// # Errors
    /// Too many or few keypoints.
    pub fn new(camera: StereoCamera, keypoints: usize) -> Result<Self, TrackError> {
        check_keypoints(keypoints)?;
        Ok(Self {
            camera,
            keypoints,
            scene: None,
            stage: Stage::Scene,
            newest: Newest::default(),
            rest_is_next: false,
        })
    }

    /// Takes the next frame; gives the keypoints in it once the rope is followed.
    ///
    /// Time 0 of `clamp`, and of the keypoints, is the first frame's start of exposure;
    /// `clamp` must reach back to when the rope began to move.
    ///
    /// # Errors
    /// A frame of another size than the camera's, or not later than the one before.
    pub fn see(
        &mut self,
        frame: EyeFrame,
        clamp: &ClampPath,
    ) -> Result<Option<TrackedFrame>, TrackError> {
        let index = usize::try_from(self.newest.count).unwrap_or(usize::MAX);
        check_frame(index, self.newest.frame.as_ref(), &frame, &self.camera)?;
        self.newest.put(frame);
        let stage = std::mem::replace(&mut self.stage, Stage::Scene);
        self.stage = self.go_on(stage, clamp);
        let Stage::Following(following) = &self.stage else {
            return Ok(None);
        };
        let plane = &following.rope.plane;
        Ok(Some(TrackedFrame {
            t_s: self.newest.t_s,
            ..keypoints(&following.state, plane, self.keypoints)
        }))
    }

    /// Forgets scene and rope: the next frame is the first one again.
    pub fn begin_anew(&mut self) {
        self.scene = None;
        self.stage = Stage::Scene;
        self.newest = Newest::default();
    }

    /// Forgets the rope: it is learnt from the next frame, moving or not. `clamp` need
    /// reach back no further than to that frame then.
    pub fn learn_anew(&mut self) {
        self.stage = Stage::Scene;
        self.rest_is_next = true;
    }

    /// Whether the scene without rope is known.
    #[must_use]
    pub fn knows_scene(&self) -> bool {
        self.scene.as_ref().and_then(Scene::background).is_some()
    }

    /// How far a point in the world is from the plane in which the rope is followed (m);
    /// `None` while it is not.
    #[must_use]
    pub fn off_plane_m(&self, p_w_m: &Vector3<f64>) -> Option<f64> {
        let Stage::Following(following) = &self.stage else {
            return None;
        };
        let plane = &following.rope.plane;
        Some(plane.off_m(&self.camera.to_left(p_w_m)))
    }

    fn go_on(&mut self, stage: Stage, clamp: &ClampPath) -> Stage {
        let Newest { frame, count, .. } = &self.newest;
        let Some(frame) = frame else {
            return stage;
        };
        let scene = self.scene.get_or_insert_with(|| Scene::new(frame.clone()));
        if std::mem::take(&mut self.rest_is_next) {
            scene.rest_in(frame, *count);
        }
        if !matches!(stage, Stage::Following(_)) {
            scene.watch(frame, *count);
        }
        scene.renew();
        match stage {
            Stage::Scene => self.look_at_rest(clamp),
            Stage::AtRest(plane, look) => self.learn(plane, &look, clamp),
            Stage::Known(rope, found) => self.find(rope, found, clamp),
            Stage::Following(mut following) => {
                let Some(scene) = &mut self.scene else {
                    return Stage::Scene;
                };
                following.go_on(&self.camera, scene, &self.newest, clamp);
                if following.given_up() {
                    self.scene = None;
                    return Stage::Scene;
                }
                Stage::Following(following)
            }
        }
    }

    /// Time of the frame in which the rope hung still (s).
    fn rest_s(&self, scene: &Scene) -> f64 {
        let since = scene.rest().stamp_ns;
        since.saturating_sub(self.newest.first_stamp_ns) as f64 * 1e-9
    }

    /// Finds the rope in the frame in which it hung still.
    fn look_at_rest(&self, clamp: &ClampPath) -> Stage {
        let known = self.scene.as_ref().and_then(|s| Some((s, s.background()?)));
        let Some((scene, background)) = known else {
            return Stage::Scene;
        };
        if !self.newest.count.is_multiple_of(TRY_EVERY) {
            return Stage::Scene;
        }
        let clamp = clamp.since(self.rest_s(scene));
        let until_s = self.newest.t_s - self.rest_s(scene);
        let Some(plane) = RopePlane::fit(&self.camera, &clamp, until_s) else {
            return Stage::Scene;
        };
        let place = Place {
            background,
            camera: &self.camera,
            plane: &plane,
            clamp: clamp.at(0.0),
            lead_px: None,
        };
        match first_frame::find(scene.rest(), &place, &mut Moving, None) {
            Ok(look) => Stage::AtRest(plane, Box::new(look)),
            Err(reason) => {
                tracing::debug!(?reason, "no rope hangs on the clamp yet");
                Stage::Scene
            }
        }
    }

    /// Learns what the rope looks like.
    fn learn(&self, plane: RopePlane, look: &FirstLook, clamp: &ClampPath) -> Stage {
        let known = self.scene.as_ref().and_then(|s| Some((s, s.background()?)));
        let Some((scene, background)) = known else {
            return Stage::Scene;
        };
        let rest_s = self.rest_s(scene);
        let clamp = clamp.since(rest_s);
        let (follower, _) = learn(scene.rest(), &self.camera, &clamp, &plane, background, look);
        let model = follower.model;
        let rope = Rope {
            plane,
            model,
            rest_s,
        };
        Stage::Known(Box::new(rope), None)
    }

    /// Finds a rope that was learnt where it is now; `before` is where it was found in
    /// the frame before.
    fn find(&self, rope: Box<Rope>, before: Option<State>, clamp: &ClampPath) -> Stage {
        let Newest {
            count,
            usual_step_s,
            ..
        } = &self.newest;
        let Some(background) = self.scene.as_ref().and_then(Scene::background) else {
            return Stage::Scene;
        };
        let Some(now) = self.newest.since(rope.rest_s) else {
            return Stage::Known(rope, None);
        };
        if before.is_none() && !count.is_multiple_of(TRY_EVERY) {
            return Stage::Known(rope, None);
        }
        let clamp = clamp.since(rope.rest_s);
        let follower = rope.follower(&self.camera, &clamp, background);
        let anew = Anew {
            follower: &follower,
            usual_step_s: *usual_step_s,
            sight: &Sight::default(),
        };
        let Some(found) = anew.look(now, None).found else {
            // The scene may have been poor when the rope was learnt.
            return Stage::Scene;
        };
        let Some(before) = before else {
            return Stage::Known(rope, Some(found));
        };
        match anew.confirmed(now, before, &found) {
            Some([_, state]) => Stage::Following(Box::new(Following::begin(*rope, state, *count))),
            None => Stage::Scene,
        }
    }
}

impl Rope {
    /// What follows it; times since it hung still.
    fn follower<'a>(
        &'a self,
        camera: &'a StereoCamera,
        clamp: &'a ClampPath,
        background: &'a super::background::Background,
    ) -> Follower<'a> {
        Follower {
            camera,
            clamp,
            plane: &self.plane,
            background,
            model: self.model.clone(),
        }
    }
}
