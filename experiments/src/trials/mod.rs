//! Identification of simulated ropes whose truth is known, and what such trials add up
//! to: errors per parameter, errors of the ratios that matter for a throw, and how
//! often intervals hold the truth.

mod statistics;
mod summary;

pub use statistics::{Spread, area_under_curve, mean, quantile};
pub use summary::{PAPER, ParameterRow, RatioRow, SysidSummary, summarise};

use planner::observation::{Observation, ObservedPoints};
use planner::phi::PhiNet;
use planner::ropes::TRIAL_SALT;
use planner::synthetic::{FilmTiming, Filmed, KeypointLayout, Randomisation, film, side_camera};

use anyhow::Context;
use arm_model::{Limits, Pole};
use planner::identify::{IdentifyError, IdentifyOptions, Method};
use planner::wiggle::{WiggleConfig, WiggleError, wiggle};
use planner::workers::map_in_order;
use rope_sim::{PlannedArm, SimulateError};
use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;
use shared_types::{RopeEstimate, RopeParams, StereoCamera};
use std::ops::ControlFlow;
use std::sync::Arc;

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
    /// Whether the rope was taken for one outside the ranges.
    pub outside: bool,
    /// Method as the estimate names it.
    pub method: String,
    /// Ropes simulated.
    pub simulations: u32,
}

impl TrialRig {
    /// The wiggle of the configuration, filmed from the side with the paper's noise.
    ///
    /// # Errors
    /// If the arm may not execute it.
    pub fn new(config: &WiggleConfig) -> Result<Self, WiggleError> {
        Ok(Self {
            motion: PlannedArm::new(wiggle(config, &Limits::default())?, Pole::default()),
            camera: side_camera(),
            randomisation: Randomisation::default(),
            points: ObservedPoints::ArcLength,
            network: None,
        })
    }

    /// Films a rope with the errors of recording `index` of `seed`.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub fn film(&self, rope: &RopeParams, seed: u64, index: u64) -> Result<Filmed, SimulateError> {
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
    pub fn observation<'a>(&'a self, filmed: &'a Filmed) -> Observation<'a> {
        Observation {
            track: &filmed.track,
            points: self.points,
            camera: &self.camera,
            motion: &self.motion,
            appearance: filmed.appearance,
        }
    }

    /// Identifies the rope of a film.
    ///
    /// # Errors
    /// What identification refuses.
    pub fn fit(
        &self,
        filmed: &Filmed,
        index: u64,
        options: &IdentifyOptions,
    ) -> Result<RopeEstimate, IdentifyError> {
        let observation = self.observation(filmed);
        let options = IdentifyOptions {
            seed: options.seed ^ index,
            // As these films are made: nothing but noise that comes and goes, and a
            // camera as far off as the randomisation puts it.
            noise_min_px: 0.0,
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

impl Trial {
    /// A trial from a rope and what was found.
    fn new(index: u64, truth: &RopeParams, found: &RopeEstimate) -> Self {
        Self {
            index,
            truth: truth.to_array(),
            found: found.params.to_array(),
            interval_90: found.posterior.interval_90,
            residual_px: found.residual_px,
            out_of_distribution: found.out_of_distribution.score,
            outside: found.out_of_distribution.is_outside(),
            method: found.method.to_string(),
            simulations: found.simulations,
        }
    }
}

/// Makes the trials with these indices, in parallel; in their order, whatever the
/// threads.
///
/// # Errors
/// The first trial that cannot be made.
pub fn in_parallel<T: Send>(
    indices: &[u64],
    threads: usize,
    make: impl Fn(u64) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let trial = |&index: &u64| make(index).with_context(|| format!("trial {index}"));
    map_in_order(indices, threads, trial).into_iter().collect()
}

/// Films and identifies the ropes with these indices.
///
/// # Errors
/// The first trial that cannot be made.
pub fn run(
    rig: &TrialRig,
    rope: impl Fn(u64) -> RopeParams + Sync,
    indices: &[u64],
    options: &IdentifyOptions,
) -> anyhow::Result<Vec<Trial>> {
    in_parallel(indices, options.threads, |index| {
        let truth = rope(index);
        let filmed = rig.film(&truth, options.seed, index)?;
        let found = rig.fit(&filmed, index, &alone(options))?;
        Ok(Trial::new(index, &truth, &found))
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
