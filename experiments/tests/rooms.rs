//! `experiments rooms` and `track-rooms`: files that the cameras' readers take, and results
//! that an interrupted run resumes from.
#![cfg(test)]

mod support;

use camera_ingest::source::FrameSource;
use camera_ingest::{load_camera, open_video};
use run_log::files::read_joints;
use std::fs::File;
use std::path::Path;
use support::report;

/// What there is of a film is what a camera's and an arm's would be.
fn is_read(folder: &Path) {
    let mut video = open_video(&folder.join("video.avi"), None).unwrap();
    assert_eq!(video.len(), 400);
    let [first, last] = [0, 399].map(|i| video.read_left(i).unwrap());
    assert_eq!((first.width_px, first.height_px), (672, 376));
    let film_s = (last.stamp_ns - first.stamp_ns) as f64 * 1e-9;
    assert!((film_s - 399.0 / 60.0).abs() < 5e-4, "{film_s}");
    let camera = load_camera(&folder.join("camera.toml")).unwrap();
    assert!((camera.left.fx - 350.0).abs() < 10.0);
    let joints = read_joints(&folder.join("joints_measured.csv")).unwrap();
    assert!(joints.times_s[0] == 0.0 && joints.times_s.last().unwrap() > &film_s);
    let truth = File::open(folder.join("truth_nodes_left_px.npy")).unwrap();
    let truth = rope_sim::npy::read(truth).unwrap();
    assert_eq!((truth.shape[0], truth.shape[2]), (400, 2));
    // The clamp, as truth and calibration see it: as far apart as a calibration is off.
    let clamp = arm_model::Pole::default().attach_pose(&joints.q[0]).0;
    let reported = camera.project_left(&clamp).unwrap();
    let off_px = (reported[0] - truth.values[0]).hypot(reported[1] - truth.values[1]);
    assert!(off_px > 0.05 && off_px < 15.0, "{off_px}");
}

#[test]
fn a_film_is_read_tracked_once_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let (films, results) = (path("films"), path("results"));
    let rendered = report(&format!("rooms --seeds 10 --out {films}"));
    assert_eq!(
        (&rendered["films"], &rendered["ok"]),
        (&1.into(), &true.into())
    );
    is_read(&dir.path().join("films/ordinary-10"));
    let track = format!("track-rooms --seeds 10 --films {films} --out {results}");
    let first = report(&track);
    let row = &first["table"][0];
    assert_eq!((&row["films"], &row["n"]), (&"all".into(), &1.into()));
    assert_eq!(first["films"][0]["scene"]["seed"], 10);
    // The second run takes what the first left.
    let kept = dir.path().join("results/ordinary-10.json");
    let text = std::fs::read_to_string(&kept).unwrap();
    let marked = text.replace("\"wall\": \"", "\"wall\": \"kept ");
    assert_ne!(marked, text);
    std::fs::write(&kept, marked).unwrap();
    let wall = report(&track)["films"][0]["scene"]["wall"].clone();
    assert!(wall.as_str().unwrap().starts_with("kept "), "{wall}");
}
