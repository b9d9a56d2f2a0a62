//! The hypothesis while frames come: found in some of them, then simulated on under the
//! joints as they are reported, and seen in each new one.

use rope_sim::{AttachMotion, LiveRope};
use shared_types::keypoints::TrackedFrame;
use shared_types::{MonotonicNs, StereoCamera};

use super::super::scene::Scene;
use super::super::{TrackError, USUAL_KEYPOINTS};
use super::Film;
use super::curve::{Pixel, at_fraction, length, normals};
use super::explainer::{Explained, Explainer};
use super::hypothesis::{CLOCK, Fidelity, rope, seen_curve, turned};
use super::read::NODES;
use super::result::usual_evidence;
use super::statistics::{mean, quantile};
use crate::frame::ImageFrame;

/// Evidence is looked for so far to either side of a keypoint (px).
const BESIDE_PX: [f64; 5] = [0.0, -2.0, 2.0, -4.0, 4.0];
/// A frame with less than this part of the usual evidence is lost.
const LOST: f64 = 0.4;
/// The newest reports change what is made of those just before them: the simulation stays
/// so far behind (s), and what is shown goes on from there.
const SETTLED_S: f64 = 0.04;
/// The simulation's steps begin at multiples of this (s), so that they are equally long.
const GRID_S: f64 = 1e-3;

/// A rope that explains the frames it was found in.
#[derive(Debug)]
pub(crate) struct Known {
    /// Hung still at the first of them; masses of which only the ratios are known.
    rope: LiveRope,
    /// Turned as the hypothesis has it.
    camera: StereoCamera,
    clock_s: f64,
    scene: Scene,
    /// Where the rope begins and where the tip weight's centre is, as parts of the curve.
    ends: [f64; 2],
    /// Evidence at the keypoints of most frames.
    usual: f64,
}

impl Known {
    /// Looks for the rope in frames that begin with it hanging still, on one thread; `motion`
    /// is the attach frame's, t = 0 at the first frame. Takes seconds. An error comes with what
    /// it means.
    pub(crate) fn find(
        frames: &[ImageFrame],
        camera: &StereoCamera,
        motion: &dyn AttachMotion,
    ) -> Result<Self, (&'static str, TrackError)> {
        let unexplained = |reason| ("no simulated rope explains the frames", reason);
        let unusable = "the rope that was found cannot be simulated";
        let zero = MonotonicNs(frames[0].stamp_ns);
        let since_zero = |f: &ImageFrame| MonotonicNs(f.stamp_ns).since_s(zero);
        let times_s: Vec<f64> = frames.iter().map(since_zero).collect();
        let film = Film {
            left: frames,
            right: &[],
        };
        let scene = Scene::of(frames);
        let explainer = Explainer::new(film, &times_s, (&scene, None), (camera, motion), 1);
        let x = explainer.hypothesis().map_err(unexplained)?;
        let Explained {
            curves, reading, ..
        } = explainer
            .read(&x, Fidelity::FINAL, 1)
            .map_err(unexplained)?;
        drop(explainer);
        usual_evidence(&reading, USUAL_KEYPOINTS).map_err(unexplained)?;
        let length = mean(&curves.iter().map(|c| length(c)).collect::<Vec<_>>());
        let Fidelity { links, step_s, .. } = Fidelity::FINAL;
        let rope = LiveRope::new(&rope(&x, links), &motion.at(0.0), step_s);
        let mut known = Self {
            rope: rope.map_err(|reason| (unusable, TrackError::motion(reason)))?,
            camera: turned(&x, camera),
            clock_s: x[CLOCK],
            ends: [
                reading.start_px / length,
                1.0 + reading.end.centre_px / length,
            ],
            usual: 0.0,
            scene,
        };
        let evident = |(frame, curve): (&ImageFrame, &Vec<Pixel>)| {
            mean(&known.evident(frame, &known.keypoints(curve, USUAL_KEYPOINTS)))
        };
        known.usual = quantile(frames.iter().zip(&curves).map(evident), 0.5);
        Ok(known)
    }

    /// Until when the rope is simulated (s, from the first of the frames it was found in on).
    pub(crate) fn reached_s(&self) -> f64 {
        self.rope.time_s()
    }

    /// Keypoints of a frame that begins at `t_s`, under a motion that was reported until
    /// `reported_s`; the first frame catches up with it. `None` where a part is behind the
    /// camera.
    pub(crate) fn see(
        &mut self,
        frame: &ImageFrame,
        [t_s, reported_s]: [f64; 2],
        motion: &dyn AttachMotion,
        keypoints: usize,
    ) -> Option<TrackedFrame> {
        let rows = f64::from(self.camera.height_px);
        // The first and the last row in the middle of their exposure, on the arm's clock.
        let [first_s, last_s] =
            [0.0, rows].map(|row| t_s + self.camera.row_time_s(row) - self.clock_s);
        let motion = |t_s: f64| motion.at(t_s);
        let settled_s = (reported_s - SETTLED_S).min(first_s);
        self.rope
            .advance(&motion, (settled_s / GRID_S).floor() * GRID_S);
        let mut shown = self.rope.clone();
        shown.advance(&motion, first_s);
        let first = shown.nodes().to_vec();
        shown.advance(&motion, last_s);
        if !shown.is_finite() {
            return None;
        }
        let node = |node: usize, row: f64| {
            let place_m = first[node].lerp(&shown.nodes()[node], row / rows);
            self.camera.project_left(&place_m)
        };
        let curve = seen_curve(&self.camera, first.len(), NODES, node)?;
        let points = self.keypoints(&curve, keypoints);
        let evident = self.evident(frame, &points);
        Some(TrackedFrame {
            t_s: 0.0,
            lost: mean(&evident) < LOST * self.usual,
            confidence: evident.iter().map(|e| (e / self.usual).min(1.0)).collect(),
            points: points.into_iter().map(Into::into).collect(),
        })
    }

    /// Places at equal distances from the clamp to the tip weight's centre.
    fn keypoints(&self, curve: &[Pixel], count: usize) -> Vec<Pixel> {
        let [first, last] = self.ends;
        let part = |k: usize| first + (last - first) * k as f64 / (count - 1) as f64;
        (0..count).map(|k| at_fraction(curve, part(k))).collect()
    }

    /// How evident it is (0 to 1) that something other than the scene is at each place.
    fn evident(&self, frame: &ImageFrame, points: &[Pixel]) -> Vec<f64> {
        let gain = self.scene.gain(frame);
        let at = |p: Pixel| {
            let (seen, behind) = self.scene.colours(frame, gain, p)?;
            Some(f64::from(self.scene.unexplained(seen, behind)))
        };
        let around = |(p, n): (&Pixel, Pixel)| {
            let beside = BESIDE_PX.map(|d| at(p + n * d));
            beside.into_iter().flatten().fold(0.0, f64::max)
        };
        points.iter().zip(normals(points)).map(around).collect()
    }
}
