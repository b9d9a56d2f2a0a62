//! A learned tracker for `wag track`: from the command line or `camera.toml`, told in the
//! report, refused with a clear line.
#![cfg(test)]

#[path = "../../camera-ingest/tests/learned/onnx.rs"]
mod onnx;
mod support;

use onnx::Axis::{Is, Open};
use onnx::{FLOAT, Graph};
use planner::phi::graph_sha256;
use shared_types::KeypointTrack;
use std::path::Path;
use support::{are_refused_in, json_in, missing, shared};

/// A folder with two trackers, another model, no model, and the wiggle's camera, which names
/// a tracker.
fn folder(wiggle: &Path) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(dir.path().join(name), bytes).unwrap();
    let steady = |size, shift| onnx::steady(size, Open("N"), shift, &[0.9; 8]).file();
    put("open.onnx", &steady([Open("H"), Open("W")], [0.0, 0.0]));
    put("half.onnx", &steady([Is(188), Is(336)], [0.1, 0.0]));
    let size = [Is(1), Is(3), Open("H"), Open("W")];
    let other = Graph::default()
        .input("image", FLOAT, &size)
        .output("mask", FLOAT, &size)
        .node("Identity", &["image"], "mask", &[]);
    put("other.onnx", &other.file());
    put("none.onnx", b"no model");
    std::fs::copy(wiggle.join("camera.conf"), dir.path().join("camera.conf")).unwrap();
    let camera = std::fs::read_to_string(wiggle.join("camera.toml")).unwrap();
    let with = |models: &str| format!("{camera}\n[models]\n{models}\n").into_bytes();
    put("camera.toml", &with("tracker = \"half.onnx\""));
    put("misspelt.toml", &with("trakcer = \"half.onnx\""));
    dir
}

fn track(wiggle: &Path, more: &str) -> String {
    let wiggle = wiggle.display();
    let camera = if more.contains("--camera") {
        String::new()
    } else {
        format!("--camera {wiggle}/camera.toml")
    };
    let files = format!("--video {wiggle} --pose {wiggle}/pose.csv {camera}");
    format!("track {files} --out keypoints.json {more}")
}

#[test]
fn the_report_tells_who_did_what() {
    let Some(wiggle) = shared("data/wiggle/a1").filter(|_| !missing::no_onnx_runtime()) else {
        return;
    };
    let dir = folder(&wiggle);
    // How far the models say that the rope goes to the right in eight frames (px).
    let cases = [
        ("", None),
        ("--camera camera.toml", Some(("half.onnx", 1.4))),
        (
            "--camera camera.toml --tracker open.onnx",
            Some(("open.onnx", 0.0)),
        ),
    ];
    for (more, model) in cases {
        let report = json_in(dir.path(), &track(&wiggle, more));
        assert_eq!(report["lost"], 0, "{report}");
        let reading = &report["models"]["reading"];
        let Some((model, moved_px)) = model else {
            assert_eq!(reading["by"], "built-in");
            continue;
        };
        assert_eq!(reading["by"], "model");
        let file = reading["file"].as_str().unwrap();
        assert!(file.ends_with(model), "{reading}");
        let bytes = std::fs::read(dir.path().join(model)).unwrap();
        assert_eq!(reading["sha256"], graph_sha256(&bytes));
        let text = std::fs::read_to_string(dir.path().join("keypoints.json")).unwrap();
        let track: KeypointTrack = serde_json::from_str(&text).unwrap();
        for (a, b) in track.frames[0].points.iter().zip(&track.frames[7].points) {
            assert!(
                (b[0] - a[0] - moved_px).abs() < 0.02,
                "{model}: {a:?} {b:?}"
            );
            assert!((b[1] - a[1]).abs() < 0.02, "{model}: {a:?} {b:?}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let Some(wiggle) = shared("data/wiggle/a1").filter(|_| !missing::no_onnx_runtime()) else {
        return;
    };
    let dir = folder(&wiggle);
    for (more, words) in [
        ("--tracker nowhere.onnx", "nowhere.onnx | path"),
        ("--tracker none.onnx", "none.onnx | ONNX file?"),
        (
            "--tracker other.onnx",
            "other.onnx | `image` | `frames`, `queries`",
        ),
        ("--camera misspelt.toml", "misspelt.toml | trakcer"),
    ] {
        let case = format!("{} => {words}", track(&wiggle, more));
        are_refused_in(dir.path(), 2, &case);
    }
}
