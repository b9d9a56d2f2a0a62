//! Identification of simulated ropes whose truth is known, and what such trials add up
//! to: errors per parameter, errors of the ratios that matter for a throw, and how
//! often intervals hold the truth.

mod fidelity;
mod importance;
mod lob_drape;
mod outside;
mod pipeline;
mod robust;
mod sensitivity;
mod sensitivity_map;
mod strike_case;
mod summary;
mod thrower;
mod wiggles;

pub use fidelity::{FidelityConfig, FidelityRow, RealRope, middle_rope};
pub use importance::{ImportanceTrial, importance_trials};
pub use lob_drape::{LobDrapeConfig, LobDrapeTrial, lob_drape_trials};
pub use outside::area_under_curve;
pub use pipeline::{PipelineTrial, Spread, pipeline_trials};
pub use robust::{Foreseen, RobustTrial, robust_trials};
pub use sensitivity::{SensitivityTrial, sensitivity_trials};
pub use sensitivity_map::{MOMENT_FRAMES, SensitivityMap};
pub use summary::{Coverage, ParameterRow, RatioRow, SysidSummary, summarise};
pub use thrower::Strikes;
pub use wiggles::{AblatedWiggle, ablated_wiggles};

use planner::filming::{FilmTiming, Filmed, KeypointLayout, Randomisation, film, side_camera};
use planner::observation::ObservedPoints;
use planner::phi::{HybridError, PhiNet, identify_by_network, proposal};
use planner::ropes::TRIAL_SALT;
pub use planner::ropes::{outside_rope, trial_rope};

use arm_model::Limits;
use planner::sysid::Method;
use planner::sysid::identify_from;
use planner::sysid::{FitProgress, IdentifyError, IdentifyOptions, Observation, identify};
use planner::tasks::PlanError;
use planner::wiggle::{WiggleConfig, WiggleError, wiggle};
use planner::workers::map_in_order;
use rope_sim::{PlannedArm, SimulateError};
use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;
use shared_types::{RopeEstimate, RopeParams, StereoCamera};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Keypoints per frame.
const KEYPOINTS: usize = 24;

/// How ropes are filmed in trials.
#[derive(Debug, Clone)]
pub struct TrialRig {
    /// Motion of the arm.
    pub motion: PlannedArm,
    /// Where the camera is said to stand.
    pub camera: StereoCamera,
    /// Errors of the recordings.
    pub randomisation: Randomisation,
    /// Where on the rope the keypoints of its films lie.
    pub points: ObservedPoints,
    /// The network, for [`planner::sysid::Method::Network`] and what the hybrid starts
    /// from.
    pub network: Option<Arc<PhiNet>>,
}

/// Why a trial could not be made.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// There is no wiggle.
    #[error(transparent)]
    Wiggle(#[from] WiggleError),
    /// The film could not be simulated.
    #[error("trial {index}: {source}")]
    Film {
        /// Index of the trial.
        index: u64,
        /// What is wrong.
        source: SimulateError,
    },
    /// A throw could not be planned.
    #[error("trial {index}: {source}")]
    Plan {
        /// Index of the trial.
        index: u64,
        /// What is wrong.
        source: Box<PlanError>,
    },
    /// The film has no frame.
    #[error("trial {index}: the film has no frame; film longer")]
    EmptyFilm {
        /// Index of the trial.
        index: u64,
    },
    /// The network gave no answer.
    #[error("trial {index}: {source}")]
    Network {
        /// Index of the trial.
        index: u64,
        /// What is wrong.
        source: planner::phi::NetworkError,
    },
    /// The fit from the network's proposal failed.
    #[error("trial {index}: {source}")]
    Hybrid {
        /// Index of the trial.
        index: u64,
        /// What is wrong.
        source: HybridError,
    },
    /// Identification failed.
    #[error("trial {index}: {source}")]
    Identify {
        /// Index of the trial.
        index: u64,
        /// What is wrong.
        source: IdentifyError,
    },
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
    /// Score of the novelty, and whether the rope was taken for one outside the ranges.
    pub novelty: f64,
    /// Whether it was.
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
    pub fn new(config: &WiggleConfig) -> Result<Self, TrialError> {
        Ok(Self {
            motion: PlannedArm::new(wiggle(config, &Limits::default())?),
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
    pub fn film(&self, rope: &RopeParams, seed: u64, index: u64) -> Result<Filmed, TrialError> {
        let noise = self.randomisation.draw(seed ^ TRIAL_SALT, index);
        let timing = FilmTiming::default();
        let layout = match self.points {
            ObservedPoints::ArcLength => KeypointLayout::Uniform(KEYPOINTS),
            ObservedPoints::LinkCentres => KeypointLayout::LinkCentres,
        };
        film(rope, &self.motion, &self.camera, layout, &timing, &noise)
            .map_err(|source| TrialError::Film { index, source })
    }

    /// A film with all that is known beside it.
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
    ) -> Result<RopeEstimate, TrialError> {
        let observation = self.observation(filmed);
        let options = IdentifyOptions {
            seed: options.seed ^ index,
            // As these films are made: nothing but noise that comes and goes, and a
            // camera as far off as said.
            noise_min_px: 0.0,
            camera_position_std_m: self.randomisation.camera_position_m.max(1e-4),
            camera_look_at_std_m: self.randomisation.camera_lookat_m.max(1e-4),
            ..*options
        };
        if let Some(net) = &self.network {
            return with_network(net, &observation, index, &options);
        }
        identify(&observation, &options, &mut |_: FitProgress| {
            ControlFlow::Continue(())
        })
        .map_err(|source| TrialError::Identify { index, source })
    }
}

/// Identifies with the network at hand.
fn with_network(
    net: &PhiNet,
    observation: &Observation<'_>,
    index: u64,
    options: &IdentifyOptions,
) -> Result<RopeEstimate, TrialError> {
    if options.method == Method::Network {
        return identify_by_network(net, observation, options)
            .map_err(|source| TrialError::Network { index, source });
    }
    let proposed = proposal(net, observation, options);
    proposed
        .map_err(HybridError::from)
        .and_then(|rope| {
            let quiet = &mut |_: FitProgress| ControlFlow::Continue(());
            Ok(identify_from(observation, rope.as_ref(), options, quiet)?)
        })
        .map_err(|source| TrialError::Hybrid { index, source })
}

impl Trial {
    /// A trial from a rope and what was found.
    #[must_use]
    pub fn new(index: u64, truth: &RopeParams, found: &RopeEstimate) -> Self {
        Self {
            index,
            truth: truth.to_array(),
            found: found.params.to_array(),
            interval_90: found.posterior.interval_90,
            residual_px: found.residual_px,
            novelty: found.novelty.score,
            outside: found.novelty.is_outside(),
            method: found.method.to_string(),
            simulations: found.simulations,
        }
    }
}

/// Films and identifies the ropes with these indices, in parallel; trials in the order
/// of the indices, whatever the threads.
///
/// # Errors
/// The first trial that cannot be made.
pub fn run(
    rig: &TrialRig,
    rope: impl Fn(u64) -> RopeParams + Sync,
    seed: u64,
    indices: &[u64],
    options: &IdentifyOptions,
) -> Result<Vec<Trial>, TrialError> {
    let alone = IdentifyOptions {
        threads: 1,
        ..*options
    };
    let trials = map_in_order(indices, options.threads, |index| {
        let truth = rope(*index);
        let filmed = rig.film(&truth, seed, *index)?;
        let found = rig.fit(&filmed, *index, &alone)?;
        Ok(Trial::new(*index, &truth, &found))
    });
    trials.into_iter().collect()
}
