//! Rope parameters from the keypoints of one filmed wiggle.
//!
//! Something proposes a rope: a network, a fast search, or the paper's Φ-CMA-ES
//! ([`Method`]).
//! Gauss-Newton steps refine it against every pixel, the offset of the clocks and a
//! small error of the camera's place along with it, under a noise estimated from the
//! residuals. What the film can tell are ratios of stiffness, damping and masses
//! (multiplying all of them by one factor changes no motion), so the fit runs over
//! those, and [`scale`] adds the factor that the parameter ranges, or a weighed lead,
//! make likely. The result is a posterior over the nine parameters.

mod alone;
mod camera_pose;
mod clock;
mod coarse;
mod coordinates;
mod descent;
mod film;
mod information;
mod linear;
mod noise;
mod novelty;
mod posterior;
mod propose;
mod refine;
pub mod scale;
mod search;

pub use alone::{Compared, compare};
pub use coordinates::Appearance;
pub use information::{WiggleInformation, information};

use crate::cmaes::CmaError;
use crate::observation::ObservedPoints;
use camera_pose::CorrectionPrior;
use clock::{ClockWindow, clock_window};
use coordinates::{CLOCK, Coordinates, Reach};
use descent::{Account, Walker};
use film::Film;
use novelty::novelty;
use posterior::believe;
use propose::{fast_search, from_proposal};
use refine::{Refined, refine};
use rope_sim::sensitivity::SensitivityError;
use rope_sim::{AttachMotion, SimulateError};
use search::search;
use serde::{Deserialize, Serialize};
use shared_types::keypoints::KeypointError;
use shared_types::rope::{FitCircumstances, KeypointNoise, Novelty};
use shared_types::{KeypointTrack, RopeEstimate, RopeParams, StereoCamera};
use std::ops::ControlFlow;

/// What was filmed.
#[derive(Clone, Copy)]
pub struct Observation<'a> {
    /// Keypoints, from the clamp to the lead; times count from the first frame.
    pub track: &'a KeypointTrack,
    /// Where on the rope they lie: uniform in arc length in anything that a camera saw.
    pub points: ObservedPoints,
    /// The camera; keypoints are raw pixels of its left eye.
    pub camera: &'a StereoCamera,
    /// Measured motion of the attach frame; t = 0 is the first frame, up to the
    /// clock offset that is fitted.
    pub motion: &'a dyn AttachMotion,
    /// Widths seen in the picture.
    pub appearance: Appearance,
}

impl core::fmt::Debug for Observation<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Observation")
            .field("frames", &self.track.frames.len())
            .field("keypoints", &self.track.keypoints)
            .field("motion_s", &self.motion.duration_s())
            .field("appearance", &self.appearance)
            .finish_non_exhaustive()
    }
}

/// Size and rules of an identification.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IdentifyOptions {
    /// How the start of the refinement is found.
    pub method: Method,
    /// Candidates per generation (paper: 60).
    pub population: usize,
    /// Most generations (paper: 50).
    pub generations: usize,
    /// Whether a search of Φ-CMA-ES stops where it has all but ceased to improve.
    pub early_stop: bool,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Step of the rope simulation in the search (s).
    pub search_step_s: f64,
    /// Step of the rope simulation in the refinement (s).
    pub step_s: f64,
    /// Threads.
    pub threads: usize,
    /// Most frames that the search compares; the refinement compares all.
    pub search_frames_max: usize,
    /// Mass of the lead if it was weighed; fixes the scale of all masses (kg).
    pub lead_mass_kg: Option<f64>,
    /// Largest offset between the clocks of arm and camera (s).
    pub clock_offset_max_s: f64,
    /// Deviation of the camera's position in each direction (m).
    pub camera_position_std_m: f64,
    /// Deviation of the point the camera looks at, in each direction (m).
    pub camera_look_at_std_m: f64,
    /// Deviation of the camera's roll (rad).
    pub camera_roll_std_rad: f64,
    /// Least deviation of a keypoint, along and across the rope (px): errors that last
    /// through the film do not show in what a fit leaves over.
    pub noise_min_px: f64,
    /// Keypoints below this confidence are not used.
    pub confidence_min: f64,
    /// Distance (px) above which a search counts as caught in a side minimum
    /// and is repeated from other random numbers.
    pub repeat_above_px: f64,
    /// Most repeats of the search.
    pub repeats_max: usize,
    /// Largest part of frames in which the rope may be lost.
    pub lost_part_max: f64,
    /// Fewest frames.
    pub frames_min: usize,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self {
            method: Method::Hybrid,
            population: 60,
            generations: 50,
            early_stop: true,
            seed: 0,
            search_step_s: 4e-3,
            step_s: 2e-3,
            threads: 2,
            search_frames_max: 100,
            lead_mass_kg: None,
            clock_offset_max_s: 0.4,
            camera_position_std_m: 0.02,
            camera_look_at_std_m: 0.02,
            camera_roll_std_rad: 0.01,
            noise_min_px: 0.2,
            confidence_min: 0.2,
            repeat_above_px: 4.5,
            repeats_max: 2,
            lost_part_max: 0.05,
            frames_min: 60,
        }
    }
}

/// How far a fit has come, told after every generation or step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitProgress {
    /// Generations done.
    pub generation: usize,
    /// Most generations.
    pub generations: usize,
    /// Mean (Huber) distance of the best candidate so far (px).
    pub residual_px: f64,
    /// Wiggles simulated so far.
    pub simulations: usize,
}

/// Why no rope was identified.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The keypoints contradict themselves.
    #[error(transparent)]
    Keypoints(#[from] KeypointError),
    /// The rope was lost in too many frames.
    #[error(
        "the rope was lost in {:.0} % of the frames, at most {:.0} % are allowed: film again with the whole rope in view",
        lost_part * 100.0, max * 100.0
    )]
    TooManyLost {
        /// Part of the frames lost.
        lost_part: f64,
        /// Part allowed.
        max: f64,
    },
    /// Too few frames.
    #[error("{found} frames, but identification needs {min} or more")]
    TooFewFrames {
        /// Frames found.
        found: usize,
        /// Frames needed.
        min: usize,
    },
    /// The motion of the attach frame ends before the film.
    #[error(
        "the attach frame's motion lasts {motion_s:.3} s, the film {film_s:.3} s: record the joints longer or film shorter"
    )]
    MotionTooShort {
        /// Duration of the motion (s).
        motion_s: f64,
        /// Time of the last frame (s).
        film_s: f64,
    },
    /// No simulated rope is in front of the camera, or every simulation failed.
    #[error(
        "no simulated rope projects into the picture: check the camera's extrinsics and the attach frame's motion"
    )]
    NothingVisible,
    /// An option is out of range.
    #[error("option `{option}` is {value}, but must be {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// The search strategy cannot go on.
    #[error(transparent)]
    Search(#[from] CmaError),
    /// The rope simulator refused or failed.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Slopes of the simulation could not be taken.
    #[error(transparent)]
    Slopes(SensitivityError),
    /// The network was asked for here, where there is none.
    #[error("method `network` is none of a search: use `hybrid` or `cmaes` here")]
    NoNetwork,
    /// The caller broke off.
    #[error("identification was cancelled after generation {generation}")]
    Cancelled {
        /// Generations done.
        generation: usize,
    },
}

/// How a rope is identified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// A proposal, refined: the network's where there is one for the film, else that of
    /// a fast search.
    #[default]
    Hybrid,
    /// The proposal of a fast search, refined.
    HybridSearch,
    /// The paper's Φ-CMA-ES, refined.
    Cmaes,
    /// The network alone, which is asked by [`crate::phi`] and not by [`identify`].
    Network,
}

/// Identifies the rope, the clock offset and the camera's place from an observation.
/// Deterministic for a seed, whatever the threads.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify(
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<RopeEstimate, IdentifyError> {
    identify_from(observation, None, options, progress)
}

/// [`identify`] from a rope that something else proposes, such as a network's answer. A
/// fast search is made all the same where the fit from there looks like that of a rope
/// outside the ranges, and by every method but [`Method::Hybrid`].
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_from(
    observation: &Observation<'_>,
    proposed: Option<&RopeParams>,
    options: &IdentifyOptions,
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<RopeEstimate, IdentifyError> {
    check(observation, options)?;
    if options.method == Method::Network {
        return Err(IdentifyError::NoNetwork);
    }
    let film = Film::new(observation, options);
    let clock = clock_window(
        &film.clamp(),
        observation.camera,
        observation.motion,
        options.clock_offset_max_s,
    );
    let mut account = Account {
        simulations: 0,
        steps: 0,
        steps_max: match options.method {
            Method::Hybrid | Method::HybridSearch => HYBRID_STEPS,
            Method::Cmaes | Method::Network => options.generations + REFINE_STEPS,
        },
        progress,
    };
    let task = Task {
        film: &film,
        options,
        clock,
        camera: CorrectionPrior::new(options),
    };
    let (fit, label) = match (options.method, proposed) {
        (Method::Hybrid, Some(rope)) => task.proposed(rope, &mut account)?,
        (Method::Hybrid | Method::HybridSearch, _) => (task.hybrid(&mut account)?, SEARCHED),
        (Method::Cmaes | Method::Network, _) => (task.cmaes(Reach::Ranges, &mut account)?, "cmaes"),
    };
    let found = novelty(&fit);
    if !found.is_outside() || options.method == Method::Cmaes {
        return Ok(task.estimate(&fit, found, label, account.simulations));
    }
    tracing::info!(
        score = found.score,
        "the rope is outside the ranges: wide search"
    );
    let wide = task.cmaes(Reach::Wide, &mut account)?;
    let fit = if wide.residual_px < fit.residual_px {
        wide
    } else {
        fit
    };
    let found = novelty(&fit);
    Ok(task.estimate(&fit, found, WIDE, account.simulations))
}

/// About how many steps a refinement takes, and a fast search with it.
const REFINE_STEPS: usize = 12;
const HYBRID_STEPS: usize = 30;
/// Method of an estimate whose rope looked like none of the ranges and was searched for
/// again beyond them.
pub const WIDE: &str = "hybrid-wide";
/// Name of a fast search, refined.
const SEARCHED: &str = "hybrid-search";

/// One identification.
struct Task<'a> {
    film: &'a Film<'a>,
    options: &'a IdentifyOptions,
    clock: ClockWindow,
    camera: CorrectionPrior,
}

impl Task<'_> {
    fn coordinates(&self, reach: Reach) -> Coordinates {
        let appearance = self.film.observation.appearance;
        let pixel_m = self.film.viewer.pixel_m();
        Coordinates::new(appearance, pixel_m, self.clock, &self.camera, reach)
    }

    /// A fast search, refined.
    fn hybrid(&self, account: &mut Account<'_>) -> Result<Refined, IdentifyError> {
        let coordinates = self.coordinates(Reach::Ranges);
        let walkers = fast_search(self.film, &coordinates, self.options.seed, account)?;
        self.refine(&coordinates, &walkers, account)
    }

    /// A proposed rope, refined; a fast search if it ends where no rope of the ranges is.
    fn proposed(
        &self,
        rope: &RopeParams,
        account: &mut Account<'_>,
    ) -> Result<(Refined, &'static str), IdentifyError> {
        let coordinates = self.coordinates(Reach::Ranges);
        let walkers = from_proposal(self.film, &coordinates, rope, account)?;
        let near = self.refine(&coordinates, &walkers, account)?;
        if !novelty(&near).is_outside() {
            return Ok((near, "hybrid-network"));
        }
        let searched = self.hybrid(account)?;
        if searched.residual_px < near.residual_px {
            Ok((searched, SEARCHED))
        } else {
            Ok((near, "hybrid-network"))
        }
    }

    fn refine(
        &self,
        coordinates: &Coordinates,
        walkers: &[Walker],
        account: &mut Account<'_>,
    ) -> Result<Refined, IdentifyError> {
        let best = walkers.first().ok_or(IdentifyError::NothingVisible)?;
        let noise_px = best.at.distance_px / 2.0_f64.sqrt();
        refine(self.film, coordinates, &best.x, noise_px, account)
    }

    /// The global search, refined.
    fn cmaes(&self, reach: Reach, account: &mut Account<'_>) -> Result<Refined, IdentifyError> {
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
        let found = search(self.film, &coordinates, &options, account)?;
        let noise_px = found.distance_px / 2.0_f64.sqrt();
        refine(self.film, &coordinates, &found.x, noise_px, account)
    }

    fn estimate(
        &self,
        fit: &Refined,
        novelty: Novelty,
        label: &str,
        simulations: usize,
    ) -> RopeEstimate {
        let options = self.options;
        let appearance = self.film.observation.appearance;
        let pixel_m = self.film.viewer.pixel_m();
        let believed = believe(fit, appearance, pixel_m, options.lead_mass_kg, options.seed);
        let (camera_position_m, camera_rotation_rad) =
            self.film.viewer.moved(&linear::corrections(&fit.x));
        let [along, across] = fit.noise.axes.map(|a| KeypointNoise {
            sigma_px: a.sigma_px,
            in_time: a.in_time,
            along_rope: a.along_rope,
        });
        RopeEstimate {
            params: believed.params,
            std_dev: believed.std_dev(),
            residual_px: fit.residual_px,
            method: label.try_into().unwrap_or_default(),
            simulations: u32::try_from(simulations).unwrap_or(u32::MAX),
            seed: options.seed,
            time_offset_s: fit.x[CLOCK],
            posterior: believed.posterior,
            circumstances: FitCircumstances {
                noise_along: along,
                noise_across: across,
                camera_position_m,
                camera_rotation_rad,
            },
            novelty,
        }
    }
}

fn check(o: &Observation<'_>, options: &IdentifyOptions) -> Result<(), IdentifyError> {
    o.track.validate()?;
    let lost_part = o.track.lost_part();
    if lost_part > options.lost_part_max {
        return Err(IdentifyError::TooManyLost {
            lost_part,
            max: options.lost_part_max,
        });
    }
    let found = o.track.frames.len();
    if found < options.frames_min {
        return Err(IdentifyError::TooFewFrames {
            found,
            min: options.frames_min,
        });
    }
    let film_s = o.track.frames.last().map_or(0.0, |f| f.t_s);
    let motion_s = o.motion.duration_s();
    if motion_s < film_s {
        return Err(IdentifyError::MotionTooShort { motion_s, film_s });
    }
    let deviation = |value: f64| value > 0.0 && value <= 1.0;
    let rules = [
        (
            "search_step_s",
            options.search_step_s,
            options.search_step_s > 0.0 && options.search_step_s <= 5e-3,
            "above 0 and at most 0.005 s",
        ),
        (
            "step_s",
            options.step_s,
            options.step_s > 0.0 && options.step_s <= 5e-3,
            "above 0 and at most 0.005 s",
        ),
        (
            "clock_offset_max_s",
            options.clock_offset_max_s,
            (1e-3..=1.0).contains(&options.clock_offset_max_s),
            "0.001 to 1 s",
        ),
        (
            "lead_mass_kg",
            options.lead_mass_kg.unwrap_or(1.0),
            options.lead_mass_kg.is_none_or(|m| m > 0.0 && m < 10.0),
            "above 0 and below 10 kg",
        ),
        (
            "camera_position_std_m",
            options.camera_position_std_m,
            deviation(options.camera_position_std_m),
            "above 0 and at most 1 m",
        ),
        (
            "camera_look_at_std_m",
            options.camera_look_at_std_m,
            deviation(options.camera_look_at_std_m),
            "above 0 and at most 1 m",
        ),
        (
            "camera_roll_std_rad",
            options.camera_roll_std_rad,
            deviation(options.camera_roll_std_rad),
            "above 0 and at most 1 rad",
        ),
        (
            "noise_min_px",
            options.noise_min_px,
            options.noise_min_px >= 0.0 && options.noise_min_px <= 10.0,
            "0 to 10 px",
        ),
    ];
    for (option, value, holds, expected) in rules {
        if !holds {
            return Err(IdentifyError::Option {
                option,
                value,
                expected,
            });
        }
    }
    Ok(())
}
