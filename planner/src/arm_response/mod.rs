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
mod recording;
mod window;

pub use following::{FollowError, Following};
pub use recording::{Recording, ResponseError, Sample, Setpoint};

use arm_model::JOINTS;
use arm_model::response::{Estimate, JointResponse, NotExcited, TrackingLag};
use recording::SAMPLES_MIN;
use window::Window;

/// Smallest travel a joint must be told to make (rad).
const TRAVEL_MIN_RAD: f64 = 2e-3;
/// Largest half interval of a dead time that still counts as known (s).
const DEAD_TIME_HALF_MAX_S: f64 = 0.004;
/// The same for natural frequency and damping, as fractions of the value.
const FRACTION_HALF_MAX: f64 = 0.15;
/// Largest unexplained fraction of a motion: residual over the motion's spread.
const UNEXPLAINED_MAX: f64 = 0.05;

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
    let found = fit::most_likely(&windows, recording.round_trip_s);
    let (lag, at_bound) = found.ok_or(NotExcited::Unexplained)?;
    if lag.residual_rad > UNEXPLAINED_MAX * window::spread_rad(&windows) {
        return Err(NotExcited::Unexplained);
    }
    if at_bound || !is_distinct(&lag) {
        return Err(NotExcited::Indistinct);
    }
    Ok(lag)
}

/// Whether dead time and lag are known well enough to be told apart.
fn is_distinct(lag: &TrackingLag) -> bool {
    let half = |e: &Estimate| e.interval[1] - e.value;
    let part = |e: &Estimate| half(e) / e.value;
    half(&lag.dead_time_s) <= DEAD_TIME_HALF_MAX_S
        && part(&lag.natural_frequency_hz) <= FRACTION_HALF_MAX
        && part(&lag.damping_ratio) <= FRACTION_HALF_MAX
}

#[cfg(test)]
mod tests;
