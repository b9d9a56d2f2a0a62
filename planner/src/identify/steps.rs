//! Whether the refinement's steps are short enough for the rope that was found.
//!
//! Steps that suit a wiggle of the ropes of the ranges are too long for a slack heavy rope,
//! and may be for a throw. The rope found tells: simulated in half the steps it must move as
//! before.

use super::coordinates::{CLOCK, Point, nearest_links, simulated_rope};
use super::error::IdentifyError;
use super::film::{Fidelity, Film, Instant, sample_s};
use super::linear::corrections;
use super::refine::Refined;
use crate::workers::map_in_order;
use rope_sim::{Candidate, NodeTrack, Outcome, SimOptions, roll_out};

/// Root mean square distance (px) by which keypoints may move with the step halved: a quarter
/// of what trackers leave, fifty times what a rope of the ranges moves.
const MOVED_MAX_PX: f64 = 0.1;
/// Most times that the steps are halved.
const HALVINGS_MAX: usize = 3;

/// A fit in steps that are short enough for what it finds: where they are not, the film's are
/// halved, and the fit goes on from where it was.
pub(super) fn short_enough(
    film: &mut Film<'_>,
    mut fit: impl FnMut(&Film<'_>, Option<&Refined>) -> Result<Refined, IdentifyError>,
) -> Result<Refined, IdentifyError> {
    let mut found = fit(film, None)?;
    for halvings in 0..=HALVINGS_MAX {
        found.moved_px = moved_px(film, &found.x)?;
        if !are_too_long(&found) || halvings == HALVINGS_MAX {
            break;
        }
        film.options.step_s /= 2.0;
        film.options.search_step_s /= 2.0;
        found = fit(film, Some(&found))?;
    }
    Ok(found)
}

/// Whether the steps of a fit are too long for what it found, however often they were halved.
pub(super) fn are_too_long(fit: &Refined) -> bool {
    fit.moved_px > MOVED_MAX_PX
}

/// Root mean square distance (px) by which keypoints move with the step halved; infinite where
/// one of the two could not be simulated as asked for.
pub(super) fn moved_px(film: &Film<'_>, x: &Point) -> Result<f64, IdentifyError> {
    let rope = simulated_rope(x, nearest_links(x));
    let options = film.sim_options(Fidelity::Fine);
    let simulate = |step_s: &f64| {
        let candidate = Candidate::new(&rope, film.observation.motion);
        let step_s = *step_s;
        roll_out(&[candidate], &SimOptions { step_s, ..options }).map(|mut r| r.remove(0))
    };
    let steps_s = [options.step_s, options.step_s / 2.0];
    let both = map_in_order(&steps_s, options.threads, simulate);
    let both = both.into_iter().collect::<Result<Vec<_>, _>>()?;
    let (usual, finer) = (&both[0], &both[1]);
    Ok(match (usual.outcome, finer.outcome) {
        (Outcome::Clean, Outcome::Clean) => apart_px(film, x, &usual.nodes, &finer.nodes),
        // What blew up was simulated in other steps than asked for, if at all.
        _ => f64::INFINITY,
    })
}

/// Root mean square distance (px) of the keypoints of two simulations.
fn apart_px(film: &Film<'_>, x: &Point, a: &NodeTrack, b: &NodeTrack) -> f64 {
    let view = film.viewer.view(&corrections(x));
    let cells = film.grid(Fidelity::Fine).cells.iter().flatten();
    let distances2 = cells.filter_map(|detection| {
        let time_s = detection.time_s - x[CLOCK];
        let now = Instant::new(time_s, sample_s(Fidelity::Fine), a.frames());
        let [ua, va] = view.project(&now.position(a, detection.along))?;
        let [ub, vb] = view.project(&now.position(b, detection.along))?;
        Some((ua - ub).powi(2) + (va - vb).powi(2))
    });
    let (sum, count) = distances2.fold((0.0, 0.0), |(sum, n), d2| (sum + d2, n + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}
