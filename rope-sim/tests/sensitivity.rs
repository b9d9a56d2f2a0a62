//! Slopes against symmetries of the model, rigid motions and extrapolation.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

#[path = "support/family.rs"]
mod family;

use arm_model::kinematics::FrameMotion;
use family::{TARGET, largest, numbers, options, rope, throw};
use nalgebra::{Rotation3, Vector3};
use rope_sim::sensitivity::{Beside, Difference, Direction, Family, sensitivities, sensitivity};
use rope_sim::{AttachMotion, Candidate, FrameTimes, Precision, Rollout, SimOptions, roll_out};
use shared_types::RopeParams;
use shared_types::rope::ROPE_PARAMETERS;

const LENGTH: usize = 1;
const DAMPING: usize = 2;
const STIFFNESS: usize = 3;
const RADIUS: usize = 4;
const MASS_PER_LENGTH: usize = 5;
const LEAD_MASS: usize = 6;
const EXTRA_SCALE: usize = 8;

/// Parameters 1 to 8, by the default steps.
fn all_parameters<'a>() -> Vec<Direction<'a>> {
    (1..ROPE_PARAMETERS)
        .map(|index| Direction::Parameter { index, step: None })
        .collect()
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
