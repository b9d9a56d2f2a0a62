//! Films in ordinary rooms, made by another engine: ropes with friction and curl, moving
//! shadows, a camera 5 mm and half a degree from where its file says. And films of the
//! model's ropes by an exact camera.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod recording;

use std::path::Path;

use camera_ingest::source::read_film;
use camera_ingest::{TrackResult, USUAL_KEYPOINTS, load_camera, open_video, track};
use recording::{Wiggle, motion, quantile, read_nodes, shared, truth_json};

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
    let mut images = read_film(&mut *video).unwrap();
    if !both {
        images.right.clear();
    }
    let camera = load_camera(&folder.join("camera.toml")).unwrap();
    track(images.film(), &camera, &*motion(folder), USUAL_KEYPOINTS).unwrap()
}

/// Median, 95th percentile, the tip's 95th percentile; hardly anything lost, nothing wrong with
/// confidence.
fn assert_followed(name: &str, result: &TrackResult, truth: &[Vec<[f64; 2]>]) {
    let frames = &result.track.frames;
    let (mut all, mut tip, mut wrong) = (Vec::new(), Vec::new(), 0);
    for (frame, line) in frames.iter().zip(truth) {
        let off: Vec<f64> = frame.points.iter().map(|p| off_px(*p, line)).collect();
        let sure = off.iter().zip(&frame.confidence);
        wrong += usize::from(sure.into_iter().any(|(off, c)| *off > 10.0 && *c > 0.5));
        all.extend(off);
        let (a, b) = (frame.points[frame.points.len() - 1], line[line.len() - 1]);
        tip.push((a[0] - b[0]).hypot(a[1] - b[1]));
    }
    let lost = frames.iter().filter(|f| f.lost).count();
    let [median, p95] = [0.5, 0.95].map(|q| quantile(&all, q));
    let tip = quantile(&tip, 0.95);
    let reported = format!(
        "{name}: median {median:.2}, p95 {p95:.2}, tip {tip:.2} px, {lost} lost, {wrong} wrong"
    );
    println!("{reported}");
    assert!(median <= 0.45 && p95 <= 2.5 && tip <= 2.8, "{reported}");
    assert!(lost * 50 <= truth.len() && wrong == 0, "{reported}");
}

fn assert_scenes_followed(scenes: &[&str], both: bool) {
    for scene in scenes {
        if let Some(folder) = shared(&format!("scenes/{scene}")) {
            let truth = read_nodes(&folder.join("truth_nodes_left_px.npy"));
            assert_followed(scene, &tracked(&folder, both), &truth);
        }
    }
}

#[test]
fn ordinary_rooms() {
    assert_scenes_followed(&["s1", "s2", "s3", "s4"], true);
}

#[test]
fn more_ordinary_rooms() {
    assert_scenes_followed(&["s5", "s6", "s7", "s8"], true);
}

#[test]
fn one_eye_is_enough_in_a_room_without_riddles() {
    assert_scenes_followed(&["s5"], false);
}

/// Also no node is off by more than 4 px, the nodes' 95th percentile is 1.5 px, and rope and
/// weight have their size.
#[test]
fn a_calibrated_camera_and_ropes_of_the_model() {
    for name in ["a1", "a2"] {
        let Some(wiggle) = Wiggle::read_both(name) else {
            continue;
        };
        let result = wiggle.track().unwrap();
        result.track.validate().unwrap();
        assert_followed(name, &result, &wiggle.truth);
        let errors = wiggle.errors(&result).concat();
        let [median, p95, max] = [0.5, 0.95, 1.0].map(|q| quantile(&errors, q));
        let reported = format!("{name}, nodes: median {median:.2}, p95 {p95:.2}, max {max:.2} px");
        println!("{reported}");
        assert!(median <= 0.5 && p95 <= 1.5 && max <= 4.0, "{reported}");
        assert!(result.track.lost_fraction() < 1e-9);

        let truth = &truth_json(name)["rope"];
        let number = |key: &str| truth[key].as_f64().unwrap();
        let seen = &result.appearance;
        println!("{seen:?}");
        // A third of a pixel is 0.9 mm at this distance.
        for (what, found, wanted, off_most) in [
            ("rope", seen.rope_radius_m, number("radius_m"), 1e-3),
            ("lead", seen.lead_radius_m, number("lead_radius_m"), 1.5e-3),
            ("length", seen.length_m / number("length_m"), 1.0, 0.01),
        ] {
            assert!((found - wanted).abs() < off_most, "{what}: {seen:?}");
        }
    }
}
