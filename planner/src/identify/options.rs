//! Method, size and rules of an identification.

use super::camera_pose::CORRECTIONS;
use super::error::IdentifyError;
use crate::OutOfRange;
use crate::observation::Observation;
use arm_model::Pole;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Deviation of what a tracker's keypoint is off by all through a film (px).
pub(super) const OFFSET_STD_PX: f64 = 0.3;

/// How a rope is identified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// A proposal, refined: the network's where the film is one that it can judge, else
    /// that of a fast search.
    #[default]
    Hybrid,
    /// The proposal of a fast search, refined.
    HybridSearch,
    /// The paper's Φ-CMA-ES, refined.
    Cmaes,
    /// The network alone.
    Network,
}

impl Method {
    /// Whether it asks a network.
    #[must_use]
    pub fn asks_network(self) -> bool {
        matches!(self, Self::Network | Self::Hybrid)
    }

    /// What to know where a network judges the film of another pole than it was trained with.
    #[must_use]
    pub fn warning_of_pole(self, pole: &Pole) -> Option<&'static str> {
        let is_other = pole.end_m() != Pole::default().end_m();
        (self.asks_network() && is_other).then_some(
            "the network was trained with the built-in pole, not with this one; compare \
             `wag identify --method hybrid-search`",
        )
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
    /// Length of the rope if it was measured by tape, clamp to lead centre (m).
    pub length_m: Option<f64>,
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
    /// Deviation of what each keypoint is off by all through the film, along and across the rope
    /// (px): the intervals of the parameters allow for it.
    pub keypoint_offset_std_px: f64,
    /// Keypoints below this confidence are not used.
    pub confidence_min: f64,
    /// Distance (px) above which a search counts as caught in a local minimum
    /// and is repeated from other random numbers.
    pub repeat_above_px: f64,
    /// Most repeats of the search.
    pub repeats_max: usize,
    /// Largest fraction of frames in which the rope may be lost.
    pub lost_fraction_max: f64,
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
            length_m: None,
            clock_offset_max_s: 0.4,
            camera_position_std_m: 0.02,
            camera_look_at_std_m: 0.02,
            camera_roll_std_rad: 0.01,
            noise_min_px: 0.2,
            keypoint_offset_std_px: OFFSET_STD_PX,
            confidence_min: 0.2,
            repeat_above_px: 4.5,
            repeats_max: 2,
            lost_fraction_max: 0.05,
            frames_min: 60,
        }
    }
}

impl IdentifyOptions {
    /// Deviations of the camera's corrections, whose means are 0.
    pub(super) fn camera_std(&self) -> [f64; CORRECTIONS] {
        let (position, look_at) = (self.camera_position_std_m, self.camera_look_at_std_m);
        let roll = self.camera_roll_std_rad;
        [position, position, position, look_at, look_at, roll]
    }
}

/// Whether a film can be fitted with these options.
pub(super) fn check(o: &Observation<'_>, options: &IdentifyOptions) -> Result<(), IdentifyError> {
    check_options(options)?;
    o.track.validate()?;
    let (lost, most) = (o.track.lost_fraction(), options.lost_fraction_max);
    let (found, min) = (o.track.frames.len(), options.frames_min);
    let film_s = o.track.frames.last().map_or(0.0, |f| f.t_s);
    let motion_s = o.motion.duration_s();
    let reason = if lost > most {
        format!(
            "the rope was lost in {:.0} % of the frames, at most {:.0} % are allowed: film again with the whole rope in view",
            lost * 100.0,
            most * 100.0
        )
    } else if found < min {
        format!("{found} frames, but identification needs {min} or more")
    } else if motion_s < film_s {
        format!(
            "the attach frame's motion lasts {motion_s:.3} s, the film {film_s:.3} s: record the joints longer or film shorter"
        )
    } else {
        return Ok(());
    };
    Err(IdentifyError::Film(reason))
}

/// Lengths of ropes (m), and the same in words.
const TAPE_M: RangeInclusive<f64> = 0.05..=5.0;
const TAPE: &str = "0.05 to 5 m";

/// A rope's length (m) measured by tape, as a command takes it.
///
/// # Errors
/// It is no length of a rope, in words.
pub fn tape_length_m(text: &str) -> Result<f64, String> {
    let length_m = text.parse().ok().filter(|m| TAPE_M.contains(m));
    length_m.ok_or_else(|| format!("a rope's length is {TAPE}, written in m: 0.55, not 55"))
}

/// Refuses what cannot be searched with, never ends, or would pass any film.
fn check_options(o: &IdentifyOptions) -> Result<(), IdentifyError> {
    const STEP: &str = "above 0 and at most 0.005 s";
    const DEVIATION: &str = "above 0 and at most 1 (m, rad)";
    const CLOCK: &str = "0.001 to 1 s";
    const LEAD: &str = "above 0 and below 10 kg";
    let within = |option, value: f64, range: RangeInclusive<f64>, expected| {
        (option, value, range.contains(&value), expected)
    };
    let count = |option, value: usize, max: usize, expected| {
        (option, value as f64, (1..=max).contains(&value), expected)
    };
    let step = |option, value| within(option, value, f64::MIN_POSITIVE..=5e-3, STEP);
    let deviation = |option, value| within(option, value, f64::MIN_POSITIVE..=1.0, DEVIATION);
    let finite = |option, value| within(option, value, f64::MIN..=f64::MAX, "finite");
    let positive = |option, value| count(option, value, usize::MAX, "1 or more");
    let lead_kg = o.lead_mass_kg.unwrap_or(1.0);
    let (population, repeats) = (o.population as f64, o.repeats_max as f64);
    let rules = [
        step("search_step_s", o.search_step_s),
        step("step_s", o.step_s),
        within(
            "clock_offset_max_s",
            o.clock_offset_max_s,
            1e-3..=1.0,
            CLOCK,
        ),
        (
            "lead_mass_kg",
            lead_kg,
            lead_kg > 0.0 && lead_kg < 10.0,
            LEAD,
        ),
        within("length_m", o.length_m.unwrap_or(1.0), TAPE_M, TAPE),
        deviation("camera_position_std_m", o.camera_position_std_m),
        deviation("camera_look_at_std_m", o.camera_look_at_std_m),
        deviation("camera_roll_std_rad", o.camera_roll_std_rad),
        within("noise_min_px", o.noise_min_px, 0.0..=10.0, "0 to 10 px"),
        within(
            "keypoint_offset_std_px",
            o.keypoint_offset_std_px,
            0.0..=10.0,
            "0 to 10 px",
        ),
        within("population", population, 4.0..=1e4, "4 to 10000"),
        count("generations", o.generations, 10_000_000, "1 to 10000000"),
        positive("search_frames_max", o.search_frames_max),
        within("repeats_max", repeats, 0.0..=100.0, "at most 100"),
        positive("frames_min", o.frames_min),
        within(
            "lost_fraction_max",
            o.lost_fraction_max,
            0.0..=1.0,
            "0 to 1",
        ),
        finite("confidence_min", o.confidence_min),
        finite("repeat_above_px", o.repeat_above_px),
    ];
    Ok(OutOfRange::check(rules)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_refused_by_name() {
        type Change = fn(&mut IdentifyOptions);
        let cases: [(&str, Change); 16] = [
            ("length_m", |o| o.length_m = Some(55.0)),
            ("population", |o| o.population = 3),
            ("population", |o| o.population = usize::MAX),
            ("generations", |o| o.generations = 0),
            ("generations", |o| o.generations = usize::MAX),
            ("search_frames_max", |o| o.search_frames_max = 0),
            ("repeats_max", |o| o.repeats_max = usize::MAX),
            ("frames_min", |o| o.frames_min = 0),
            ("lost_fraction_max", |o| o.lost_fraction_max = f64::NAN),
            ("lost_fraction_max", |o| o.lost_fraction_max = 1.5),
            ("confidence_min", |o| o.confidence_min = f64::NAN),
            ("repeat_above_px", |o| o.repeat_above_px = f64::INFINITY),
            ("step_s", |o| o.step_s = 0.0),
            ("noise_min_px", |o| o.noise_min_px = -1.0),
            ("keypoint_offset_std_px", |o| {
                o.keypoint_offset_std_px = 11.0
            }),
            ("lead_mass_kg", |o| o.lead_mass_kg = Some(f64::NAN)),
        ];
        assert!(check_options(&IdentifyOptions::default()).is_ok());
        for (name, change) in cases {
            let mut options = IdentifyOptions::default();
            change(&mut options);
            match check_options(&options) {
                Err(IdentifyError::Option(refusal)) => assert_eq!(refusal.key, name),
                other => panic!("{name}: {other:?}"),
            }
        }
    }

    #[test]
    fn another_pole_is_warned_of_where_a_network_is_asked() {
        let longer = Pole {
            length_m: 0.3,
            ..Pole::default()
        };
        assert!(Method::Hybrid.warning_of_pole(&longer).is_some());
        assert!(Method::Hybrid.warning_of_pole(&Pole::default()).is_none());
        assert!(Method::HybridSearch.warning_of_pole(&longer).is_none());
    }
}
