//! From a film's evidence to the hypothesis that explains it, and what is read along it.

use rope_sim::AttachMotion;
use shared_types::StereoCamera;

use super::super::scene::Scene;
use super::Film;
use super::curve::{self, Pixel};
use super::evidence::Lit;
use super::hypothesis::{Fidelity, MIDDLE, Point, SPREAD, Seen, Setup, Side};
use super::read::{NODES, Reader};
use super::reading::Reading;
use super::refine::{Detection, Fit};
use super::search::{EvidenceFrame, Searcher, side_by_side};
use super::statistics::quantile;
use crate::track::TrackError;

/// Of the frames with two images, every which one is searched, in evidence blurred by so
/// much.
const SEARCHED_EVERY: usize = 3;
const BLUR_PX: usize = 4;
/// Frames that what was found by searching is fitted to, and how often it is.
const ROUGH: (usize, usize) = (50, 2);
/// Frames that the best of it is fitted to, how often at most, and the change of its numbers
/// below which it has settled (spreads).
const LAST: (usize, usize) = (100, 4);
const SETTLED: f64 = 0.02;

/// A film, and what moves the rope in it.
pub(super) struct Explainer<'a> {
    setup: Setup<'a>,
    frames: Vec<Lit<'a>>,
    /// Starts of the frames' exposures.
    times_s: &'a [f64],
    moments: Vec<EvidenceFrame>,
}

/// A hypothesis, and what was read off the film along it.
pub(super) struct Explained {
    pub(super) seen: Seen,
    /// The hypothesis's curves in all frames.
    pub(super) curves: Vec<Vec<Pixel>>,
    pub(super) reading: Reading,
}

impl<'a> Explainer<'a> {
    /// `scenes` are those of the left and the right images.
    pub(super) fn new(
        film: Film<'a>,
        times_s: &'a [f64],
        (left, right): (&'a Scene, Option<&'a Scene>),
        (camera, motion): (&'a StereoCamera, &'a dyn AttachMotion),
        threads: usize,
    ) -> Self {
        let frames: Vec<Lit<'_>> = film.left.iter().map(|f| Lit::of(f, left)).collect();
        let moment = |i: usize| {
            let blurred = |side, lit: &Lit<'_>| (side, lit.map().blurred(BLUR_PX));
            let mut maps = vec![blurred(Side::Left, &frames[i])];
            let right = right.zip(film.right_at(film.left[i].stamp_ns));
            maps.extend(right.map(|(scene, frame)| blurred(Side::Right, &Lit::of(frame, scene))));
            EvidenceFrame {
                t_s: times_s[i],
                maps,
            }
        };
        let searched = (0..times_s.len()).filter(|i| Film::needs_right(*i, times_s.len()));
        Self {
            moments: searched.step_by(SEARCHED_EVERY).map(moment).collect(),
            setup: Setup {
                camera,
                motion,
                film_s: times_s[times_s.len() - 1],
                threads,
            },
            frames,
            times_s,
        }
    }

    /// The hypothesis that explains most, fitted to what is read along it.
    pub(super) fn hypothesis(&self) -> Result<Point, TrackError> {
        let searcher = Searcher {
            moments: &self.moments,
            setup: self.setup,
        };
        let starts = searcher.search()?.into_iter();
        let mut fitted: Vec<_> = starts.map(|start| Ok(start.x)).collect();
        let (frames, rounds) = ROUGH;
        let alone = Setup {
            threads: 1,
            ..self.setup
        };
        side_by_side(&mut fitted, self.setup.threads, |x| {
            for _ in 0..rounds {
                let fit = |x| self.refined(x, frames, Fidelity::COARSE, alone);
                *x = x.clone().and_then(fit);
            }
        });
        let fitted = fitted.into_iter().collect::<Result<Vec<_>, _>>()?;
        let scored = searcher.scored(fitted)?.into_iter();
        let best = scored.max_by(|a, b| a.score.total_cmp(&b.score));
        let mut x = best.map_or(MIDDLE, |found| found.x);
        let (frames, rounds) = LAST;
        for _ in 0..rounds {
            let before = x;
            x = self.refined(x, frames, Fidelity::FINAL, self.setup)?;
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
        setup: Setup<'_>,
    ) -> Result<Point, TrackError> {
        let every = (self.frames.len() / frames).max(1);
        let Ok(Explained { reading, .. }) = self.read(&x, fidelity, every) else {
            return Ok(x);
        };
        let times_s = self.times_s.iter().step_by(every).enumerate();
        let detections: Vec<Detection> = times_s
            .map(|(frame, t_s)| Detection::of(&reading, frame, *t_s))
            .collect();
        let fit = Fit {
            detections: &detections,
            setup,
            fidelity,
        };
        fit.refined(x)
    }

    /// Reads each `every`-th frame off along a hypothesis.
    pub(super) fn read(
        &self,
        x: &Point,
        fidelity: Fidelity,
        every: usize,
    ) -> Result<Explained, TrackError> {
        let seen = self.setup.simulate_one(x, fidelity)?;
        let times_s = self.times_s.iter().step_by(every);
        let curves: Option<Vec<_>> = times_s
            .map(|t_s| seen.curve(*t_s, Side::Left, NODES))
            .collect();
        let curves = curves.ok_or_else(TrackError::behind_camera)?;
        let frames = self.frames.iter().step_by(every).collect();
        let reader = Reader::new(frames, every, curves.clone());
        Ok(Explained {
            reading: reader.read(self.clamp_px(&curves, every)),
            seen,
            curves,
        })
    }

    /// Where the arm and the camera's file put the clamp, along the hypothesis from its
    /// beginning on (px, middle of the frames).
    fn clamp_px(&self, curves: &[Vec<Pixel>], every: usize) -> f64 {
        let Setup { camera, motion, .. } = self.setup;
        let along = |(curve, t_s): (&Vec<Pixel>, &f64)| {
            let predicted = camera.project_left(&motion.at(*t_s).p_m)?;
            let (t, _) = curve::tangent(curve, 0, 2);
            Some((Pixel::from(predicted) - curve[0]).dot(&t))
        };
        let times_s = self.times_s.iter().step_by(every);
        quantile(curves.iter().zip(times_s).filter_map(along), 0.5)
    }
}
