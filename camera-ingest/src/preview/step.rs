//! What the preview makes of frames and poses as they come: no clock, no shared memory.

use arm_model::{JointVector, Pole};
use shared_types::StereoCamera;
use shared_types::ipc::{PreviewFrame, PreviewState};
use shared_types::keypoints::{KeypointFrame, TrackedFrame};

use super::arm::{Arm, Knot};
use crate::frame::EyeFrame;
use crate::track::{OnePass, TrackError};

/// A longer pause between two frames restarts it (ns).
const PAUSE_NS: u64 = 1_000_000_000;
/// A rope that was lost for longer is looked for from the beginning (ns): a hand that
/// passes takes less.
const LOST_NS: u64 = 3_000_000_000;
/// A clamp further from the rope's plane leaves it (m): the rope would seem longer or
/// shorter by more than the tracker allows.
const OFF_PLANE_M: f64 = 0.05;
/// While the rope is looked for: a clamp that was moved that far (m) and has stood there
/// for so long (ns). The rope would be looked for where it hung before.
const ELSEWHERE_M: f64 = 0.05;
const STOOD_NS: u64 = 500_000_000;
/// While the rope is looked for in a scene that is known: so often it is looked for where
/// it is now (ns), for it may have been poorly seen where it was.
const AGAIN_NS: u64 = 2_000_000_000;
/// While the rope is followed only the clamp's last second counts (ns).
const PAST_NS: u64 = 1_000_000_000;

/// A frame that was looked at.
#[derive(Debug, Clone, Copy)]
struct Last {
    sequence: u64,
    stamp_ns: u64,
}

/// How much is forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Forget {
    /// The rope; what is behind it is known.
    Rope,
    /// The scene, too.
    All,
}

/// What is known of the tracker's present attempt.
#[derive(Debug, Clone, Copy)]
struct Attempt {
    /// Its first frame.
    zero_ns: u64,
    /// The frame in which the rope is looked for first, and the clamp in it.
    rest_ns: u64,
    clamp: Knot,
    /// Since when the rope is lost.
    lost_ns: Option<u64>,
}

/// Follows the rope in whatever frames it is given.
#[derive(Debug)]
pub struct Preview {
    tracker: OnePass,
    pole: Pole,
    arm: Arm,
    attempt: Option<Attempt>,
    last: Option<Last>,
    seen: u64,
    skipped: u64,
    restarts: u32,
}

impl Preview {
    /// One that has seen nothing, of a rope on this pole; so many keypoints a frame, clamp and
    /// lead centre included.
    ///
    /// # Errors
    /// Too many or few keypoints.
    pub fn new(camera: StereoCamera, pole: Pole, keypoints: usize) -> Result<Self, TrackError> {
        Ok(Self {
            tracker: OnePass::new(camera, keypoints)?,
            pole,
            arm: Arm::default(),
            attempt: None,
            last: None,
            seen: 0,
            skipped: 0,
            restarts: 0,
        })
    }

    /// Takes in the arm's joints as measured (CLOCK_MONOTONIC ns, rad).
    pub fn report(&mut self, stamp_ns: u64, q: &JointVector) {
        if let Some(knot) = Knot::of_joints(stamp_ns, q, &self.pole) {
            self.arm.put(knot);
        }
    }

    /// Looks at a frame. `sequence` is the camera's count: what it leaves out was skipped.
    pub fn see(&mut self, frame: EyeFrame) -> PreviewFrame {
        let (sequence, stamp_ns) = (frame.sequence, frame.stamp_ns);
        self.count(sequence, stamp_ns);
        let (state, tracked) = self.track(frame);
        self.told(state, sequence, stamp_ns, tracked.as_ref())
    }

    /// The message while no frame arrives.
    #[must_use]
    pub fn without_camera(&self) -> PreviewFrame {
        self.told(PreviewState::NoCamera, 0, 0, None)
    }

    /// A frame came that is none, or none of this camera.
    pub fn unfit(&mut self, sequence: u64, stamp_ns: u64) -> PreviewFrame {
        self.count(sequence, stamp_ns);
        self.begin_anew("the camera's frames do not fit its calibration");
        self.told(PreviewState::Unfit, sequence, stamp_ns, None)
    }

    /// Counts a frame; a camera that restarted or paused shows another scene.
    fn count(&mut self, sequence: u64, stamp_ns: u64) {
        self.seen += 1;
        if let Some(last) = self.last {
            if sequence <= last.sequence || stamp_ns <= last.stamp_ns {
                self.begin_anew("the camera restarted");
            } else {
                self.skipped += sequence - last.sequence - 1;
                if stamp_ns - last.stamp_ns > PAUSE_NS {
                    self.begin_anew("no frame was seen for a second");
                }
            }
        }
        self.last = Some(Last { sequence, stamp_ns });
    }

    /// Forgets scene and rope.
    fn begin_anew(&mut self, why: &'static str) {
        if self.attempt.take().is_some() {
            self.restarts = self.restarts.saturating_add(1);
            tracing::info!("restarts: {why}");
        }
        self.tracker.begin_anew();
    }

    /// Why what is known of scene or rope is of no use any more.
    fn outdated(&mut self, stamp_ns: u64) -> Option<(Forget, &'static str)> {
        let jumped = self.arm.take_jump();
        let (attempt, clamp) = (self.attempt?, self.arm.newest()?);
        if jumped {
            return Some((Forget::Rope, "the arm is elsewhere than its path leads to"));
        }
        let lost = |since: u64| stamp_ns.saturating_sub(since) > LOST_NS;
        if attempt.lost_ns.is_some_and(lost) {
            return Some((Forget::All, "the rope is lost"));
        }
        if let Some(off_m) = self.tracker.off_plane_m(&clamp.p_w_m) {
            let why = (Forget::Rope, "the clamp left the plane of the rope");
            return (off_m > OFF_PLANE_M).then_some(why);
        }
        let moved = (clamp.p_w_m - attempt.clamp.p_w_m).norm() > ELSEWHERE_M;
        if moved && self.arm.stood_ns() > STOOD_NS {
            return Some((Forget::Rope, "the arm stands elsewhere"));
        }
        let full = (
            Forget::All,
            "the rope was not found in half a minute of motion",
        );
        self.arm.is_full().then_some(full)
    }

    fn track(&mut self, frame: EyeFrame) -> (PreviewState, Option<TrackedFrame>) {
        let stamp_ns = frame.stamp_ns;
        let clamp = self.arm.newest().copied();
        let Some(clamp) = clamp.filter(|_| self.arm.is_known_at(stamp_ns)) else {
            self.begin_anew("the arm's pose is unknown");
            return (PreviewState::NoArm, None);
        };
        match self.outdated(stamp_ns) {
            Some((Forget::Rope, why)) if self.tracker.knows_scene() => {
                self.restarts = self.restarts.saturating_add(1);
                tracing::info!("detects the rope again: {why}");
                self.learn_anew(stamp_ns, clamp);
            }
            Some((_, why)) => self.begin_anew(why),
            None => self.look_again(stamp_ns, clamp),
        }
        let attempt = *self.attempt.get_or_insert_with(|| {
            self.arm.forget_before(stamp_ns);
            Attempt {
                zero_ns: stamp_ns,
                rest_ns: stamp_ns,
                clamp,
                lost_ns: None,
            }
        });
        let Ok(path) = self.arm.since(attempt.zero_ns) else {
            return (PreviewState::NoArm, None);
        };
        match self.tracker.see(frame, &path) {
            Ok(None) => {
                self.note_lost(None);
                (PreviewState::Looking, None)
            }
            Ok(Some(tracked)) => {
                self.note_lost(tracked.lost.then_some(stamp_ns));
                self.arm.forget_before(stamp_ns.saturating_sub(PAST_NS));
                (PreviewState::Following, Some(tracked))
            }
            Err(error) => {
                self.begin_anew("a frame was refused");
                tracing::debug!("{error}");
                (PreviewState::Unfit, None)
            }
        }
    }

    /// Learns the rope from the frame at hand.
    fn learn_anew(&mut self, stamp_ns: u64, clamp: Knot) {
        self.tracker.learn_anew();
        self.arm.forget_before(stamp_ns);
        if let Some(attempt) = &mut self.attempt {
            *attempt = Attempt {
                zero_ns: attempt.zero_ns,
                rest_ns: stamp_ns,
                clamp,
                lost_ns: None,
            };
        }
    }

    /// The rope of a scene that is known was looked for long enough where it was.
    fn look_again(&mut self, stamp_ns: u64, clamp: Knot) {
        let Some(attempt) = self.attempt else { return };
        let looks = self.tracker.off_plane_m(&clamp.p_w_m).is_none();
        let long = stamp_ns.saturating_sub(attempt.rest_ns) > AGAIN_NS;
        if looks && long && self.tracker.knows_scene() {
            self.learn_anew(stamp_ns, clamp);
        }
    }

    /// Keeps since when the rope is lost; `now_ns` when it is.
    fn note_lost(&mut self, now_ns: Option<u64>) {
        if let Some(attempt) = &mut self.attempt {
            attempt.lost_ns = now_ns.map(|now| attempt.lost_ns.unwrap_or(now));
        }
    }

    fn told(
        &self,
        state: PreviewState,
        sequence: u64,
        stamp_ns: u64,
        tracked: Option<&TrackedFrame>,
    ) -> PreviewFrame {
        let nothing = KeypointFrame {
            sequence,
            stamp_ns,
            ..KeypointFrame::default()
        };
        PreviewFrame {
            state: state as u8,
            seen: self.seen,
            skipped: self.skipped,
            restarts: self.restarts,
            rope: tracked.map_or(nothing, |t| KeypointFrame::new(sequence, stamp_ns, t)),
            ..PreviewFrame::default()
        }
    }
}

#[cfg(test)]
#[path = "step_tests.rs"]
mod tests;
