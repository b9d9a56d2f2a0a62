//! Learned models for `wag track`: from the command line or `camera.toml`, told in the
//! report, refused with a clear line.
#![cfg(test)]

#[path = "../../camera-ingest/tests/learned/onnx.rs"]
mod onnx;
mod support;

use onnx::Axis::{Is, Open};
use planner::phi::graph_sha256;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;
use support::{said, wag_in};

/// Folder of a recorded wiggle; `None`, said aloud, where it is not there.
fn wiggle() -> Option<PathBuf> {
    let path = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/wiggle/a1"
    ));
    if !path.exists() {
        println!("skipped: {} not found", path.display());
    }
    path.exists().then(|| path.to_owned())
}

/// A folder with two segmenters, no model, and the wiggle's camera, which names one.
fn folder(wiggle: &Path) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(dir.path().join(name), bytes).unwrap();
    put("open.onnx", &onnx::by_colour([Open("H"), Open("W")]).file());
    put("half.onnx", &onnx::by_colour([Is(188), Is(336)]).file());
    put("none.onnx", b"no model");
    std::fs::copy(wiggle.join("camera.conf"), dir.path().join("camera.conf")).unwrap();
    let camera = std::fs::read_to_string(wiggle.join("camera.toml")).unwrap();
    let with = |models: &str| format!("{camera}\n[models]\n{models}\n").into_bytes();
    put("camera.toml", &with("segmenter = \"half.onnx\""));
    put("misspelt.toml", &with("segmentor = \"half.onnx\""));
    dir
}

fn track(folder: &Path, wiggle: &Path, more: &str) -> Output {
    let wiggle = wiggle.display();
    let camera = if more.contains("--camera") {
        String::new()
    } else {
        format!("--camera {wiggle}/camera.toml")
    };
    let files = format!("--video {wiggle} --pose {wiggle}/pose.csv {camera}");
    wag_in(
        folder,
        &format!("track --json {files} --out keypoints.json {more}"),
    )
}

#[test]
fn the_report_tells_who_did_what() {
    let Some(wiggle) = wiggle() else { return };
    let dir = folder(&wiggle);
    let cases = [
        ("", None),
        ("--camera camera.toml", Some("half.onnx")),
        (
            "--camera camera.toml --segmenter open.onnx",
            Some("open.onnx"),
        ),
    ];
    for (more, model) in cases {
        let output = track(dir.path(), &wiggle, more);
        assert!(output.status.success(), "{}", said(&output));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["lost"], 0, "{report}");
        assert_eq!(report["models"]["following"]["by"], "built-in");
        let mask = &report["models"]["first_mask"];
        let Some(model) = model else {
            assert_eq!(mask["by"], "built-in");
            continue;
        };
        assert_eq!(mask["by"], "model");
        assert!(mask["file"].as_str().unwrap().ends_with(model), "{mask}");
        let bytes = std::fs::read(dir.path().join(model)).unwrap();
        assert_eq!(mask["sha256"], graph_sha256(&bytes));
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let Some(wiggle) = wiggle() else { return };
    let dir = folder(&wiggle);
    let cases: [(&str, &[&str]); 8] = [
        ("--segmenter nowhere.onnx", &["nowhere.onnx", "path"]),
        ("--segmenter none.onnx", &["none.onnx", "ONNX file?"]),
        (
            "--tracker open.onnx",
            &["open.onnx", "`image`", "`frames`, `queries`"],
        ),
        ("--lead-px 300,250", &["--lead-px", "--segmenter"]),
        (
            "--segmenter open.onnx --lead-px 700,250",
            &["700,250", "672x376"],
        ),
        ("--lead-px 300", &["--lead-px", "U,V"]),
        ("--lead-px 300,nan", &["--lead-px", "finite"]),
        ("--camera misspelt.toml", &["misspelt.toml", "segmentor"]),
    ];
    for (more, words) in cases {
        let output = track(dir.path(), &wiggle, more);
        let error = said(&output);
        assert_eq!(output.status.code(), Some(2), "{more}: {error}");
        for word in words {
            assert!(error.contains(word), "{more}: {error}");
        }
        assert!(!dir.path().join("keypoints.json").exists());
    }
}
