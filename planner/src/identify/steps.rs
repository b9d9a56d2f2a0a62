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
    for _ in 0..HALVINGS_MAX {
        if moved_px(film, &found.x)? <= MOVED_MAX_PX {
            break;
        }
        film.options.step_s /= 2.0;
        film.options.search_step_s /= 2.0;
        found = fit(film, Some(&found))?;
    }
    Ok(found)
}

/// Root mean square distance (px) by which keypoints move with the step halved; 0 where the
/// rope cannot be simulated in half the steps either.
fn moved_px(film: &Film<'_>, x: &Point) -> Result<f64, IdentifyError> {
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
        (_, Outcome::Diverged) => 0.0,
        (Outcome::Clean, _) => apart_px(film, x, &usual.nodes, &finer.nodes),
        // What blew up was simulated in other steps than asked for.
        _ => f64::INFINITY,
    })
}

/// Root mean square distance (px) of the keypoints of two simulations.
fn apart_px(film: &Film<'_>, x: &Point, a: &NodeTrack, b: &NodeTrack) -> f64 {
    let view = film.viewer.view(&corrections(x));
    let cells = film.grid(Fidelity::Fine).cells.iter().flatten();
    let distances2 = cells.filter_map(|sighting| {
        let time_s = sighting.time_s - x[CLOCK];
        let now = Instant::new(time_s, sample_s(Fidelity::Fine), a.frames());
        let [ua, va] = view.project(&now.position(a, sighting.along))?;
        let [ub, vb] = view.project(&now.position(b, sighting.along))?;
        Some((ua - ub).powi(2) + (va - vb).powi(2))
    });
    let (sum, count) = distances2.fold((0.0, 0.0), |(sum, n), d2| (sum + d2, n + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::budget::Budget;
    use super::super::clock::ClockWindow;
    use super::super::coordinates::{DAMPING, LENGTH, Reach, STIFFNESS, point_of};
    use super::super::options::IdentifyOptions;
    use super::super::refine::refine;
    use super::*;
    use crate::observation::{Appearance, Observation, ObservedPoints};
    use crate::ropes::trial_rope;
    use crate::synthetic::{FilmNoise, FilmTiming, film, side_camera};
    use crate::wiggle::{WiggleConfig, wiggling_arm};
    use shared_types::RopeParams;
    use std::ops::ControlFlow;

    /// The fit of a rope filmed without noise, from its own parameters on: how far it ends from
    /// them, and in which steps (s).
    fn fitted(rope: &RopeParams) -> (Point, f64) {
        let (arm, camera) = (
            wiggling_arm(&WiggleConfig::default()).unwrap(),
            side_camera(),
        );
        let (timing, noise) = (FilmTiming::default(), FilmNoise::default());
        let filmed = film(rope, &arm, &camera, 24, &timing, &noise).unwrap();
        let observation = Observation {
            track: &filmed.track,
            points: ObservedPoints::ArcLength,
            camera: &camera,
            motion: &arm,
            appearance: Appearance::default(),
        };
        let mut film = Film::new(&observation, &IdentifyOptions::default());
        let clock = ClockWindow {
            offset_s: 0.0,
            half_width_s: 0.01,
        };
        let coordinates = film.coordinates(clock, Reach::Wide);
        let mut budget = Budget {
            simulations: 0,
            steps: 0,
            steps_max: 30,
            progress: &mut |_| ControlFlow::Continue(()),
        };
        let truth = point_of(rope);
        let found = short_enough(&mut film, |film, from| {
            let start = from.map_or(&truth, |from| &from.x);
            refine(film, &coordinates, start, 0.1, &mut budget)
        });
        let found = found.unwrap();
        (found.x - truth, film.options.step_s)
    }

    #[test]
    fn a_slack_heavy_rope_is_fitted_in_shorter_steps_and_a_rope_of_the_ranges_is_not() {
        let (_, step_s) = fitted(&trial_rope(2, 9));
        assert_eq!(step_s, IdentifyOptions::default().step_s);
        let slack = RopeParams {
            joint_stiffness_nm_per_rad: 1e-3,
            joint_damping_nms_per_rad: 4e-4,
            mass_per_length_kg_per_m: 0.2,
            lead_mass_kg: 0.02,
            ..trial_rope(2, 8)
        };
        let (off, step_s) = fitted(&slack);
        assert!(step_s < IdentifyOptions::default().step_s);
        // In the usual steps 3 % of stiffness and damping.
        assert!(off[LENGTH].abs() < 1e-3, "{off}");
        assert!(
            off[STIFFNESS].abs() < 0.015 && off[DAMPING].abs() < 0.015,
            "{off}"
        );
    }
}
