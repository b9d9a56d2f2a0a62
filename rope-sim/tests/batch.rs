//! Batches: a rope's result is its own, whatever runs beside it.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use nalgebra::Vector3;
use proptest::prelude::*;
use rope_sim::{
    AttachMotion, BoxRegion, Candidate, FrameTimes, Kernel, Outcome, Precision, Rollout, Scene,
    SimOptions, Watch, roll_out, roll_out_in_with,
};
use shared_types::RopeParams;
use shared_types::rope::RANGES;
use support::pushed::{Broken, Pushed};

/// Shakes along x with a constant acceleration that flips at every `period_s / 2`, above the
/// origin.
fn shake(acceleration_m_s2: f64, period_s: f64) -> Pushed {
    let push = Vector3::x() * acceleration_m_s2;
    let piece = |i: u32| {
        let flipped = if i.is_multiple_of(2) { push } else { -push };
        (f64::from(i + 1) * period_s / 2.0, flipped)
    };
    Pushed {
        from_m: Vector3::z(),
        ..Pushed::from_origin((0..200).map(piece).collect())
    }
}

fn options(threads: usize) -> SimOptions {
    SimOptions {
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
        },
        threads,
        ..SimOptions::new(1e-3, Precision::F32, 0.07)
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

fn arbitrary_shake() -> impl Strategy<Value = Pushed> {
    (1.0f64..40.0, 0.02f64..0.3).prop_map(|(a_m_s2, period_s)| shake(a_m_s2, period_s))
}

fn run(kernel: Kernel, ropes: &[(RopeParams, Pushed)], threads: usize) -> Vec<Rollout> {
    let candidates: Vec<Candidate> = ropes
        .iter()
        .map(|(rope, motion)| Candidate::new(rope, motion))
        .collect();
    roll_out_in_with(kernel, &Scene::EMPTY, &candidates, &options(threads)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn neighbours_lanes_and_threads_do_not_change_a_bit(
        ropes in prop::collection::vec((arbitrary_rope(), arbitrary_shake()), 1..40),
        threads in 1usize..4,
    ) {
        let double = Precision::F64.fastest_kernel();
        for kernel in [Precision::F32.fastest_kernel(), double, Kernel::ScalarF64] {
            let together = run(kernel, &ropes, threads);
            for (index, (rope, result)) in ropes.iter().zip(&together).enumerate() {
                let alone = run(kernel, core::slice::from_ref(rope), 1);
                prop_assert_eq!(result, &alone[0], "{:?} candidate {}", kernel, index);
            }
        }
    }

    #[test]
    fn kernels_of_one_precision_agree_bit_by_bit(
        ropes in prop::collection::vec((arbitrary_rope(), arbitrary_shake()), 1..20),
    ) {
        let pairs = [
            [Kernel::Avx512F32, Kernel::Avx2F32],
            [Kernel::Avx512F64, Kernel::Avx2F64],
            [Kernel::Avx2F64, Kernel::ScalarF64],
        ];
        for [a, b] in pairs {
            if a.is_available() && b.is_available() {
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
    let gentle = (rope(), shake(3.0, 0.1));
    let absurd = (rope(), shake(1e7, 0.1));
    for kernel in Kernel::ALL.into_iter().filter(|k| k.is_available()) {
        let together = run(kernel, &[gentle.clone(), absurd.clone(), gentle.clone()], 2);
        let alone = run(kernel, core::slice::from_ref(&gentle), 1);
        assert_eq!(together[0], alone[0], "{kernel:?}");
        assert_eq!(together[2], alone[0], "{kernel:?}");
        assert_eq!(together[0].outcome, Outcome::Clean);
        assert_eq!(together[1].outcome, Outcome::Diverged, "{kernel:?}");
        assert!(together[1].watched.to_point.is_none());
        assert!(together[1].nodes.to_f64().iter().all(|x| x.is_finite()));
    }
}

#[test]
fn sharing_a_motion_changes_nothing() {
    let shake = shake(12.0, 0.1);
    let copy = shake.clone();
    let rope = rope();
    let shared = [Candidate::new(&rope, &shake), Candidate::new(&rope, &shake)];
    let separate = [Candidate::new(&rope, &shake), Candidate::new(&rope, &copy)];
    assert_eq!(
        roll_out(&shared, &options(1)).unwrap(),
        roll_out(&separate, &options(2)).unwrap()
    );
}

/// What a person reads: the candidate, the field, the value, what is allowed.
#[test]
fn what_cannot_be_simulated_is_refused_by_name() {
    let (good, shake, base) = (rope(), shake(1.0, 0.1), options(1));
    let broken = Broken {
        ends_s: 0.05,
        nan_from_s: 0.03,
        in_place: false,
    };
    let rope = |change: fn(&mut RopeParams)| {
        let mut rope = good;
        change(&mut rope);
        (rope, &shake as &dyn AttachMotion, base)
    };
    let option = |change: fn(&mut SimOptions)| {
        let mut options = base;
        change(&mut options);
        (good, &shake as &dyn AttachMotion, options)
    };
    let long = SimOptions {
        horizon_s: 0.05,
        frames: FrameTimes::NONE,
        ..base
    };
    let named = "candidate 1: ";
    for ((rope, motion, options), words) in [
        (rope(|r| r.links = 0), [named, "links"]),
        (rope(|r| r.links = 201), [named, "200"]),
        (rope(|r| r.lead_mass_kg = -0.1), [named, "lead_mass_kg"]),
        (rope(|r| r.length_m = f64::NAN), [named, "length_m"]),
        (
            rope(|r| r.mass_per_length_kg_per_m = -0.05),
            ["mass_per_length_kg_per_m", "-0.05"],
        ),
        (
            (good, &broken, base),
            [
                "candidate 1: its motion ends at 0.05 s",
                "horizon of 0.07 s",
            ],
        ),
        ((good, &broken, long), [named, "motion is not finite"]),
        (
            option(|o| o.frames.period_s = 0.1),
            ["frames from 0.003 s", "0.07 s"],
        ),
        (option(|o| o.step_s = 0.0), ["`step_s` is 0", "above 0"]),
        (option(|o| o.step_s = 1e-12), ["`step_s`", "1e8 steps"]),
        (
            option(|o| o.frames.count = usize::MAX),
            ["`frames.count`", "1e8 frames"],
        ),
        (
            option(|o| o.horizon_s = f64::NAN),
            ["`horizon_s` is NaN", "finite"],
        ),
        (
            option(|o| o.watch = Watch::point([0.0, f64::INFINITY, 0.0])),
            ["`watch.point_m` is inf", "finite"],
        ),
    ] {
        let first = Candidate::new(&good, &shake);
        let refusal = roll_out(&[first, Candidate::new(&rope, motion)], &options).unwrap_err();
        let is_ones = words.iter().any(|w| w.contains("candidate 1"));
        assert!(!is_ones || refusal.candidate == Some(1), "{refusal}");
        let sentence = refusal.to_string();
        for word in words {
            assert!(sentence.contains(word), "`{sentence}` lacks `{word}`");
        }
    }
}
