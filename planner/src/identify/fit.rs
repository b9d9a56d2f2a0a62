//! One identification by fitting: where it starts, how it is refined, and what comes of it.

use super::budget::{Budget, FitProgress};
use super::camera_pose::CorrectionPrior;
use super::clock::{ClockWindow, clock_window};
use super::coordinates::{CLOCK, Coordinates, Reach};
use super::descent::Iterate;
use super::error::IdentifyError;
use super::film::Film;
use super::linear;
use super::options::IdentifyOptions;
use super::out_of_distribution::out_of_distribution;
use super::posterior::posterior;
use super::propose::{fast_search, from_proposal};
use super::refine::{Refined, refine};
use super::search::search;
use crate::observation::Observation;
use shared_types::rope::{FitCircumstances, KeypointNoise, OutOfDistribution};
use shared_types::{RopeEstimate, RopeParams};
use std::ops::ControlFlow;

/// About how many steps a refinement takes, and a fast search with it.
const REFINE_STEPS: usize = 12;
const HYBRID_STEPS: usize = 30;
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
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<RopeEstimate, IdentifyError> {
    let film = Film::new(observation, options);
    let fit = Fit {
        clock: clock_window(
            &film.clamp(),
            observation.camera,
            observation.motion,
            options.clock_offset_max_s,
        ),
        film: &film,
        options,
        camera: CorrectionPrior::new(options),
    };
    let mut budget = Budget {
        simulations: 0,
        steps: 0,
        steps_max: match start {
            Start::Proposal(_) | Start::FastSearch => HYBRID_STEPS,
            Start::Cmaes => options.generations + REFINE_STEPS,
        },
        progress,
    };
    let (near, label) = match start {
        Start::Proposal(rope) => fit.proposed(rope, &mut budget)?,
        Start::FastSearch => (fit.searched(&mut budget)?, SEARCHED),
        Start::Cmaes => (fit.cmaes(Reach::Ranges, &mut budget)?, "cmaes"),
    };
    let found = out_of_distribution(&near);
    if !found.is_outside() || matches!(start, Start::Cmaes) {
        return Ok(fit.estimate(&near, found, label, budget.simulations));
    }
    tracing::info!(
        score = found.score,
        "the rope is outside the ranges: wide search"
    );
    let wide = fit.cmaes(Reach::Wide, &mut budget)?;
    let better = if wide.residual_px < near.residual_px {
        wide
    } else {
        near
    };
    let found = out_of_distribution(&better);
    Ok(fit.estimate(&better, found, WIDE, budget.simulations))
}

struct Fit<'a> {
    film: &'a Film<'a>,
    options: &'a IdentifyOptions,
    clock: ClockWindow,
    camera: CorrectionPrior,
}

impl Fit<'_> {
    fn coordinates(&self, reach: Reach) -> Coordinates {
        let appearance = self.film.observation.appearance;
        let pixel_m = self.film.viewer.pixel_m();
        Coordinates::new(appearance, pixel_m, self.clock, &self.camera, reach)
    }

    /// A fast search, refined.
    fn searched(&self, budget: &mut Budget<'_>) -> Result<Refined, IdentifyError> {
        let coordinates = self.coordinates(Reach::Ranges);
        let iterates = fast_search(self.film, &coordinates, self.options.seed, budget)?;
        self.refine(&coordinates, &iterates, budget)
    }

    /// A proposed rope, refined; a fast search if it ends where no rope of the ranges is.
    fn proposed(
        &self,
        rope: &RopeParams,
        budget: &mut Budget<'_>,
    ) -> Result<(Refined, &'static str), IdentifyError> {
        let coordinates = self.coordinates(Reach::Ranges);
        let iterates = from_proposal(self.film, &coordinates, rope, budget)?;
        let near = self.refine(&coordinates, &iterates, budget)?;
        if !out_of_distribution(&near).is_outside() {
            return Ok((near, PROPOSED));
        }
        let searched = self.searched(budget)?;
        if searched.residual_px < near.residual_px {
            Ok((searched, SEARCHED))
        } else {
            Ok((near, PROPOSED))
        }
    }

    fn refine(
        &self,
        coordinates: &Coordinates,
        iterates: &[Iterate],
        budget: &mut Budget<'_>,
    ) -> Result<Refined, IdentifyError> {
        let best = iterates.first().ok_or(IdentifyError::NothingVisible)?;
        let noise_px = best.at.distance_px / 2.0_f64.sqrt();
        refine(self.film, coordinates, &best.x, noise_px, budget)
    }

    /// The global search, refined.
    fn cmaes(&self, reach: Reach, budget: &mut Budget<'_>) -> Result<Refined, IdentifyError> {
        let coordinates = self.coordinates(reach);
        // A rope that no candidate resembles would have every repeat for nothing.
        let repeats_max = match reach {
            Reach::Ranges => self.options.repeats_max,
            Reach::Wide => 0,
        };
        let options = IdentifyOptions {
            repeats_max,
            ..*self.options
        };
        let found = search(self.film, &coordinates, &options, budget)?;
        let noise_px = found.distance_px / 2.0_f64.sqrt();
        refine(self.film, &coordinates, &found.x, noise_px, budget)
    }

    fn estimate(
        &self,
        fit: &Refined,
        out_of_distribution: OutOfDistribution,
        label: &str,
        simulations: usize,
    ) -> RopeEstimate {
        let options = self.options;
        let appearance = self.film.observation.appearance;
        let pixel_m = self.film.viewer.pixel_m();
        let found = posterior(fit, appearance, pixel_m, options.lead_mass_kg, options.seed);
        let (camera_position_m, camera_rotation_rad) =
            self.film.viewer.moved(&linear::corrections(&fit.x));
        let [noise_along, noise_across] = fit.noise.axes.map(|a| KeypointNoise {
            sigma_px: a.sigma_px,
            in_time: a.in_time,
            along_rope: a.along_rope,
        });
        RopeEstimate {
            params: found.params,
            std_dev: found.std_dev(),
            residual_px: fit.residual_px,
            method: label.try_into().unwrap_or_default(),
            simulations: u32::try_from(simulations).unwrap_or(u32::MAX),
            seed: options.seed,
            time_offset_s: fit.x[CLOCK],
            posterior: found.posterior,
            circumstances: FitCircumstances {
                noise_along,
                noise_across,
                camera_position_m,
                camera_rotation_rad,
            },
            out_of_distribution,
        }
    }
}
