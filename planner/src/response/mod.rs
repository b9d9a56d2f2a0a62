//! How the arm follows its setpoints: a motion that shows it, and the estimate.
//!
//! [`excitation`] makes a small sweep for each joint. [`identify`] takes what
//! was sent and what the arm reported, on one clock, and finds each joint's
//! dead time and second-order lag (gain one) by maximum likelihood: the lag is
//! integrated exactly through the staircase of setpoints, so that neither the
//! cycle nor the jitter of either side limits the resolution. [`delay`] tells
//! how long a setpoint takes until the arm names it as its target. [`Following`] is the
//! way back: the motion of an arm so measured.
//!
//! It lives with the planner, and not with the commands, because it is
//! identification: plans are to be made through the lag it finds. It sees no
//! sockets, files or clocks.

pub mod delay;
pub mod excitation;
mod fit;
mod following;
mod lag;
mod noise;
mod window;

pub use following::{FollowError, Following};

use arm_model::response::{Estimate, JointResponse, NotExcited, TrackingLag};
use arm_model::{JOINTS, JointVector};
use fit::Fit;
use window::Window;

/// Smallest travel a joint must be told to make (rad).
const TRAVEL_MIN_RAD: f64 = 2e-3;
/// Fewest reports of a joint in motion.
const SAMPLES_MIN: usize = 100;
/// Largest half interval of a dead time that still counts as known (s).
const DEAD_TIME_HALF_MAX_S: f64 = 0.004;
/// The same for natural frequency and damping, as parts of the value.
const PART_HALF_MAX: f64 = 0.15;
/// Largest unexplained part of a motion: residual over the motion's spread.
const UNEXPLAINED_MAX: f64 = 0.05;

/// A setpoint as it left for the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// When it was sent (s).
    pub sent_s: f64,
    /// Joints (rad).
    pub q: JointVector,
}

/// A joint report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// When the joints were measured, on the clock of the setpoints (s).
    pub at_s: f64,
    /// Measured joints (rad).
    pub q: JointVector,
    /// What the arm said it was told to take (rad), if it was recorded.
    pub q_target: Option<JointVector>,
}

/// What was sent to an arm and what came back, in order of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Setpoints; each holds until the next.
    pub setpoints: Vec<Setpoint>,
    /// Joint reports.
    pub samples: Vec<Sample>,
    /// Typical round trip of a setpoint and its reply (s): what time on the wire
    /// may add to a dead time. 0 when unknown.
    pub round_trip_s: f64,
}

/// Why a recording is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// Too little of something.
    #[error(
        "the recording holds {found} {what}, at least {needed} are needed: record a whole motion"
    )]
    TooFew {
        /// Of what.
        what: &'static str,
        /// Number found.
        found: usize,
        /// Number needed.
        needed: usize,
    },
    /// Times do not increase.
    #[error("{what} {index} of the recording does not come after the one before, at {time_s} s")]
    Order {
        /// Of what.
        what: &'static str,
        /// Place in the list, 0-based.
        index: usize,
        /// Time found (s).
        time_s: f64,
    },
    /// A number is NaN or infinite.
    #[error("{what} {index} of the recording holds a number that is not finite")]
    NotFinite {
        /// Of what.
        what: &'static str,
        /// Place in the list, 0-based.
        index: usize,
    },
    /// Setpoints and reports are of different times.
    #[error(
        "the joint reports begin or end when no setpoint was sent: they are of another run or another clock"
    )]
    Apart,
}

impl Recording {
    /// Refuses recordings that nothing can be learnt from.
    ///
    /// # Errors
    /// [`ResponseError`].
    pub fn check(&self) -> Result<(), ResponseError> {
        let setpoints = self.setpoints.iter().map(|s| (s.sent_s, s.q));
        let samples = self.samples.iter().map(|s| (s.at_s, s.q));
        check_rows("setpoint", "setpoints", setpoints)?;
        check_rows("joint report", "joint reports", samples)?;
        let (Some(first), Some(last)) = (self.setpoints.first(), self.setpoints.last()) else {
            return Err(ResponseError::Apart);
        };
        let shared = self
            .samples
            .iter()
            .filter(|s| (first.sent_s..=last.sent_s).contains(&s.at_s))
            .count();
        if shared < SAMPLES_MIN {
            return Err(ResponseError::Apart);
        }
        Ok(())
    }
}

fn check_rows(
    one: &'static str,
    many: &'static str,
    rows: impl ExactSizeIterator<Item = (f64, JointVector)>,
) -> Result<(), ResponseError> {
    let found = rows.len();
    if found < SAMPLES_MIN {
        return Err(ResponseError::TooFew {
            what: many,
            found,
            needed: SAMPLES_MIN,
        });
    }
    let mut before_s = f64::NEG_INFINITY;
    for (index, (time_s, q)) in rows.enumerate() {
        if !time_s.is_finite() || !q.is_finite() {
            return Err(ResponseError::NotFinite { what: one, index });
        }
        if time_s <= before_s {
            return Err(ResponseError::Order {
                what: one,
                index,
                time_s,
            });
        }
        before_s = time_s;
    }
    Ok(())
}

/// Finds how each joint follows. `each` is told the joint (0-based) begun.
///
/// # Errors
/// [`ResponseError`] for a recording that makes no sense; a joint that cannot
/// be told is no error but [`JointResponse::NotExcited`].
pub fn identify(
    recording: &Recording,
    mut each: impl FnMut(usize),
) -> Result<[JointResponse; JOINTS], ResponseError> {
    recording.check()?;
    Ok(core::array::from_fn(|joint| {
        each(joint);
        match identify_joint(recording, joint) {
            Ok(lag) => JointResponse::Excited(lag),
            Err(why) => JointResponse::NotExcited(why),
        }
    }))
}

fn identify_joint(recording: &Recording, joint: usize) -> Result<TrackingLag, NotExcited> {
    let windows = Window::all(recording, joint);
    let travel_rad = windows.iter().map(Window::travel_rad).fold(0.0, f64::max);
    let samples: usize = windows.iter().map(|w| w.samples.len()).sum();
    if travel_rad < TRAVEL_MIN_RAD || samples < SAMPLES_MIN {
        return Err(NotExcited::Still);
    }
    let fit = Fit::of(&windows).ok_or(NotExcited::Unexplained)?;
    if fit.residual_rad > UNEXPLAINED_MAX * window::spread_rad(&windows) {
        return Err(NotExcited::Unexplained);
    }
    let lag = fit.tracking_lag(recording.round_trip_s);
    if fit.at_bound || !is_distinct(&lag) {
        return Err(NotExcited::Indistinct);
    }
    Ok(lag)
}

/// Whether dead time and lag are known well enough to be told apart.
fn is_distinct(lag: &TrackingLag) -> bool {
    let half = |e: &Estimate| e.interval[1] - e.value;
    let part = |e: &Estimate| half(e) / e.value;
    half(&lag.dead_time_s) <= DEAD_TIME_HALF_MAX_S
        && part(&lag.natural_frequency_hz) <= PART_HALF_MAX
        && part(&lag.damping_ratio) <= PART_HALF_MAX
}

#[cfg(test)]
mod tests;
