//! What speaks against relying on a fit: errors that went into other numbers than the residual.
//!
//! What the model leaves out is taken up by whatever can move. A camera far from where its file
//! says, clocks at the end of what is looked for, parts of the film that contradict each other and
//! starts that end elsewhere each show it; forecasts allow for what is known of it in metres.

use super::camera_pose::CORRECTIONS;
use super::clock::ClockWindow;
use super::coordinates::{CLOCK, LENGTH};
use super::film::Film;
use super::linear::corrections;
use super::refine::Refined;
use super::steps::are_too_long;

/// What trackers of rendered films leave, along or across the rope (px), and the residual from
/// which it is pointed out.
const TRACKER_PX: f64 = 0.4;
const RESIDUAL_PX: f64 = 3.0 * TRACKER_PX;
/// Deviations of a correction of the camera beyond which it is no longer the camera's error.
const CAMERA_DEVIATIONS: f64 = 3.0;
/// Part of the clock's window beyond which its end may have stopped the fit.
const CLOCK_PART: f64 = 0.95;
/// Variance by which parts of a film may disagree more than its noise explains.
pub(super) const INFLATION_MAX: f64 = 5.0;

/// Warnings for a person, each with what to do.
pub(super) fn warnings(fit: &Refined, film: &Film<'_>, clock: ClockWindow) -> Vec<String> {
    let measure = match film.options.length_m {
        None => "measure the rope's length (--length), or film a gentler wiggle",
        Some(_) => "check the length that was given (--length), or film a gentler wiggle",
    };
    let sizes = fit.noise.axes.iter().map(|axis| axis.sigma_px);
    let residual_px = sizes.fold(0.0, f64::max);
    let residual = (residual_px > RESIDUAL_PX).then(|| {
        format!("the best rope leaves {residual_px:.1} px of the keypoints unexplained, where a tracker leaves about {TRACKER_PX} px: {measure}")
    });
    let (camera, std) = (corrections(&fit.x), film.options.camera_std());
    let deviations = (0..CORRECTIONS).map(|i| camera[i].abs() / std[i]);
    let farthest = deviations.fold(0.0, f64::max);
    let camera = (farthest > CAMERA_DEVIATIONS).then(|| {
        format!("the film fits only a camera {farthest:.1} standard deviations from where its file says it stands: find its place again (`wag calib extrinsics`); if that is right, {measure}")
    });
    let off_s = fit.x[CLOCK] - clock.offset_s;
    let clock = (off_s.abs() > CLOCK_PART * clock.half_width_s).then(|| {
        format!("the clocks of arm and camera are {:.0} ms apart, which is the end of what was looked for: check that film and joints are of the same motion", 1e3 * fit.x[CLOCK])
    });
    let disagree = (fit.inflation > INFLATION_MAX).then(|| {
        format!("parts of the film contradict each other {:.0} times more than its noise explains (standard deviations): the rope does something that the model does not know; {measure}", fit.inflation.sqrt())
    });
    let rival = fit.rival_length_m.map(|rival_m| {
        format!(
            "ropes of {:.1} and {:.1} cm explain the film about equally well: {measure}",
            100.0 * fit.x[LENGTH],
            100.0 * rival_m
        )
    });
    let steps = are_too_long(fit).then(|| {
        "the simulation's steps are too long for a rope this slack and heavy, and its parameters depend on them: set a smaller `step_s` in the table `identify` of the planner's configuration".to_owned()
    });
    let all = [residual, camera, clock, disagree, rival, steps];
    all.into_iter().flatten().collect()
}

/// How far the rope would be elsewhere (m) if the camera were no farther off than it can be, and
/// half of what another length that fits as well differs by.
pub(super) fn absorbed_m(fit: &Refined, film: &Film<'_>) -> f64 {
    let (camera, std) = (corrections(&fit.x), film.options.camera_std());
    // The point looked at stays: a camera elsewhere shows by parallax and size only, one that is
    // turned by as much as the rope is long.
    let length_m = fit.x[LENGTH];
    let parallax = length_m / film.viewer.depth_m();
    let lever = [parallax, parallax, parallax, 1.0, 1.0, length_m];
    let beyond = |i: usize| {
        let excess = (camera[i].abs() - CAMERA_DEVIATIONS * std[i]).max(0.0);
        (excess * lever[i]).powi(2)
    };
    let camera_m2: f64 = (0..CORRECTIONS).map(beyond).sum();
    let rival_m = fit.rival_length_m.map_or(0.0, |m| (m - length_m) / 2.0);
    (camera_m2 + rival_m.powi(2)).sqrt()
}
