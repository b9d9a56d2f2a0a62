//! Learned models in the place of the tracker's parts, through the embedded runtime:
//! small graphs that are written here.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod onnx;
#[path = "../recording/mod.rs"]
mod recording;

use std::path::PathBuf;

use camera_ingest::learned::{OnnxSegmenter, OnnxTracker};
use camera_ingest::track::{FirstMask, FirstScene, ModelError, Models, PointTracker, SeenPoint};
use camera_ingest::{EyeFrame, TrackResult};
use onnx::Axis::{Is, Open};
use onnx::{Axis, DOUBLE, FLOAT, Graph, by_colour, int, ints, segmenter};
use recording::{Wiggle, quantile};

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

/// All is rope if the prompts' coordinates and ten times their labels sum up to more
/// than `limit`.
fn by_prompts(size: [Axis; 2], p: Axis, limit: f32) -> Graph {
    segmenter(size, p)
        .floats("weight", &[1, 3, 1, 1], &[0.0; 3])
        .floats("bias", &[1], &[-limit])
        .floats("ten", &[], &[10.0])
        .node(
            "Conv",
            &["image", "weight", "bias"],
            "limit",
            &[ints("kernel_shape", &[1, 1])],
        )
        .node("ReduceSum", &["points"], "p", &[int("keepdims", 0)])
        .node("ReduceSum", &["labels"], "l", &[int("keepdims", 0)])
        .node("Mul", &["l", "ten"], "tens", &[])
        .node("Add", &["p", "tens"], "sum", &[])
        .node("Add", &["limit", "sum"], "mask", &[])
}

/// Where a point is seen worse than this, [`steady`] has it a pixel of its picture too far
/// to the right.
const POORLY: f32 = 0.5;

/// Points move by `shift` a frame (pixels of its picture), whatever is seen; they are
/// seen as well as `visible` says of each frame of a chunk.
fn steady(size: [Axis; 2], n: Axis, shift: [f32; 2], visible: &[f32]) -> Graph {
    let t = visible.len() as u64;
    let moved: Vec<f32> = (0..visible.len())
        .flat_map(|frame| {
            let [x, y] = shift.map(|s| s * frame as f32);
            [x + f32::from(visible[frame] < POORLY), y]
        })
        .collect();
    Graph::default()
        .input("frames", FLOAT, &[Is(1), Is(t), Is(3), size[0], size[1]])
        .input("queries", FLOAT, &[Is(1), n, Is(3)])
        .output("tracks", FLOAT, &[Is(1), Is(t), n, Is(2)])
        .output("visibility", FLOAT, &[Is(1), Is(t), n])
        .floats("moved", &[1, t, 1, 2], &moved)
        .floats("shift", &[1, 1, 1, 2], &shift)
        .floats("visible", &[1, t, 1], visible)
        .floats("nothing", &[], &[0.0])
        .integers("axis0", &[0])
        .integers("axis1", &[1])
        .integers("axis2", &[2])
        .integers("axis3", &[3])
        .node(
            "Slice",
            &["queries", "axis0", "axis1", "axis2"],
            "when",
            &[],
        )
        .node(
            "Slice",
            &["queries", "axis1", "axis3", "axis2"],
            "where",
            &[],
        )
        .node("Unsqueeze", &["when", "axis1"], "when4", &[])
        .node("Unsqueeze", &["where", "axis1"], "where4", &[])
        .node("Mul", &["when4", "shift"], "before", &[])
        .node("Sub", &["where4", "before"], "origin", &[])
        .node("ReduceMean", &["frames"], "light", &[int("keepdims", 0)])
        .node("Mul", &["light", "nothing"], "dark", &[])
        .node("Add", &["origin", "moved"], "places", &[])
        .node("Add", &["places", "dark"], "tracks", &[])
        .node("Transpose", &["when"], "flat", &[ints("perm", &[0, 2, 1])])
        .node("Mul", &["flat", "nothing"], "zero", &[])
        .node("Add", &["visible", "zero"], "visibility", &[])
}

fn errors(wiggle: &Wiggle, result: &TrackResult) -> [f64; 2] {
    let errors = wiggle.errors(result).concat();
    [0.5, 0.95].map(|q| quantile(&errors, q))
}

#[test]
fn a_learned_mask_takes_the_place_of_the_moving_one() {
    let Some(wiggle) = Wiggle::read_first("a1", SHORT) else {
        return;
    };
    for size in [[Open("H"), Open("W")], [Is(188), Is(336)]] {
        let file = file(&by_colour(size).file());
        let mut segmenter = OnnxSegmenter::load(&file.path).unwrap();
        assert_eq!(segmenter.sha256().len(), 64);
        let result = wiggle.track_with(&mut Models {
            first_mask: Some(&mut segmenter),
            point_tracker: None,
        });
        let result = result.unwrap();
        let [median, p95] = errors(&wiggle, &result);
        println!("by colour: median {median:.2}, p95 {p95:.2} px");
        assert!(median < 1.2 && p95 < 2.5, "{median} {p95}");
    }
    // Nothing is rope: it is the learned mask that is used.
    let none = file(&by_prompts([Open("H"), Open("W")], Open("P"), 1e6).file());
    let mut segmenter = OnnxSegmenter::load(&none.path).unwrap();
    let error = wiggle.track_with(&mut Models {
        first_mask: Some(&mut segmenter),
        point_tracker: None,
    });
    let error = error.unwrap_err().to_string();
    assert!(error.contains("nothing long enough hangs"), "{error}");
}

fn grey(width_px: usize, height_px: usize, stamp_ns: u64) -> EyeFrame {
    EyeFrame {
        stamp_ns,
        sequence: stamp_ns,
        ..EyeFrame::grey([width_px, height_px], 90)
    }
}

#[test]
fn prompts_are_clamp_and_lead_in_pixels_of_the_scaled_picture() {
    let frame = grey(32, 16, 1);
    let scene = |lead_px| FirstScene {
        frame: &frame,
        empty: &frame,
        gain: 1.0,
        noise: 1.0,
        clamp_px: [20.0, 5.0],
        lead_px,
    };
    // In a picture of half the size (20, 5) lies at (9.75, 2.25), (21, 13) at (10.25, 6.25).
    let cases = [
        (Open("P"), None, 12.0 + 10.0),
        (Open("P"), Some([21.0, 13.0]), 28.5 + 20.0),
        (Is(1), Some([21.0, 13.0]), 12.0 + 10.0),
        (Is(4), Some([21.0, 13.0]), 28.5),
    ];
    for (count, lead_px, sum) in cases {
        for (limit, all) in [(sum - 0.01, true), (sum + 0.01, false)] {
            let file = file(&by_prompts([Is(8), Is(16)], count, limit).file());
            let mask = OnnxSegmenter::load(&file.path).unwrap();
            let mask = { mask }.mask(&scene(lead_px)).unwrap();
            assert_eq!(mask, vec![all; 32 * 16], "{sum} against {limit}");
        }
    }
}

#[test]
fn chunks_join_where_the_points_are_seen_best() {
    let frames: Vec<EyeFrame> = (1..14).map(|stamp| grey(32, 16, stamp)).collect();
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
        let astray = f64::from(u8::from(frame == 7 || frame == 12));
        for (point, seen) in points.iter().zip(seen) {
            // Half a pixel of half the size is a whole one.
            let wanted = [
                point[0] + frame as f64 + 2.0 * astray,
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
struct Told<'a> {
    wiggle: &'a Wiggle,
    /// Frames in which it sees nothing.
    blind: std::ops::Range<usize>,
    /// Frames in which it draws the rope out to twice its length.
    long: std::ops::Range<usize>,
}

impl PointTracker for Told<'_> {
    fn points(&self) -> Option<usize> {
        Some(self.wiggle.nodes())
    }

    fn follow(
        &mut self,
        frames: &[EyeFrame],
        points: &[[f64; 2]],
    ) -> Result<Vec<Vec<SeenPoint>>, ModelError> {
        for (asked, truth) in points.iter().zip(&self.wiggle.truth[0]) {
            let off = (asked[0] - truth[0]).hypot(asked[1] - truth[1]);
            assert!(off < 5.0, "asked for a point {off} px off");
        }
        let point = |frame: usize, p: &[f64; 2]| {
            let clamp = self.wiggle.truth[frame][0];
            let drawn = if self.long.contains(&frame) { 2.0 } else { 1.0 };
            SeenPoint {
                pixel: [0, 1].map(|k| clamp[k] + drawn * (p[k] - clamp[k])),
                visible: if self.blind.contains(&frame) {
                    0.0
                } else {
                    0.9
                },
            }
        };
        Ok((0..frames.len())
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
    let mut told = Told {
        wiggle: &wiggle,
        blind: 40..50,
        long: 60..65,
    };
    let result = wiggle.track_with(&mut Models {
        first_mask: None,
        point_tracker: Some(&mut told),
    });
    let result = result.unwrap();
    result.track.validate().unwrap();
    assert_eq!(result.appearance, wiggle.track().unwrap().appearance);
    for (index, frame) in result.track.frames.iter().enumerate() {
        let lost = (40..50).contains(&index) || (60..65).contains(&index);
        assert_eq!(frame.lost, lost, "frame {index}");
        if index > 0 && !lost {
            assert!(frame.confidence.iter().all(|c| (c - 0.9).abs() < 1e-9));
        }
    }
    let kept: Vec<f64> = wiggle
        .errors(&result)
        .into_iter()
        .zip(&result.track.frames)
        .filter(|(_, frame)| !frame.lost)
        .flat_map(|(errors, _)| errors)
        .collect();
    let [median, p95] = [0.5, 0.95].map(|q| quantile(&kept, q));
    println!("told: median {median:.2}, p95 {p95:.2} px");
    assert!(median < 0.5 && p95 < 1.5, "{median} {p95}");
}

/// The message when a file is loaded.
fn refusal<T: std::fmt::Debug>(
    load: fn(&std::path::Path) -> Result<T, ModelError>,
    bytes: &[u8],
) -> String {
    let file = file(bytes);
    let said = load(&file.path).unwrap_err().to_string();
    assert!(said.contains("model.onnx"), "{said}");
    said
}

#[test]
fn files_that_do_not_fit_are_refused_with_what_is_wanted() {
    let missing = OnnxSegmenter::load(std::path::Path::new("none.onnx")).unwrap_err();
    assert!(matches!(missing, ModelError::Unreadable { .. }));
    for bytes in [&b""[..], b"no model", &[0xff; 64]] {
        let said = refusal(OnnxSegmenter::load, bytes);
        assert!(said.contains("is it an ONNX file?"), "{said}");
    }
    let whole = by_colour([Open("H"), Open("W")]).file();
    let said = refusal(OnnxSegmenter::load, &whole[..whole.len() / 2]);
    assert!(said.contains("is it an ONNX file?"), "{said}");
    // Another kind of model.
    let said = refusal(OnnxTracker::load, &whole);
    for word in ["inputs", "`image`", "`frames`, `queries`"] {
        assert!(said.contains(word), "{said}");
    }
    let shaped = |kind: u64, axes: &[Axis]| {
        Graph::default()
            .input("image", kind, axes)
            .input("points", FLOAT, &[Is(1), Open("P"), Is(2)])
            .input("labels", FLOAT, &[Is(1), Open("P")])
            .output("mask", kind, axes)
            .node("Identity", &["image"], "mask", &[])
            .file()
    };
    let cases = [
        (
            shaped(DOUBLE, &[Is(1), Is(3), Is(8), Is(8)]),
            ["`image`", "float64 [1, 3, 8, 8]", "float32 [1, 3, H, W]"],
        ),
        (
            shaped(FLOAT, &[Is(1), Is(8), Is(8), Is(3)]),
            ["`image`", "float32 [1, 8, 8, 3]", "float32 [1, 3, H"],
        ),
        (
            shaped(FLOAT, &[Is(3), Open("H"), Is(8)]),
            ["`image`", "float32 [3, ?, 8]", "float32 [1, 3, H"],
        ),
        (
            shaped(FLOAT, &[Is(1), Is(3), Is(8), Is(8)]),
            ["`mask`", "float32 [1, 3, 8, 8]", "float32 [1, 1, H = 8"],
        ),
    ];
    for (bytes, words) in cases {
        let said = refusal(OnnxSegmenter::load, &bytes);
        for word in words {
            assert!(said.contains(word), "{said}");
        }
    }
    let few = steady([Open("H"), Open("W")], Is(2), [0.0; 2], &[1.0; 8]);
    let said = refusal(OnnxTracker::load, &few.file());
    assert!(
        said.contains("`queries`") && said.contains("N = 2"),
        "{said}"
    );
    let short = steady([Open("H"), Open("W")], Open("N"), [0.0; 2], &[1.0]);
    let said = refusal(OnnxTracker::load, &short.file());
    assert!(
        said.contains("`frames`") && said.contains("T = 1"),
        "{said}"
    );
}

#[test]
fn an_answer_of_no_numbers_is_refused() {
    let frame = grey(16, 8, 1);
    let graph = by_prompts([Is(8), Is(16)], Open("P"), f32::NAN);
    let file = file(&graph.file());
    let error = OnnxSegmenter::load(&file.path)
        .unwrap()
        .mask(&FirstScene {
            frame: &frame,
            empty: &frame,
            gain: 1.0,
            noise: 1.0,
            clamp_px: [3.0, 3.0],
            lead_px: None,
        })
        .unwrap_err();
    assert!(matches!(error, ModelError::NotFinite { name: "mask", .. }));
}
