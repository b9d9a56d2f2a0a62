//! What is measured in the step, against dense recordings and formulas.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use nalgebra::{Rotation2, Vector2, Vector3};
use rope_sim::{
    AttachMotion, BoxRegion, Candidate, FrameTimes, Precision, Rollout, Scene, SimOptions, Watch,
    roll_out,
};
use shared_types::RopeParams;
use support::{pendulum, released, rope, throw, tips, world};

const HORIZON_S: f64 = 0.9;
/// Period of the dense recording (s).
const DENSE_S: f64 = 25e-6;
const POINT: [f64; 3] = [0.45, 0.1, 0.05];
const SEGMENT: [[f64; 3]; 2] = [[0.30, 0.06, -0.30], [0.40, 0.06, -0.28]];

fn region() -> BoxRegion {
    BoxRegion {
        center_m: [0.35, 0.10, -0.26],
        half_m: [0.025, 0.5, 0.06],
        yaw_rad: 0.3,
    }
}

fn everything() -> Watch {
    Watch {
        point_m: Some(POINT),
        segment_m: Some(SEGMENT),
        dwell_in: Some(region()),
        height: true,
        rest_window_s: Some(0.3),
    }
}

fn options(step_s: f64, period_s: f64) -> SimOptions {
    SimOptions {
        step_s,
        watch: everything(),
        ..support::options(Precision::F64, HORIZON_S, 1.0 / period_s)
    }
}

fn simulate(rope: &RopeParams, motion: &dyn AttachMotion, options: &SimOptions) -> Rollout {
    support::simulate(&Scene::EMPTY, rope, motion, options)
}

fn from_segment(x: &Vector3<f64>) -> f64 {
    let [a, b] = SEGMENT.map(Vector3::from);
    let t = ((x - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    (x - a - (b - a) * t).norm()
}

fn is_inside(x: &Vector3<f64>) -> bool {
    let r = region();
    let d = x - Vector3::from(r.center_m);
    let local = Rotation2::new(-r.yaw_rad) * Vector2::new(d.x, d.y);
    let local = [local.x, local.y, d.z];
    (0..3).all(|i| local[i].abs() < r.half_m[i])
}

/// Index of the smallest value, and the value.
fn least(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (index, value) = values
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap();
    (index as f64 * DENSE_S, value)
}

fn assert_near(what: &str, got: f64, want: f64, bound: f64) {
    assert!(
        (got - want).abs() <= bound,
        "{what}: {got}, but the dense recording says {want}"
    );
}

/// Compares what was watched in `rollout` with a dense recording; `error_m` is how far
/// the two motions may be apart.
fn compare(rollout: &Rollout, tips: &[Vector3<f64>], error_m: f64) {
    let watched = &rollout.watched;
    let point = watched.to_point.unwrap();
    let (time_s, distance_m) = least(tips.iter().map(|x| (x - Vector3::from(POINT)).norm()));
    assert_near("distance", point.distance_m, distance_m, error_m);
    assert_near("time of the approach", point.time_s, time_s, 3e-4);
    let at = (point.time_s / DENSE_S).round() as usize;
    let velocity = (tips[at + 4] - tips[at - 4]) / (8.0 * DENSE_S);
    let off = (velocity - Vector3::from(point.velocity_m_s)).norm();
    assert!(off < 1e-2 + 300.0 * error_m, "arrives {off} m/s off");
    assert!((Vector3::from(point.tip_m) - tips[at]).norm() < error_m + 10.0 * DENSE_S);

    let segment = watched.to_segment.unwrap();
    let (time_s, distance_m) = least(tips.iter().map(from_segment));
    assert_near("gap", segment.distance_m, distance_m, error_m);
    assert_near("time of the gap", segment.time_s, time_s, 3e-4);
    let dwell = watched.dwell.unwrap();
    let inside: Vec<bool> = tips.iter().map(is_inside).collect();
    let total_s = inside.iter().filter(|i| **i).count() as f64 * DENSE_S;
    // Slowest crossing of a face.
    let slow_s = error_m / 0.05;
    let passes = inside.windows(2).filter(|w| w[0] != w[1]).count() as f64;
    let bound_s = passes * (DENSE_S + slow_s);
    assert_near("dwell", dwell.total_s, total_s, bound_s);
    assert_eq!(dwell.inside_since_s.is_some(), *inside.last().unwrap());

    let (_, high) = least(tips.iter().map(|x| -x.z));
    assert_near("highest", watched.highest_m.unwrap(), -high, error_m);
}

/// The reductions are those of the path itself, and close to those of the exact motion.
#[test]
fn reductions_are_those_of_a_dense_recording() {
    let (rope, arm) = (rope(), throw(0.0));
    let coarse = simulate(&rope, &arm, &options(5e-4, DENSE_S));
    compare(&coarse, &tips(&coarse), 1e-6);
    let fine = simulate(&rope, &arm, &options(DENSE_S, DENSE_S));
    compare(&fine, &tips(&fine), 1e-7);
    compare(&coarse, &tips(&fine), 3e-4);
    let single = SimOptions {
        precision: Precision::F32,
        frames: FrameTimes::NONE,
        ..options(5e-4, DENSE_S)
    };
    compare(&simulate(&rope, &arm, &single), &tips(&fine), 4e-4);
}

#[test]
fn rest_measures_are_those_of_the_recorded_middle() {
    for links in [22, 23] {
        let rope = RopeParams { links, ..rope() };
        let rollout = simulate(&rope, &throw(0.0), &options(5e-4, 5e-4));
        let rest = rollout.watched.rest.unwrap();
        let frames = rollout.nodes.frames();
        let n = rollout.nodes.nodes() - 1;
        let middle = |f: usize| {
            let [a, b] = [n / 2, n.div_ceil(2)].map(|node| rollout.nodes.position(f, node));
            (a + b) / 2.0
        };
        let window = frames - 601..frames;
        let (mut low, mut high) = (middle(frames - 1), middle(frames - 1));
        for frame in window.clone() {
            (low, high) = (low.inf(&middle(frame)), high.sup(&middle(frame)));
        }
        assert!((rest.middle_movement_m - (high - low).norm()).abs() < 5e-4);
        assert!((Vector3::from(rest.middle_m) - middle(frames - 1)).norm() < 1e-12);
        let tips = &tips(&rollout)[window];
        let heights = tips.iter().map(|x| x.z);
        let spread = heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min);
        assert!((rest.tip_height_spread_m - spread).abs() < 2e-4);
        assert!((Vector3::from(rest.tip_m) - tips[600]).norm() < 1e-12);
    }
}

#[test]
fn a_hanging_rope_is_at_rest() {
    let rollout = simulate(&rope(), &world, &options(1e-3, 0.1));
    let rest = rollout.watched.rest.unwrap();
    assert!(rest.tip_height_spread_m < 1e-12 && rest.middle_movement_m < 1e-12);
    assert!((rest.middle_m[2] + 0.275).abs() < 1e-12);
    assert!((rest.tip_m[2] + 0.55).abs() < 1e-12);
    assert_eq!(rollout.watched.dwell.unwrap().total_s, 0.0);
}

/// One rigid link is a pendulum: heights, arrival at the bottom, and time within a
/// sector follow from its energy and its equation of motion.
#[test]
fn a_pendulum_does_what_its_formulas_say() {
    let (rope, inertia, moment) = pendulum();
    let (s, start, stiffness) = (rope.length_m, 1.2_f64, moment / inertia);
    // Its own integration: fourth order, 2 us.
    let (h, mut angle, mut rate) = (2e-6, start, 0.0_f64);
    let (mut inside_s, mut bottom_s) = (0.0, 0.0);
    for i in 0..450_000_i32 {
        let f = |a: f64, r: f64| (r, -stiffness * a.sin());
        let k1 = f(angle, rate);
        let k2 = f(angle + 0.5 * h * k1.0, rate + 0.5 * h * k1.1);
        let k3 = f(angle + 0.5 * h * k2.0, rate + 0.5 * h * k2.1);
        let k4 = f(angle + h * k3.0, rate + h * k3.1);
        let before = angle;
        angle += h / 6.0 * (k1.0 + 2.0 * k2.0 + 2.0 * k3.0 + k4.0);
        rate += h / 6.0 * (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1);
        if before > 0.0 && angle <= 0.0 {
            bottom_s = f64::from(i + 1) * h;
        }
        if angle.abs() < 0.3 {
            inside_s += h;
        }
    }
    let half_width = s * 0.3_f64.sin();
    let options = SimOptions {
        frames: FrameTimes::NONE,
        watch: Watch {
            point_m: Some([0.0, 0.0, -s - 0.01]),
            dwell_in: Some(BoxRegion {
                center_m: [0.0, 0.0, -s],
                half_m: [half_width, 1.0, 1.0],
                yaw_rad: 0.0,
            }),
            height: true,
            ..Watch::NOTHING
        },
        ..options(2.5e-4, 1.0)
    };
    let rollout = simulate(&rope, &world, &released([0.0, start, 0.0], options));
    let watched = rollout.watched;
    let highest_m = watched.highest_m.unwrap();
    assert!((highest_m + s * start.cos()).abs() < 1e-5 * s);
    let arrival = watched.to_point.unwrap();
    assert!((arrival.distance_m - 0.01).abs() < 1e-8, "{arrival:?}");
    assert!((arrival.time_s - bottom_s).abs() < 2e-5, "{bottom_s}");
    let speed = s * (2.0 * stiffness * (1.0 - start.cos())).sqrt();
    assert!((arrival.velocity_m_s[0].abs() / speed - 1.0).abs() < 1e-4);
    assert!(arrival.velocity_m_s[2].abs() < 1e-3);
    let dwell = watched.dwell.unwrap();
    assert!(
        (dwell.total_s - inside_s).abs() < 5e-5,
        "{dwell:?} {inside_s}"
    );
}

/// A candidate's own point counts before that of all, and is measured as that would be.
#[test]
fn each_candidate_may_watch_a_point_of_its_own() {
    let (rope, arm) = (rope(), throw(0.0));
    let of_all = |point_m| SimOptions {
        watch: Watch::point(point_m),
        ..options(5e-4, 0.01)
    };
    let nowhere = options(5e-4, 0.01);
    let nowhere = SimOptions {
        watch: Watch::NOTHING,
        ..nowhere
    };
    let one = Candidate::new(&rope, &arm);
    let other_m = POINT.map(|x| x + 0.2);
    let candidates = [one.watching(other_m), one, one.watching(POINT)];
    for options in [of_all(POINT), nowhere] {
        let found = roll_out(&candidates, &options).unwrap();
        let near = |point_m| {
            simulate(&rope, &arm, &of_all(point_m))
                .watched
                .to_point
                .unwrap()
        };
        let [own, of_all, same] = [0, 1, 2].map(|i| found[i].watched.to_point);
        assert!((own.unwrap().distance_m - near(other_m).distance_m).abs() < 1e-9);
        assert!((same.unwrap().distance_m - near(POINT).distance_m).abs() < 1e-9);
        assert_eq!(of_all.is_some(), options.watch.point_m.is_some());
        assert_eq!(found[0].nodes, found[1].nodes);
    }
    let nan = [one.watching([f64::NAN; 3])];
    let refusal = roll_out(&nan, &nowhere).unwrap_err().to_string();
    assert!(refusal.contains("point_m"), "{refusal}");
}

#[test]
fn watching_changes_nothing_else() {
    let (rope, arm) = (rope(), throw(0.0));
    let watching = options(5e-4, 0.01);
    let only_point = SimOptions {
        watch: Watch::point(POINT),
        ..watching
    };
    let [with, without] = [watching, only_point].map(|o| simulate(&rope, &arm, &o));
    assert_eq!(with.nodes, without.nodes);
    assert_eq!(with.watched.to_point, without.watched.to_point);
    assert_eq!(without.watched.dwell, None);
}
