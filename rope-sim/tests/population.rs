//! Accuracy over a random population of ropes and flings: the default step in single
//! precision against double precision in steps a fifth as long.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod support;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rope_sim::{AttachMotion, Candidate, Outcome, Precision, Rollout, SimOptions, roll_out};
use shared_types::RopeParams;
use shared_types::rope::RANGES;
use support::fling::Fling;
use support::{assert_derivatives, options, tips};

const ROPES: usize = 240;
const HORIZON_S: f64 = 1.5;

/// Ropes uniform in the parameter ranges, with 22 links, each with its fling.
fn population() -> Vec<(RopeParams, Fling)> {
    let mut random = ChaCha8Rng::seed_from_u64(240);
    let mut one = || {
        let numbers = RANGES.map(|r| random.random_range(r.min..r.max));
        let rope = RopeParams {
            links: 22,
            ..RopeParams::from_array(numbers)
        };
        (rope, Fling::random(&mut random))
    };
    (0..ROPES).map(|_| one()).collect()
}

fn simulate(population: &[(RopeParams, Fling)], precision: Precision, step_s: f64) -> Vec<Rollout> {
    let candidates: Vec<Candidate> = population
        .iter()
        .map(|(rope, fling)| Candidate::new(rope, fling))
        .collect();
    let options = SimOptions {
        step_s,
        threads: 2,
        ..options(precision, HORIZON_S, 100.0)
    };
    roll_out(&candidates, &options).unwrap()
}

/// The value below which the given part of the numbers lies.
fn quantile(numbers: impl IntoIterator<Item = f64>, part: f64) -> f64 {
    let mut sorted: Vec<f64> = numbers.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * part).round() as usize]
}

fn max_tip_difference_mm(a: &Rollout, b: &Rollout) -> f64 {
    let (a, b) = (tips(a), tips(b));
    let pairs = a.iter().zip(&b);
    pairs.map(|(a, b)| 1e3 * (a - b).norm()).fold(0.0, f64::max)
}

/// The population is the one the bounds below were stated for: attach speed median
/// 3.9, 95 % 5.5 m/s, attach acceleration median 73 m/s2 (peaks over each fling).
#[test]
fn the_flings_are_as_violent_as_stated() {
    let population = population();
    let peak = |fling: &Fling, of: fn(&arm_model::kinematics::FrameMotion) -> f64| {
        (0..=1500)
            .map(|i| of(&fling.at(f64::from(i) * 1e-3)))
            .fold(0.0, f64::max)
    };
    let speeds: Vec<f64> = population
        .iter()
        .map(|(_, fling)| peak(fling, |m| m.v_m_s.norm()))
        .collect();
    let accelerations = population
        .iter()
        .map(|(_, fling)| peak(fling, |m| m.a_m_s2.norm()));
    let (median, p95) = (quantile(speeds.clone(), 0.5), quantile(speeds, 0.95));
    let acceleration = quantile(accelerations, 0.5);
    println!("attach speed median {median:.2}, 95 % {p95:.2} m/s, acceleration {acceleration:.1}");
    assert!((median / 3.9 - 1.0).abs() < 0.08, "{median} m/s");
    assert!((p95 / 5.5 - 1.0).abs() < 0.08, "{p95} m/s");
    assert!(
        (acceleration / 73.0 - 1.0).abs() < 0.08,
        "{acceleration} m/s2"
    );
}

#[test]
fn a_flings_derivatives_are_those_of_its_pose() {
    for (_, fling) in population().iter().take(5) {
        assert_derivatives(fling, [0.1, 0.31, 0.7, 1.0]);
    }
}

#[test]
fn half_a_millisecond_in_single_precision_is_enough_for_random_flings() {
    let population = population();
    let truth = simulate(&population, Precision::F64, 1e-4);
    let fast = simulate(&population, Precision::F32, 5e-4);
    for rollout in truth.iter().chain(&fast) {
        assert!(rollout.nodes.to_f64().iter().all(|x| x.is_finite()));
        assert!(rollout.peak_tip_speed_m_s.is_finite());
    }
    let count = |outcome| fast.iter().filter(|r| r.outcome == outcome).count();
    let errors = || {
        fast.iter()
            .zip(&truth)
            .map(|(a, b)| max_tip_difference_mm(a, b))
    };
    let [median, p90, p99] = [0.5, 0.9, 0.99].map(|part| quantile(errors(), part));
    let fastest = quantile(fast.iter().map(|r| r.peak_tip_speed_m_s), 1.0);
    println!(
        "tip error median {median:.3}, 90 % {p90:.2}, 99 % {p99:.1} mm; repeated {}, diverged {}; fastest tip {fastest:.1} m/s",
        count(Outcome::RerunAtQuarterStep),
        count(Outcome::Diverged),
    );
    assert!(truth.iter().all(|r| r.outcome != Outcome::Diverged));
    assert_eq!(count(Outcome::Diverged), 0);
    assert!(median <= 0.15, "median {median} mm");
    assert!(p90 <= 3.0, "90 % {p90} mm");
}
