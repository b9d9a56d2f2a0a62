//! Looks for the hypothesis that explains most of the film.
//!
//! What a curve explains: evidence on it less half of what lies beside it, summed along
//! the rope, with a price per pixel, so that a curve is neither cut short nor drawn on.
//! First in blurred evidence from a bank of ropes, then by CMA-ES from the best ones.

use super::curve::{across, tangent};
use super::evidence::EvidenceMap;
use super::hypothesis::{Fidelity, LOWER, MIDDLE, Point, SPREAD, Seen, Setup, Side, TURN, UPPER};
use crate::track::TrackError;
use cmaes::{CmaEs, CmaOptions, StopRules};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

/// Hypotheses drawn at first, and how many of them are improved.
const BANK: usize = 128;
const STARTS: usize = 4;
/// Two starts are apart if one of the rope's numbers differs by so many spreads.
const APART: f64 = 0.7;
/// How widely the bank is drawn about the middle, for the rope and for the camera.
const BANK_SPREADS: [f64; 2] = [1.7, 0.7];
/// Price of the camera's turns and the clock, per squared spread.
const PRIOR: f64 = 0.015;
/// Weight of the least evident tenth of the rope.
const WEAKEST: f64 = 0.3;
/// How widely and how long a climb looks; as many ropes as are simulated side by side.
const CLIMB_SPREADS: f64 = 0.6;
const GENERATIONS: usize = 8;
const POPULATION: usize = 16;
const CLIMB_SEED: u64 = 2;

/// Points compared along the rope.
const POINTS: usize = 24;
/// How far beside it evidence counts against it (px).
const SIDE_PX: f64 = 22.0;
/// What a pixel of the curve costs.
const PRICE: f64 = 0.2;
/// Score of what cannot be looked at.
const NOTHING: f64 = -10.0;

/// Blurred evidence of one moment.
#[derive(Debug)]
pub(super) struct EvidenceFrame {
    /// Start of the frame's exposure (s).
    pub(super) t_s: f64,
    /// Left image's, and the right one's where there is one.
    pub(super) maps: Vec<(Side, EvidenceMap)>,
}

/// A hypothesis and how much it explains: about the part of the picture's height that
/// evident rope takes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) x: Point,
    pub(super) score: f64,
}

/// A film's evidence, and what moves the rope in it.
pub(super) struct Searcher<'a> {
    pub(super) moments: &'a [EvidenceFrame],
    pub(super) setup: Setup<'a>,
}

impl Searcher<'_> {
    /// From a bank of ropes to some good ones.
    pub(super) fn search(&self) -> Result<Vec<Found>, TrackError> {
        let mut starts: Vec<Found> = Vec::new();
        for found in self.bank()? {
            let apart =
                |a: &Found| (0..TURN).any(|i| (a.x[i] - found.x[i]).abs() > APART * SPREAD[i]);
            if starts.iter().all(apart) {
                starts.push(found);
            }
            if starts.len() == STARTS {
                break;
            }
        }
        let seeded = starts.into_iter().zip(CLIMB_SEED..);
        seeded
            .map(|(start, seed)| self.climb(start, seed))
            .collect()
    }

    /// Ropes drawn about the middle, the best first.
    fn bank(&self) -> Result<Vec<Found>, TrackError> {
        let mut rng = ChaCha12Rng::seed_from_u64(1);
        let mut draw = |i: usize| {
            let spreads = BANK_SPREADS[usize::from(i >= TURN)];
            let x = MIDDLE[i] + rng.random_range(-1.0..1.0) * spreads * SPREAD[i];
            x.clamp(LOWER[i], UPPER[i])
        };
        let points: Vec<Point> = (0..BANK).map(|_| core::array::from_fn(&mut draw)).collect();
        let mut bank = self.scored(points)?;
        bank.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(bank)
    }

    /// The best hypothesis near a start.
    fn climb(&self, start: Found, seed: u64) -> Result<Found, TrackError> {
        let mut strategy = CmaEs::new(CmaOptions {
            mean: start.x.to_vec(),
            std_dev: SPREAD.iter().map(|s| s * CLIMB_SPREADS).collect(),
            lower: LOWER.to_vec(),
            upper: UPPER.to_vec(),
            population: POPULATION,
            draws_max: 1,
            seed,
            stop: StopRules {
                generations_max: GENERATIONS,
                ..StopRules::default()
            },
        })
        .map_err(TrackError::motion)?;
        let mut best = start;
        while strategy.stop().is_none() {
            let requested = strategy.ask(&mut |_| true).map_err(TrackError::motion)?;
            let point = |x: &Vec<f64>| core::array::from_fn(|i| x[i]);
            let all = self.scored(requested.iter().map(point).collect())?;
            let costs: Vec<f64> = all.iter().map(|f| -f.score).collect();
            strategy.tell(&costs).map_err(TrackError::motion)?;
            for found in all {
                if found.score > best.score {
                    best = found;
                }
            }
        }
        Ok(best)
    }

    /// How much each of some hypotheses explains; the same for any number of threads.
    pub(super) fn scored(&self, points: Vec<Point>) -> Result<Vec<Found>, TrackError> {
        let setup = Setup {
            film_s: self.moments.last().map_or(0.0, |m| m.t_s),
            ..self.setup
        };
        let seen = setup.simulate(&points, Fidelity::COARSE)?;
        let score = NOTHING;
        let found = points.into_iter().map(|x| Found { x, score });
        let mut found: Vec<(Found, Option<Seen>)> = found.zip(seen).collect();
        side_by_side(&mut found, setup.threads, |(found, seen)| {
            let score = seen.as_ref().and_then(|seen| self.score(&found.x, seen));
            found.score = score.unwrap_or(NOTHING);
        });
        Ok(found.into_iter().map(|(found, _)| found).collect())
    }

    /// `None` where a part is behind the camera.
    fn score(&self, x: &Point, seen: &Seen) -> Option<f64> {
        let mut along = [0.0; POINTS];
        let (mut sum, mut images) = (0.0, 0.0);
        for moment in self.moments {
            for (side, map) in &moment.maps {
                let curve = seen.curve(moment.t_s, *side, POINTS)?;
                for (k, p) in curve.iter().enumerate() {
                    let (t, span_px) = tangent(&curve, k, 1);
                    let step_px = if k == 0 || k == POINTS - 1 { 1.0 } else { 0.5 } * span_px;
                    let aside = |px: f64| map.at(p + across(t) * px);
                    let beside = 0.5 * f64::from(aside(SIDE_PX) + aside(-SIDE_PX));
                    let evident = f64::from(map.at(*p)) - 0.5 * beside;
                    along[k] += evident;
                    sum += (evident - PRICE) * step_px;
                }
                images += 1.0;
            }
        }
        along.sort_by(f64::total_cmp);
        let prior: f64 = (TURN..x.len()).map(|i| (x[i] / SPREAD[i]).powi(2)).sum();
        let half_height_px = f64::from(self.setup.camera.height_px) / 2.0;
        let weakest = WEAKEST * along[POINTS / 10] / images;
        Some(sum / (images * half_height_px) + weakest - PRIOR * prior)
    }
}

/// Does the same work on all of some things, on so many threads.
pub(super) fn side_by_side<T: Send>(
    things: &mut [T],
    threads: usize,
    work: impl Fn(&mut T) + Sync,
) {
    let part = things.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        for part in things.chunks_mut(part) {
            scope.spawn(|| part.iter_mut().for_each(&work));
        }
    });
}
