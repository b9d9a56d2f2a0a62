//! Slopes against symmetries of the model, rigid motions, delays and extrapolation; which are refused or flagged.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, Vector3};
use rope_sim::sensitivity::{
    Family, Perturbation, Sensitivity, SensitivityError, sensitivities, sensitivity,
};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Outcome, Precision, Rollout, SimOptions, SimulateError,
    Start, Watch, roll_out,
};
use shared_types::RopeParams;
use shared_types::rope::RopeError;
use support::{rope, throw, world};

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
/// `relative` of its value; and those of the distance to the target.
fn central(indices: &[usize], relative: &[f64], options: &SimOptions) -> Vec<(Vec<f64>, f64)> {
    let (rope, arm) = (rope(), throw(0.0));
    let values = rope.to_array();
    let mut neighbours = Vec::new();
    for (index, relative) in indices.iter().zip(relative) {
        let step = relative * values[*index];
        for signed in [step, -step] {
            let Perturbation::Rope { rope, .. } = by(&rope, *index, signed) else {
                unreachable!("a rope is varied")
            };
            neighbours.push(Perturbation::Rope {
                rope,
                distance: step,
            });
        }
    }
    let s = run(&rope, &arm, &neighbours, options).unwrap();
    let nodes = s.slopes(|r| r.nodes.to_f64());
    let distance = s.slopes(|r| vec![r.watched.to_point.unwrap().distance_m]);
    let half = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| 0.5 * (a - b)).collect();
    let row = |rows: &[Option<Vec<f64>>], k: usize| -> Vec<f64> {
        half(rows[k].as_ref().unwrap(), rows[k + 1].as_ref().unwrap())
    };
    (0..indices.len())
        .map(|i| (row(&nodes, 2 * i), row(&distance, 2 * i)[0]))
        .collect()
}

/// Multiplying stiffness, damping and all masses by one factor changes no motion, so
/// the logarithmic slopes cancel.
#[test]
fn slopes_of_the_scale_symmetry_cancel() {
    let values = rope().to_array();
    let scaled = [DAMPING, STIFFNESS, MASS_PER_LENGTH, LEAD_MASS];
    let (mut sum, mut sum_of_distances) = (vec![0.0; 13 * 23 * 3], 0.0);
    for (index, (slopes, distance)) in
        scaled
            .into_iter()
            .zip(central(&scaled, &[1e-5; 4], &options()))
    {
        assert!(largest(slopes.iter().map(|x| x * values[index])) > 1e-3);
        for (sum, slope) in sum.iter_mut().zip(slopes) {
            *sum += slope * values[index];
        }
        sum_of_distances += distance * values[index];
    }
    let left = largest(sum);
    assert!(left < 1e-6, "{left} m per unit of the logarithm");
    assert!(sum_of_distances.abs() < 1e-6, "{sum_of_distances}");
    // The extra scale rules R_I here: it does little, the radius nothing.
    let little = central(&[RADIUS, EXTRA_SCALE], &[1e-5; 2], &options());
    assert_eq!(largest(little[0].0.iter().copied()), 0.0);
    assert!(largest(little[1].0.iter().copied()) > 0.0);
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
    for (index, ((a, _), (b, _))) in indices.into_iter().zip(double.into_iter().zip(single)) {
        let error = largest(a.iter().zip(&b).map(|(a, b)| a - b)) / largest(a);
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

/// One-sided differences err in proportion to the step.
#[test]
fn errors_fall_in_proportion_to_the_step() {
    let (rope, arm) = (rope(), throw(0.0));
    for index in [LENGTH, STIFFNESS] {
        let relative = [2e-2, 1e-2, 1e-3, 5e-4];
        let neighbours = relative.map(|r| by(&rope, index, r * rope.to_array()[index]));
        let s = run(&rope, &arm, &neighbours, &options()).unwrap();
        let rows = s.slopes(|r| r.nodes.to_f64());
        let [coarse, half, fine, finer] = [0, 1, 2, 3].map(|i| rows[i].clone().unwrap());
        let exact: Vec<f64> = fine.iter().zip(&finer).map(|(a, b)| 2.0 * b - a).collect();
        let error = |slopes: &[f64]| largest(slopes.iter().zip(&exact).map(|(a, b)| a - b));
        let found = error(&coarse) / error(&half);
        assert!((found / 2.0 - 1.0).abs() < 0.15, "{index}: {found}");
        let error = error(&half) / largest(exact.clone());
        assert!(error < 0.1 && error > 1e-6, "{index}: {error}");
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
    let options = SimOptions {
        start: Start::Straight {
            joint0_rotvec: [0.0, 1.0, 0.0],
        },
        step_s: 1e-3,
        ..options()
    };
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

/// Its acceleration jumps at a given time.
struct Jerk(Option<f64>);

impl AttachMotion for Jerk {
    fn at(&self, t_s: f64) -> FrameMotion {
        let t = self.0.map_or(0.0, |jump_s| (t_s - jump_s).max(0.0));
        let a = if t > 0.0 { 3.0 } else { 0.0 };
        FrameMotion {
            p_m: Vector3::x() * (1.5 * t * t),
            v_m_s: Vector3::x() * (3.0 * t),
            a_m_s2: Vector3::x() * a,
            ..FrameMotion::world()
        }
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        self.0.into_iter().collect()
    }
}

/// A jump on the grid of steps, moved a little, would add a step to one side.
#[test]
fn moved_jumps_do_not_change_the_number_of_steps() {
    let rope = rope();
    let around = |distance: f64| {
        let later = Jerk(Some(0.2 + distance));
        run(
            &rope,
            &Jerk(Some(0.2)),
            &[towards(&later, distance)],
            &options(),
        )
    };
    let near = slopes(&around(1e-5).unwrap()).remove(0);
    let wide = slopes(&around(4e-5).unwrap()).remove(0);
    // In the last frame the attach point's own slope, and a smooth one along the rope.
    let (first, last) = (12 * 23, 12 * 23 + 22);
    assert!((near[first].x + 3.0 * 0.4).abs() < 1e-4);
    let off = (wide[last] - near[last]).norm();
    assert!(off < 1e-3, "{off}");
    // Four steps further there is no common number of steps.
    let refused = SensitivityError::SteppedDifferently {
        base: 0,
        neighbour: 0,
    };
    assert_eq!(around(2e-3).unwrap_err(), refused);
    let smooth = Jerk(None);
    let found = run(
        &rope,
        &Jerk(Some(0.2)),
        &[towards(&smooth, 1.0)],
        &options(),
    );
    assert_eq!(found.unwrap_err(), refused);
}

/// Ends early, and is not finite at its end.
struct Broken {
    ends_s: f64,
}

impl AttachMotion for Broken {
    fn at(&self, t_s: f64) -> FrameMotion {
        let x = if t_s > 0.5 { f64::NAN } else { 0.0 };
        FrameMotion {
            p_m: Vector3::new(x, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        self.ends_s
    }
    fn holds_after_end(&self) -> bool {
        false
    }
}

#[test]
fn bad_input_is_named_with_base_and_neighbour() {
    let (rope, arm) = (rope(), throw(0.0));
    let good = [by(&rope, LENGTH, 1e-4)];
    let run = |rope: &RopeParams, motion: &dyn AttachMotion, perturbations: &[Perturbation]| {
        let fine = self::rope();
        let first = Family {
            base: Candidate::new(&fine, &world),
            perturbations: &good,
        };
        let second = Family {
            base: Candidate::new(rope, motion),
            perturbations,
        };
        sensitivities(&[first, second], &options()).unwrap_err()
    };
    assert_eq!(
        run(&rope, &arm, &[good[0], by(&rope, 0, 1.0)]),
        SensitivityError::LinksAreDiscrete {
            base: 1,
            neighbour: 1
        }
    );
    assert_eq!(
        run(&rope, &arm, &[by(&rope, LENGTH, -1e-3)]),
        SensitivityError::Distance {
            base: 1,
            neighbour: 0,
            value: -1e-3
        }
    );
    let light = Perturbation::Rope {
        rope: RopeParams {
            lead_mass_kg: -0.1,
            ..rope
        },
        distance: 1.0,
    };
    let SensitivityError::Neighbour {
        neighbour: 1,
        source:
            SimulateError::Rope {
                candidate: 1,
                source: RopeError::OutOfBounds { key, .. },
            },
    } = run(&rope, &arm, &[good[0], light])
    else {
        panic!("a negative mass was accepted")
    };
    assert_eq!(key, "lead_mass_kg");
    let none = RopeParams { links: 0, ..rope };
    assert!(matches!(
        run(&none, &arm, &good),
        SensitivityError::Base(SimulateError::Rope { candidate: 1, .. })
    ));
    let (short, nan) = (Broken { ends_s: 0.3 }, Broken { ends_s: 9.0 });
    assert!(matches!(
        run(&rope, &world, &[good[0], towards(&short, 1.0)]),
        SensitivityError::Neighbour {
            neighbour: 1,
            source: SimulateError::MotionTooShort { candidate: 1, .. }
        }
    ));
    assert!(matches!(
        run(&rope, &world, &[towards(&nan, 1.0)]),
        SensitivityError::Neighbour {
            neighbour: 0,
            source: SimulateError::MotionNotFinite { candidate: 1, .. }
        }
    ));
    assert!(matches!(
        run(&rope, &nan, &[]),
        SensitivityError::Base(SimulateError::MotionNotFinite { candidate: 1, .. })
    ));
}
