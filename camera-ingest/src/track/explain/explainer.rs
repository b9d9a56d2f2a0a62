//! From a film's evidence to the hypothesis that explains it, and what is read along it.

use rope_sim::AttachMotion;
use shared_types::StereoCamera;

use super::evidence::Scene;
use super::hypothesis::{Curve, Fidelity, Point, SPREAD, Seen, Side, simulate};
use super::read::{Lit, NODES, Reader};
use super::reading::Reading;
use super::refine::{Fit, Sighting};
use super::search::{Comparison, Found, Moment, SearchError, Searcher};
use super::{TrackError, curve, quantile};

/// Every which moment is searched, in blurred evidence.
const BLURRED_EVERY: usize = 3;
const BLUR_PX: usize = 4;
const COARSE: Comparison = Comparison {
    points: 24,
    side_px: 22.0,
    price: 0.2,
    fidelity: Fidelity::COARSE,
};
/// Frames that what was found by searching is fitted to, and how often it is.
const ROUGH: (usize, usize) = (50, 2);
/// Frames that the best of it is fitted to, how often at most, and the change of its numbers
/// below which it has settled (spreads).
const LAST: (usize, usize) = (100, 4);
const SETTLED: f64 = 0.02;

/// The film of one eye, and what moves the rope in it.
pub(super) struct Explainer<'a> {
    pub(super) scene: &'a Scene,
    pub(super) frames: &'a [Lit<'a>],
    /// Starts of the frames' exposures.
    pub(super) times_s: &'a [f64],
    pub(super) camera: &'a StereoCamera,
    pub(super) motion: &'a dyn AttachMotion,
    pub(super) threads: usize,
}

impl Explainer<'_> {
    /// The hypothesis that explains most, fitted to what is read along it.
    pub(super) fn hypothesis(&self, moments: &[Moment]) -> Result<Point, TrackError> {
        let blurred: Vec<Moment> = moments
            .iter()
            .step_by(BLURRED_EVERY)
            .map(|m| m.blurred(BLUR_PX))
            .collect();
        let searcher = Searcher {
            moments: &blurred,
            camera: self.camera,
            motion: self.motion,
            comparison: COARSE,
            threads: self.threads,
        };
        let mut starts = searcher.search()?;
        let part = starts.len().div_ceil(self.threads).max(1);
        let (frames, rounds) = ROUGH;
        std::thread::scope(|scope| {
            let fit = |starts: &mut [Found]| -> Result<(), TrackError> {
                for start in starts {
                    for _ in 0..rounds {
                        start.x = self.refined(start.x, frames, Fidelity::COARSE, 1)?;
                    }
                }
                Ok(())
            };
            let parts = starts.chunks_mut(part);
            let all: Vec<_> = parts.map(|s| scope.spawn(move || fit(s))).collect();
            all.into_iter()
                .try_for_each(|s| s.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
        })?;
        let fitted = searcher.scored(starts.iter().map(|s| s.x).collect())?;
        let best = fitted
            .into_iter()
            .max_by(|a, b| a.score.total_cmp(&b.score));
        let mut x = best.map_or(starts[0].x, |found| found.x);
        let (frames, rounds) = LAST;
        for _ in 0..rounds {
            let before = x;
            x = self.refined(x, frames, Fidelity::FINAL, self.threads)?;
            let moved = (0..x.len()).map(|i| ((x[i] - before[i]) / SPREAD[i]).abs());
            if moved.fold(0.0, f64::max) < SETTLED {
                break;
            }
        }
        Ok(x)
    }

    /// A hypothesis fitted to what is read along it in about so many frames.
    fn refined(
        &self,
        x: Point,
        frames: usize,
        fidelity: Fidelity,
        threads: usize,
    ) -> Result<Point, TrackError> {
        let every = (self.frames.len() / frames).max(1);
        let Ok(told) = self.told(&x, fidelity, every) else {
            return Ok(x);
        };
        let reading = self.read(told, every);
        let times_s = self.times_s.iter().step_by(every);
        let sightings: Vec<Sighting> = times_s
            .enumerate()
            .map(|(frame, t_s)| Sighting::of(&reading, frame, *t_s))
            .collect();
        let fit = Fit {
            sightings: &sightings,
            camera: self.camera,
            motion: self.motion,
            fidelity,
            film_s: self.film_s(),
            threads,
        };
        Ok(fit.refined(x)?)
    }

    pub(super) fn film_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Curves of a hypothesis in each `every`-th frame.
    pub(super) fn told(
        &self,
        x: &Point,
        fidelity: Fidelity,
        every: usize,
    ) -> Result<Vec<Vec<[f64; 2]>>, TrackError> {
        let rollouts =
            simulate(&[*x], fidelity, self.motion, self.film_s(), 1).map_err(SearchError::from)?;
        let seen = Seen::new(x, &rollouts[0], self.camera).ok_or(TrackError::BehindCamera)?;
        let times_s = self.times_s.iter().step_by(every);
        times_s
            .map(|t_s| curve_at(&seen, *t_s, Side::Left))
            .collect::<Option<_>>()
            .ok_or(TrackError::BehindCamera)
    }

    /// Reads each `every`-th frame off along curves.
    pub(super) fn read(&self, curves: Vec<Vec<[f64; 2]>>, every: usize) -> Reading {
        let told_px = self.clamp_px(&curves, every);
        let frames = self.frames.iter().step_by(every).collect();
        Reader::new(self.scene, frames, every, curves).read(told_px)
    }

    /// Where the arm and the camera's file put the clamp, along the hypothesis from its
    /// beginning on (px, median of the frames).
    fn clamp_px(&self, curves: &[Vec<[f64; 2]>], every: usize) -> f64 {
        let along = |(curve, t_s): (&Vec<[f64; 2]>, &f64)| {
            let told = self.camera.project_left(&self.motion.at(*t_s).p_m)?;
            let (t, _) = curve::tangent(curve, 0, 2);
            Some((told[0] - curve[0][0]) * t[0] + (told[1] - curve[0][1]) * t[1])
        };
        let times_s = self.times_s.iter().step_by(every);
        quantile(curves.iter().zip(times_s).filter_map(along).collect(), 0.5)
    }
}

/// The hypothesis in one frame.
pub(super) fn curve_at(seen: &Seen<'_>, t_s: f64, side: Side) -> Option<Vec<[f64; 2]>> {
    let mut curve = Curve::default();
    seen.curve(t_s, side, NODES, &mut curve)
        .then_some(curve.points)
}
