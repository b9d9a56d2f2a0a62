//! What is measured in the step, against dense recordings and formulas.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

use arm_model::kinematics::FrameMotion;
use arm_model::{JointTrajectory, JointVector, Pole};
use nalgebra::{Quaternion, Rotation2, UnitQuaternion, Vector2, Vector3};
use rope_sim::{
    AttachMotion, BoxRegion, Candidate, FrameTimes, PlannedArm, Precision, Rollout, SimOptions,
    Start, Watch, roll_out,
};
use shared_types::RopeParams;

const G: f64 = 9.81;
const HORIZON_S: f64 = 0.9;
/// Period of the dense recording (s).
const DENSE_S: f64 = 25e-6;
const POINT: [f64; 3] = [0.45, 0.1, 0.05];
const SEGMENT: [[f64; 3]; 2] = [[0.30, 0.06, -0.30], [0.40, 0.06, -0.28]];

struct Still;

impl AttachMotion for Still {
    fn at(&self, _t_s: f64) -> FrameMotion {
        FrameMotion::world()
    }
    fn duration_s(&self) -> f64 {
        f64::INFINITY
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.01, 0.2, 0.008, 0.06, 0.06, 0.03, 0.8])
}

fn throw() -> PlannedArm {
    let waypoints = [
        JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
        JointVector([0.2, -0.3, 0.2, 0.8, -0.2, 1.2, 0.3]),
        JointVector([0.1, -0.5, 0.1, 1.0, 0.1, 1.6, -0.2]),
    ];
    PlannedArm::new(
        JointTrajectory::new(&[0.0, 0.2137, 0.4511], &waypoints).unwrap(),
        Pole::default(),
    )
}

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
        final_state: true,
    }
}

fn options(step_s: f64, period_s: f64) -> SimOptions {
    SimOptions {
        step_s,
        precision: Precision::F64,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s,
            count: (HORIZON_S / period_s).round() as usize + 1,
        },
        watch: everything(),
        horizon_s: HORIZON_S,
        threads: 1,
    }
}

fn simulate(rope: &RopeParams, motion: &dyn AttachMotion, options: &SimOptions) -> Rollout {
    roll_out(&[Candidate::new(rope, motion)], options)
        .unwrap()
        .remove(0)
}

/// The lead at all frames.
fn tips(rollout: &Rollout) -> Vec<Vector3<f64>> {
    let last = rollout.nodes.nodes() - 1;
    (0..rollout.nodes.frames())
        .map(|f| rollout.nodes.position(f, last))
        .collect()
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
    assert_near("gap", segment.approach.distance_m, distance_m, error_m);
    assert_near("time of the gap", segment.approach.time_s, time_s, 3e-4);
    assert!(segment.along > 0.0 && segment.along < 1.0);
    let dwell = watched.dwell.unwrap();
    let inside: Vec<bool> = tips.iter().map(is_inside).collect();
    let total_s = inside.iter().filter(|i| **i).count() as f64 * DENSE_S;
    let longest_s = inside.split(|i| !i).map(<[bool]>::len).max().unwrap() as f64 * DENSE_S;
    assert!(longest_s > 0.02 && longest_s < total_s, "a telling region");
    // Slowest crossing of a face.
    let slow_s = error_m / 0.05;
    let passes = inside.windows(2).filter(|w| w[0] != w[1]).count() as f64;
    let bound_s = passes * (DENSE_S + slow_s);
    assert_near("dwell", dwell.total_s, total_s, bound_s);
    assert_near("longest stay", dwell.longest_s, longest_s, bound_s);
    assert_eq!(dwell.inside_since_s.is_some(), *inside.last().unwrap());

    let height = watched.height.unwrap();
    // Extremes are flat: small errors of height are large ones of time.
    let flat_s = 5e-4 + 5.0 * error_m;
    let (high_s, high) = least(tips.iter().map(|x| -x.z));
    let (low_s, low) = least(tips.iter().map(|x| x.z));
    assert_near("highest", height.highest_m, -high, error_m);
    assert_near("lowest", height.lowest_m, low, error_m);
    assert_near("time of the highest", height.highest_s, high_s, flat_s);
    assert_near("time of the lowest", height.lowest_s, low_s, flat_s);
}

/// The reductions are those of the path itself, and close to those of the exact motion.
#[test]
fn reductions_are_those_of_a_dense_recording() {
    let (rope, arm) = (rope(), throw());
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
    for links in [22.0, 23.0] {
        let mut array = rope().to_array();
        array[0] = links;
        let rope = RopeParams::from_array(array);
        let rollout = simulate(&rope, &throw(), &options(5e-4, 5e-4));
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
        let speed = (tips[600] - tips[599]) / 5e-4;
        assert!((Vector3::from(rest.tip_velocity_m_s) - speed).norm() < 0.05);
    }
}

#[test]
fn a_hanging_rope_is_at_rest() {
    let rollout = simulate(&rope(), &Still, &options(1e-3, 0.1));
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
    let rope = RopeParams::from_array([1.0, 0.5, 0.0, 0.0, 0.01, 0.06, 0.05, 0.03, 0.5]);
    let (s, m, m_lead, start) = (
        rope.length_m,
        rope.link_mass_kg(),
        rope.lead_mass_kg,
        1.2_f64,
    );
    let inertia =
        rope.link_inertia_kg_m2() + m * s * s / 4.0 + rope.lead_inertia_kg_m2() + m_lead * s * s;
    let stiffness = G * s * (m / 2.0 + m_lead) / inertia;
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
    let rollout = simulate(
        &rope,
        &Still,
        &SimOptions {
            start: Start::Straight {
                joint0_rotvec: [0.0, start, 0.0],
            },
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
        },
    );
    let watched = rollout.watched;
    let height = watched.height.unwrap();
    assert!((height.highest_m + s * start.cos()).abs() < 1e-5 * s);
    assert!((height.lowest_m + s).abs() < 1e-9, "{height:?}");
    assert!(
        (height.lowest_s - bottom_s).abs() < 2e-5,
        "{height:?} {bottom_s}"
    );
    let arrival = watched.to_point.unwrap();
    assert!((arrival.distance_m - 0.01).abs() < 1e-8, "{arrival:?}");
    let speed = s * (2.0 * stiffness * (1.0 - start.cos())).sqrt();
    assert!((arrival.velocity_m_s[0].abs() / speed - 1.0).abs() < 1e-4);
    assert!(arrival.velocity_m_s[2].abs() < 1e-3);
    let dwell = watched.dwell.unwrap();
    assert!(
        (dwell.total_s - inside_s).abs() < 5e-5,
        "{dwell:?} {inside_s}"
    );
}

#[test]
fn final_states_rebuild_the_last_frame() {
    let (rope, arm) = (rope(), throw());
    let mut options = options(5e-4, HORIZON_S / 9000.0);
    options.frames.count = 9001;
    let rollout = simulate(&rope, &arm, &options);
    let state = rollout.watched.final_state.unwrap();
    assert_eq!(state.len(), 22);
    let mut node = rollout.nodes.position(9000, 0);
    let mut velocity = (node - rollout.nodes.position(8999, 0)) * (9000.0 / HORIZON_S);
    for (index, link) in state.iter().enumerate() {
        let [w, x, y, z] = link.q_wxyz;
        let q = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        let span = q * Vector3::new(0.0, 0.0, -rope.link_length_m());
        node += span;
        velocity += Vector3::from(link.w_rad_s).cross(&span);
        assert!((node - rollout.nodes.position(9000, index + 1)).norm() < 1e-9);
    }
    let before = rollout.nodes.position(8999, 22);
    let difference = (node - before) * (9000.0 / HORIZON_S);
    assert!(
        (velocity - difference).norm() < 0.02,
        "{velocity} {difference}"
    );
}

#[test]
fn watching_changes_nothing_else() {
    let (rope, arm) = (rope(), throw());
    let with = simulate(&rope, &arm, &options(5e-4, 0.01));
    let without = simulate(
        &rope,
        &arm,
        &SimOptions {
            watch: Watch::point(POINT),
            ..options(5e-4, 0.01)
        },
    );
    assert_eq!(with.nodes, without.nodes);
    assert_eq!(with.watched.to_point, without.watched.to_point);
    assert_eq!(without.watched.dwell, None);
    assert_eq!(without.watched.final_state, None);
}
