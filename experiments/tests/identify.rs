//! Identification against planted parameters and against a recording whose
//! keypoints were made by another simulator (MuJoCo).
#![cfg(test)]

#[path = "../../hil-tests/support/missing.rs"]
mod missing;

use arm_model::{JointTrajectory, Pole};
use experiments::trials::{TrialRig, mean, summarise};
use planner::identify;
use planner::identify::{IdentifyError, IdentifyOptions, Method};
use planner::observation::{Appearance, Observation, ObservedPoints};
use planner::ropes::{outside_rope, random_rope, trial_rope};
use planner::synthetic::{FilmNoise, FilmTiming, Randomisation, SyntheticFilm, film, side_camera};
use planner::wiggle::WiggleConfig;
use rope_sim::{AttachMotion, PlannedArm, PoseTrack};
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, RopeParams, StereoCamera};
use std::ops::ControlFlow;
use std::path::Path;

/// Keypoints seen by the camera at the side, spread over the rope, of unknown width.
fn observed<'a>(
    track: &'a KeypointTrack,
    camera: &'a StereoCamera,
    motion: &'a dyn AttachMotion,
) -> Observation<'a> {
    Observation {
        track,
        points: ObservedPoints::ArcLength,
        camera,
        motion,
        appearance: Appearance::default(),
    }
}

fn wiggling_arm() -> PlannedArm {
    planner::wiggle::wiggling_arm(&WiggleConfig::default()).unwrap()
}

fn quick(seed: u64, threads: usize) -> IdentifyOptions {
    IdentifyOptions {
        method: Method::HybridSearch,
        seed,
        threads,
        ..IdentifyOptions::default()
    }
}

fn per_mass(rope: &RopeParams) -> [f64; 3] {
    let mu = rope.mass_per_length_kg_per_m;
    [
        rope.bending_stiffness_nm2() / mu,
        rope.joint_damping_nms_per_rad * rope.link_length_m() / mu,
        rope.lead_mass_kg / mu,
    ]
}

fn filmed(rope: &RopeParams, noise: &FilmNoise) -> SyntheticFilm {
    let timing = FilmTiming::default();
    film(rope, &wiggling_arm(), &side_camera(), 24, &timing, noise).unwrap()
}

#[test]
fn both_methods_find_planted_parameters_in_noise() {
    let arm = wiggling_arm();
    let camera = side_camera();
    for (seed, method) in [
        (21, Method::HybridSearch),
        (22, Method::HybridSearch),
        (22, Method::Cmaes),
    ] {
        let rope = random_rope(seed);
        let noise = FilmNoise {
            clock_offset_s: 0.017,
            ..FilmNoise::white(1.0, seed)
        };
        let film = filmed(&rope, &noise);
        let observation = Observation {
            appearance: Appearance {
                rope_radius_m: None,
                ..film.appearance
            },
            ..observed(&film.track, &camera, &arm)
        };
        let mut last = 0;
        // The camera stands where its calibration says, and the fit may rely on it.
        let options = IdentifyOptions {
            method,
            camera_position_std_m: 1e-3,
            camera_look_at_std_m: 1e-3,
            camera_roll_std_rad: 1e-3,
            ..quick(seed, 2)
        };
        let found = identify(&observation, &options, None, &mut |p| {
            last = p.done;
            ControlFlow::Continue(())
        })
        .unwrap();
        assert!(last > 0);
        let off_m = (found.params.length_m - rope.length_m).abs();
        assert!(off_m < 2e-3, "{found:?} against {rope:?}");
        assert!((found.time_offset_s - 0.017).abs() < 1e-3, "{found:?}");
        for (a, b) in per_mass(&found.params).into_iter().zip(per_mass(&rope)) {
            assert!((a / b - 1.0).abs() < 0.1, "{found:?} against {rope:?}");
        }
        // One pixel of noise on both axes is 1.41 px of distance.
        assert!((found.residual_px - 2.0_f64.sqrt()).abs() < 0.05);
        let noise = found.circumstances.noise_across;
        assert!((noise.sigma_px - 1.0).abs() < 0.05 && noise.in_time < 0.1);
        assert!(off_m < 4.0 * found.std_dev[1].unwrap());
        // The width of the rope was not seen, and motion does not reveal it.
        assert!(found.std_dev[4].is_none() && found.std_dev[8].is_none());
        assert!(!found.out_of_distribution.is_flagged(), "{found:?}");
    }
}

#[test]
fn a_misplaced_camera_and_a_late_clock_are_found_out() {
    let rig = TrialRig::new(&WiggleConfig::default()).unwrap();
    let rope = random_rope(33);
    let noise = FilmNoise {
        camera_shift_m: [0.02, -0.03, 0.01].into(),
        lookat_shift_m: [-0.02, 0.0, 0.02].into(),
        padding_frames: 15,
        longitudinal_px: 1.5,
        lateral_px: 0.7,
        correlation: 0.8,
        ..FilmNoise::default()
    };
    let found = rig.fit(&filmed(&rope, &noise), 0, &quick(3, 2)).unwrap();
    assert!((found.time_offset_s - 0.25).abs() < 2e-3, "{found:?}");
    assert!(
        (found.params.length_m - rope.length_m).abs() < 4e-3,
        "{found:?}"
    );
    let moved = found.circumstances.camera_position_m;
    // The camera looks along y: its distance shows in the size of everything.
    assert!((moved[1] + 0.03).abs() < 0.01, "{found:?}");
    let (along, across) = (
        found.circumstances.noise_along,
        found.circumstances.noise_across,
    );
    assert!((along.in_time - 0.8).abs() < 0.06 && (across.in_time - 0.8).abs() < 0.06);
    assert!((along.sigma_px - 1.5).abs() < 0.15 && (across.sigma_px - 0.7).abs() < 0.1);
}

#[test]
fn intervals_contain_the_truth_about_as_often_as_stated() {
    let rig = TrialRig::new(&WiggleConfig::default()).unwrap();
    let indices: Vec<u64> = (0..20).collect();
    let rope = |i| trial_rope(4, i);
    let trials = experiments::trials::run(&rig, rope, &indices, &quick(4, 2)).unwrap();
    let summary = summarise(&trials);
    let all: Vec<f64> = summary.parameters.iter().map(|p| p.coverage).collect();
    let mean = mean(all.iter().copied());
    // 180 intervals: three deviations of a binomial are 7 %.
    assert!((0.83..=0.97).contains(&mean), "{all:?}");
    assert!(all.iter().all(|c| *c >= 0.65), "{all:?}");
}

#[test]
fn a_rope_like_a_chain_is_noticed_with_the_reason() {
    let rig = TrialRig::new(&WiggleConfig::default()).unwrap();
    let rope = outside_rope(1, 0);
    let filmed = rig.film(&rope, 1, 0).unwrap();
    let found = rig.fit(&filmed, 0, &quick(1, 2)).unwrap();
    assert!(found.out_of_distribution.is_flagged(), "{found:?}");
    assert_eq!(found.method.as_str(), "hybrid-wide");
    assert!(!found.out_of_distribution.reasons.is_empty());
}

#[test]
fn a_weighed_lead_fixes_every_mass() {
    let rig = TrialRig::new(&WiggleConfig::default()).unwrap();
    let rope = random_rope(9);
    let film = filmed(&rope, &FilmNoise::white(0.5, 9));
    let options = IdentifyOptions {
        lead_mass_kg: Some(rope.lead_mass_kg),
        ..quick(9, 2)
    };
    let found = rig.fit(&film, 0, &options).unwrap();
    assert!((found.params.lead_mass_kg - rope.lead_mass_kg).abs() < 1e-9);
    let off = found.params.mass_per_length_kg_per_m / rope.mass_per_length_kg_per_m - 1.0;
    assert!(off.abs() < 0.03, "{found:?}");
    let free = rig.fit(&film, 0, &quick(9, 2)).unwrap();
    let width = |e: &shared_types::RopeEstimate| e.posterior.covariance[5][5].sqrt();
    assert!(width(&found) < 0.3 * width(&free));
}

#[test]
fn the_estimate_does_not_depend_on_threads() {
    let rig = TrialRig::new(&WiggleConfig::default()).unwrap();
    let noise = Randomisation::default().draw(7, 5);
    let film = filmed(&random_rope(5), &noise);
    for method in [Method::HybridSearch, Method::Cmaes] {
        let run = |threads| {
            let options = IdentifyOptions {
                method,
                generations: 3,
                population: 16,
                repeats_max: 0,
                ..quick(1, threads)
            };
            rig.fit(&film, 0, &options).unwrap()
        };
        assert_eq!(run(1), run(2));
    }
}

#[test]
fn useless_films_are_refused_with_the_reason() {
    let camera = side_camera();
    let arm = wiggling_arm();
    let short = PlannedArm::new(
        JointTrajectory::hold(arm_model::joint::START_POSE, 2.0).unwrap(),
        Pole::default(),
    );
    let timing = FilmTiming {
        frames: 200,
        ..FilmTiming::default()
    };
    let noise = FilmNoise::white(1.0, 0);
    let track = film(&random_rope(1), &arm, &camera, 24, &timing, &noise)
        .unwrap()
        .track;
    let refuse = |track: &KeypointTrack, motion: &PlannedArm| {
        identify(
            &observed(track, &camera, motion),
            &quick(0, 2),
            None,
            &mut |_| panic!("the film must be refused before any simulation"),
        )
        .unwrap_err()
    };
    let said = |track: &KeypointTrack, motion: &PlannedArm| match refuse(track, motion) {
        IdentifyError::Film(reason) => reason,
        other => panic!("{other}"),
    };
    assert!(said(&track, &short).contains("motion lasts 2.000 s"));
    let mut lost = track.clone();
    lost.frames
        .iter_mut()
        .step_by(5)
        .for_each(|f| f.lost = true);
    assert!(said(&lost, &arm).contains("lost in 20 % of the frames"));
    let mut few = track.clone();
    few.frames.truncate(30);
    assert!(said(&few, &arm).contains("30 frames, but"));
    let mut bad = track;
    bad.frames[7].points[3][0] = f64::NAN;
    assert!(matches!(refuse(&bad, &arm), IdentifyError::Keypoints(_)));
}

fn pose_of(folder: &Path) -> PoseTrack {
    PoseTrack::new(&run_log::files::read_pose(&folder.join("pose.csv")).unwrap()).unwrap()
}

fn true_keypoints_of(folder: &Path) -> KeypointTrack {
    let file = std::fs::File::open(folder.join("nodes_left_px.npy")).unwrap();
    let array = rope_sim::npy::read(std::io::BufReader::new(file)).unwrap();
    let keypoints = array.shape[1];
    let frames = array
        .values
        .chunks(2 * keypoints)
        .enumerate()
        .map(|(i, values)| TrackedFrame {
            t_s: i as f64 / 60.0,
            points: values.chunks(2).map(|p| [p[0], p[1]]).collect(),
            confidence: vec![1.0; keypoints],
            lost: false,
        })
        .collect();
    KeypointTrack {
        keypoints,
        frames,
        unconfirmed: Vec::new(),
    }
}

/// MuJoCo's rope has links of solid cylinders, so its true radius counts for
/// little and `link_extra_scale` means nothing there.
#[test]
fn the_recorded_rope_is_identified_from_its_true_keypoints() {
    let Some(folder) = missing::shared("data/wiggle/a1") else {
        return;
    };
    let folder = folder.as_path();
    let camera = camera_ingest::load_camera(&folder.join("camera.toml")).unwrap();
    let motion = pose_of(folder);
    let track = true_keypoints_of(folder);
    let observation = Observation {
        appearance: Appearance {
            rope_radius_m: Some(0.0055),
            lead_radius_m: Some(0.02),
        },
        ..observed(&track, &camera, &motion)
    };
    let found = identify(&observation, &quick(0, 2), None, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    println!("{found:?}");
    assert!((found.params.length_m - 0.55).abs() < 3e-3, "{found:?}");
    assert!(found.residual_px < 1.0, "{found:?}");
    let truth = [0.15 * 0.55 / 23.0 / 0.05, 0.006 * 0.55 / 23.0 / 0.05, 1.0];
    for (a, b) in per_mass(&found.params).into_iter().zip(truth) {
        assert!((a / b - 1.0).abs() < 0.1, "{found:?}");
    }
}
