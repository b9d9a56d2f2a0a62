//! Slopes against symmetries of the model, rigid motions and extrapolation.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::float_cmp,
    missing_docs,
    reason = "tests may fail loudly"
)]

use nalgebra::{Rotation3, Vector3};
use rope_sim::sensitivity::{
    Beside, Difference, Direction, Doubt, Family, Sensitivity, SensitivityError, sensitivities,
    sensitivity,
};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Outcome, PlannedArm, Precision, Rollout, SimOptions,
    SimulateError, Start, Watch, roll_out,
};
use shared_types::kinematics::FrameMotion;
use shared_types::rope::{ROPE_PARAMETERS, RopeError};
use shared_types::{JointTrajectory, JointVector, RopeParams};

const LENGTH: usize = 1;
const DAMPING: usize = 2;
const STIFFNESS: usize = 3;
const RADIUS: usize = 4;
const MASS_PER_LENGTH: usize = 5;
const LEAD_MASS: usize = 6;
const EXTRA_SCALE: usize = 8;
const TARGET: [f64; 3] = [0.45, 0.1, 0.05];

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.01, 0.2, 0.008, 0.06, 0.06, 0.03, 0.8])
}

/// A throw whose middle waypoint is moved by `offset` at joint 2 (rad).
fn throw(offset: f64) -> PlannedArm {
    let waypoints = [
        JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
        JointVector([0.2, -0.3 + offset, 0.2, 0.8, -0.2, 1.2, 0.3]),
        JointVector([0.1, -0.5, 0.1, 1.0, 0.1, 1.6, -0.2]),
    ];
    PlannedArm::new(JointTrajectory::new(&[0.0, 0.2137, 0.4511], &waypoints).unwrap())
}

fn options() -> SimOptions {
    SimOptions {
        step_s: 5e-4,
        precision: Precision::F64,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 0.05,
            count: 13,
        },
        watch: Watch {
            final_state: true,
            ..Watch::point(TARGET)
        },
        horizon_s: 0.6,
        threads: 1,
    }
}

/// Parameters 1 to 8, by the default steps.
fn all_parameters<'a>() -> Vec<Direction<'a>> {
    (1..ROPE_PARAMETERS)
        .map(|index| Direction::Parameter { index, step: None })
        .collect()
}

fn by<'a>(index: usize, step: f64) -> Direction<'a> {
    Direction::Parameter {
        index,
        step: Some(step),
    }
}

fn numbers(s: &Sensitivity, direction: usize) -> Vec<f64> {
    s.nodes(direction).unwrap().to_f64()
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Multiplying stiffness, damping and all masses by one factor changes no motion, so
/// the logarithmic slopes cancel.
#[test]
fn slopes_of_the_scale_symmetry_cancel() {
    let (rope, arm) = (rope(), throw(0.0));
    let base = Candidate::new(&rope, &arm);
    let s = sensitivity(base, &all_parameters(), Difference::Central, &options()).unwrap();
    let values = rope.to_array();
    let scaled = [DAMPING, STIFFNESS, MASS_PER_LENGTH, LEAD_MASS];
    let mut sum = vec![0.0; numbers(&s, 0).len()];
    for index in scaled {
        let slopes = numbers(&s, index - 1);
        assert!(largest(slopes.iter().map(|x| x * values[index])) > 1e-3);
        for (sum, slope) in sum.iter_mut().zip(slopes) {
            *sum += slope * values[index];
        }
    }
    let left = largest(sum);
    assert!(left < 1e-6, "{left} m per unit of the logarithm");
    // The same for the miss and for the last state.
    let miss: f64 = scaled
        .iter()
        .map(|i| s.closest(i - 1).unwrap().distance_m * values[*i])
        .sum();
    assert!(miss.abs() < 1e-6, "{miss}");
    let spin: Vector3<f64> = scaled
        .iter()
        .map(|i| Vector3::from(s.final_state(i - 1).unwrap()[21].w_rad_s) * values[*i])
        .sum();
    assert!(spin.norm() < 1e-4, "{spin}");
    // The extra scale rules R_I here: it does little, the radius nothing.
    assert_eq!(largest(numbers(&s, RADIUS - 1)), 0.0);
    assert!(largest(numbers(&s, EXTRA_SCALE - 1)) > 0.0);
}

/// A motion turned about the vertical through the origin and then shifted.
struct Moved<'a> {
    motion: &'a dyn AttachMotion,
    turn_rad: f64,
    shift_m: f64,
}

impl AttachMotion for Moved<'_> {
    fn at(&self, t_s: f64) -> FrameMotion {
        let m = self.motion.at(t_s);
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), self.turn_rad).into_inner();
        FrameMotion {
            p_m: turn * m.p_m + Vector3::new(0.3, -0.5, 1.1) * self.shift_m,
            r: turn * m.r,
            v_m_s: turn * m.v_m_s,
            w_rad_s: turn * m.w_rad_s,
            a_m_s2: turn * m.a_m_s2,
            alpha_rad_s2: turn * m.alpha_rad_s2,
        }
    }
    fn duration_s(&self) -> f64 {
        self.motion.duration_s()
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        self.motion.acceleration_jumps_s()
    }
}

#[test]
fn rigid_motions_carry_the_rope_along() {
    let (rope, arm) = (rope(), throw(0.0));
    let moved = |turn_rad, shift_m| Moved {
        motion: &arm,
        turn_rad,
        shift_m,
    };
    let (shifted, back) = (moved(0.0, 1e-3), moved(0.0, -1e-3));
    let (turned, turned_back) = (moved(1e-4, 0.0), moved(-1e-4, 0.0));
    let direction = |plus, minus, distance| Direction::Motion {
        plus: Beside { at: plus, distance },
        minus: Some(Beside {
            at: minus,
            distance,
        }),
    };
    let directions = [
        direction(
            &shifted as &dyn AttachMotion,
            &back as &dyn AttachMotion,
            1e-3,
        ),
        direction(&turned, &turned_back, 1e-4),
    ];
    let base = Candidate::new(&rope, &arm);
    let s = sensitivity(base, &directions, Difference::Central, &options()).unwrap();
    let [shift, turn] = [0, 1].map(|d| s.nodes(d).unwrap());
    for frame in 0..13 {
        for node in 0..=22 {
            let x = s.base.nodes.position(frame, node);
            let off = shift.position(frame, node) - Vector3::new(0.3, -0.5, 1.1);
            assert!(off.norm() < 1e-9, "frame {frame} node {node}: {off}");
            let off = turn.position(frame, node) - Vector3::z().cross(&x);
            assert!(off.norm() < 1e-7, "frame {frame} node {node}: {off}");
        }
    }
    let states = s.base.watched.final_state.as_ref().unwrap();
    for (link, state) in s.final_state(1).unwrap().iter().zip(states) {
        assert!((Vector3::from(link.turn_rad) - Vector3::z()).norm() < 1e-7);
        let spin = Vector3::z().cross(&Vector3::from(state.w_rad_s));
        assert!((Vector3::from(link.w_rad_s) - spin).norm() < 1e-5);
    }
    let slope = s.closest(0).unwrap();
    let approach = s.base.watched.to_point.unwrap();
    let away = Vector3::from(approach.tip_m) - Vector3::from(TARGET);
    let want = away.normalize().dot(&Vector3::new(0.3, -0.5, 1.1));
    assert!((slope.distance_m - want).abs() < 1e-5, "{slope:?} {want}");
}

/// Swings softly along x from `from_s` on.
struct Swing {
    from_s: f64,
}

impl AttachMotion for Swing {
    fn at(&self, t_s: f64) -> FrameMotion {
        let (w, t) = (9.0, (t_s - self.from_s).max(0.0));
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
    fn duration_s(&self) -> f64 {
        5.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// A later motion is the same motion: its slope is minus the velocity.
#[test]
fn slopes_of_a_delay_are_velocities() {
    let rope = rope();
    let (now, later, earlier) = (
        Swing { from_s: 0.1 },
        Swing { from_s: 0.101 },
        Swing { from_s: 0.099 },
    );
    let direction = Direction::Motion {
        plus: Beside {
            at: &later,
            distance: 1e-3,
        },
        minus: Some(Beside {
            at: &earlier,
            distance: 1e-3,
        }),
    };
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.599,
            period_s: 0.001,
            count: 3,
        },
        horizon_s: 0.61,
        ..options()
    };
    let base = Candidate::new(&rope, &now);
    let s = sensitivity(base, &[direction], Difference::Central, &options).unwrap();
    let slope = s.nodes(0).unwrap();
    for node in 0..=22 {
        let nodes = &s.base.nodes;
        let velocity = (nodes.position(2, node) - nodes.position(0, node)) / 0.002;
        assert!(node == 0 || velocity.norm() > 0.1);
        let off = (slope.position(1, node) + velocity).norm();
        assert!(
            off < 2e-4 * velocity.norm() + 1e-5,
            "{node}: {off} {velocity}"
        );
    }
}

/// Forward differences err in proportion to the step, central ones to its square; both
/// tend to Richardson's extrapolation, and the default step is close to it.
#[test]
fn errors_fall_with_the_order_of_the_difference() {
    let (rope, arm) = (rope(), throw(0.0));
    let base = Candidate::new(&rope, &arm);
    for index in [LENGTH, STIFFNESS] {
        let value = rope.to_array()[index];
        let slopes = |relative: Option<f64>, difference| {
            let step = relative.map(|r| r * value);
            let direction = Direction::Parameter { index, step };
            numbers(
                &sensitivity(base, &[direction], difference, &options()).unwrap(),
                0,
            )
        };
        let fine = slopes(Some(1e-3), Difference::Central);
        let finer = slopes(Some(5e-4), Difference::Central);
        let exact: Vec<f64> = fine
            .iter()
            .zip(&finer)
            .map(|(a, b)| b + (b - a) / 3.0)
            .collect();
        let error = |relative, difference| {
            let slopes = slopes(relative, difference);
            largest(slopes.iter().zip(&exact).map(|(a, b)| a - b)) / largest(exact.clone())
        };
        for (difference, ratio) in [(Difference::Forward, 2.0), (Difference::Central, 4.0)] {
            let (coarse, half) = (error(Some(2e-2), difference), error(Some(1e-2), difference));
            let found = coarse / half;
            assert!((found / ratio - 1.0).abs() < 0.15, "{index}: {found}");
            assert!(half < 0.1 && half > 1e-6, "{index}: {half}");
        }
        let default = error(None, Difference::Central);
        assert!(default < 1e-6, "{index}: {default}");
        let default = error(None, Difference::Forward);
        assert!(default < 1e-4, "{index}: {default}");
    }
}

#[test]
fn single_precision_comes_close_with_its_larger_steps() {
    let (rope, arm) = (rope(), throw(0.0));
    let base = Candidate::new(&rope, &arm);
    let with = |precision| {
        let options = SimOptions {
            precision,
            ..options()
        };
        sensitivity(base, &all_parameters(), Difference::Central, &options).unwrap()
    };
    let (double, single) = (with(Precision::F64), with(Precision::F32));
    for index in [LENGTH, DAMPING, STIFFNESS, MASS_PER_LENGTH, LEAD_MASS] {
        let (a, b) = (numbers(&double, index - 1), numbers(&single, index - 1));
        let error = largest(a.iter().zip(&b).map(|(a, b)| a - b)) / largest(a);
        assert!(error < 0.02, "parameter {index}: {error}");
    }
}

/// Slopes of a waypoint from one call are those of separate rollouts.
#[test]
fn a_moved_waypoint_is_a_motion() {
    let (rope, arm, beside) = (rope(), throw(0.0), throw(1e-4));
    let direction = Direction::Motion {
        plus: Beside {
            at: &beside,
            distance: 1e-4,
        },
        minus: None,
    };
    let base = Candidate::new(&rope, &arm);
    let s = sensitivity(base, &[direction], Difference::Central, &options()).unwrap();
    let alone: Vec<Rollout> = [&arm, &beside]
        .map(|motion| roll_out(&[Candidate::new(&rope, motion)], &options()).unwrap())
        .into_iter()
        .flatten()
        .collect();
    assert_eq!(s.base, alone[0]);
    assert_eq!(s.neighbours[0].to, alone[1]);
    let tip = |r: &Rollout| r.nodes.position(12, 22).as_slice().to_vec();
    let slopes = s.slopes(tip).remove(0).unwrap();
    let want = (alone[1].nodes.position(12, 22) - alone[0].nodes.position(12, 22)) / 1e-4;
    assert!((Vector3::from_vec(slopes) - want).norm() < 1e-9);
    assert!(want.norm() > 0.1);
}

#[test]
fn companions_and_threads_do_not_change_slopes() {
    let arm = throw(0.0);
    let ropes = [0.15, 0.2, 0.3].map(|k| RopeParams {
        joint_stiffness_nm_per_rad: k,
        ..rope()
    });
    let directions = all_parameters();
    let families = [0, 1, 2].map(|i| Family {
        base: Candidate::new(&ropes[i], &arm),
        directions: &directions[i..],
    });
    let together = |threads| {
        let options = SimOptions {
            threads,
            ..options()
        };
        sensitivities(&families, Difference::Forward, &options).unwrap()
    };
    let all = together(3);
    assert_eq!(all, together(1));
    for (family, got) in families.iter().zip(&all) {
        let alone = sensitivity(
            family.base,
            family.directions,
            Difference::Forward,
            &options(),
        );
        assert_eq!(*got, alone.unwrap());
    }
}

/// At the end of the physical range the neighbour inside is left.
#[test]
fn parameters_at_their_bounds_have_one_neighbour() {
    let arm = throw(0.0);
    let undamped = RopeParams {
        joint_damping_nms_per_rad: 0.0,
        ..rope()
    };
    let stiffest = RopeParams {
        joint_stiffness_nm_per_rad: 100.0,
        ..rope()
    };
    let s = |rope: &RopeParams, direction| {
        let base = Candidate::new(rope, &arm);
        sensitivity(base, &[direction], Difference::Central, &options()).unwrap()
    };
    let up = s(&undamped, by(DAMPING, 1e-5));
    assert!(up.neighbours[0].from.is_none() && up.neighbours[0].span > 0.0);
    let down = s(&stiffest, by(STIFFNESS, 1e-2));
    assert!(down.neighbours[0].from.is_none() && down.neighbours[0].span < 0.0);
    // One-sided towards smaller values, it has the slope of a nearby inner point.
    let inner = RopeParams {
        joint_stiffness_nm_per_rad: 99.98,
        ..rope()
    };
    let inner = numbers(&s(&inner, by(STIFFNESS, 1e-2)), 0);
    let down = numbers(&down, 0);
    let off = largest(down.iter().zip(&inner).map(|(a, b)| a - b));
    assert!(off < 1e-2 * largest(inner), "{off}");
}

#[test]
fn a_kink_between_neighbours_is_flagged() {
    let arm = throw(0.0);
    let link_length_m = rope().link_length_m();
    let rope = RopeParams {
        radius_m: 0.4 * link_length_m,
        ..rope()
    };
    let base = Candidate::new(&rope, &arm);
    let directions = [by(EXTRA_SCALE, 1e-3), by(STIFFNESS, 1e-3)];
    let s = sensitivity(base, &directions, Difference::Central, &options()).unwrap();
    assert_eq!(s.neighbours[0].doubt, Some(Doubt::InertiaKink));
    assert_eq!(s.neighbours[1].doubt, None);
}

/// Stands still; the rope is released from a snapped joint.
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
        let rollouts = roll_out(&[Candidate::new(rope, &Still)], &options).unwrap();
        (rollouts[0].outcome, rollouts[0].nodes.clone())
    };
    assert_eq!(outcome(&wild, 1e-3).0, Outcome::RerunAtQuarterStep);
    assert_eq!(outcome(&calm, 1e-3).0, Outcome::Clean);
    let towards = |at| Direction::Rope {
        plus: Beside { at, distance: 1.0 },
        minus: None,
    };
    let base = Candidate::new(&calm, &Still);
    let one = [towards(wild)];
    let s = sensitivity(base, &one, Difference::Forward, &options).unwrap();
    assert_eq!(s.neighbours[0].doubt, None);
    assert_eq!(s.base.outcome, Outcome::RerunAtQuarterStep);
    assert_eq!(s.base.nodes, outcome(&calm, 2.5e-4).1);
    assert_eq!(s.neighbours[0].to.nodes, outcome(&wild, 2.5e-4).1);

    let hopeless = SimOptions {
        step_s: 5e-3,
        ..options
    };
    assert_ne!(outcome(&wild, 1.25e-3).0, Outcome::Clean);
    let both = [towards(wild), towards(calm)];
    let s = sensitivity(base, &both, Difference::Forward, &hopeless).unwrap();
    assert_eq!(s.neighbours[0].doubt, Some(Doubt::Diverged));
    assert!(s.nodes(0).is_none() && s.closest(0).is_none() && s.final_state(0).is_none());
    let slopes = s.slopes(|r| r.nodes.to_f64());
    assert!(slopes[0].is_none());
    assert_eq!(largest(slopes[1].clone().unwrap()), 0.0);
}

/// Its acceleration jumps at a given time.
struct Jerk {
    jump_s: Option<f64>,
}

impl AttachMotion for Jerk {
    fn at(&self, t_s: f64) -> FrameMotion {
        let t = self.jump_s.map_or(0.0, |jump| (t_s - jump).max(0.0));
        let a = if t > 0.0 { 3.0 } else { 0.0 };
        FrameMotion {
            p_m: Vector3::x() * (1.5 * t * t),
            v_m_s: Vector3::x() * (3.0 * t),
            a_m_s2: Vector3::x() * a,
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        5.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        self.jump_s.into_iter().collect()
    }
}

/// A jump on the grid of steps, moved a little, would add a step to one side.
#[test]
fn moved_jumps_do_not_change_the_number_of_steps() {
    let rope = rope();
    let jerk = |jump_s| Jerk {
        jump_s: Some(jump_s),
    };
    let (base, plus, minus) = (jerk(0.2), jerk(0.2 + 1e-5), jerk(0.2 - 1e-5));
    let direction = |plus, minus| Direction::Motion {
        plus: Beside {
            at: plus,
            distance: 1e-5,
        },
        minus: Some(Beside {
            at: minus,
            distance: 1e-5,
        }),
    };
    let directions = [direction(&plus as &dyn AttachMotion, &minus)];
    let candidate = Candidate::new(&rope, &base);
    let s = sensitivity(candidate, &directions, Difference::Central, &options()).unwrap();
    let slope = s.nodes(0).unwrap();
    let (frame, t) = (12, 0.4);
    // The attach point's own slope, and a smooth one along the rope.
    assert!((slope.position(frame, 0).x + 3.0 * t).abs() < 1e-6);
    let around = |distance| {
        let (later, earlier) = (jerk(0.2 + distance), jerk(0.2 - distance));
        let direction = Direction::Motion {
            plus: Beside {
                at: &later as &dyn AttachMotion,
                distance,
            },
            minus: Some(Beside {
                at: &earlier,
                distance,
            }),
        };
        sensitivity(candidate, &[direction], Difference::Central, &options())
    };
    let wide = around(4e-5).unwrap().nodes(0).unwrap();
    let off = (wide.position(frame, 22) - slope.position(frame, 22)).norm();
    assert!(off < 1e-4, "{off}");
    // Four steps further there is no common number of steps.
    assert!(matches!(
        around(2e-3),
        Err(SensitivityError::SteppedDifferently { .. })
    ));

    let smooth = Jerk { jump_s: None };
    let directions = [direction(&smooth as &dyn AttachMotion, &smooth)];
    assert!(matches!(
        sensitivity(candidate, &directions, Difference::Central, &options()),
        Err(SensitivityError::SteppedDifferently {
            base: 0,
            direction: 0
        })
    ));
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
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
    fn holds_after_end(&self) -> bool {
        false
    }
}

#[test]
fn bad_input_is_named_with_base_and_direction() {
    let (rope, arm) = (rope(), throw(0.0));
    let good = [by(LENGTH, 1e-4)];
    let run = |rope: &RopeParams, motion: &dyn AttachMotion, directions: &[Direction]| {
        let fine = self::rope();
        let first = Family {
            base: Candidate::new(&fine, &Still),
            directions: &good,
        };
        let second = Family {
            base: Candidate::new(rope, motion),
            directions,
        };
        sensitivities(&[first, second], Difference::Central, &options()).unwrap_err()
    };
    assert_eq!(
        run(&rope, &arm, &[good[0], by(0, 1.0)]),
        SensitivityError::LinksAreDiscrete {
            base: 1,
            direction: 1
        }
    );
    assert_eq!(
        run(&rope, &arm, &[by(9, 1.0)]),
        SensitivityError::UnknownParameter {
            base: 1,
            direction: 0,
            index: 9
        }
    );
    assert_eq!(
        run(&rope, &arm, &[by(LENGTH, -1e-3)]),
        SensitivityError::Distance {
            base: 1,
            direction: 0,
            value: -1e-3
        }
    );
    let towards = |at| Direction::Rope {
        plus: Beside { at, distance: 1.0 },
        minus: None,
    };
    let more = RopeParams { links: 23, ..rope };
    assert!(matches!(
        run(&rope, &arm, &[towards(more)]),
        SensitivityError::LinksAreDiscrete { .. }
    ));
    let light = RopeParams {
        lead_mass_kg: -0.1,
        ..rope
    };
    let SensitivityError::Neighbour {
        direction: 1,
        source:
            SimulateError::Rope {
                candidate: 1,
                source: RopeError::OutOfBounds { key, .. },
            },
    } = run(&rope, &arm, &[good[0], towards(light)])
    else {
        panic!("a negative mass was accepted")
    };
    assert_eq!(key, "lead_mass_kg");
    let none = RopeParams { links: 0, ..rope };
    assert!(matches!(
        run(&none, &arm, &good),
        SensitivityError::Base(SimulateError::Rope { candidate: 1, .. })
    ));
    let beside = |at| Direction::Motion {
        plus: Beside { at, distance: 1.0 },
        minus: None,
    };
    let (short, nan) = (Broken { ends_s: 0.3 }, Broken { ends_s: 9.0 });
    assert!(matches!(
        run(&rope, &Still, &[good[0], beside(&short)]),
        SensitivityError::Neighbour {
            direction: 1,
            source: SimulateError::MotionTooShort { candidate: 1, .. }
        }
    ));
    assert!(matches!(
        run(&rope, &Still, &[beside(&nan)]),
        SensitivityError::Neighbour {
            direction: 0,
            source: SimulateError::MotionNotFinite { candidate: 1, .. }
        }
    ));
    assert!(matches!(
        run(&rope, &nan, &[]),
        SensitivityError::Base(SimulateError::MotionNotFinite { candidate: 1, .. })
    ));
}
