//! A rope among obstacles is its own, whatever runs beside it.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rope_sim::{
    Candidate, Domino, Kernel, Obstacle, Outcome, Precision, Rollout, Scene, SimOptions,
    roll_out_in_with,
};
use shared_types::{BendingFriction, RopeExtras, RopeParams};
use support::contact::{random_rope, random_whip, wall};
use support::pushed::Pushed;
use support::{AIR, options};

/// A wall with a floor beside it and a domino.
fn crowded() -> Scene {
    Scene {
        obstacles: vec![wall(), Obstacle::floor(-0.45, 0.6)],
        domino: Some(Domino {
            foot_m: [0.0, 0.0, 0.2],
            facing_rad: 0.3,
            thickness_m: 0.01,
            width_m: 0.3,
            height_m: 0.06,
            mass_kg: 0.02,
            friction: 0.4,
        }),
    }
}

fn extras(index: usize) -> RopeExtras {
    RopeExtras {
        air_drag: (index % 3 == 1).then_some(AIR),
        rest_curvature_per_m: [0.0, if index % 4 == 2 { 1.5 } else { 0.0 }, 0.0],
        mass_slope: if index % 5 == 3 { 0.4 } else { 0.0 },
        clamp_stiffness: if index % 7 == 5 { 1.6 } else { 1.0 },
        friction: (index % 6 == 4).then_some(BendingFriction {
            moment_max_nm: 0.002,
            slip_curvature_per_m: 0.5,
        }),
    }
}

fn throws(seed: u64) -> Vec<(RopeParams, Pushed)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..20)
        .map(|i| {
            let links = if i % 5 == 4 { 21.0 } else { 20.0 };
            let rope = random_rope(&mut rng, links).with_extras(extras(i));
            (rope, random_whip(&mut rng))
        })
        .collect()
}

fn candidates(throws: &[(RopeParams, Pushed)]) -> Vec<Candidate<'_>> {
    throws
        .iter()
        .map(|(rope, whip)| Candidate::new(rope, whip))
        .collect()
}

fn run(kernel: Kernel, candidates: &[Candidate], threads: usize) -> Vec<Rollout> {
    let options = SimOptions {
        threads,
        ..options(Precision::F32, 0.35, 40.0)
    };
    roll_out_in_with(kernel, &crowded(), candidates, &options).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]

    #[test]
    fn results_do_not_depend_on_lanes_groups_or_threads(seed in 0u64..1000, turn in 1usize..19) {
        let throws = throws(seed);
        let candidates = candidates(&throws);
        for family in [
            [Kernel::Avx512F32, Kernel::Avx2F32],
            [Kernel::Avx512F64, Kernel::ScalarF64],
        ] {
            let mut runs = Vec::new();
            for kernel in family.into_iter().filter(|k| k.is_available()) {
                let straight = run(kernel, &candidates, 1);
                let mut turned = candidates.clone();
                turned.rotate_left(turn);
                let mut shuffled = run(kernel, &turned, 2);
                shuffled.rotate_right(turn);
                prop_assert_eq!(&straight, &shuffled);
                runs.push(straight);
            }
            if let [a, b] = runs.as_slice() {
                prop_assert_eq!(a, b);
            }
        }
    }
}

#[test]
fn the_scene_is_touched_in_these_throws() {
    let throws = throws(5);
    let runs = run(Precision::F32.fastest_kernel(), &candidates(&throws), 2);
    let touched = runs.iter().filter(|r| r.contacts[0].touched());
    assert!(touched.count() > 2);
}

#[test]
fn a_rope_that_blows_up_disturbs_no_other() {
    let throws = throws(11);
    let mut candidates = candidates(&throws);
    let kernel = Precision::F32.fastest_kernel();
    let alone = run(kernel, &candidates, 1);
    let spoilt = candidates[3].rope;
    // Shaken to pieces from the first step on.
    let violent = |t_s: f64| FrameMotion {
        p_m: Vector3::new(-0.25, 0.0, 0.42),
        a_m_s2: Vector3::new(1e12 * (1e5 * t_s).sin(), 1e12, 0.0),
        ..FrameMotion::world()
    };
    candidates[3] = Candidate::new(spoilt, &violent);
    let together = run(kernel, &candidates, 1);
    assert_eq!(together[3].outcome, Outcome::Diverged);
    for (index, (a, b)) in alone.iter().zip(&together).enumerate() {
        if index != 3 {
            assert_eq!(a, b, "candidate {index}");
        }
    }
}

/// A floor so near that contacts are looked for, but not reached, changes no bit.
#[test]
fn looking_for_contacts_changes_nothing() {
    let throws = throws(23);
    let candidates: Vec<_> = throws.iter().map(|(r, w)| Candidate::new(r, w)).collect();
    for kernel in [Precision::F32, Precision::F64].map(Precision::fastest_kernel) {
        let options = options(Precision::F32, 0.3, 500.0);
        let run = |scene: &Scene| roll_out_in_with(kernel, scene, &candidates, &options).unwrap();
        let plain = run(&Scene::EMPTY);
        let lowest = |run: &Rollout| {
            let frames = 0..run.nodes.frames();
            frames
                .flat_map(|f| (0..=21).map(move |n| (f, n)))
                .filter(|(_, n)| *n < run.nodes.nodes())
                .map(|(f, n)| run.nodes.position(f, n).z)
                .fold(f64::INFINITY, f64::min)
        };
        let lowest_m = plain.iter().map(lowest).fold(f64::INFINITY, f64::min);
        let among = run(&Scene::with(vec![Obstacle::floor(lowest_m - 0.055, 0.5)]));
        for (a, b) in plain.iter().zip(&among) {
            assert!(!b.contacts[0].touched());
            assert_eq!(a.nodes, b.nodes);
        }
    }
}
