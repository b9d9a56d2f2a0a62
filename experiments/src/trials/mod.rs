//! Identification of simulated ropes whose truth is known, and what such trials add up
//! to: errors per parameter, errors of the ratios that matter for a throw, and how
//! often intervals hold the truth.

mod statistics;
mod summary;

pub use statistics::{Rate, Spread, area_under_curve, mean, quantile, wilson};
pub use summary::{PAPER, ParameterRow, RatioRow, SysidSummary, summarise};

use planner::observation::{Observation, ObservedPoints};
use planner::phi::PhiNet;
use planner::ropes::TRIAL_SALT;
use planner::synthetic::{
    FilmTiming, KeypointLayout, Randomisation, SyntheticFilm, film, side_camera,
};

use anyhow::Context;
use planner::identify::{IdentifyError, IdentifyOptions, Method};
use planner::wiggle::{WiggleConfig, WiggleError, wiggling_arm};
use planner::workers::map_in_order;
use rope_sim::{PlannedArm, SimulateError};
use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;
use shared_types::{RopeEstimate, RopeParams, StereoCamera};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Keypoints per frame.
pub const KEYPOINTS: usize = 24;

/// How ropes are filmed in trials.
#[derive(Debug, Clone)]
pub struct TrialRig {
    /// Motion of the arm.
    pub motion: PlannedArm,
    /// The calibrated camera.
    pub camera: StereoCamera,
    /// Errors of the recordings.
    pub randomisation: Randomisation,
    /// Where on the rope the keypoints of its films lie.
    pub points: ObservedPoints,
    /// The network, for [`Method::Network`] and what the hybrid starts from; without one
    /// the hybrid starts from a search.
    pub network: Option<Arc<PhiNet>>,
}

/// One identified rope with its truth. Arrays are in the order of the parameter ranges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Index of the trial under its seed.
    pub index: u64,
    /// True parameters.
    pub truth: [f64; ROPE_PARAMETERS],
    /// Found parameters.
    pub found: [f64; ROPE_PARAMETERS],
    /// Intervals of 90 %.
    pub interval_90: [[f64; 2]; ROPE_PARAMETERS],
    /// Distance of the fit to the keypoints (px).
    pub residual_px: f64,
    /// Out-of-distribution score.
    #[serde(alias = "novelty")]
    pub out_of_distribution: f64,
    /// Whether the rope was flagged as out of distribution.
    pub flagged: bool,
    /// Method as the estimate names it.
    pub method: String,
    /// Ropes simulated.
    pub simulations: u32,
}

impl TrialRig {
    /// The wiggle of the configuration, which the arm must be able to execute, filmed from
    /// the side with the paper's noise.
    pub fn new(config: &WiggleConfig) -> Result<Self, WiggleError> {
        Ok(Self {
            motion: wiggling_arm(config)?,
            camera: side_camera(),
            randomisation: Randomisation::default(),
            points: ObservedPoints::ArcLength,
            network: None,
        })
    }

    /// Films a rope with the errors of recording `index` of `seed`.
    pub fn film(
        &self,
        rope: &RopeParams,
        seed: u64,
        index: u64,
    ) -> Result<SyntheticFilm, SimulateError> {
        let noise = self.randomisation.draw(seed ^ TRIAL_SALT, index);
        let timing = FilmTiming::default();
        let layout = match self.points {
            ObservedPoints::ArcLength => KeypointLayout::Uniform(KEYPOINTS),
            ObservedPoints::LinkCentres => KeypointLayout::LinkCentres,
        };
        let camera = &self.camera;
        film(rope, &self.motion, camera, layout, &timing, &noise)
    }

    /// A film with its camera and motion.
    #[must_use]
    pub fn observation<'a>(&'a self, filmed: &'a SyntheticFilm) -> Observation<'a> {
        Observation {
            track: &filmed.track,
            points: self.points,
            camera: &self.camera,
            motion: &self.motion,
            appearance: filmed.appearance,
        }
    }

    /// Identifies the rope of a film.
    pub fn fit(
        &self,
        filmed: &SyntheticFilm,
        index: u64,
        options: &IdentifyOptions,
    ) -> Result<RopeEstimate, IdentifyError> {
        let observation = self.observation(filmed);
        let options = IdentifyOptions {
            seed: options.seed ^ index,
            // As these films are made: nothing but noise that comes and goes, and a
            // camera as far off as the randomisation puts it.
            noise_min_px: 0.0,
            keypoint_offset_std_px: 0.0,
            camera_position_std_m: self.randomisation.camera_position_m.max(1e-4),
            camera_look_at_std_m: self.randomisation.camera_lookat_m.max(1e-4),
            method: match (options.method, &self.network) {
                (Method::Hybrid, None) => Method::HybridSearch,
                (method, _) => method,
            },
            ..*options
        };
        let network = self.network.as_deref();
        let go_on = &mut |_| ControlFlow::Continue(());
        planner::identify(&observation, &options, network, go_on)
    }
}

/// Makes the trials (or what else `name` says) with these numbers, in parallel; in their
/// order, whatever the threads. After a failure no further one is begun.
///
/// # Errors
/// The first in that order that was begun and failed.
pub fn in_parallel<T: Send>(
    name: &str,
    numbers: &[u64],
    threads: usize,
    make: impl Fn(u64) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let failed = AtomicBool::new(false);
    let results = map_in_order(numbers, threads, |&number| {
        if failed.load(Ordering::Relaxed) {
            return None;
        }
        let result = make(number).with_context(|| format!("{name} {number}"));
        failed.fetch_or(result.is_err(), Ordering::Relaxed);
        Some(result)
    });
    // What was not begun comes with a failure.
    results.into_iter().flatten().collect()
}

/// Films and identifies the ropes with these indices; fails as [`in_parallel`] does.
pub fn run(
    rig: &TrialRig,
    rope: impl Fn(u64) -> RopeParams + Sync,
    indices: &[u64],
    options: &IdentifyOptions,
) -> anyhow::Result<Vec<Trial>> {
    in_parallel("trial", indices, options.threads, |index| {
        let truth = rope(index);
        let filmed = rig.film(&truth, options.seed, index)?;
        let found = rig.fit(&filmed, index, &alone(options))?;
        Ok(Trial {
            index,
            truth: truth.to_array(),
            found: found.params.to_array(),
            interval_90: found.posterior.interval_90,
            residual_px: found.residual_px,
            out_of_distribution: found.out_of_distribution.score,
            flagged: found.out_of_distribution.is_flagged(),
            method: found.method.to_string(),
            simulations: found.simulations,
        })
    })
}

/// One of several trials that are made at once.
#[must_use]
pub fn alone(options: &IdentifyOptions) -> IdentifyOptions {
    IdentifyOptions {
        threads: 1,
        ..*options
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_and_a_failure_names_its_number() {
        let seeds: Vec<u64> = (1..40).collect();
        assert_eq!(in_parallel("seed", &seeds, 3, Ok).unwrap(), seeds);
        let fails = |seed: u64| -> anyhow::Result<u64> {
            anyhow::ensure!(seed != 7, "no");
            Ok(seed)
        };
        let error = in_parallel("seed", &seeds, 2, fails).unwrap_err();
        assert!(format!("{error:#}").contains("seed 7"));
    }
}
