//! What the preview makes of frames and poses as they come: no clock, no shared memory, no
//! threads.

use arm_model::{JointVector, Pole};
use rope_sim::MeasuredArm;
use shared_types::ipc::{PAYLOAD_VERSION, PreviewFrame, PreviewState};
use shared_types::keypoints::{KeypointFrame, TrackedFrame};
use shared_types::{MonotonicNs, StereoCamera};

use super::arm::Arm;
use crate::frame::ImageFrame;
use crate::track::{Known, TrackError, check_keypoints};

/// A longer pause between two frames restarts it (ns).
const PAUSE_NS: u64 = 1_000_000_000;
/// A rope that was lost for longer is looked for from the beginning (ns): a hand that
/// passes takes less.
const LOST_NS: u64 = 3_000_000_000;
/// The arm must have stood for so long before it moves: the rope hangs still (ns).
const REST_NS: u64 = 500_000_000;
/// Frames in which the rope is looked for, and how far apart they are at least (ns).
const FRAMES: usize = 100;
const PERIOD_NS: u64 = 60_000_000;
/// A joint must have moved by this much in them (rad).
const ENOUGH_RAD: f64 = 0.05;
/// Joint reports kept from before the first of them (ns).
const BEFORE_NS: u64 = 200_000_000;
/// And from before the instant until which a known rope is simulated, because its motion
/// still depends on them (ns).
const PAST_NS: u64 = 250_000_000;

/// A frame that was looked at.
#[derive(Debug, Clone, Copy)]
struct Last {
    sequence: u64,
    stamp_ns: u64,
}

#[derive(Debug)]
enum Stage {
    /// Takes frames: the newest one while the arm stands, then all of a motion.
    Collecting(Vec<ImageFrame>),
    /// Somebody looks for the rope in them, the first of which began at `zero_ns`.
    Searching { zero_ns: u64 },
    /// There is one; `lost_ns` is the frame since which nothing of it is seen.
    Following {
        known: Box<Known>,
        zero_ns: u64,
        lost_ns: Option<u64>,
    },
}

/// A search for the rope, which takes seconds.
#[derive(Debug)]
pub struct Search {
    attempt: u32,
    frames: Vec<ImageFrame>,
    camera: StereoCamera,
    motion: MeasuredArm,
}

/// What came of a [`Search`].
#[derive(Debug)]
pub struct Answer {
    attempt: u32,
    found: Result<Known, (&'static str, TrackError)>,
}

impl Search {
    /// Looks for the rope, on this thread.
    #[must_use]
    pub fn run(self) -> Answer {
        Answer {
            attempt: self.attempt,
            found: Known::find(&self.frames, &self.camera, &self.motion),
        }
    }
}

/// Follows the rope in whatever frames it is given.
#[derive(Debug)]
pub struct Preview {
    camera: StereoCamera,
    keypoints: usize,
    arm: Arm,
    stage: Stage,
    /// Whether anything was seen since it began anew.
    begun: bool,
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
        check_keypoints(keypoints)?;
        Ok(Self {
            camera,
            keypoints,
            arm: Arm::new(pole),
            stage: Stage::Collecting(Vec::new()),
            begun: false,
            last: None,
            seen: 0,
            skipped: 0,
            restarts: 0,
        })
    }

    /// Takes in the arm's joints as measured (CLOCK_MONOTONIC ns, rad).
    pub fn report(&mut self, stamp_ns: u64, q: &JointVector) {
        self.arm.put(stamp_ns, *q);
    }

    /// Looks at a frame. `sequence` is the camera's count: what it leaves out was skipped.
    pub fn see(&mut self, frame: ImageFrame) -> PreviewFrame {
        let (sequence, stamp_ns) = (frame.sequence, frame.stamp_ns);
        self.count(sequence, stamp_ns);
        let (state, tracked) = self.track(frame);
        self.reported(state, sequence, stamp_ns, tracked.as_ref())
    }

    /// The message while no frame arrives.
    #[must_use]
    pub fn without_camera(&self) -> PreviewFrame {
        self.reported(PreviewState::NoCamera, 0, 0, None)
    }

    /// A frame came that is none, or none of this camera.
    pub fn unfit(&mut self, sequence: u64, stamp_ns: u64) -> PreviewFrame {
        self.count(sequence, stamp_ns);
        self.restart("the camera's frames do not fit its calibration");
        self.reported(PreviewState::Unfit, sequence, stamp_ns, None)
    }

    /// The search that is due, once. Frames and reports may go on coming while it runs.
    pub fn search(&mut self) -> Option<Search> {
        let frames = match &mut self.stage {
            Stage::Collecting(frames) if frames.len() == FRAMES => std::mem::take(frames),
            _ => return None,
        };
        let zero_ns = frames[0].stamp_ns;
        match self.arm.motion(zero_ns) {
            Ok(motion) => {
                self.stage = Stage::Searching { zero_ns };
                Some(Search {
                    attempt: self.restarts,
                    frames,
                    camera: self.camera.clone(),
                    motion,
                })
            }
            Err(reason) => {
                tracing::debug!(%reason, "joint reports");
                self.restart("the joint reports are no motion");
                None
            }
        }
    }

    /// Takes in what came of a search. It is of no use where the preview began anew since.
    pub fn take(&mut self, answer: Answer) {
        let Stage::Searching { zero_ns } = self.stage else {
            return;
        };
        if answer.attempt != self.restarts {
            return;
        }
        match answer.found {
            Ok(known) => {
                self.stage = Stage::Following {
                    known: Box::new(known),
                    zero_ns,
                    lost_ns: None,
                }
            }
            Err((what, reason)) => {
                tracing::info!(%reason, "no rope found");
                self.restart(what);
            }
        }
    }

    /// Counts a frame; a camera that restarted or paused shows another scene.
    fn count(&mut self, sequence: u64, stamp_ns: u64) {
        self.seen += 1;
        if let Some(last) = self.last {
            if sequence <= last.sequence || stamp_ns <= last.stamp_ns {
                self.restart("the camera restarted");
            } else {
                self.skipped += sequence - last.sequence - 1;
                if stamp_ns - last.stamp_ns > PAUSE_NS {
                    self.restart("no frame was seen for a second");
                }
            }
        }
        self.last = Some(Last { sequence, stamp_ns });
    }

    /// Forgets scene and rope.
    fn restart(&mut self, why: &'static str) {
        if std::mem::take(&mut self.begun) {
            self.restarts = self.restarts.wrapping_add(1);
            tracing::info!("restarts: {why}");
        }
        self.stage = Stage::Collecting(Vec::new());
    }

    fn track(&mut self, frame: ImageFrame) -> (PreviewState, Option<TrackedFrame>) {
        let size = [frame.width_px, frame.height_px];
        if size != [self.camera.width_px, self.camera.height_px].map(|px| px as usize) {
            self.restart("a frame has another size");
            return (PreviewState::Unfit, None);
        }
        if !self.arm.is_known_at(frame.stamp_ns) {
            self.restart("the arm's pose is unknown");
            return (PreviewState::NoArm, None);
        }
        if self.arm.take_jump() {
            self.restart("the arm is elsewhere than its path leads to");
        }
        if self.arm.is_full() {
            self.restart("the search took too long");
        }
        self.begun = true;
        let stamp_ns = frame.stamp_ns;
        match &mut self.stage {
            Stage::Collecting(frames) => {
                collect(frames, &mut self.arm, frame);
                (PreviewState::Looking, None)
            }
            Stage::Searching { .. } => (PreviewState::Looking, None),
            Stage::Following {
                known,
                zero_ns,
                lost_ns,
            } => {
                let seen = follow(known, *zero_ns, &frame, &mut self.arm, self.keypoints);
                if let Some(tracked) = &seen {
                    *lost_ns = tracked.lost.then_some(lost_ns.unwrap_or(stamp_ns));
                }
                let is_lost = lost_ns.is_some_and(|since_ns| stamp_ns - since_ns > LOST_NS);
                if seen.is_some() && !is_lost {
                    return (PreviewState::Following, seen);
                }
                self.restart(if is_lost {
                    "the rope is lost"
                } else {
                    "the rope cannot be simulated further"
                });
                (PreviewState::Looking, None)
            }
        }
    }

    fn reported(
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
            version: PAYLOAD_VERSION,
            state: state as u8,
            seen: self.seen,
            skipped: self.skipped,
            restarts: self.restarts,
            rope: tracked.map_or(nothing, |t| KeypointFrame::new(sequence, stamp_ns, t)),
            ..PreviewFrame::default()
        }
    }
}

/// Keypoints of a frame. Where the arm's reports end before its exposure, the arm comes to
/// rest. `None` where they are no motion, or the simulated rope is not before the camera.
fn follow(
    known: &mut Known,
    zero_ns: u64,
    frame: &ImageFrame,
    arm: &mut Arm,
    keypoints: usize,
) -> Option<TrackedFrame> {
    let motion = arm.motion(zero_ns);
    let motion = motion.inspect_err(|reason| tracing::debug!(%reason, "joint reports"));
    let since_s = |stamp_ns| MonotonicNs(stamp_ns).since_s(MonotonicNs(zero_ns));
    let times_s = [frame.stamp_ns, arm.newest_ns()].map(since_s);
    let seen = known.see(frame, times_s, &motion.ok()?, keypoints);
    let reached_ns = zero_ns + (known.reached_s() * 1e9) as u64;
    arm.forget_before(reached_ns.saturating_sub(PAST_NS));
    seen
}

/// Takes in a frame while the rope is unknown: the newest one of a rest, then those of the
/// motion that follows it.
fn collect(frames: &mut Vec<ImageFrame>, arm: &mut Arm, frame: ImageFrame) {
    let stood = |since_ns, at_ns| {
        let stands = arm.stands_since_ns();
        stands.is_some_and(|stands_ns| stands_ns + since_ns <= at_ns)
    };
    let now_ns = frame.stamp_ns;
    let Some((first_ns, last_ns)) = frames
        .first()
        .zip(frames.last())
        .map(|(first, last)| (first.stamp_ns, last.stamp_ns))
    else {
        if stood(REST_NS, now_ns) {
            frames.push(frame);
        }
        arm.forget_before(now_ns.saturating_sub(BEFORE_NS));
        return;
    };
    if now_ns < last_ns + PERIOD_NS || frames.len() == FRAMES {
        return;
    }
    if stood(0, first_ns) {
        frames.clear();
        arm.forget_before(now_ns.saturating_sub(BEFORE_NS));
    }
    frames.push(frame);
    if frames.len() == FRAMES && arm.reach_rad() < ENOUGH_RAD {
        frames.clear();
    }
}

#[cfg(test)]
#[path = "step_tests.rs"]
mod tests;
