//! What a wiggle can tell about a rope: its Fisher information before anything is
//! filmed.
//!
//! The normal equations of a perfect fit under a tracker's noise, the clock and the
//! camera's place unknown as in any identification. Their inverse bounds what any
//! method can learn from this motion.

use super::clock::ClockWindow;
use super::coordinates::{
    DAMPING, LEAD_MASS, LEAD_RADIUS, LENGTH, LINKS, Reach, STIFFNESS, point_of,
};
use super::error::IdentifyError;
use super::film::{Fidelity, Film};
use super::linear::linearise;
use super::noise::Noise;
use super::options::IdentifyOptions;
use crate::observation::{Appearance, Observation, ObservedPoints};
use crate::synthetic::{FilmNoise, FilmTiming, film};
use nalgebra::SMatrix;
use rope_sim::AttachMotion;
use serde::{Deserialize, Serialize};
use shared_types::rope::KeypointNoise;
use shared_types::{RopeParams, StereoCamera};

/// Keypoints per frame.
const KEYPOINTS: usize = 24;
/// A middling tracker of the paper's noise: along and across the rope (px), and from
/// frame to frame.
const NOISE_PX: [f64; 2] = [1.5, 0.75];
const CORRELATION: f64 = 0.8;

/// Standard deviations that a wiggle leaves to the best possible method.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WiggleInformation {
    /// Rope length (m).
    pub length_m: f64,
    /// Bending stiffness per length over mass per length, relative.
    pub bending_stiffness: f64,
    /// Damping per length over mass per length, relative.
    pub damping: f64,
    /// Lead mass over mass per length, relative.
    pub lead_mass: f64,
    /// Lead radius from its inertia alone (m).
    pub lead_radius_m: f64,
    /// Number of links.
    pub links: f64,
    /// Mean logarithm of the principal deviations of length (in 0.1 m) and the three
    /// ratios: what a designed wiggle makes small.
    pub log_volume: f64,
}

/// Information of a motion about one rope; `None` where it cannot be simulated or
/// leaves the camera's half space.
pub fn information(
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    camera: &StereoCamera,
    exact: bool,
    threads: usize,
) -> Result<Option<WiggleInformation>, IdentifyError> {
    let (timing, noise) = (FilmTiming::default(), FilmNoise::default());
    let filmed = film(rope, motion, camera, KEYPOINTS, &timing, &noise)?;
    let observation = Observation {
        track: &filmed.track,
        points: ObservedPoints::ArcLength,
        camera,
        motion,
        appearance: Appearance::default(),
    };
    let options = IdentifyOptions {
        threads,
        ..IdentifyOptions::default()
    };
    let seen = Film::new(&observation, &options);
    let fidelity = if exact {
        Fidelity::Fine
    } else {
        Fidelity::Coarse
    };
    let clock = ClockWindow {
        offset_s: 0.0,
        half_width_s: options.clock_offset_max_s,
    };
    let coordinates = seen.coordinates(clock, Reach::Ranges);
    let x = point_of(rope);
    let (mut at, _) = linearise(&seen, &[x], &[], rope.links, coordinates.fitted, fidelity)?;
    let Some(Some(at)) = at.pop() else {
        return Ok(None);
    };
    let noise = Noise {
        axes: NOISE_PX.map(|sigma_px| KeypointNoise {
            sigma_px,
            // Frames left out between two that are compared take it along.
            in_time: if exact { CORRELATION } else { 0.0 },
            along_rope: 0.0,
        }),
    };
    let normal = at.normal(&seen, fidelity, &noise);
    let covariance = (normal.information + coordinates.prior_information()).try_inverse();
    Ok(covariance.map(|c| {
        let deviation = |i: usize| c[(i, i)].max(0.0).sqrt();
        let reported = [LENGTH, STIFFNESS, DAMPING, LEAD_MASS];
        let unit = [0.1, 1.0, 1.0, 1.0];
        let block = SMatrix::<f64, 4, 4>::from_fn(|i, j| {
            c[(reported[i], reported[j])] / (unit[i] * unit[j])
        });
        WiggleInformation {
            length_m: deviation(LENGTH),
            bending_stiffness: deviation(STIFFNESS),
            damping: deviation(DAMPING),
            lead_mass: deviation(LEAD_MASS),
            lead_radius_m: deviation(LEAD_RADIUS),
            links: deviation(LINKS),
            log_volume: block.determinant().max(1e-300).ln() / 8.0,
        }
    }))
}
