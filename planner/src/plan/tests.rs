use super::*;
use crate::PlannerConfig;
use crate::collide::ContactCounts;
use crate::ropes::random_rope;
use setup::Setup;
use shared_types::Task;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// A small search for a strike.
pub(super) fn request(target_m: [f64; 3]) -> PlanRequest {
    let goal = PlannerConfig::default().goal(Task::Strike, target_m);
    let options = PlanOptions {
        population: 24,
        generations: Some(12),
        searches: 1,
        library_candidates: 0,
        ..PlanOptions::default()
    };
    PlanRequest::new(goal, &random_rope(11), options)
}

fn go_on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn fitness_is_the_sum_of_its_named_terms() {
    let r = request([0.9, 0.0, 0.2]);
    let setup = Setup::new(r.goal.task(), &r).unwrap();
    let rest = setup.space.decode(&setup.space.resting()).unwrap();
    let outcome = ThrowOutcome {
        closest_m: 0.25,
        closest_s: 0.7,
        contacts: ContactCounts {
            rope_robot: 3,
            pole_robot: 2,
            base_region: 1,
        },
        finite: true,
        ..ThrowOutcome::default()
    };
    let got = setup.fitness(&r.rope, &rest, &outcome);
    let want = 0.25 - 1.0 / 1.25 + 3.0 * 0.02 + 2.0 * 0.1 + 0.2;
    assert!((got - want).abs() < 1e-12);
    let mut x = setup.space.resting();
    x[0] += 0.2;
    let moved = setup.space.decode(&x).unwrap();
    assert!((setup::joint_motion_rad(&moved) - 0.4).abs() < 1e-12);
    let lost = ThrowOutcome {
        finite: false,
        ..outcome
    };
    assert!(setup.fitness(&r.rope, &rest, &lost) > 100.0);
}

/// A small search alone ends centimetres away; polished it meets the target.
#[test]
fn a_small_search_is_polished_onto_the_target_and_keeps_every_limit() {
    let mut generations = 0;
    let mut r = request([0.95, 0.25, 0.1]);
    let found = plan(&r, &mut |p| {
        generations = p.done;
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(
        found.predicted_error_m < 5e-4,
        "{}",
        found.predicted_error_m
    );
    assert_eq!(found.limited_by, Some(shared_types::LimitedBy::Nothing));
    assert!(found.verdict.success && !found.interrupted);
    assert_eq!(generations, 12);
    assert!(found.margins.iter().all(|m| m.left >= 0.0));
    assert_eq!(found.trajectory.start(), start_pose_for(found.target_m));
    if let ThrowGoal::Strike(strike) = &mut r.goal {
        strike.config.robustness.polished = 0;
    }
    let rough = plan(&r, &mut go_on).unwrap().predicted_error_m;
    assert!(rough > found.predicted_error_m, "{rough}");
}

/// A search of all joints for the rope that a throw was polished for ends off the target.
#[test]
fn a_robust_plan_is_no_riskier_than_the_throw_it_starts_from() {
    let mut r = request([0.95, 0.25, 0.1]);
    r.options.dimensions = Dimensions::Full;
    let plain = plan(&r, &mut go_on).unwrap();
    r.ensemble.optimised = vec![r.rope; 2];
    let robust = plan(&r, &mut go_on).unwrap();
    let setup = Setup::new(r.goal.task(), &r).unwrap();
    let risks = setup.risks(&[plain.trajectory, robust.trajectory]).unwrap();
    let [plain, robust] = [0, 1].map(|i| risks[i].fitness);
    assert!(robust <= plain, "{robust} after {plain}");
}

/// A throw that is right for the rope planned for: what a forecast adds is all that it says.
#[test]
fn a_forecast_allows_for_all_that_is_not_known() {
    let mut r = request([0.95, 0.25, 0.1]);
    let thrown = plan(&r, &mut go_on).unwrap();
    r.ensemble.forecast = vec![r.rope; 32];
    let forecast = |ensemble: PosteriorEnsemble| {
        let r = PlanRequest {
            ensemble,
            ..r.clone()
        };
        let setup = Setup::new(r.goal.task(), &r).unwrap();
        setup.forecast(&thrown.trajectory).unwrap().unwrap()
    };
    let sure = r.ensemble.clone();
    assert!(forecast(sure.clone()).interval_90_m[1] < 1e-3);
    let unexplained = PosteriorEnsemble {
        discrepancy_m: 0.01,
        ..sure.clone()
    };
    // Two normal errors of 1 cm across the path: 1.18 cm in the median.
    let median_m = forecast(unexplained).median_m;
    assert!((median_m - 0.0118).abs() < 0.001, "{median_m}");
    let zeros = PosteriorEnsemble {
        joint_zero_std_rad: 3e-3,
        ..sure.clone()
    };
    let median_m = forecast(zeros).median_m;
    assert!((0.002..0.007).contains(&median_m), "{median_m}");
    let undrawn = forecast(PosteriorEnsemble { undrawn: 8, ..sure });
    assert_eq!((undrawn.ropes, undrawn.failed), (40, 8));
    assert!(undrawn.interval_90_m[1] >= r.rope.length_m);
}

/// What zeros of the joints and the model leave open counts in the risk of a robust throw.
#[test]
fn risk_counts_what_the_ropes_do_not_show() {
    let mut r = request([0.95, 0.25, 0.1]);
    let thrown = plan(&r, &mut go_on).unwrap();
    r.ensemble.optimised = vec![r.rope; 2];
    let risk_m = |joint_zero_std_rad: f64, discrepancy_m: f64| {
        let mut r = r.clone();
        r.ensemble.joint_zero_std_rad = joint_zero_std_rad;
        r.ensemble.discrepancy_m = discrepancy_m;
        let setup = Setup::new(r.goal.task(), &r).unwrap();
        setup.risks(&[thrown.trajectory]).unwrap()[0].fitness
    };
    let sure = risk_m(0.0, 0.0);
    // Mean and three times the worst fifth of `d - 1 / (1 + d)`: eight times a small distance.
    let zeros_m = (risk_m(3e-3, 0.0) - sure) / 8.0;
    assert!((0.003..0.008).contains(&zeros_m), "{zeros_m}");
    // Only what is across the path counts: two of three directions, of a size known to 30 %.
    let unexplained_m = (risk_m(0.0, 0.01) - sure) / 8.0;
    let expected_m = 0.01 * (2.0 * (2.0 * 0.3_f64.powi(2)).exp()).sqrt();
    assert!(
        (unexplained_m / expected_m - 1.0).abs() < 0.03,
        "{unexplained_m}"
    );
}

/// Byte for byte, as it would be written down.
#[test]
fn same_plan_for_one_two_and_four_threads() {
    let mut r = request([0.9, -0.2, 0.3]);
    r.options.generations = Some(4);
    let written = |r: &PlanRequest| serde_json::to_vec(&plan(r, &mut go_on).unwrap()).unwrap();
    r.options.threads = 1;
    let one = written(&r);
    for threads in [2, 4] {
        r.options.threads = threads;
        assert!(one == written(&r), "{threads} threads");
    }
    r.options.seed += 1;
    assert!(one != written(&r));
}

#[test]
fn impossible_requests_are_refused_before_any_simulation() {
    let good = [0.9, 0.0, 0.2];
    for (target_m, length_m, lead_kg, said) in [
        ([1.8, 0.3, 0.4], 0.5, 0.05, "is out of reach"),
        ([0.0, 0.0, 0.1], 0.5, 0.05, "lies in the arm's base"),
        (good, f64::NAN, 0.05, "length"),
        (good, 0.5, 6.0, "the arm carries 3.5 kg"),
    ] {
        let mut r = request(target_m);
        (r.rope.length_m, r.rope.lead_mass_kg) = (length_m, lead_kg);
        let error = plan(&r, &mut |_| panic!("{target_m:?} was not refused")).unwrap_err();
        assert!(
            error.is_input() && error.to_string().contains(said),
            "{error}"
        );
    }
}

/// Values that would hide collisions, or keep the planner busy for ever.
#[test]
fn values_out_of_range_are_refused_by_name() {
    for (value, limit) in [
        ("strike.tail_s = 1e9", "30 s"),
        ("strike.observed_s = nan", "30 s"),
        ("strike.contact_tail_s = -1e9", "30 s"),
        ("strike.contact_period_s = 0.0", "0.001"),
        ("strike.contact_period_s = 1e-12", "0.001"),
        ("strike.contact_period_s = 2.0", "1 s"),
        ("strike.waypoint_times_s = [0.4, 0.8, 1e9]", "30 s"),
        ("strike.weights.pole_contact = -1.0", "0 or more"),
        ("strike.weights.proximity = nan", "finite"),
        ("strike.clearance.tool_m = nan", "finite"),
        ("strike.draws_max = 9_000_000_000", "10000"),
        ("strike.robustness.finalists = 9_000_000_000", "1000"),
        ("search.population = 9_000_000_000", "10000"),
        ("search.population = 3", "4"),
        ("search.generations = 0", "1"),
        ("search.step_s = 0.0", "above 0"),
        ("search.segment_stretch_max = 0.5", "1 to 2"),
        ("search.segment_stretch_max = 2.5", "1 to 2"),
        ("search.segment_stretch_max = nan", "1 to 2"),
        ("lob.stay = nan", "finite"),
        ("drape.arc_per_m = inf", "finite"),
    ] {
        let config: PlannerConfig = toml::from_str(value).unwrap();
        let (table, key) = value.split_once('.').unwrap();
        let task = match table {
            "lob" => Task::Lob,
            "drape" => Task::Drape,
            _ => Task::Strike,
        };
        let goal = config.goal(task, [0.9, 0.0, 0.2]);
        let r = PlanRequest::new(goal, &random_rope(11), config.search);
        let error = plan(&r, &mut |_| panic!("{value} was not refused")).unwrap_err();
        assert!(error.is_input(), "{error}");
        let (sentence, key) = (error.to_string(), key.split(' ').next().unwrap());
        assert!(sentence.contains(&format!("`{key}`")), "{sentence}");
        assert!(sentence.contains(limit), "{sentence}");
    }
}

#[test]
fn an_interrupted_search_leaves_the_best_so_far() {
    let mut generations = 0;
    let found = plan(&request([0.9, 0.0, 0.2]), &mut |p| {
        generations = p.done;
        if p.done == 2 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .unwrap();
    assert_eq!(generations, 2);
    assert!(found.interrupted && found.predicted_error_m < 0.3);
    assert!(found.margins.iter().all(|m| m.left >= 0.0));
}

/// Each in a sentence, and none of a plan that has nothing of it.
#[test]
fn everything_to_know_before_a_throw_is_said() {
    let r = request([0.95, 0.25, 0.1]);
    let mut found = plan(&r, &mut go_on).unwrap();
    assert_eq!(warnings(&found), Vec::<String>::new());
    found.interrupted = true;
    found.predicted_error_m = 0.03;
    found.rope.lead_radius_m = 0.2;
    found.forecast = Some(shared_types::ErrorForecast {
        ropes: 64,
        failed: 3,
        mean_m: 0.01,
        median_m: 0.01,
        interval_90_m: [0.0, 0.02],
    });
    let said = warnings(&found).join("; ");
    for part in [
        "miss the target by 3.0 cm",
        "interrupted",
        "3 of 64 ropes",
        "up to 2.0 cm",
        "`lead_radius_m` is 0.2",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

/// Scenes stand on the target's bearing, and warm starts are throws the arm can make.
#[test]
fn warm_starts_are_executable_at_any_bearing() {
    for (kind, target_m) in [
        (Task::Lob, [0.7, 0.45, 0.20]),
        (Task::Drape, [0.65, -0.35, 0.30]),
    ] {
        let goal = PlannerConfig::default().goal(kind, target_m);
        let r = PlanRequest::new(goal, &random_rope(3), PlanOptions::default());
        let task = r.goal.task();
        let setup = Setup::new(task, &r).unwrap();
        assert_ne!(setup.start, setup.space.resting(), "{kind:?}");
        assert!(setup.screen.accepts(&setup.start), "{kind:?}");
        let first = task.scene(&r.cell).obstacles[0].pose.translation.vector;
        assert_eq!(first.y.signum(), target_m[1].signum());
    }
}

#[test]
fn bodies_where_the_rope_hangs_are_refused_in_words() {
    for (kind, near_m, far_m) in [(Task::Lob, 0.80, 0.86), (Task::Drape, 0.66, 0.75)] {
        let of = |x_m: f64| {
            let goal = PlannerConfig::default().goal(kind, [x_m, 0.0, 0.2]);
            PlanRequest::new(goal, &random_rope(3), PlanOptions::default())
        };
        let (near, far) = (of(near_m), of(far_m));
        let refused = Setup::new(near.goal.task(), &near).map(|_| ()).unwrap_err();
        let said = refused.to_string();
        assert!(refused.is_input() && said.contains(kind.name()), "{said}");
        assert!(Setup::new(far.goal.task(), &far).is_ok(), "{kind:?}");
    }
}

/// What a rope on the board, or over the wall, is said to have done.
#[test]
fn lobs_and_drapes_are_judged_by_their_conditions() {
    let rope = random_rope(5);
    let met =
        |v: &shared_types::Verdict| -> Vec<bool> { v.conditions.iter().map(|c| c.met).collect() };
    let lob = Lob {
        target_m: [0.85, 0.0, 0.20],
        config: LobConfig::default(),
    };
    let mut outcome = ThrowOutcome {
        finite: true,
        end_s: 5.0,
        ..ThrowOutcome::default()
    };
    let stay = |since_s| rope_sim::Dwell {
        total_s: 1.0,
        inside_since_s: since_s,
    };
    outcome.watched.dwell = Some(stay(Some(4.5)));
    outcome.domino = Some(rope_sim::DominoOutcome {
        down_at_s: Some(1.2),
        ..Default::default()
    });
    assert_eq!(met(&lob.judge(&rope, &outcome)), [true, false, true]);
    assert!(!lob.judge(&rope, &outcome).success);
    outcome.watched.dwell = Some(stay(Some(3.9)));
    assert!(lob.judge(&rope, &outcome).success);
    outcome.domino = None;
    assert_eq!(met(&lob.judge(&rope, &outcome)), [false, true, false]);

    let drape = Drape {
        target_m: [0.75, 0.0, 0.30],
        config: DrapeConfig::default(),
    };
    let rest = rope_sim::RestMeasures {
        tip_height_spread_m: 0.02,
        middle_movement_m: 0.01,
        tip_m: [0.78, 0.0, 0.1],
        middle_m: [0.75, 0.0, 0.31],
    };
    outcome.watched.rest = Some(rest);
    outcome.obstacles = vec![rope_sim::ContactSummary {
        first: Some((1.5, rope_sim::RopePart::Links)),
    }];
    assert!(drape.judge(&rope, &outcome).success);
    assert!((drape.error_m(&outcome) - 0.01).abs() < 1e-12);
    outcome.watched.rest = Some(rope_sim::RestMeasures {
        middle_movement_m: 0.04,
        ..rest
    });
    assert_eq!(
        met(&drape.judge(&rope, &outcome)),
        [true, false, true, true]
    );
    outcome.watched.dwell = Some(stay(None));
    assert_eq!(met(&drape.judge(&rope, &outcome))[..2], [false, false]);
}

#[test]
fn free_times_stay_within_their_range_and_the_plan_within_every_limit() {
    let mut r = request([0.95, 0.25, 0.1]);
    r.options.segment_stretch_max = 1.3;
    let planned = plan(&r, &mut go_on).unwrap();
    let error_m = planned.predicted_error_m;
    assert!(error_m < 5e-4, "{error_m}");
    assert!(r.limits.worst_violation(&planned.trajectory).is_none());
    let durations = |times_s: &[f64]| times_s.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>();
    let mut fixed_s = vec![0.0];
    fixed_s.extend(r.goal.task().config().waypoint_times_s);
    let stretches: Vec<f64> = durations(planned.trajectory.times_s())
        .iter()
        .zip(durations(&fixed_s))
        .map(|(is, was)| is / was)
        .collect();
    let within = 1.0 / 1.3 - 1e-9..=1.3 + 1e-9;
    assert!(
        stretches.iter().all(|s| within.contains(s)),
        "{stretches:?}"
    );
    assert!(
        stretches.iter().any(|s| (s - 1.0).abs() > 0.01),
        "{stretches:?}"
    );
}
