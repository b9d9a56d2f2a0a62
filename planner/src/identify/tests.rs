//! Parts of a fit, on films without noise by a camera whose place is known.

use super::budget::Budget;
use super::coordinates::{
    CAMERA, CLOCK, DAMPING, LEAD_RADIUS, LENGTH, LINKS, PLAIN, Point, Reach, STIFFNESS, Square,
    parameter, point_of,
};
use super::film::{Fidelity, Film};
use super::fit::Fit;
use super::noise::{Noise, RESIDUAL};
use super::offsets;
use super::options::IdentifyOptions;
use super::out_of_distribution::out_of_distribution;
use super::posterior::posterior;
use super::refine::{Refined, refine};
use super::reliance;
use super::steps::short_enough;
use crate::observation::{Appearance, Observation, ObservedPoints};
use crate::ropes::{random_rope, trial_rope};
use crate::synthetic::{FilmNoise, FilmTiming, film, side_camera};
use crate::wiggle::{WiggleConfig, wiggling_arm};
use arm_model::{JointTrajectory, Pole};
use rope_sim::PlannedArm;
use shared_types::RopeParams;
use shared_types::rope::RANGES;
use std::ops::ControlFlow;

fn with_film<T>(rope: &RopeParams, look: impl FnOnce(Film<'_>, &mut Budget<'_>) -> T) -> T {
    let arm = wiggling_arm(&WiggleConfig::default()).unwrap();
    with_film_of(&arm, &FilmTiming::default(), rope, look)
}

/// A film of a rope that an arm moves.
fn with_film_of<T>(
    arm: &PlannedArm,
    timing: &FilmTiming,
    rope: &RopeParams,
    look: impl FnOnce(Film<'_>, &mut Budget<'_>) -> T,
) -> T {
    let camera = side_camera();
    let filmed = film(rope, arm, &camera, 24, timing, &FilmNoise::default()).unwrap();
    let observation = Observation {
        track: &filmed.track,
        points: ObservedPoints::ArcLength,
        camera: &camera,
        motion: arm,
        appearance: Appearance::default(),
    };
    let options = IdentifyOptions {
        camera_position_std_m: 1e-4,
        camera_look_at_std_m: 1e-4,
        camera_roll_std_rad: 1e-4,
        ..IdentifyOptions::default()
    };
    let mut budget = Budget {
        simulations: 0,
        steps: 0,
        steps_max: 30,
        progress: &mut |_| ControlFlow::Continue(()),
    };
    look(Film::new(&observation, &options), &mut budget)
}

fn refined(film: &Film<'_>, reach: Reach, start: &Point, budget: &mut Budget<'_>) -> Refined {
    let coordinates = film.coordinates(film.clock_window(), reach);
    refine(film, &coordinates, start, 0.1, budget).unwrap()
}

/// A slack rope of 0.2 kg/m.
fn slack_rope() -> RopeParams {
    RopeParams {
        joint_stiffness_nm_per_rad: 1e-3,
        joint_damping_nms_per_rad: 4e-4,
        mass_per_length_kg_per_m: 0.2,
        lead_mass_kg: 0.02,
        ..trial_rope(2, 8)
    }
}

/// A plain fit from the rope's own parameters on: how far it ends from them, and in which steps (s).
fn fitted(rope: &RopeParams) -> (Point, f64) {
    let arm = wiggling_arm(&WiggleConfig::default()).unwrap();
    fitted_to(&arm, &FilmTiming::default(), rope)
}

/// The same to a film of another motion.
fn fitted_to(arm: &PlannedArm, timing: &FilmTiming, rope: &RopeParams) -> (Point, f64) {
    let truth = point_of(rope);
    with_film_of(arm, timing, rope, |mut film, budget| {
        let found = short_enough(&mut film, |film, from| {
            let start = from.map_or(&truth, |from| &from.x);
            Ok(refined(film, Reach::Wide, start, budget))
        });
        (found.unwrap().x - truth, film.options.step_s)
    })
}

/// The check is part of every fit.
#[test]
fn a_fit_goes_on_in_shorter_steps_where_it_must() {
    with_film(&slack_rope(), |film, _| {
        let clock = film.clock_window();
        let coordinates = film.coordinates(clock, Reach::Wide);
        let go_on = &mut |_| ControlFlow::Continue(());
        let mut fit = Fit {
            film,
            clock,
            budget: Budget {
                simulations: 0,
                steps: 0,
                steps_max: 30,
                progress: go_on,
            },
        };
        let start = point_of(&slack_rope());
        fit.refine(&coordinates, &start, 0.1).unwrap();
        assert!(fit.film.options.step_s < IdentifyOptions::default().step_s);
    });
}

#[test]
fn a_slack_heavy_rope_is_fitted_in_shorter_steps_and_a_rope_of_the_ranges_is_not() {
    let (_, step_s) = fitted(&trial_rope(2, 9));
    assert_eq!(step_s, IdentifyOptions::default().step_s);
    let (off, step_s) = fitted(&slack_rope());
    assert!(step_s < IdentifyOptions::default().step_s);
    // In the usual steps 3 % of stiffness and damping.
    assert!(off[LENGTH].abs() < 1e-3, "{off}");
    assert!(
        off[STIFFNESS].abs() < 0.015 && off[DAMPING].abs() < 0.015,
        "{off}"
    );
}

/// The steps are chosen for the motion that was filmed, whichever it is. So short a film tells the
/// parameters less well.
#[test]
fn a_throw_is_fitted_in_the_steps_that_it_needs() {
    let start = wiggling_arm(&WiggleConfig::default())
        .unwrap()
        .trajectory()
        .start();
    let knots = [0.0, 0.5, -0.4, 0.0].map(|swing| {
        let mut q = start;
        q[1] += 0.6 * swing;
        q[3] -= swing;
        q
    });
    let trajectory = JointTrajectory::new(&[0.0, 0.35, 0.7, 1.1], &knots).unwrap();
    let arm = PlannedArm::new(trajectory, Pole::default());
    let timing = FilmTiming {
        frames: 80,
        ..FilmTiming::default()
    };
    let usual_s = IdentifyOptions::default().step_s;
    let rope = trial_rope(2, 9);
    let (_, step_s) = fitted_to(&arm, &timing, &rope);
    assert_eq!(step_s, usual_s);
    let (_, thrown_s) = fitted_to(&arm, &timing, &slack_rope());
    assert!(thrown_s < usual_s, "{thrown_s}");
}

/// What went into other numbers than the residual is said, and counts as unexplained.
#[test]
fn what_speaks_against_a_fit_is_said_and_counted() {
    let rope = random_rope(4);
    with_film(&rope, |film, budget| {
        let fit = refined(&film, Reach::Ranges, &point_of(&rope), budget);
        let clock = film.clock_window();
        let said = |fit: &Refined| reliance::warnings(fit, &film, clock).join("; ");
        let absorbed_m = |fit: &Refined| reliance::absorbed_m(fit, &film);
        assert_eq!((said(&fit), absorbed_m(&fit)), (String::new(), 0.0));
        let (position_m, look_at_m) = (
            film.options.camera_position_std_m,
            film.options.camera_look_at_std_m,
        );
        let mut moved = fit.clone();
        moved.x[CAMERA] = 2.0 * position_m;
        assert_eq!((said(&moved), absorbed_m(&moved)), (String::new(), 0.0));
        moved.x[CAMERA] = 5.0 * position_m;
        assert!(said(&moved).contains("a camera 5.0 standard deviations"));
        let parallax_m = 2.0 * position_m * fit.x[LENGTH] / film.viewer.depth_m();
        assert!((absorbed_m(&moved) - parallax_m).abs() < 1e-12);
        moved.x[CAMERA + 3] = -5.0 * look_at_m;
        let both_m = parallax_m.hypot(2.0 * look_at_m);
        assert!((absorbed_m(&moved) - both_m).abs() < 1e-12);
        let mut late = fit.clone();
        late.x[CLOCK] = clock.offset_s - clock.half_width_s;
        assert!(said(&late).contains("clocks of arm and camera"));
        let noisy = Refined {
            noise: Noise::white(1.6),
            ..fit.clone()
        };
        assert!(said(&noisy).contains("1.6 px of the keypoints"));
        let torn = Refined {
            inflation: 36.0,
            ..fit.clone()
        };
        assert!(said(&torn).contains("contradict each other 6 times"));
        let other = Refined {
            rival_length_m: Some(fit.x[LENGTH] + 0.04),
            ..fit.clone()
        };
        assert!(said(&other).contains("explain the film about equally well"));
        assert!((absorbed_m(&other) - 0.02).abs() < 1e-12);
        let slack = Refined {
            moved_px: 0.5,
            ..fit.clone()
        };
        assert!(said(&slack).contains("steps are too long"));
    });
}

/// A rope outside the ranges stays outside when its film contradicts itself.
#[test]
fn a_film_that_contradicts_itself_does_not_make_its_rope_likelier() {
    let rope = RopeParams {
        length_m: RANGES[parameter::LENGTH].max + 0.05,
        ..random_rope(2)
    };
    with_film(&rope, |film, budget| {
        let mut fit = refined(&film, Reach::Wide, &point_of(&rope), budget);
        assert!(out_of_distribution(&fit).is_flagged());
        fit.inflation = 1e4;
        assert!(out_of_distribution(&fit).is_flagged());
    });
}

/// A rope a centimetre longer than the ranges know, whose film seems to contradict itself:
/// all within the ranges is a centimetre off, but not unlikely.
#[test]
fn a_film_that_contradicts_itself_still_gets_the_rope_that_fits_it() {
    let rope = RopeParams {
        length_m: RANGES[parameter::LENGTH].max + 0.01,
        ..random_rope(2)
    };
    with_film(&rope, |film, budget| {
        let mut fit = refined(&film, Reach::Ranges, &point_of(&rope), budget);
        for inflation in [1.0, 1e3, 1e4, 1e5] {
            fit.inflation = inflation;
            let (params, posterior) = posterior(&fit, &film);
            let off_m = params.length_m - rope.length_m;
            assert!(off_m.abs() < 1e-3, "{inflation}: {off_m}");
            let is_within = posterior.interval_90[parameter::LENGTH][1] < 0.65;
            assert_eq!(is_within, (1e3..=1e4).contains(&inflation));
        }
    });
}

/// A tip of 5 g on a heavy rope: its radius hardly shows, and follows a link count that no
/// rope of the ranges has.
#[test]
fn every_reported_rope_can_be_one() {
    let rope = RopeParams {
        mass_per_length_kg_per_m: 0.082,
        length_m: 0.55,
        lead_mass_kg: 0.005,
        ..random_rope(1)
    };
    with_film(&rope, |film, budget| {
        let mut fit = refined(&film, Reach::Wide, &point_of(&rope), budget);
        (fit.x[LINKS], fit.x[LEAD_RADIUS]) = (32.0, 0.003);
        (
            fit.covariance[(LINKS, LINKS)],
            fit.covariance[(LEAD_RADIUS, LEAD_RADIUS)],
        ) = (4.0, 4e-4);
        for (i, k) in [(LINKS, LEAD_RADIUS), (LEAD_RADIUS, LINKS)] {
            fit.covariance[(i, k)] = 0.9 * 2.0 * 0.02;
        }
        let (params, posterior) = posterior(&fit, &film);
        assert!(params.validate().is_ok(), "{params:?}");
        assert!((params.length_m - rope.length_m).abs() < 2e-3, "{params:?}");
        assert!(posterior.interval_90[parameter::LEAD_RADIUS][0] > 0.0);
    });
}

/// What errors that last add is how far the fit moves when each keypoint in turn, along and
/// across the rope, is off all through the film.
#[test]
fn lasting_errors_widen_a_fit_by_how_far_they_move_it() {
    const OFFSET_PX: f64 = 0.05;
    let rope = random_rope(3);
    with_film(&rope, |film, budget| {
        let fit = refined(&film, Reach::Ranges, &point_of(&rope), budget);
        let coordinates = film.coordinates(film.clock_window(), Reach::Ranges);
        let noise = Noise::white(0.3);
        let at = |rows| {
            let mut at = fit.at.clone();
            at.rows = rows;
            at.normal(&film, Fidelity::Fine, &noise)
        };
        let still = at(fit.at.rows.clone());
        let information = still.information + coordinates.prior_information();
        let covariance = information.cholesky().unwrap().inverse();
        let keypoints = film.grid(Fidelity::Fine).keypoints;
        let mut moved = Square::zeros();
        for keypoint in 0..keypoints {
            for axis in 0..2 {
                let mut rows = fit.at.rows.clone();
                for row in rows.iter_mut().skip(keypoint).step_by(keypoints).flatten() {
                    row[axis][RESIDUAL] += OFFSET_PX;
                }
                let step = covariance * (at(rows).gradient - still.gradient);
                moved += step * step.transpose();
            }
        }
        let of = |std_px| {
            let rows = (&fit.at.rows, PLAIN);
            offsets::covariance(rows, &covariance, &film, &noise, std_px)
        };
        let found = of(OFFSET_PX);
        assert!(moved[(LENGTH, LENGTH)] > 0.0);
        assert!(
            (found - moved).norm() < 0.01 * moved.norm(),
            "{found} {moved}"
        );
        assert_eq!(of(0.0), Square::zeros());
        assert!(fit.lasting[(LENGTH, LENGTH)] > 0.0);
    });
}
