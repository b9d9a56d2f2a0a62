//! Looks for the hypothesis that explains most of the film.
//!
//! What a curve explains: evidence on it less half of what lies beside it, summed along
//! the rope, with a price per pixel, so that a curve is neither cut short nor drawn on.
//! First in blurred evidence from a bank of ropes, then by CMA-ES from the best ones.

use super::curve::tangent;
use super::evidence::EvidenceMap;
use super::hypothesis::{
    Curve, Fidelity, LOWER, MIDDLE, Point, SPREAD, Seen, Side, TURN, UPPER, simulate,
};
use cmaes::{CmaError, CmaEs, CmaOptions, StopRules};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rope_sim::{AttachMotion, SimulateError};
use shared_types::StereoCamera;

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

/// Evidence of one moment.
#[derive(Debug)]
pub(super) struct Moment {
    /// Start of the frame's exposure (s).
    pub(super) t_s: f64,
    /// Left image's, and the right one's where there is one.
    pub(super) maps: Vec<(Side, EvidenceMap)>,
}

impl Moment {
    /// With evidence spread over so many pixels to every side.
    pub(super) fn blurred(&self, reach_px: usize) -> Self {
        let blurred = |(side, map): &(Side, EvidenceMap)| (*side, map.blurred(reach_px));
        Self {
            t_s: self.t_s,
            maps: self.maps.iter().map(blurred).collect(),
        }
    }
}

/// How a curve is compared with evidence.
#[derive(Debug, Clone, Copy)]
pub(super) struct Comparison {
    /// Points along the rope.
    pub(super) points: usize,
    /// How far beside it evidence counts against it (px).
    pub(super) side_px: f64,
    /// What a pixel of the curve costs.
    pub(super) price: f64,
    pub(super) fidelity: Fidelity,
}

/// A hypothesis and how much it explains: about the part of the picture's height that
/// evident rope takes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) x: Point,
    pub(super) score: f64,
}

/// Why a search cannot be made.
#[derive(Debug, thiserror::Error)]
pub(in super::super) enum SearchError {
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    #[error(transparent)]
    Cma(#[from] CmaError),
}

/// A film's evidence and how it is searched.
pub(super) struct Searcher<'a> {
    pub(super) moments: &'a [Moment],
    pub(super) camera: &'a StereoCamera,
    pub(super) motion: &'a dyn AttachMotion,
    pub(super) comparison: Comparison,
    pub(super) threads: usize,
}

impl Searcher<'_> {
    /// From a bank of ropes to some good ones.
    pub(super) fn search(&self) -> Result<Vec<Found>, SearchError> {
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
    fn bank(&self) -> Result<Vec<Found>, SearchError> {
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
    fn climb(&self, start: Found, seed: u64) -> Result<Found, SearchError> {
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
        })?;
        let mut best = start;
        while strategy.stop().is_none() {
            let asked = strategy.ask(&mut |_| true)?;
            let point = |x: &Vec<f64>| core::array::from_fn(|i| x[i]);
            let all = self.scored(asked.iter().map(point).collect())?;
            strategy.tell(&all.iter().map(|f| -f.score).collect::<Vec<_>>())?;
            for found in all {
                if found.score > best.score {
                    best = found;
                }
            }
        }
        Ok(best)
    }

    /// How much each of some hypotheses explains; the same for any number of threads.
    pub(super) fn scored(&self, points: Vec<Point>) -> Result<Vec<Found>, SearchError> {
        let film_s = self.moments.last().map_or(0.0, |m| m.t_s);
        let fidelity = self.comparison.fidelity;
        let rollouts = simulate(&points, fidelity, self.motion, film_s, self.threads)?;
        let mut out: Vec<Found> = points
            .into_iter()
            .map(|x| Found { x, score: NOTHING })
            .collect();
        let part = out.len().div_ceil(self.threads).max(1);
        std::thread::scope(|scope| {
            for (found, rollouts) in out.chunks_mut(part).zip(rollouts.chunks(part)) {
                scope.spawn(move || {
                    let mut curve = Curve::default();
                    for (found, rollout) in found.iter_mut().zip(rollouts) {
                        if let Some(seen) = Seen::new(&found.x, rollout, self.camera) {
                            found.score = self.score(&found.x, &seen, &mut curve);
                        }
                    }
                });
            }
        });
        Ok(out)
    }

    fn score(&self, x: &Point, seen: &Seen<'_>, curve: &mut Curve) -> f64 {
        let Comparison {
            points,
            side_px,
            price,
            ..
        } = self.comparison;
        let mut along = vec![0.0; points];
        let (mut sum, mut images) = (0.0, 0.0);
        for moment in self.moments {
            for (side, map) in &moment.maps {
                if !seen.curve(moment.t_s, *side, points, curve) {
                    return NOTHING;
                }
                let curve = &curve.points;
                for (k, p) in curve.iter().enumerate() {
                    let (t, span_px) = tangent(curve, k, 1);
                    let step_px = if k == 0 || k == points - 1 { 1.0 } else { 0.5 } * span_px;
                    let aside = |d: f64| map.at([p[0] - t[1] * d, p[1] + t[0] * d]);
                    let beside = 0.5 * f64::from(aside(side_px) + aside(-side_px));
                    let evident = f64::from(map.at(*p)) - 0.5 * beside;
                    along[k] += evident;
                    sum += (evident - price) * step_px;
                }
                images += 1.0;
            }
        }
        along.sort_by(f64::total_cmp);
        let prior: f64 = (TURN..x.len()).map(|i| (x[i] / SPREAD[i]).powi(2)).sum();
        let half_height_px = f64::from(self.camera.height_px) / 2.0;
        sum / (images * half_height_px) + WEAKEST * along[points / 10] / images - PRIOR * prior
    }
}

/// Score of what cannot be looked at.
const NOTHING: f64 = -10.0;
