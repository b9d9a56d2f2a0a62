//! The hypothesis while frames come: found in some of them, then seen in each new one.

use nalgebra::Vector3;
use rope_sim::AttachMotion;
use shared_types::keypoints::TrackedFrame;
use shared_types::{MonotonicNs, RopeParams, StereoCamera};

use super::colour::colour_at;
use super::curve::{at_part, length_px, normals};
use super::evidence::Scene;
use super::explainer::Explainer;
use super::hypothesis::{CLOCK, Curve, Fidelity, rope, turned};
use super::read::{Lit, NODES};
use super::{Film, TrackError, TrackOptions};
use super::{mean, moments, quantile, usual_evidence};
use crate::frame::EyeFrame;

/// Evidence is looked for so far to either side of a keypoint (px).
const BESIDE_PX: [f64; 5] = [0.0, -2.0, 2.0, -4.0, 4.0];
/// A frame with less than this part of the usual evidence is lost.
const LOST: f64 = 0.4;

/// A rope that explains the frames it was found in.
#[derive(Debug)]
pub(crate) struct Known {
    rope: RopeParams,
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
    /// is the attach frame's, t = 0 at the first frame. Takes seconds.
    pub(crate) fn find(
        frames: &[EyeFrame],
        camera: &StereoCamera,
        motion: &dyn AttachMotion,
    ) -> Result<Self, TrackError> {
        let options = TrackOptions::default();
        let zero = MonotonicNs(frames[0].stamp_ns);
        let since_zero = |f: &EyeFrame| MonotonicNs(f.stamp_ns).since_s(zero);
        let times_s: Vec<f64> = frames.iter().map(since_zero).collect();
        let film = Film {
            left: frames,
            right: &[],
        };
        let scene = Scene::of(frames, options.background_frames);
        let lit: Vec<Lit<'_>> = frames.iter().map(|f| Lit::of(f, &scene)).collect();
        let moments = moments(film, &lit, (&scene, None), &times_s);
        let explainer = Explainer {
            scene: &scene,
            frames: &lit,
            times_s: &times_s,
            camera,
            motion,
            threads: 1,
        };
        let x = explainer.hypothesis(&moments)?;
        drop(moments);
        let curves = explainer.told(&x, Fidelity::FINAL, 1)?;
        let reading = explainer.read(curves.clone(), 1);
        drop(lit);
        usual_evidence(&reading, options.keypoints)?;
        let length = mean(&curves.iter().map(|c| length_px(c)).collect::<Vec<_>>());
        let mut known = Self {
            rope: rope(&x, Fidelity::FINAL.links),
            camera: turned(&x, camera),
            clock_s: x[CLOCK],
            ends: [
                reading.start_px / length,
                1.0 + reading.end.centre_px / length,
            ],
            usual: 0.0,
            scene,
        };
        let evident = |(frame, curve): (&EyeFrame, &Vec<[f64; 2]>)| {
            mean(&known.evident(frame, &known.keypoints(curve, options.keypoints)))
        };
        known.usual = quantile(frames.iter().zip(&curves).map(evident).collect(), 0.5);
        Ok(known)
    }

    /// The rope, with masses of which only the ratios are known.
    pub(crate) fn rope(&self) -> &RopeParams {
        &self.rope
    }

    /// Longest step of its simulation (s).
    pub(crate) fn step_s() -> f64 {
        Fidelity::FINAL.step_s
    }

    /// When the first and the last row of a frame that begins at `t_s` are in the middle of
    /// their exposure, on the arm's clock (s).
    pub(crate) fn exposed_s(&self, t_s: f64) -> [f64; 2] {
        [0.0, f64::from(self.camera.height_px)]
            .map(|row| t_s + self.camera.row_time_s(row) - self.clock_s)
    }

    /// Keypoints of a frame, from the nodes (m, world) at the exposures of its first and last
    /// row; `None` where a part is behind the camera.
    pub(crate) fn see(
        &self,
        frame: &EyeFrame,
        [first, last]: [&[Vector3<f64>]; 2],
        keypoints: usize,
    ) -> Option<TrackedFrame> {
        let rows = f64::from(self.camera.height_px);
        let node = |node: usize, row: f64| {
            let place_m = first[node].lerp(&last[node], row / rows);
            self.camera.project_left(&place_m)
        };
        let mut curve = Curve::default();
        if !curve.fill(&self.camera, first.len(), NODES, node) {
            return None;
        }
        let points = self.keypoints(&curve.points, keypoints);
        let evident = self.evident(frame, &points);
        Some(TrackedFrame {
            t_s: 0.0,
            lost: mean(&evident) < LOST * self.usual,
            confidence: evident.iter().map(|e| (e / self.usual).min(1.0)).collect(),
            points,
        })
    }

    /// Places at equal distances from the clamp to the tip weight's centre.
    fn keypoints(&self, curve: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
        let [first, last] = self.ends;
        let part = |k: usize| first + (last - first) * k as f64 / (count - 1) as f64;
        (0..count).map(|k| at_part(curve, part(k))).collect()
    }

    /// How evident it is (0 to 1) that something other than the scene is at each place.
    fn evident(&self, frame: &EyeFrame, points: &[[f64; 2]]) -> Vec<f64> {
        let gain = self.scene.gain(frame);
        let at = |p: [f64; 2]| {
            let (seen, behind) = (colour_at(frame, gain, p)?, self.scene.colour_at(p)?);
            Some(f64::from(self.scene.unexplained(seen, behind)))
        };
        let around = |(p, n): (&[f64; 2], [f64; 2])| {
            let beside = BESIDE_PX.map(|d| at([p[0] + n[0] * d, p[1] + n[1] * d]));
            beside.into_iter().flatten().fold(0.0, f64::max)
        };
        points.iter().zip(normals(points)).map(around).collect()
    }
}
