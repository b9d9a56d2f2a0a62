//! What slopes may be asked for, and which are refused or flagged.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

#[path = "support/family.rs"]
mod family;

use arm_model::kinematics::FrameMotion;
use family::{largest, numbers, options, rope, throw};
use nalgebra::Vector3;
use rope_sim::sensitivity::{
    Beside, Difference, Direction, Doubt, Family, SensitivityError, sensitivities, sensitivity,
};
use rope_sim::{AttachMotion, Candidate, Outcome, SimOptions, SimulateError, Start, roll_out};
use shared_types::RopeParams;
use shared_types::rope::RopeError;

const LENGTH: usize = 1;
const DAMPING: usize = 2;
const STIFFNESS: usize = 3;
const EXTRA_SCALE: usize = 8;

fn by<'a>(index: usize, step: f64) -> Direction<'a> {
    Direction::Parameter {
        index,
        step: Some(step),
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
