//! Films in ordinary rooms, made by another engine: ropes with friction and curl, moving
//! shadows, a camera 5 mm and half a degree from where its file says.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod recording;

use std::path::{Path, PathBuf};

use camera_ingest::source::read_film;
use camera_ingest::{TrackOptions, TrackResult, load_camera, open_video, track};
use recording::{motion, quantile, read_npy};

/// Distance of a point from a polyline.
fn off_px(p: [f64; 2], line: &[[f64; 2]]) -> f64 {
    let from = |w: &[[f64; 2]]| {
        let ([ax, ay], [bx, by]) = (w[0], w[1]);
        let (x, y) = (bx - ax, by - ay);
        let along = (p[0] - ax) * x + (p[1] - ay) * y;
        let part = (along / (x * x + y * y).max(1e-9)).clamp(0.0, 1.0);
        (p[0] - ax - part * x).hypot(p[1] - ay - part * y)
    };
    line.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

fn tracked(folder: &Path, both: bool) -> TrackResult {
    let mut video = open_video(folder, None).unwrap();
    let mut eyes = read_film(&mut *video).unwrap();
    if !both {
        eyes.right.clear();
    }
    let camera = load_camera(&folder.join("camera.toml")).unwrap();
    let options = TrackOptions::default();
    track(eyes.film(), &camera, &*motion(folder), &options).unwrap()
}

/// The bounds of `checks/track_scenes.py`: median, 95th percentile, the tip's 95th
/// percentile; hardly anything lost, nothing wrong with confidence.
fn assert_followed(folder: &Path, nodes: &str, both: bool) {
    let result = tracked(folder, both);
    let (shape, truth) = read_npy(&folder.join(nodes));
    let (mut all, mut tip, mut wrong) = (Vec::new(), Vec::new(), 0);
    for (frame, truth) in result
        .track
        .frames
        .iter()
        .zip(truth.chunks_exact(2 * shape[1]))
    {
        let truth = truth.chunks_exact(2);
        let line: Vec<[f64; 2]> = truth.map(|p| [f64::from(p[0]), f64::from(p[1])]).collect();
        let off: Vec<f64> = frame.points.iter().map(|p| off_px(*p, &line)).collect();
        let sure = off.iter().zip(&frame.confidence);
        wrong += usize::from(sure.into_iter().any(|(off, c)| *off > 10.0 && *c > 0.5));
        all.extend(off);
        let (a, b) = (frame.points[frame.points.len() - 1], line[line.len() - 1]);
        tip.push((a[0] - b[0]).hypot(a[1] - b[1]));
    }
    let lost = result.track.frames.iter().filter(|f| f.lost).count();
    let [median, p95] = [0.5, 0.95].map(|q| quantile(&all, q));
    let tip = quantile(&tip, 0.95);
    let told = format!(
        "{}: median {median:.2}, p95 {p95:.2}, tip {tip:.2} px, {lost} lost, {wrong} wrong",
        folder.display()
    );
    println!("{told}");
    assert!(median <= 0.6 && p95 <= 2.5 && tip <= 3.0, "{told}");
    assert!(lost * 50 <= shape[0] && wrong == 0, "{told}");
}

fn shared(name: &str) -> Option<PathBuf> {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let path = Path::new(data).join(name);
    if !path.exists() {
        println!("skipped: {} not found", path.display());
        return None;
    }
    Some(path)
}

fn assert_scenes_followed(scenes: [&str; 4]) {
    for scene in scenes {
        if let Some(folder) = shared(&format!("scenes/{scene}")) {
            assert_followed(&folder, "truth_nodes_left_px.npy", true);
        }
    }
}

#[test]
fn ordinary_rooms() {
    assert_scenes_followed(["s1", "s2", "s3", "s4"]);
}

#[test]
fn more_ordinary_rooms() {
    assert_scenes_followed(["s5", "s6", "s7", "s8"]);
}

#[test]
fn one_eye_is_enough_in_a_room_without_riddles() {
    if let Some(folder) = shared("scenes/s5") {
        assert_followed(&folder, "truth_nodes_left_px.npy", false);
    }
}

#[test]
fn a_calibrated_camera_and_ropes_of_the_model() {
    for name in ["a1", "a2"] {
        if let Some(folder) = shared(&format!("wiggle/{name}")) {
            assert_followed(&folder, "nodes_left_px.npy", true);
            let truth = std::fs::read_to_string(folder.join("truth.json")).unwrap();
            let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
            let number = |key: &str| truth["rope"][key].as_f64().unwrap();
            let seen = tracked(&folder, true).appearance;
            println!("{seen:?}");
            assert!(
                (seen.length_m / number("length_m") - 1.0).abs() < 0.02,
                "{seen:?}"
            );
            assert!(
                (seen.rope_radius_m - number("radius_m")).abs() < 1e-3,
                "{seen:?}"
            );
            let off_m = seen.lead_radius_m - number("lead_radius_m");
            assert!(off_m.abs() < 2e-3, "{seen:?}");
        }
    }
}
