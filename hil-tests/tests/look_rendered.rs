//! What the camera tells of lobs and drapes, in the rig's pictures: where the tip comes to
//! rest, and whether the domino fell.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use arm_model::Cell;
use arm_model::joint::START_POSE;
use camera_ingest::frame::StereoFrame;
use camera_ingest::score::look;
use nalgebra::Vector3;
use rig_sim::render::{Appearance, Renderer, RopeShape, ScenePose, TaskBodies};
use rig_sim::{CameraConfig, RigConfig};
use rope_sim::{Scene, TaskFrame};
use shared_types::Task;
use shared_types::ipc::message::{DominoLook, SeenThrow};

const RATE_HZ: f64 = 60.0;
const FRAMES: u32 = 126;
/// The tip leaves where it hangs, and lies still again (s).
const LEAVES_S: f64 = 0.2;
const RESTS_S: f64 = 0.9;
const LEAD_RADIUS_M: f64 = 0.025;
/// A domino stands, or has fallen away from the arm or towards it.
const FALLS_RAD: [f64; 3] = [0.0, 1.5, -1.5];

/// A lead that hides the domino.
#[derive(Clone, Copy)]
struct Hides {
    from_s: f64,
    /// From the domino's middle towards its foot: so much shows at its top (m).
    aside_m: f64,
}

/// A tip that goes from where it hangs to `end_m` by a way above both.
fn tip(end_m: Vector3<f64>, t_s: f64) -> Vector3<f64> {
    let start_m = Vector3::new(0.62, 0.0, -0.2);
    let u = ((t_s - LEAVES_S) / (RESTS_S - LEAVES_S)).clamp(0.0, 1.0);
    let arc_m = 0.4 * (core::f64::consts::PI * u).sin();
    start_m + (end_m - start_m) * u + Vector3::z() * arc_m
}

/// A throw whose tip ends at a place of the target's frame; the domino falls by an angle at 0.8 s,
/// and the tip hangs before it at last, if it hides it.
#[derive(Clone, Copy)]
struct Throw {
    task: Task,
    target_m: [f64; 3],
    end_m: [f64; 3],
    falls_rad: f64,
    hides: Option<Hides>,
    seed: u64,
    /// Of the domino, if not as the seed has it.
    domino_rgb: Option<[u8; 3]>,
    /// Until when it is looked at (s).
    until_s: f64,
}

impl Default for Throw {
    fn default() -> Self {
        Self {
            task: Task::Lob,
            target_m: [0.85, 0.0, 0.2],
            end_m: [0.03, 0.02, LEAD_RADIUS_M],
            falls_rad: 0.0,
            hides: None,
            seed: 1,
            domino_rgb: None,
            until_s: 10.0,
        }
    }
}

fn film(throw: Throw) -> SeenThrow {
    let seed = throw.seed;
    let config: CameraConfig = RigConfig::default().seeing(throw.task).camera;
    let (camera, cell) = (config.stereo_camera(), Cell::default());
    let appearance = Appearance::from_seed(seed);
    let domino_rgb = throw.domino_rgb.unwrap_or(appearance.target_rgb);
    let shape = RopeShape {
        radius_m: 0.005,
        lead_radius_m: LEAD_RADIUS_M,
    };
    let mut renderer = Renderer::new(&camera, &cell, shape, appearance, config.noise_levels, seed);
    let scene = Scene::of_task(throw.task, throw.target_m, &cell);
    renderer.place_bodies(Some(TaskBodies::of(&scene, domino_rgb)));
    let end_m = Vector3::from(TaskFrame::at(throw.target_m).point(throw.end_m));
    let mut bytes = vec![0; renderer.frame_bytes()];
    let mut frames: Vec<StereoFrame> = (0..FRAMES)
        .map(|index| {
            let t_s = f64::from(index) / RATE_HZ;
            renderer.lean_domino(if t_s > 0.8 { throw.falls_rad } else { 0.0 });
            let hides = throw.hides.filter(|hides| t_s > hides.from_s);
            let at = match scene.domino.zip(hides) {
                Some((domino, hides)) => {
                    let (s, c) = domino.facing_rad.sin_cos();
                    let (out, up) = throw.falls_rad.sin_cos();
                    let up = [c * out, s * out, up];
                    let up_m = domino.height_m / 2.0 - hides.aside_m;
                    let middle_m = Vector3::from(domino.foot_m) + up_m * Vector3::from(up);
                    middle_m + 0.04 * (camera.p_w_cam_m - middle_m).normalize()
                }
                None => tip(end_m, t_s + config.exposure_s / 2.0),
            };
            let clamp_m = Vector3::new(0.6, 0.0, 0.45);
            let nodes = (0..=10).map(|k| clamp_m + (at - clamp_m) * (f64::from(k) / 10.0));
            let pose = ScenePose {
                q: START_POSE,
                nodes: nodes.collect(),
            };
            renderer.render(&[pose], u64::from(index), &mut bytes);
            let size = [2 * camera.width_px as usize, camera.height_px as usize];
            let stamp_ns = 1_000_000_000 + (1e9 * t_s) as u64;
            StereoFrame::from_yuyv(&bytes, size, stamp_ns, u64::from(index)).unwrap()
        })
        .collect();
    let domino = scene.domino.map(|domino| DominoLook {
        rgb: domino_rgb,
        foot_m: domino.foot_m,
        height_m: domino.height_m,
    });
    let span_s = [1.0, 1.0 + throw.until_s];
    look(
        &mut frames,
        &camera,
        appearance.lead_rgb,
        domino.as_ref(),
        span_s.map(|s| (1e9 * s) as u64),
    )
    .unwrap()
}

/// The places of the last second against the truth: (along the line of sight, across it) (m).
fn worst_m(seen: &SeenThrow, end_m: Vector3<f64>) -> [f64; 2] {
    let last = seen.tip.iter().filter(|(t_s, _)| *t_s > seen.end_s - 1.0);
    last.fold([0.0, 0.0], |[along, across]: [f64; 2], (_, at)| {
        let error = Vector3::from(*at) - end_m;
        [along.max(error.y.abs()), across.max(error.x.hypot(error.z))]
    })
}

#[test]
fn a_tip_on_the_board_and_a_domino_are_seen_at_every_bearing() {
    for (seed, bearing_deg) in [(1_u64, -20.0_f64), (2, 0.0), (3, 20.0)] {
        let (s, c) = bearing_deg.to_radians().sin_cos();
        let target_m = [0.85 * c, 0.85 * s, 0.10 + 0.05 * seed as f64];
        for falls_rad in FALLS_RAD {
            let throw = Throw {
                target_m,
                falls_rad,
                seed,
                ..Throw::default()
            };
            let seen = film(throw);
            let end_m = Vector3::from(TaskFrame::at(target_m).point(throw.end_m));
            let [along_m, across_m] = worst_m(&seen, end_m);
            let told = format!("seed {seed}, {falls_rad} rad: {along_m} {across_m}");
            assert_eq!(seen.domino_down, Some(falls_rad != 0.0), "{told}");
            assert!(along_m < 0.04 && across_m < 0.012, "{told}");
            let last_s = seen.tip.last().unwrap().0;
            assert!(seen.end_s - last_s < 0.05, "unseen at the end, {told}");
        }
    }
}

/// Somebody who clears up knocks it over.
#[test]
fn what_happens_after_the_throw_is_not_looked_at() {
    for (until_s, fell) in [(0.7, false), (10.0, true)] {
        let seen = film(Throw {
            falls_rad: 1.5,
            until_s,
            ..Throw::default()
        });
        assert_eq!(seen.domino_down, Some(fell), "until {until_s} s");
        // A row is exposed somewhat after the frame's stamp.
        let last_s = seen.tip.last().unwrap().0 - 1.0 / RATE_HZ;
        assert!(last_s < until_s && seen.end_s <= until_s, "{last_s}");
    }
}

/// The board is of wood, whose colour is faintly that of orange and yellow.
#[test]
fn a_domino_is_told_from_a_board_of_a_faintly_similar_colour() {
    for domino_rgb in [[235, 120, 25], [235, 200, 40]] {
        for falls_rad in FALLS_RAD {
            let seen = film(Throw {
                falls_rad,
                // Its lead is of another colour.
                seed: 2,
                domino_rgb: Some(domino_rgb),
                ..Throw::default()
            });
            let told = format!("{domino_rgb:?}, {falls_rad} rad");
            assert_eq!(seen.domino_down, Some(falls_rad != 0.0), "{told}");
        }
    }
}

/// One that fell before the lead hid it stays down, and one that shows an end beside the lead that
/// felled it lies; whether one that stood does so behind the lead is not known.
#[test]
fn a_domino_that_the_lead_hides_is_judged_by_what_was_seen_of_it() {
    let at_last = Hides {
        from_s: 1.4,
        aside_m: 0.0,
    };
    let but_for_an_end = Hides {
        from_s: 0.75,
        aside_m: 0.012,
    };
    for (hides, seeds) in [(at_last, [4, 5, 6]), (but_for_an_end, [8, 9, 10])] {
        for (seed, falls_rad) in seeds.iter().flat_map(|s| FALLS_RAD.map(|f| (*s, f))) {
            let seen = film(Throw {
                falls_rad,
                hides: Some(hides),
                seed,
                ..Throw::default()
            });
            let expected = (falls_rad != 0.0).then_some(true);
            assert_eq!(seen.domino_down, expected, "seed {seed}, {falls_rad} rad");
        }
    }
}

#[test]
fn a_tip_behind_the_wall_is_seen_hanging() {
    for (seed, bearing_deg) in [(5_u64, -20.0_f64), (6, 0.0), (7, 20.0)] {
        let (s, c) = bearing_deg.to_radians().sin_cos();
        let throw = Throw {
            task: Task::Drape,
            target_m: [0.75 * c, 0.75 * s, 0.3],
            end_m: [0.01 + LEAD_RADIUS_M, 0.0, -0.25],
            seed,
            ..Throw::default()
        };
        let seen = film(throw);
        let end_m = Vector3::from(TaskFrame::at(throw.target_m).point(throw.end_m));
        let [along_m, across_m] = worst_m(&seen, end_m);
        assert!(
            along_m < 0.04 && across_m < 0.012,
            "seed {seed}: {along_m} {across_m}"
        );
        assert_eq!(seen.domino_down, None);
    }
}
