//! A learned tracker of points in the place of the built-in reading, through the ONNX
//! Runtime: small graphs that are written here.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod onnx;
#[path = "../recording/mod.rs"]
mod recording;

use std::path::PathBuf;

use camera_ingest::learned::OnnxTracker;
use camera_ingest::track::{ModelError, PointTracker, SeenPoint};
use camera_ingest::{ImageFrame, TrackError};
use onnx::Axis::{Is, Open};
use onnx::{Axis, DOUBLE, FLOAT, Graph, steady};
use recording::{Wiggle, missing, quantile};

/// Frames of a recording that are used.
const SHORT: usize = 90;

/// A file in a folder that goes with it.
struct File {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

fn file(bytes: &[u8]) -> File {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.onnx");
    std::fs::write(&path, bytes).unwrap();
    File {
        path,
        _folder: folder,
    }
}

fn grey(width_px: usize, height_px: usize, stamp_ns: u64) -> ImageFrame {
    ImageFrame {
        stamp_ns,
        sequence: stamp_ns,
        ..ImageFrame::grey([width_px, height_px], 90)
    }
}

#[test]
fn chunks_join_where_the_points_are_seen_best() {
    if missing::no_onnx_runtime() {
        return;
    }
    let frames: Vec<ImageFrame> = (1..14).map(|stamp| grey(32, 16, stamp)).collect();
    let points = [[4.0, 5.0], [6.5, 3.0], [8.0, 4.0], [9.0, 9.0]];
    // A chunk of 8 shares 2 frames; its last one is seen worse than the one before.
    let visible = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.9, 0.3];
    let file = file(&steady([Is(8), Is(16)], Is(4), [0.5, -0.25], &visible).file());
    let mut tracker = OnnxTracker::load(&file.path).unwrap();
    assert_eq!(tracker.points(), Some(4));
    let seen = tracker.follow(&frames, &points).unwrap();
    assert_eq!(seen.len(), 13);
    for (frame, seen) in seen.iter().enumerate() {
        // The last frames of both chunks; nothing is followed on from there.
        let deviation = f64::from(u8::from(frame == 7 || frame == 12));
        for (point, seen) in points.iter().zip(seen) {
            // Half a pixel of half the size is a whole one.
            let wanted = [
                point[0] + frame as f64 + 2.0 * deviation,
                point[1] - 0.5 * frame as f64,
            ];
            for k in 0..2 {
                assert!((seen.pixel[k] - wanted[k]).abs() < 1e-4, "frame {frame}");
            }
        }
    }
    let worst = |frame: usize| seen[frame].iter().fold(1.0, |w: f64, s| w.min(s.visible));
    assert!(worst(5) > 0.99 && worst(7) < 0.31 && worst(8) > 0.99);
    // A film shorter than a chunk.
    assert_eq!(tracker.follow(&frames[..3], &points).unwrap().len(), 3);
}

/// Knows where the rope is.
struct Reported<'a> {
    wiggle: &'a Wiggle,
    /// Frames in which it sees nothing.
    blind: std::ops::Range<usize>,
    /// Frames it keeps to itself.
    kept: usize,
}

impl PointTracker for Reported<'_> {
    fn points(&self) -> Option<usize> {
        Some(self.wiggle.nodes())
    }

    fn follow(
        &mut self,
        frames: &[ImageFrame],
        points: &[[f64; 2]],
    ) -> Result<Vec<Vec<SeenPoint>>, ModelError> {
        for (requested, truth) in points.iter().zip(&self.wiggle.truth[0]) {
            let off = (requested[0] - truth[0]).hypot(requested[1] - truth[1]);
            assert!(off < 5.0, "asked for a point {off} px off");
        }
        let point = |frame: usize, pixel: &[f64; 2]| SeenPoint {
            pixel: *pixel,
            visible: if self.blind.contains(&frame) {
                0.0
            } else {
                0.9
            },
        };
        Ok((0..frames.len() - self.kept)
            .map(|frame| {
                let truth = self.wiggle.truth[frame].iter();
                truth.map(|p| point(frame, p)).collect()
            })
            .collect())
    }
}

#[test]
fn followed_points_become_keypoints_and_lost_frames() {
    let Some(wiggle) = Wiggle::read_first("a1", SHORT) else {
        return;
    };
    let explained = wiggle.track().unwrap();
    let reported = |blind, kept| {
        let mut reported = Reported {
            wiggle: &wiggle,
            blind,
            kept,
        };
        explained.clone().by_points(&wiggle.frames, &mut reported)
    };
    let result = reported(40..50, 0).unwrap();
    result.track.validate().unwrap();
    assert_eq!(result.appearance, explained.appearance);
    for (index, frame) in result.track.frames.iter().enumerate() {
        let lost = (40..50).contains(&index);
        assert_eq!(frame.lost, lost, "frame {index}");
        let wanted = if lost { 0.0 } else { 0.9 };
        assert!(frame.confidence.iter().all(|c| (c - wanted).abs() < 1e-9));
    }
    let errors = wiggle.errors(&result).concat();
    let [median, p95] = [0.5, 0.95].map(|q| quantile(&errors, q));
    println!("told: median {median:.2}, p95 {p95:.2} px");
    assert!(median < 0.5 && p95 < 1.5, "{median} {p95}");

    let blind = reported(10..70, 0).unwrap_err();
    assert_eq!(
        blind,
        TrackError::MostlyLost {
            lost: 60,
            frames: SHORT,
            first: 10
        }
    );
    let short = reported(0..0, 2).unwrap_err().to_string();
    assert!(short.contains("gave 88 frames, it must give 90"), "{short}");
}

/// A file is not loaded; the message names it and has these words.
#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) {
    let file = file(bytes);
    let said = OnnxTracker::load(&file.path).unwrap_err().to_string();
    for word in words.iter().chain(&["model.onnx"]) {
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn files_that_do_not_fit_are_refused_with_what_is_wanted() {
    if missing::no_onnx_runtime() {
        return;
    }
    let missing = OnnxTracker::load(std::path::Path::new("none.onnx")).unwrap_err();
    let missing = missing.to_string();
    assert!(missing.contains("check the path"), "{missing}");
    let open = [Open("H"), Open("W")];
    let whole = steady(open, Open("N"), [0.0; 2], &[1.0; 8]).file();
    let half = &whole[..whole.len() / 2];
    for bytes in [&b""[..], b"no model", &[0xff; 64], half] {
        refused(bytes, &["is it an ONNX file?"]);
    }
    // Another kind of model.
    let other = Graph::default()
        .input("image", FLOAT, &[Is(1), Is(3), open[0], open[1]])
        .output("mask", FLOAT, &[Is(1), Is(3), open[0], open[1]])
        .node("Identity", &["image"], "mask", &[]);
    refused(&other.file(), &["inputs", "`image`", "`frames`, `queries`"]);
    let shaped = |kind: u64, frames: &[Axis], visibility: &[Axis]| {
        Graph::default()
            .input("frames", kind, frames)
            .input("queries", FLOAT, &[Is(1), Is(4), Is(3)])
            .output("tracks", FLOAT, &[Is(1), Is(8), Is(4), Is(2)])
            .output("visibility", kind, visibility)
            .floats("places", &[1, 8, 4, 2], &[0.0; 64])
            .node("Identity", &["places"], "tracks", &[])
            .node("Identity", &["frames"], "visibility", &[])
            .file()
    };
    let film = [Is(1), Is(8), Is(3), Is(8), Is(8)];
    let cases = [
        (
            shaped(DOUBLE, &film, &film),
            [
                "`frames`",
                "float64 [1, 8, 3, 8, 8]",
                "float32 [1, T, 3, H, W]",
            ],
        ),
        (
            shaped(FLOAT, &[Is(1), Is(8), Is(8), Is(8), Is(3)], &film),
            ["`frames`", "float32 [1, 8, 8, 8, 3]", "float32 [1, T"],
        ),
        (
            shaped(FLOAT, &[Is(3), Open("H"), Is(8)], &film),
            ["`frames`", "float32 [3, ?, 8]", "float32 [1, T"],
        ),
        (
            shaped(FLOAT, &film, &film),
            [
                "`visibility`",
                "float32 [1, 8, 3, 8, 8]",
                "float32 [1, T = 8, N = 4]",
            ],
        ),
    ];
    for (bytes, words) in cases {
        refused(&bytes, &words);
    }
    let few = steady(open, Is(2), [0.0; 2], &[1.0; 8]);
    refused(&few.file(), &["`queries`", "N = 2"]);
    let short = steady(open, Open("N"), [0.0; 2], &[1.0]);
    refused(&short.file(), &["`frames`", "T = 1"]);
}

#[test]
fn an_answer_of_no_numbers_is_refused() {
    if missing::no_onnx_runtime() {
        return;
    }
    let frames = [grey(16, 8, 1), grey(16, 8, 2)];
    let graph = steady([Is(8), Is(16)], Open("N"), [f32::NAN, 0.0], &[1.0; 2]);
    let file = file(&graph.file());
    let error = OnnxTracker::load(&file.path)
        .unwrap()
        .follow(&frames, &[[3.0, 3.0]; 4])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("`tracks`") && error.contains("not finite"),
        "{error}"
    );
}
