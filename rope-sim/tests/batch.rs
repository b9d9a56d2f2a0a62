//! Batches: a rope's result is its own, whatever runs beside it.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

use arm_model::JointVector;
use arm_model::Pole;
use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use proptest::prelude::*;
use rope_sim::{
    AttachMotion, BoxRegion, Candidate, FrameTimes, Kernel, MeasuredArm, MotionError, Outcome,
    PoseRow, PoseTrack, Precision, Rollout, SimOptions, SimulateError, Start, Watch, roll_out,
    roll_out_with,
};
use shared_types::RopeParams;
use shared_types::rope::{RANGES, RopeError};

/// Shakes along x with a constant acceleration that flips at every `period_s / 2`.
#[derive(Debug, Clone)]
struct Shake {
    acceleration_m_s2: f64,
    period_s: f64,
}

impl AttachMotion for Shake {
    fn at(&self, t_s: f64) -> FrameMotion {
        let half = self.period_s / 2.0;
        let (whole, part) = ((t_s / half).floor(), t_s.rem_euclid(half));
        let falling = whole.rem_euclid(2.0) > 0.5;
        let a = self.acceleration_m_s2;
        let sign = if falling { -1.0 } else { 1.0 };
        let done = 0.5 * a * half * half * whole;
        let x = if falling {
            a * half * part - 0.5 * a * part * part
        } else {
            0.5 * a * part * part
        };
        let v = if falling { a * (half - part) } else { a * part };
        FrameMotion {
            p_m: Vector3::new(done + x, 0.0, 1.0),
            v_m_s: Vector3::new(v, 0.0, 0.0),
            a_m_s2: Vector3::new(sign * a, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        10.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        (0..200)
            .map(|i| f64::from(i) * self.period_s / 2.0)
            .collect()
    }
}

fn options(threads: usize) -> SimOptions {
    SimOptions {
        step_s: 1e-3,
        precision: Precision::F32,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.003,
            period_s: 0.0171,
            count: 4,
        },
        watch: Watch {
            point_m: Some([0.3, 0.1, 0.6]),
            segment_m: Some([[0.0, 0.1, 0.5], [0.1, -0.1, 0.5]]),
            dwell_in: Some(BoxRegion {
                center_m: [0.0, 0.0, 0.5],
                half_m: [0.01, 0.01, 0.1],
                yaw_rad: 0.4,
            }),
            height: true,
            rest_window_s: Some(0.03),
            final_state: true,
        },
        horizon_s: 0.07,
        threads,
    }
}

fn arbitrary_rope() -> impl Strategy<Value = RopeParams> {
    prop::array::uniform9(0.0f64..1.0).prop_map(|unit| {
        let mut v: [f64; 9] =
            core::array::from_fn(|i| RANGES[i].min + unit[i] * (RANGES[i].max - RANGES[i].min));
        v[0] = if unit[0] < 0.5 { 20.0 } else { 21.0 };
        RopeParams::from_array(v)
    })
}

fn arbitrary_shake() -> impl Strategy<Value = Shake> {
    (1.0f64..40.0, 0.02f64..0.3).prop_map(|(acceleration_m_s2, period_s)| Shake {
        acceleration_m_s2,
        period_s,
    })
}

fn run(kernel: Kernel, ropes: &[(RopeParams, Shake)], threads: usize) -> Vec<Rollout> {
    let candidates: Vec<Candidate> = ropes
        .iter()
        .map(|(rope, motion)| Candidate::new(rope, motion))
        .collect();
    roll_out_with(kernel, &candidates, &options(threads)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn neighbours_lanes_and_threads_do_not_change_a_bit(
        ropes in prop::collection::vec((arbitrary_rope(), arbitrary_shake()), 1..40),
        threads in 1usize..4,
    ) {
        let double = Precision::F64.fastest_kernel();
        for kernel in [Precision::F32.fastest_kernel(), double, Kernel::PortableF32] {
            let together = run(kernel, &ropes, threads);
            for (index, (rope, result)) in ropes.iter().zip(&together).enumerate() {
                let alone = run(kernel, core::slice::from_ref(rope), 1);
                prop_assert_eq!(result, &alone[0], "{:?} candidate {}", kernel, index);
            }
        }
    }

    #[test]
    fn vector_kernels_of_one_precision_agree_bit_by_bit(
        ropes in prop::collection::vec((arbitrary_rope(), arbitrary_shake()), 1..20),
    ) {
        let fused = [
            [Kernel::Avx512F32, Kernel::Avx2F32],
            [Kernel::Avx512F64, Kernel::Avx2F64],
            [Kernel::Avx2F64, Kernel::ScalarF64],
        ];
        for [a, b] in fused {
            if a.is_available() && b.is_available() && Kernel::Avx2F32.is_available() {
                prop_assert_eq!(run(a, &ropes, 1), run(b, &ropes, 1), "{:?} {:?}", a, b);
            }
        }
    }
}

fn rope() -> RopeParams {
    RopeParams::from_array([20.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0])
}

#[test]
fn a_rope_that_blows_up_is_flagged_and_harms_nobody() {
    let gentle = (
        rope(),
        Shake {
            acceleration_m_s2: 3.0,
            period_s: 0.1,
        },
    );
    let absurd = (
        rope(),
        Shake {
            acceleration_m_s2: 1e7,
            period_s: 0.1,
        },
    );
    let together = run(
        Precision::F32.fastest_kernel(),
        &[gentle.clone(), absurd, gentle.clone()],
        2,
    );
    let alone = run(Precision::F32.fastest_kernel(), &[gentle], 1);
    assert_eq!(together[0], alone[0]);
    assert_eq!(together[2], alone[0]);
    assert_eq!(together[0].outcome, Outcome::Clean);
    assert_eq!(together[1].outcome, Outcome::Diverged);
    assert!(together[1].watched.to_point.is_none());
    assert!(together[1].nodes.to_f64().iter().all(|x| x.is_finite()));
}

#[test]
fn sharing_a_motion_changes_nothing() {
    let shake = Shake {
        acceleration_m_s2: 12.0,
        period_s: 0.06,
    };
    let copy = shake.clone();
    let rope = rope();
    let shared = [Candidate::new(&rope, &shake), Candidate::new(&rope, &shake)];
    let separate = [Candidate::new(&rope, &shake), Candidate::new(&rope, &copy)];
    assert_eq!(
        roll_out(&shared, &options(1)).unwrap(),
        roll_out(&separate, &options(2)).unwrap()
    );
}

struct Broken;

impl AttachMotion for Broken {
    fn at(&self, t_s: f64) -> FrameMotion {
        let x = if t_s > 0.03 { f64::NAN } else { 0.0 };
        FrameMotion {
            v_m_s: Vector3::new(x, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        0.05
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
    fn holds_after_end(&self) -> bool {
        false
    }
}

/// The error of a batch whose second candidate is this one.
fn refusal(rope: &RopeParams, motion: &dyn AttachMotion, options: &SimOptions) -> SimulateError {
    let (good, shake) = (
        self::rope(),
        Shake {
            acceleration_m_s2: 1.0,
            period_s: 0.1,
        },
    );
    let first = Candidate::new(&good, &shake);
    roll_out(&[first, Candidate::new(rope, motion)], options).unwrap_err()
}

#[test]
fn candidates_that_cannot_be_simulated_are_named() {
    let (good, base) = (rope(), options(1));
    let shake = Shake {
        acceleration_m_s2: 1.0,
        period_s: 0.1,
    };
    for (rope, key) in [
        (RopeParams { links: 0, ..good }, "links"),
        (
            RopeParams {
                lead_mass_kg: -0.1,
                ..good
            },
            "lead_mass_kg",
        ),
        (
            RopeParams {
                length_m: f64::NAN,
                ..good
            },
            "length_m",
        ),
    ] {
        let error = refusal(&rope, &shake, &base);
        let SimulateError::Rope {
            candidate: 1,
            source,
        } = error
        else {
            panic!("{error}")
        };
        let RopeError::OutOfBounds { key: found, .. } = source;
        assert_eq!(found, key);
    }
    assert!(matches!(
        refusal(&good, &Broken, &base),
        SimulateError::MotionTooShort { candidate: 1, .. }
    ));
    let short = SimOptions {
        horizon_s: 0.05,
        frames: FrameTimes::NONE,
        ..base
    };
    assert!(matches!(
        refusal(&good, &Broken, &short),
        SimulateError::MotionNotFinite { candidate: 1, .. }
    ));
}

/// What a person reads: the candidate, the field, the value, what is allowed.
#[test]
fn refusals_read_as_sentences_that_name_candidate_and_field() {
    let (good, base) = (rope(), options(1));
    let shake = Shake {
        acceleration_m_s2: 1.0,
        period_s: 0.1,
    };
    let heavy = RopeParams {
        mass_per_length_kg_per_m: -0.05,
        ..good
    };
    let late = SimOptions {
        horizon_s: 0.05,
        frames: FrameTimes::NONE,
        ..base
    };
    for (error, words) in [
        (
            refusal(&heavy, &shake, &base),
            ["candidate 1", "mass_per_length_kg_per_m", "-0.05"],
        ),
        (
            refusal(&RopeParams { links: 201, ..good }, &shake, &base),
            ["candidate 1", "links", "200"],
        ),
        (
            refusal(&good, &Broken, &base),
            ["candidate 1", "ends at 0.05 s", "horizon of 0.07 s"],
        ),
        (
            refusal(&good, &Broken, &late),
            ["candidate 1", "motion is not finite", " s"],
        ),
    ] {
        let sentence = error.to_string();
        for word in words {
            assert!(sentence.contains(word), "`{sentence}` lacks `{word}`");
        }
    }
}

/// Motions are refused when they are made, before they meet a rope.
#[test]
fn times_that_do_not_increase_name_the_sample() {
    let row = |t_s: f64| PoseRow {
        t_s,
        p_m: [0.0, 0.0, 1.0],
        q_wxyz: [1.0, 0.0, 0.0, 0.0],
    };
    for times_s in [[0.0, 0.1, 0.1, 0.2], [0.0, 0.2, 0.1, 0.3]] {
        let error = PoseTrack::new(&times_s.map(row)).unwrap_err();
        assert!(
            matches!(error, MotionError::TimeOrder { index: 2, .. }),
            "{error}"
        );
        assert!(error.to_string().contains("sample 2"), "{error}");
    }
    let times_s = [0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.04, 0.07];
    let error = MeasuredArm::new(&times_s, &[JointVector::ZERO; 8], Pole::default()).unwrap_err();
    assert!(
        matches!(error, MotionError::TimeOrder { index: 6, .. }),
        "{error}"
    );
}

#[test]
fn options_that_make_no_sense_are_named() {
    let (good, base) = (rope(), options(1));
    let shake = Shake {
        acceleration_m_s2: 1.0,
        period_s: 0.1,
    };
    let late = FrameTimes {
        first_s: 0.0,
        period_s: 0.1,
        count: 2,
    };
    assert!(matches!(
        refusal(
            &good,
            &shake,
            &SimOptions {
                frames: late,
                ..base
            }
        ),
        SimulateError::FramesOutsideHorizon { .. }
    ));
    for (options, field) in [
        (
            SimOptions {
                step_s: 0.0,
                ..base
            },
            "step_s",
        ),
        (
            SimOptions {
                step_s: 1e-12,
                ..base
            },
            "step_s",
        ),
        (
            SimOptions {
                horizon_s: f64::NAN,
                ..base
            },
            "horizon_s",
        ),
        (
            SimOptions {
                watch: Watch::point([0.0, f64::INFINITY, 0.0]),
                ..base
            },
            "watch.point_m",
        ),
    ] {
        let error = refusal(&good, &shake, &options);
        assert!(
            matches!(error, SimulateError::Option { field: f, .. } if f == field),
            "{error}"
        );
    }
}
