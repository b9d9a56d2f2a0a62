use super::super::{
    Dimensions, PlanOptions, PlanRequest, PosteriorEnsemble, ThrowGoal, plan, simulator_for,
};
use super::*;
use crate::PlannerConfig;
use crate::ropes::{random_strike_target, trial_rope};
use arm_model::Limits;
use arm_model::limits::LimitsSpec;
use shared_types::{Plan, Task};
use std::ops::ControlFlow;

/// A strike planned with default options but for these.
fn strike(index: u64, options: PlanOptions) -> (PlanRequest, Plan) {
    let goal = PlannerConfig::default().goal(Task::Strike, random_strike_target(index));
    let request = PlanRequest::new(goal, &trial_rope(9_201, index), options);
    let planned = plan(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    (request, planned)
}

#[test]
fn strikes_of_unknown_ropes_are_planned_without_a_search_and_keep_every_limit() {
    for index in 0..6 {
        let (request, planned) = strike(index, PlanOptions::default());
        assert!(
            planned.simulations < 250,
            "{} simulations",
            planned.simulations
        );
        assert!(planned.predicted_error_m < 1e-3 && planned.verdict.success);
        assert_eq!(request.limits.worst_violation(&planned.trajectory), None);
        let one = PlanOptions {
            threads: 1,
            ..request.options
        };
        assert_eq!(strike(index, one).1, planned);
    }
}

/// In a cell that the library's throws were not made in, by an independent simulation.
#[test]
fn a_longer_pole_and_a_raised_floor_are_kept_clear_of() {
    let mut strikes = 0;
    for index in 10..16 {
        let (mut request, _) = strike(index, PlanOptions::default());
        request.cell.pole.length_m += 0.02;
        request.cell.floor_z_m = -0.6;
        let Ok(planned) = plan(&request, &mut |_| ControlFlow::Continue(())) else {
            continue;
        };
        let task = request.goal.task();
        let simulator = simulator_for(task, &request.rope, &request.cell, &request.options);
        let throws = [(&request.rope, &planned.trajectory)];
        let outcome = simulator.exact().run(&throws).unwrap().remove(0);
        if planned.simulations < 250 {
            strikes += 1;
            assert!(
                outcome.contacts.none() && outcome.closest_m < 1e-3,
                "{outcome:?}"
            );
        }
    }
    assert!(strikes > 0, "the library was of no use in this cell");
}

#[test]
fn what_the_library_has_no_throws_for_is_searched_for() {
    let small = PlanOptions {
        population: 24,
        generations: Some(4),
        searches: 1,
        ..PlanOptions::default()
    };
    let searched = |request: &PlanRequest| {
        // The library asks whether to go on once, a search after each generation.
        let mut asked = 0;
        let planned = plan(request, &mut |progress| {
            asked += usize::from(progress.total > 1);
            ControlFlow::Continue(())
        });
        planned.unwrap();
        asked > 0
    };
    let (request, planned) = strike(1, small);
    assert!(!planned.interrupted && !searched(&request));
    // Interrupted at once, it is what one generation found.
    let broken = plan(&request, &mut |_| ControlFlow::Break(())).unwrap();
    assert!(broken.interrupted);
    let ensemble = PosteriorEnsemble {
        optimised: vec![request.rope],
        ..PosteriorEnsemble::default()
    };
    assert!(searched(&PlanRequest {
        ensemble,
        ..request.clone()
    }));
    let none = PlanOptions {
        library_candidates: 0,
        ..small
    };
    let full = PlanOptions {
        dimensions: Dimensions::Full,
        ..small
    };
    let stretched = PlanOptions {
        segment_stretch_max: 1.3,
        ..small
    };
    // No throw is as good.
    let better = PlanOptions {
        good_enough_m: 1e-12,
        ..small
    };
    for options in [none, full, stretched, better] {
        assert!(searched(&PlanRequest {
            options,
            ..request.clone()
        }));
    }
    let ThrowGoal::Strike(mut slower) = request.goal.clone() else {
        panic!("{:?}", request.goal);
    };
    slower.config.waypoint_times_s[2] = 1.3;
    let goal = ThrowGoal::Strike(slower);
    assert!(searched(&PlanRequest {
        goal,
        ..request.clone()
    }));
    // Limits that no throw of the library keeps.
    let built_in = Limits::default();
    let slow = LimitsSpec {
        velocity_max_rad_s: built_in.velocity_max_rad_s * 0.1,
        ..(*built_in).clone()
    };
    let limits = Limits::try_from(slow).unwrap();
    assert!(searched(&PlanRequest { limits, ..request }));
}

fn kept(rope: &RopeParams, tip_mm: &[[i16; 2]]) -> StoredThrow {
    StoredThrow {
        rope: rope.to_array().map(|v| v as f32),
        waypoints_rad: [[f32::from(tip_mm[0][0]); PLANAR]; WAYPOINTS],
        tip_mm: tip_mm.to_vec(),
    }
}

#[test]
fn the_nearest_tips_of_like_ropes_come_first() {
    let rope = trial_rope(9_201, 0);
    let longer = RopeParams {
        length_m: rope.length_m + 0.1,
        ..rope
    };
    // The segment passes 30 mm beside the target, though both its ends are far.
    let beside = kept(&rope, &[[400, 230], [1400, 230]]);
    let near = kept(&rope, &[[880, 0], [880, 190]]);
    let of_longer = kept(&longer, &[[900, 0], [900, 400]]);
    let library = ThrowLibrary {
        version: String::new(),
        options: LibraryOptions {
            seed: 0,
            searches: 3,
            kept: 1,
        },
        times_s: [0.4, 0.8, 1.1],
        period_s: 0.03,
        throws: vec![of_longer, beside, near],
    };
    let first = |count| -> Vec<f64> {
        let found = library.nearest(&rope, [0.9, 0.2], count);
        found.iter().map(|x| x[0]).collect()
    };
    assert_eq!(first(9), [880.0, 400.0, 900.0]);
    assert_eq!(first(2), [880.0, 400.0]);
    assert_eq!(first(0), [0.0; 0]);
    assert!((library.throws[1].tip_distance_m([0.9, 0.2]) - 0.03).abs() < 1e-12);
    let bytes = library.to_bytes().unwrap();
    assert_eq!(ThrowLibrary::from_bytes(&bytes).unwrap(), library);
    assert!(ThrowLibrary::from_bytes(&bytes[..bytes.len() - 1]).is_err());
    assert!(ThrowLibrary::from_bytes(b"").is_err());
}

#[test]
fn the_librarys_throws_are_throws_of_the_ranges() {
    let library = ThrowLibrary::embedded().unwrap();
    assert!(library.len() > 1000);
    for throw in &library.throws {
        for (value, range) in throw.rope.iter().zip(&RANGES) {
            let near = |end: f64| (f64::from(*value) - end).abs() < 1e-6 * end;
            let (low, high) = (range.min, range.max);
            assert!((low..=high).contains(&f64::from(*value)) || near(low) || near(high));
        }
        assert!(throw.tip_mm.len() > 40);
    }
}

#[test]
fn the_same_options_make_the_same_library_whatever_the_threads() {
    let options = LibraryOptions {
        seed: 3,
        searches: 1,
        kept: 5,
    };
    let make = |threads| ThrowLibrary::make(options, threads, &mut |_| ControlFlow::Continue(()));
    let library = make(1).unwrap();
    assert_eq!(library.len(), 5);
    assert_eq!(make(2).unwrap(), library);
    // A tip that hangs from the pole, at first.
    let (rope, tip) = (&library.throws[0].rope, library.throws[0].tip_mm[0]);
    assert!(
        (f64::from(tip[0]) - 663.0).abs() < 20.0,
        "{tip:?} of {rope:?}"
    );
}
