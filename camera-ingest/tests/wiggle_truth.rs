//! The scorer, calibrations and raw files against rendered recordings with exact truth.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod recording;

use camera_ingest::source::FrameSource;
use camera_ingest::{load_camera, open_video, score};
use recording::{folder, read_npy, truth_json};

#[test]
fn scores_the_throw_within_six_millimetres() {
    let Some(folder) = folder("athrow") else {
        return;
    };
    let truth = truth_json("athrow");
    let camera = load_camera(&folder.join("camera.toml")).unwrap();
    let colour =
        |key: &str| -> [u8; 3] { serde_json::from_value(truth["colours"][key].clone()).unwrap() };
    let score = score(
        &mut open_video(&folder, None).unwrap(),
        &camera,
        colour("lead_rgb"),
        colour("target_rgb"),
    )
    .unwrap();
    let number = |key: &str| truth["throw"][key].as_f64().unwrap();
    let distance = number("min_tip_target_distance_m");
    println!(
        "{:.1} mm, truth {:.1} mm",
        score.closest_m * 1e3,
        distance * 1e3
    );
    assert!(
        (score.closest_m - distance).abs() < 0.006,
        "{}",
        score.closest_m
    );
    assert!((score.interval_m[0]..=score.interval_m[1]).contains(&distance));
    assert!(
        (score.time_s - number("t_min_s")).abs() < 0.001,
        "{}",
        score.time_s
    );
    let target: [f64; 3] = serde_json::from_value(truth["throw"]["target_xyz_m"].clone()).unwrap();
    let off: f64 = (0..3)
        .map(|k| (score.target_m[k] - target[k]).powi(2))
        .sum();
    assert!(off.sqrt() < 0.015, "{}", off.sqrt());
}

#[test]
fn calibration_puts_true_nodes_on_their_pixels() {
    for name in ["a1", "a2", "athrow"] {
        let Some(folder) = folder(name) else { return };
        let camera = load_camera(&folder.join("camera.toml")).unwrap();
        let (shape, world) = read_npy(&folder.join("nodes_world_m.npy"));
        let (_, left) = read_npy(&folder.join("nodes_left_px.npy"));
        let (_, right) = read_npy(&folder.join("nodes_right_px.npy"));
        // Frame 0: all still, so that the rows' times do not matter.
        for node in 0..shape[1] {
            let p: [f64; 3] = core::array::from_fn(|k| f64::from(world[node * 3 + k]));
            let pixel = |all: &[f32]| [f64::from(all[node * 2]), f64::from(all[node * 2 + 1])];
            let seen = camera.project_left(&p.into()).unwrap();
            let off = (seen[0] - pixel(&left)[0]).hypot(seen[1] - pixel(&left)[1]);
            assert!(off < 0.01, "{name} node {node}: {off} px");
            let found = camera.triangulate(pixel(&left), pixel(&right)).unwrap();
            let off = (found.p_w_m - nalgebra::Vector3::from(p)).norm();
            assert!(off < 5e-5, "{name} node {node}: {off} m");
        }
    }
}

#[test]
fn the_uncompressed_sample_shows_the_video() {
    let Some(folder) = folder("a2") else { return };
    let mut raw = open_video(&folder.join("sample_1344x376.yuyv"), Some(60.0)).unwrap();
    let mut video = open_video(&folder, None).unwrap();
    assert_eq!((raw.len(), video.len()), (4, 400));
    for (sample, frame) in [0, 133, 266, 399].into_iter().enumerate() {
        let (a, b) = (raw.read(sample).unwrap().0, video.read(frame).unwrap().0);
        let mean = |x: &[u8], y: &[u8]| {
            let sum: f64 = x
                .iter()
                .zip(y)
                .map(|(x, y)| f64::from(x.abs_diff(*y)))
                .sum();
            sum / x.len() as f64
        };
        // Quality 28 leaves a few grey levels; swapped planes would leave tens.
        assert!(mean(&a.luma, &b.luma) < 8.0, "{}", mean(&a.luma, &b.luma));
        assert!(mean(&a.cb, &b.cb) < 4.0 && mean(&a.cr, &b.cr) < 4.0);
    }
}
