//! One identification by fitting: where it starts, how it is refined, and what comes of it.

use super::beyond::beyond;
use super::budget::Budget;
use super::clock::ClockWindow;
use super::coordinates::{CLOCK, Coordinates, Point, Reach, sway_of};
use super::error::IdentifyError;
use super::film::Film;
use super::linear;
use super::options::IdentifyOptions;
use super::out_of_distribution::out_of_distribution;
use super::posterior::{posterior, std_dev};
use super::propose::{fast_search, from_proposal};
use super::refine::{Refined, refine};
use super::reliance::warnings;
use super::search::search;
use super::steps::short_enough;
use crate::observation::Observation;
use shared_types::ipc::message::Progress;
use shared_types::rope::{FitCircumstances, OutOfDistribution};
use shared_types::{RopeEstimate, RopeParams};
use std::ops::ControlFlow;

/// About how many steps a refinement takes, and a fast search with it.
const REFINE_STEPS: usize = 20;
const HYBRID_STEPS: usize = 38;
/// Method of an estimate whose rope looked like none of the ranges and was searched for
/// again beyond them.
pub const WIDE: &str = "hybrid-wide";
/// Name of a fast search, refined, and of a network's proposal, refined.
const SEARCHED: &str = "hybrid-search";
const PROPOSED: &str = "hybrid-network";

/// Where the refinement starts.
pub(super) enum Start {
    /// At a rope that something else proposes.
    Proposal(RopeParams),
    /// At that of a fast search.
    FastSearch,
    /// At that of the paper's Φ-CMA-ES.
    Cmaes,
}

/// Fits a rope to a film. A fast search is made all the same where the fit from a
/// proposal looks like that of a rope outside the ranges.
pub(super) fn fit(
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    start: &Start,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RopeEstimate, IdentifyError> {
    let film = Film::new(observation, options);
    let mut fit = Fit {
        clock: film.clock_window(),
        film,
        budget: Budget {
            simulations: 0,
            steps: 0,
            steps_max: match start {
                Start::Proposal(_) | Start::FastSearch => HYBRID_STEPS,
                Start::Cmaes => options.generations + REFINE_STEPS,
            },
            progress,
        },
    };
    let (near, label) = match start {
        Start::Proposal(rope) => fit.proposed(rope)?,
        Start::FastSearch => (fit.searched()?, SEARCHED),
        Start::Cmaes => (fit.cmaes(Reach::Ranges)?, "cmaes"),
    };
    let found = out_of_distribution(&near);
    if !found.is_flagged() || matches!(start, Start::Cmaes) {
        return Ok(fit.estimate(&near, found, label));
    }
    tracing::info!(
        score = found.score,
        "the rope is outside the ranges: wide search"
    );
    let better = nearer(fit.cmaes(Reach::Wide)?, near);
    Ok(fit.estimate(&better, out_of_distribution(&better), WIDE))
}

/// The fit that is nearer to the film, the second if neither is.
fn nearer(a: Refined, b: Refined) -> Refined {
    if a.at.distance_px < b.at.distance_px {
        a
    } else {
        b
    }
}

/// One fit on its way.
pub(super) struct Fit<'a> {
    pub(super) film: Film<'a>,
    pub(super) clock: ClockWindow,
    pub(super) budget: Budget<'a>,
}

impl Fit<'_> {
    /// A fast search, refined.
    fn searched(&mut self) -> Result<Refined, IdentifyError> {
        let coordinates = self.film.coordinates(self.clock, Reach::Ranges);
        let found = fast_search(&self.film, &coordinates, &mut self.budget)?;
        self.refine(&coordinates, &found.x, found.at.distance_px)
    }

    /// A proposed rope, refined; a fast search if it ends where no rope of the ranges is.
    fn proposed(&mut self, rope: &RopeParams) -> Result<(Refined, &'static str), IdentifyError> {
        let coordinates = self.film.coordinates(self.clock, Reach::Ranges);
        let found = from_proposal(&self.film, &coordinates, rope, &mut self.budget)?;
        let near = self.refine(&coordinates, &found.x, found.at.distance_px)?;
        if !out_of_distribution(&near).is_flagged() {
            return Ok((near, PROPOSED));
        }
        let searched = self.searched()?;
        Ok(if searched.at.distance_px < near.at.distance_px {
            (searched, SEARCHED)
        } else {
            (near, PROPOSED)
        })
    }

    /// A start refined whose root mean square distance to the film is `distance_px`.
    pub(super) fn refine(
        &mut self,
        coordinates: &Coordinates,
        start: &Point,
        distance_px: f64,
    ) -> Result<Refined, IdentifyError> {
        let budget = &mut self.budget;
        let plain = short_enough(&mut self.film, |film, from| {
            let from = from.map(|fit| (&fit.x, fit.at.distance_px));
            let (start, distance_px) = from.unwrap_or((start, distance_px));
            let noise_px = distance_px / 2.0_f64.sqrt();
            refine(film, coordinates, start, noise_px, budget)
        })?;
        beyond(&self.film, coordinates, plain, &mut self.budget)
    }

    /// The global search, refined.
    fn cmaes(&mut self, reach: Reach) -> Result<Refined, IdentifyError> {
        let coordinates = self.film.coordinates(self.clock, reach);
        // A rope that no candidate resembles would have every repeat for nothing.
        let repeats_max = match reach {
            Reach::Ranges => self.film.options.repeats_max,
            Reach::Wide => 0,
        };
        let found = search(&self.film, &coordinates, repeats_max, &mut self.budget)?;
        self.refine(&coordinates, &found.x, found.distance_px)
    }

    fn estimate(
        &self,
        fit: &Refined,
        out_of_distribution: OutOfDistribution,
        label: &str,
    ) -> RopeEstimate {
        let (params, posterior) = posterior(fit, &self.film);
        let (camera_position_m, camera_rotation_rad) =
            self.film.viewer.moved(&linear::corrections(&fit.x));
        let [noise_along, noise_across] = fit.noise.axes;
        RopeEstimate {
            params,
            std_dev: std_dev(&posterior),
            residual_px: fit.at.distance_px,
            method: label.try_into().unwrap_or_default(),
            simulations: u32::try_from(self.budget.simulations).unwrap_or(u32::MAX),
            seed: self.film.options.seed,
            time_offset_s: fit.x[CLOCK],
            posterior,
            circumstances: FitCircumstances {
                noise_along,
                noise_across,
                camera_position_m,
                camera_rotation_rad,
                sway: sway_of(&fit.x),
            },
            out_of_distribution,
            warnings: warnings(fit, &self.film, self.clock),
        }
    }
}
