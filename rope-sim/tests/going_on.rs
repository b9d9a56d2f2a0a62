//! A simulation that goes on from the state in which another ended is the one that never stopped.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod support;

use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use rope_sim::{
    AttachMotion, Candidate, PlannedArm, Precision, Rollout, SimOptions, Sway, roll_out,
};
use shared_types::{BendingFriction, RopeExtras, RopeParams, RopeState};
use support::{options, rope, simulate, throw, tips};

/// Where the motion is cut (s): while the arm moves, off the grid of steps.
const CUT_S: f64 = 0.3333;
const END_S: f64 = 0.9333;
const RATE_HZ: f64 = 100.0;

/// The throw from [`CUT_S`] on.
struct Rest<'a>(&'a PlannedArm);

impl AttachMotion for Rest<'_> {
    fn at(&self, t_s: f64) -> FrameMotion {
        self.0.at(t_s + CUT_S)
    }

    fn acceleration_jumps_s(&self) -> Vec<f64> {
        vec![0.4511 - CUT_S]
    }
}

fn rubbing() -> RopeParams {
    RopeParams {
        extras: Some(RopeExtras {
            friction: Some(BendingFriction {
                moment_max_nm: 4e-3,
                slip_curvature_per_m: 1.0,
            }),
            ..RopeExtras::NONE
        }),
        ..rope()
    }
}

/// The rope at the cut.
fn state_at_cut(rope: &RopeParams, precision: Precision) -> RopeState {
    let until = SimOptions {
        keeps_end: true,
        ..SimOptions::new(2.5e-4, precision, CUT_S)
    };
    let arm = throw(0.0);
    // Beside a motion that is cut into more steps.
    let longer = throw(0.2);
    let both = [Candidate::new(rope, &longer), Candidate::new(rope, &arm)];
    let ends = roll_out(&both, &until).unwrap();
    assert!(ends[0].end != ends[1].end);
    ends[1].end.clone().unwrap()
}

fn gone_on(rope: &RopeParams, state: &RopeState, precision: Precision) -> Rollout {
    let arm = throw(0.0);
    let rest = Rest(&arm);
    let options = SimOptions {
        step_s: 2.5e-4,
        ..options(precision, END_S - CUT_S, RATE_HZ)
    };
    let from = Candidate::new(rope, &rest).from_state(Some(state));
    roll_out(&[from], &options).unwrap().remove(0)
}

fn largest(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    apart.fold(0.0, f64::max)
}

#[test]
fn a_rope_goes_on_from_the_state_it_was_left_in() {
    let whole = SimOptions {
        step_s: 2.5e-4,
        frames: rope_sim::FrameTimes {
            first_s: CUT_S,
            period_s: 1.0 / RATE_HZ,
            count: 61,
        },
        ..SimOptions::new(2.5e-4, Precision::F64, END_S)
    };
    for rope in [rope(), rubbing()] {
        let arm = throw(0.0);
        let wanted = tips(&simulate(&rope_sim::Scene::EMPTY, &rope, &arm, &whole));
        for (precision, bound_m) in [(Precision::F64, 1e-4), (Precision::F32, 3e-4)] {
            let state = state_at_cut(&rope, precision);
            let found = tips(&gone_on(&rope, &state, precision));
            assert_eq!(found.len(), wanted.len());
            let off_m = largest(&found, &wanted);
            assert!(off_m < bound_m, "{precision:?}: {off_m}");
        }
        // Nothing of the state can be left out.
        let state = state_at_cut(&rope, Precision::F64);
        let still = RopeState::at_rest(state.attitudes.clone());
        let off_m = largest(&tips(&gone_on(&rope, &still, Precision::F64)), &wanted);
        assert!(off_m > 0.05, "{off_m}");
        if rope.extras.is_some() {
            let smooth = RopeState {
                friction_nm: Vec::new(),
                ..state
            };
            let off_m = largest(&tips(&gone_on(&rope, &smooth, Precision::F64)), &wanted);
            assert!(off_m > 5e-4, "{off_m}");
        }
    }
}

#[test]
fn a_state_of_another_rope_or_beside_a_swing_is_refused() {
    let state = state_at_cut(&rope(), Precision::F64);
    let arm = throw(0.0);
    let options = SimOptions::new(5e-4, Precision::F64, 0.1);
    let shorter = RopeParams {
        links: 21,
        ..rope()
    };
    let other = Candidate::new(&shorter, &arm).from_state(Some(&state));
    let error = roll_out(&[other], &options).unwrap_err().to_string();
    assert!(error.contains("a rope of 21 links"), "{error}");
    let rope = rope();
    let swaying = Candidate::new(&rope, &arm).with_sway(Sway {
        angle_rad: [0.1, 0.0],
        rate_rad_s: [0.0; 2],
    });
    let error = roll_out(&[swaying.from_state(Some(&state))], &options);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("give it one of them"), "{error}");
}
