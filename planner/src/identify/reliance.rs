//! What speaks against relying on a fit: errors that went into other numbers than the residual.
//!
//! What the model leaves out is taken up by whatever can move. A camera far from where its file
//! says, clocks at the end of what is looked for, parts of the film that contradict each other and
//! starts that end elsewhere each show it; forecasts count their metres as unexplained.

use super::camera_pose::CORRECTIONS;
use super::clock::ClockWindow;
use super::coordinates::{CLOCK, LENGTH};
use super::film::{Fidelity, Film};
use super::linear::corrections;
use super::refine::Refined;

/// Residual along or across the rope (px) from which it is pointed out: three times what trackers
/// of rendered films leave.
const RESIDUAL_PX: f64 = 1.2;
/// Deviations of the camera's corrections beyond which they are none of the camera.
const CAMERA_DEVIATIONS: f64 = 3.0;
/// Part of the clock's window beyond which its end may have stopped the fit.
const CLOCK_PART: f64 = 0.95;
/// Variance by which parts of a film may disagree more than its noise explains; films of ropes
/// that the model describes stay below 4.
pub(super) const INFLATION_MAX: f64 = 5.0;
/// Part of the keypoints that a fit should have seen.
const SEEN_MIN: f64 = 0.7;

/// Warnings for a person, each with a remedy.
pub(super) fn warnings(fit: &Refined, film: &Film<'_>, clock: ClockWindow) -> Vec<String> {
    let sizes = fit.noise.axes.iter().map(|axis| axis.sigma_px);
    let residual_px = sizes.fold(0.0, f64::max);
    let residual = (residual_px > RESIDUAL_PX).then(|| {
        format!("the best rope leaves {residual_px:.1} px of the keypoints unexplained, three times what a tracker does: film a gentler wiggle, or measure the length (--length)")
    });
    let (camera, std) = (corrections(&fit.x), film.options.camera_std());
    let deviations = (0..CORRECTIONS).map(|i| camera[i].abs() / std[i]);
    let farthest = deviations.fold(0.0, f64::max);
    let camera = (farthest > CAMERA_DEVIATIONS).then(|| {
        format!("the film fits only a camera {farthest:.1} standard deviations from where its file says it stands: find its place again (`wag calib extrinsics`), or measure the rope's length (--length)")
    });
    let off_s = fit.x[CLOCK] - clock.offset_s;
    let clock = (off_s.abs() > CLOCK_PART * clock.half_width_s).then(|| {
        format!("the clocks of arm and camera are {:.0} ms apart, which is the end of what was looked for: check that film and joints are of the same motion", 1e3 * fit.x[CLOCK])
    });
    let disagree = (fit.inflation > INFLATION_MAX).then(|| {
        format!("parts of the film contradict each other {:.0} times more than its noise explains: the rope does something that the model does not know; film a gentler wiggle", fit.inflation.sqrt())
    });
    let rival = fit.rival_length_m.map(|rival_m| {
        format!("ropes of {:.1} and {:.1} cm explain the film equally well: measure the length (--length)", 100.0 * fit.x[LENGTH], 100.0 * rival_m)
    });
    let cells = &film.grid(Fidelity::Fine).cells;
    let seen = cells.iter().flatten().count() as f64 / cells.len().max(1) as f64;
    let seen = (seen < SEEN_MIN).then(|| {
        format!("only {:.0} % of the keypoints were seen: film the rope before a wall without clutter, all of it in the picture", 100.0 * seen)
    });
    let all = [residual, camera, clock, disagree, rival, seen];
    all.into_iter().flatten().collect()
}

/// What a fit does not explain (m, root mean square): its residual, the camera's corrections as
/// far as they are none of the camera's, and half of what ropes that fit equally differ by.
pub(super) fn unexplained_m(fit: &Refined, film: &Film<'_>) -> f64 {
    let (camera, std) = (corrections(&fit.x), film.options.camera_std());
    // The roll turns the rope about the point looked at.
    let lever_m = |i: usize| {
        if i + 1 == CORRECTIONS {
            fit.x[LENGTH]
        } else {
            1.0
        }
    };
    let beyond = |i: usize| {
        let excess = (camera[i].abs() - CAMERA_DEVIATIONS * std[i]).max(0.0);
        (excess * lever_m(i)).powi(2)
    };
    let camera_m2: f64 = (0..CORRECTIONS).map(beyond).sum();
    let rival_m = fit
        .rival_length_m
        .map_or(0.0, |m| (m - fit.x[LENGTH]) / 2.0);
    let residual_m = fit.at.distance_px * film.viewer.pixel_m();
    (residual_m.powi(2) + camera_m2 + rival_m.powi(2)).sqrt()
}
