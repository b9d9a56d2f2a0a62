//! Slopes against symmetries of the model, rigid motions, delays and separate rollouts; which are refused or flagged.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, Vector3};
use rope_sim::sensitivity::{
    Family, Perturbation, Sensitivity, SensitivityError, sensitivities, sensitivity,
};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Outcome, Precision, Rollout, SimOptions, Watch, roll_out,
};
use shared_types::RopeParams;
use support::pushed::{Broken, Pushed};
use support::{released, rope, throw, world};

const LENGTH: usize = 1;
const DAMPING: usize = 2;
const STIFFNESS: usize = 3;
const RADIUS: usize = 4;
const MASS_PER_LENGTH: usize = 5;
const LEAD_MASS: usize = 6;
const EXTRA_SCALE: usize = 8;
/// Where the lead is watched (m).
const TARGET: [f64; 3] = [0.45, 0.1, 0.05];

/// Double precision with frames and approach.
fn options() -> SimOptions {
    SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 0.05,
            count: 13,
        },
        watch: Watch::point(TARGET),
        ..SimOptions::new(5e-4, Precision::F64, 0.6)
    }
}

/// `rope` with one parameter larger by `distance`.
fn by<'a>(rope: &RopeParams, index: usize, distance: f64) -> Perturbation<'a> {
    let mut numbers = rope.to_array();
    numbers[index] += distance;
    Perturbation::Rope {
        rope: RopeParams::from_array(numbers),
        distance,
    }
}

fn towards(motion: &dyn AttachMotion, distance: f64) -> Perturbation<'_> {
    Perturbation::Motion { motion, distance }
}

fn run(
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    perturbations: &[Perturbation],
    options: &SimOptions,
) -> Result<Sensitivity, SensitivityError> {
    let base = Candidate::new(rope, motion);
    let family = Family {
        base,
        perturbations,
    };
    sensitivity(&family, options)
}

/// Slopes of all nodes towards each neighbour, frame by frame.
fn slopes(s: &Sensitivity) -> Vec<Vec<Vector3<f64>>> {
    let rows = s.slopes(|r| r.nodes.to_f64()).into_iter();
    let vectors = |row: Vec<f64>| row.chunks(3).map(Vector3::from_column_slice).collect();
    rows.map(|row| vectors(row.unwrap())).collect()
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Central differences of all nodes, per unit of each parameter, which is varied by
/// `relative` of its value; the last is that of the distance to the target.
fn central(indices: &[usize], relative: &[f64], options: &SimOptions) -> Vec<Vec<f64>> {
    let (rope, arm) = (rope(), throw(0.0));
    let values = rope.to_array();
    let mut neighbours = Vec::new();
    for (index, relative) in indices.iter().zip(relative) {
        let distance = relative * values[*index];
        for signed in [distance, -distance] {
            let mut numbers = values;
            numbers[*index] += signed;
            let rope = RopeParams::from_array(numbers);
            neighbours.push(Perturbation::Rope { rope, distance });
        }
    }
    let s = run(&rope, &arm, &neighbours, options).unwrap();
    let rows: Option<Vec<Vec<f64>>> = s.slopes(nodes_and_distance).into_iter().collect();
    let half = |pair: &[Vec<f64>]| {
        let both = pair[0].iter().zip(&pair[1]);
        both.map(|(a, b)| 0.5 * (a - b)).collect()
    };
    rows.unwrap().chunks(2).map(half).collect()
}

fn nodes_and_distance(rollout: &Rollout) -> Vec<f64> {
    let mut numbers = rollout.nodes.to_f64();
    numbers.push(rollout.watched.to_point.unwrap().distance_m);
    numbers
}

/// Multiplying stiffness, damping and all masses by one factor changes no motion, so
/// the logarithmic slopes cancel.
#[test]
fn slopes_of_the_scale_symmetry_cancel() {
    let values = rope().to_array();
    let scaled = [DAMPING, STIFFNESS, MASS_PER_LENGTH, LEAD_MASS];
    let mut sum = vec![0.0; 13 * 23 * 3 + 1];
    for (index, slopes) in scaled
        .into_iter()
        .zip(central(&scaled, &[1e-5; 4], &options()))
    {
        let nodes = &slopes[..slopes.len() - 1];
        assert!(largest(nodes.iter().map(|x| x * values[index])) > 1e-3);
        for (sum, slope) in sum.iter_mut().zip(slopes) {
            *sum += slope * values[index];
        }
    }
    let left = largest(sum);
    assert!(left < 1e-6, "{left} m per unit of the logarithm");
    // The extra scale rules R_I here: it does little, the radius nothing.
    let [radius, scale] = [RADIUS, EXTRA_SCALE].map(|i| central(&[i], &[1e-5], &options()));
    assert_eq!(largest(radius.concat()), 0.0);
    assert!(largest(scale.concat()) > 0.0);
}

/// Single precision, which the search for settling moves takes its slopes in, wants larger
/// steps: these move the tip by millimetres, a hundred times its rounding.
#[test]
fn single_precision_comes_close_with_its_larger_steps() {
    let indices = [LENGTH, DAMPING, STIFFNESS, MASS_PER_LENGTH, LEAD_MASS];
    let double = central(&indices, &[1e-5; 5], &options());
    let options = SimOptions {
        precision: Precision::F32,
        ..options()
    };
    let single = central(&indices, &[5e-3, 5e-2, 2e-2, 2e-2, 2e-2], &options);
    for (index, (a, b)) in indices.into_iter().zip(double.iter().zip(&single)) {
        let error = largest(a.iter().zip(b).map(|(a, b)| a - b)) / largest(a.iter().copied());
        assert!(error < 0.02, "parameter {index}: {error}");
    }
}

#[test]
fn rigid_motions_carry_the_rope_along() {
    let (rope, arm) = (rope(), throw(0.0));
    let (shift, turn_rad) = (Vector3::new(0.3, -0.5, 1.1), 1e-4);
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), turn_rad).into_inner();
    let shifted = Moved(&arm, |m: FrameMotion| FrameMotion {
        p_m: m.p_m + shift * 1e-5,
        ..m
    });
    let turned = Moved(&arm, |m: FrameMotion| FrameMotion {
        p_m: turn * m.p_m,
        r: turn * m.r,
        v_m_s: turn * m.v_m_s,
        w_rad_s: turn * m.w_rad_s,
        a_m_s2: turn * m.a_m_s2,
        alpha_rad_s2: turn * m.alpha_rad_s2,
    });
    let neighbours = [towards(&shifted, 1e-5), towards(&turned, turn_rad)];
    let s = run(&rope, &arm, &neighbours, &options()).unwrap();
    let slopes = slopes(&s);
    let nodes = s.base.nodes.to_f64();
    for (i, x) in nodes.chunks(3).map(Vector3::from_column_slice).enumerate() {
        let off = slopes[0][i] - shift;
        assert!(off.norm() < 1e-7, "node {i}: {off}");
        let off = slopes[1][i] - (turn * x - x) / turn_rad;
        assert!(off.norm() < 1e-7, "node {i}: {off}");
    }
    // Towards the target the closest tip goes as the shift does.
    let approach = s.base.watched.to_point.unwrap();
    let away = (Vector3::from(approach.tip_m) - Vector3::from(TARGET)).normalize();
    let slope = away.dot(&Vector3::from(s.closest_tip_m(0).unwrap()));
    assert!((slope - away.dot(&shift)).abs() < 1e-3, "{slope}");
}

/// A motion changed at every time, with the jumps of the original.
struct Moved<'a, F>(&'a dyn AttachMotion, F);

impl<F: Fn(FrameMotion) -> FrameMotion + Sync> AttachMotion for Moved<'_, F> {
    fn at(&self, t_s: f64) -> FrameMotion {
        (self.1)(self.0.at(t_s))
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        self.0.acceleration_jumps_s()
    }
}

/// Swings softly along x from `from_s` on.
fn swing(from_s: f64) -> impl AttachMotion {
    move |t_s: f64| {
        let (w, t) = (9.0, (t_s - from_s).max(0.0));
        // x = t^5 sin(w t): four derivatives vanish at the start.
        let (s, c) = (w * t).sin_cos();
        FrameMotion {
            p_m: Vector3::new(t.powi(5) * s, 0.0, 0.0) * 8.0,
            v_m_s: Vector3::x() * (8.0 * (5.0 * t.powi(4) * s + t.powi(5) * w * c)),
            a_m_s2: Vector3::x()
                * (8.0 * (20.0 * t.powi(3) * s + 10.0 * t.powi(4) * w * c - t.powi(5) * w * w * s)),
            ..FrameMotion::world()
        }
    }
}

/// A later motion is the same motion: its slope is minus the velocity.
#[test]
fn slopes_of_a_delay_are_velocities() {
    let (rope, delay_s) = (rope(), 1e-5);
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.599,
            period_s: 0.001,
            count: 3,
        },
        horizon_s: 0.61,
        ..options()
    };
    let later = swing(0.1 + delay_s);
    let s = run(&rope, &swing(0.1), &[towards(&later, delay_s)], &options).unwrap();
    let slopes = &slopes(&s)[0];
    for node in 0..=22 {
        let nodes = &s.base.nodes;
        let velocity = (nodes.position(2, node) - nodes.position(0, node)) / 0.002;
        assert!(node == 0 || velocity.norm() > 0.1);
        let off = (slopes[23 + node] + velocity).norm();
        assert!(
            off < 1e-3 * velocity.norm() + 1e-4,
            "{node}: {off} {velocity}"
        );
    }
}

/// Slopes of a waypoint from one call are those of separate rollouts.
#[test]
fn a_moved_waypoint_is_a_motion() {
    let (rope, arm, beside) = (rope(), throw(0.0), throw(1e-4));
    let s = run(&rope, &arm, &[towards(&beside, 1e-4)], &options()).unwrap();
    let alone: Vec<Rollout> = [&arm, &beside]
        .map(|motion| roll_out(&[Candidate::new(&rope, motion)], &options()).unwrap())
        .concat();
    assert_eq!(s.base, alone[0]);
    assert_eq!(s.neighbours[0].rollout, alone[1]);
    let slope = slopes(&s)[0][12 * 23 + 22];
    let want = (alone[1].nodes.position(12, 22) - alone[0].nodes.position(12, 22)) / 1e-4;
    assert!((slope - want).norm() < 1e-9);
    assert!(want.norm() > 0.1);
}

#[test]
fn companions_and_threads_do_not_change_slopes() {
    let arm = throw(0.0);
    let ropes = [0.15, 0.2, 0.3].map(|k| RopeParams {
        joint_stiffness_nm_per_rad: k,
        ..rope()
    });
    let neighbours = ropes.map(|rope| [1, 2, 3, 5].map(|i| by(&rope, i, 1e-4)));
    let families = [0, 1, 2].map(|i| Family {
        base: Candidate::new(&ropes[i], &arm),
        perturbations: &neighbours[i][i..],
    });
    let together = |threads| {
        let options = SimOptions {
            threads,
            ..options()
        };
        sensitivities(&families, &options).unwrap()
    };
    let all = together(3);
    assert_eq!(all, together(1));
    for (family, got) in families.iter().zip(&all) {
        assert_eq!(*got, sensitivity(family, &options()).unwrap());
    }
}

/// A neighbour that needs smaller steps takes its whole family along; one that always
/// blows up is no slope.
#[test]
fn families_always_step_alike() {
    let calm = rope();
    let wild = RopeParams {
        joint_damping_nms_per_rad: 0.001,
        joint_stiffness_nm_per_rad: 1.0,
        mass_per_length_kg_per_m: 0.03,
        ..rope()
    };
    let coarse = SimOptions {
        step_s: 1e-3,
        ..options()
    };
    let options = released([0.0, 1.0, 0.0], coarse);
    let outcome = |rope: &RopeParams, step_s| {
        let options = SimOptions { step_s, ..options };
        let rollouts = roll_out(&[Candidate::new(rope, &world)], &options).unwrap();
        (rollouts[0].outcome, rollouts[0].nodes.clone())
    };
    assert_eq!(outcome(&wild, 1e-3).0, Outcome::RerunAtQuarterStep);
    assert_eq!(outcome(&calm, 1e-3).0, Outcome::Clean);
    let [to_wild, to_calm] = [wild, calm].map(|rope| Perturbation::Rope {
        rope,
        distance: 1.0,
    });
    let s = run(&calm, &world, &[to_wild], &options).unwrap();
    assert!(s.neighbours[0].valid);
    assert_eq!(s.base.outcome, Outcome::RerunAtQuarterStep);
    assert_eq!(s.base.nodes, outcome(&calm, 2.5e-4).1);
    assert_eq!(s.neighbours[0].rollout.nodes, outcome(&wild, 2.5e-4).1);

    let hopeless = SimOptions {
        step_s: 5e-3,
        ..options
    };
    assert_ne!(outcome(&wild, 1.25e-3).0, Outcome::Clean);
    let s = run(&calm, &world, &[to_wild, to_calm], &hopeless).unwrap();
    assert!(!s.neighbours[0].valid && s.closest_tip_m(0).is_none());
    let slopes = s.slopes(|r| r.nodes.to_f64());
    assert!(slopes[0].is_none());
    assert_eq!(largest(slopes[1].clone().unwrap()), 0.0);
}

/// Still until its acceleration jumps.
fn jerk(jump_s: f64) -> Pushed {
    let pieces = [
        (jump_s, Vector3::zeros()),
        (f64::INFINITY, Vector3::x() * 3.0),
    ];
    Pushed::from_origin(pieces.to_vec())
}

/// A jump on the grid of steps, moved a little, would add a step to one side.
#[test]
fn moved_jumps_do_not_change_the_number_of_steps() {
    let rope = rope();
    let around = |distance: f64| {
        let later = jerk(0.2 + distance);
        run(&rope, &jerk(0.2), &[towards(&later, distance)], &options())
    };
    let near = slopes(&around(1e-5).unwrap()).remove(0);
    let wide = slopes(&around(4e-5).unwrap()).remove(0);
    // In the last frame the attach point's own slope, and a smooth one along the rope.
    let (first, last) = (12 * 23, 12 * 23 + 22);
    assert!((near[first].x + 3.0 * 0.4).abs() < 1e-4);
    let off = (wide[last] - near[last]).norm();
    assert!(off < 1e-3, "{off}");
    // Four steps further there is no common number of steps.
    let never = run(&rope, &jerk(0.2), &[towards(&world, 1.0)], &options());
    for refused in [around(2e-3), never] {
        let said = refused.unwrap_err().to_string();
        assert!(
            said.starts_with("base 0, neighbour 0: the acceleration"),
            "{said}"
        );
    }
}

#[test]
fn bad_input_is_named_with_base_and_neighbour() {
    let (rope, arm) = (rope(), throw(0.0));
    let good = by(&rope, LENGTH, 1e-4);
    let light = Perturbation::Rope {
        rope: RopeParams {
            lead_mass_kg: -0.1,
            ..rope
        },
        distance: 1.0,
    };
    let linkless = RopeParams { links: 0, ..rope };
    let [short, nan] = [0.3, 9.0].map(|ends_s| Broken {
        ends_s,
        nan_from_s: 0.5,
        in_place: true,
    });
    let first = Family {
        base: Candidate::new(&rope, &world),
        perturbations: &[good],
    };
    let cases: [(&RopeParams, &dyn AttachMotion, &[Perturbation], &str); 7] = [
        (
            &rope,
            &arm,
            &[good, by(&rope, 0, 1.0)],
            "base 1, neighbour 1: the number of links is discrete",
        ),
        (
            &rope,
            &arm,
            &[by(&rope, LENGTH, -1e-3)],
            "base 1, neighbour 0: the step is -0.001, but",
        ),
        (
            &rope,
            &arm,
            &[good, light],
            "neighbour 1 of a base: candidate 1: rope parameter `lead_mass_kg`",
        ),
        (
            &linkless,
            &arm,
            &[good],
            "candidate 1: rope parameter `links`",
        ),
        (
            &rope,
            &world,
            &[good, towards(&short, 1.0)],
            "neighbour 1 of a base: candidate 1: its motion ends at 0.3 s",
        ),
        (
            &rope,
            &world,
            &[towards(&nan, 1.0)],
            "neighbour 0 of a base: candidate 1: its attach motion is not finite",
        ),
        (
            &rope,
            &nan,
            &[],
            "candidate 1: its attach motion is not finite",
        ),
    ];
    for (rope, motion, perturbations, words) in cases {
        let second = Family {
            base: Candidate::new(rope, motion),
            perturbations,
        };
        let refusal = sensitivities(&[first, second], &options()).unwrap_err();
        let said = refusal.to_string();
        assert!(said.starts_with(words), "`{said}`, not `{words}`");
    }
}
