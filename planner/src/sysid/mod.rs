//! Φ-CMA-ES: rope parameters from the keypoints of one filmed wiggle.
//!
//! Paper, baseline Φ-CMA-ES: 60 candidates by 50 generations minimise the pixel
//! distance between observed and simulated keypoints; the attach frame moves as
//! measured. What the film can tell are ratios of stiffness, damping and masses
//! (multiplying all of them by one factor changes no motion), so the search runs
//! over those, and [`scale`] adds the factor that the parameter ranges, or a
//! weighed lead, make likely. A Gauss-Newton polish gives the uncertainty.

mod clock;
mod coordinates;
mod observe;
mod polish;
pub mod scale;

pub use coordinates::Appearance;

use crate::cmaes::{CmaError, CmaEs, CmaOptions, StopRules};
use clock::clock_window;
use coordinates::{COORDINATES, Coordinates};
use observe::Film;
use rope_sim::{AttachMotion, SimulateError};
use serde::{Deserialize, Serialize};
use shared_types::keypoints::KeypointError;
use shared_types::{KeypointTrack, RopeEstimate, StereoCamera};
use std::ops::ControlFlow;

/// What was filmed.
#[derive(Clone, Copy)]
pub struct Observation<'a> {
    /// Keypoints, uniform in arc length from clamp to lead centre; times count
    /// from the first frame.
    pub track: &'a KeypointTrack,
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
    /// Candidates per generation (paper: 60).
    pub population: usize,
    /// Most generations (paper: 50).
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Step of the rope simulation in the search (s).
    pub search_step_s: f64,
    /// Step of the rope simulation in the polish (s).
    pub step_s: f64,
    /// Threads.
    pub threads: usize,
    /// Most frames that the search compares; the polish compares all.
    pub search_frames_max: usize,
    /// Mass of the lead if it was weighed; fixes the scale of all masses (kg).
    pub lead_mass_kg: Option<f64>,
    /// Largest offset between the clocks of arm and camera (s).
    pub clock_offset_max_s: f64,
    /// Pixel distance beyond which a keypoint counts as an outlier (Huber).
    pub outlier_px: f64,
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
            population: 60,
            generations: 50,
            seed: 0,
            search_step_s: 2e-3,
            step_s: 1e-3,
            threads: 2,
            search_frames_max: 100,
            lead_mass_kg: None,
            clock_offset_max_s: 0.06,
            outlier_px: 3.0,
            confidence_min: 0.2,
            repeat_above_px: 2.5,
            repeats_max: 2,
            lost_part_max: 0.05,
            frames_min: 60,
        }
    }
}

/// How far a fit has come, told after every generation.
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
    /// The caller broke off.
    #[error("identification was cancelled after generation {generation}")]
    Cancelled {
        /// Generations done.
        generation: usize,
    },
}

/// Fits the rope's parameters and the clock offset to an observation.
/// Deterministic for a seed, whatever the threads.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify(
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<RopeEstimate, IdentifyError> {
    check(observation, options)?;
    let film = Film::new(observation, options);
    let clock = clock_window(
        &film.clamp(),
        observation.camera,
        observation.motion,
        options.clock_offset_max_s,
    );
    let coordinates = Coordinates::new(observation.appearance, options.lead_mass_kg, clock);
    let mut found = search(&film, &coordinates, options, options.seed, progress)?;
    for repeat in 1..=options.repeats_max as u64 {
        if found.distance_px <= options.repeat_above_px {
            break;
        }
        let seed = options.seed.wrapping_add(repeat << 32);
        let again = search(&film, &coordinates, options, seed, progress)?;
        let simulations = found.simulations + again.simulations;
        if again.distance_px < found.distance_px {
            found = again;
        }
        found.simulations = simulations;
    }
    polish::polish(&film, &coordinates, options.seed, &found)
}

/// Result of the global search.
struct Found {
    x: [f64; COORDINATES],
    distance_px: f64,
    simulations: usize,
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
            "outlier_px",
            options.outlier_px,
            options.outlier_px > 0.0,
            "above 0",
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

/// The global search.
fn search(
    film: &Film<'_>,
    coordinates: &Coordinates,
    options: &IdentifyOptions,
    seed: u64,
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<Found, IdentifyError> {
    let mut strategy = CmaEs::new(CmaOptions {
        mean: coordinates.middle.to_vec(),
        std_dev: coordinates.spread().to_vec(),
        lower: coordinates.lower.to_vec(),
        upper: coordinates.upper.to_vec(),
        population: options.population,
        draws_max: 1,
        seed,
        stop: StopRules {
            generations_max: options.generations,
            ..StopRules::default()
        },
    })?;
    let mut simulations = 0;
    let mut history = Vec::new();
    loop {
        let points: Vec<[f64; COORDINATES]> = strategy
            .ask(&mut |_| true)?
            .iter()
            .map(|x| core::array::from_fn(|i| x[i]))
            .collect();
        let fitness = film.distances_px(coordinates, &points)?;
        simulations += points.len();
        strategy.tell(&fitness)?;
        let (residual_px, best) = match strategy.best() {
            Some(best) if best.fitness < observe::INVISIBLE_PX => {
                (best.fitness, core::array::from_fn(|i| best.x[i]))
            }
            _ => return Err(IdentifyError::NothingVisible),
        };
        let report = FitProgress {
            generation: strategy.generation(),
            generations: options.generations,
            residual_px,
            simulations,
        };
        if progress(report).is_break() {
            return Err(IdentifyError::Cancelled {
                generation: report.generation,
            });
        }
        history.push(residual_px);
        if strategy.stop().is_some() || stalled(&history) {
            tracing::debug!(simulations, residual_px, "rope search ended");
            return Ok(Found {
                x: best,
                distance_px: residual_px,
                simulations,
            });
        }
    }
}

/// Whether the best distance has all but ceased to fall: from there the polish
/// goes on faster.
fn stalled(history: &[f64]) -> bool {
    const WINDOW: usize = 6;
    const PART: f64 = 0.02;
    let now = history.len();
    now > 2 * WINDOW && history[now - 1] > (1.0 - PART) * history[now - 1 - WINDOW]
}
