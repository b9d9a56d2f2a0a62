//! The tracker that sees every frame once, against the recordings' exact truth.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

#[path = "recording/alter.rs"]
mod alter;
mod recording;

use std::time::Instant;

use camera_ingest::TrackError;
use camera_ingest::track::OnePass;
use recording::{Wiggle, quantile};

/// A node that is further off is wrong (px).
const WRONG_PX: f64 = 20.0;

/// What came of a recording.
#[derive(Debug)]
struct Outcome {
    /// First frame with keypoints.
    first: usize,
    /// Frames after it in which the rope is lost.
    lost: usize,
    /// Median and 95th percentile over the frames not lost (px).
    error_px: [f64; 2],
    /// Nodes further off than [`WRONG_PX`] with a confidence above one half.
    wrong: usize,
    /// Time of a frame: median, 99th percentile, most (ms).
    took_ms: [f64; 3],
}

/// Every `step`-th frame is seen.
fn outcome(wiggle: &Wiggle, step: usize) -> Outcome {
    let mut tracker = OnePass::new(wiggle.camera.clone(), wiggle.nodes()).unwrap();
    let (mut first, mut lost, mut wrong) = (None, 0, 0);
    let (mut errors, mut took_ms) = (Vec::new(), Vec::new());
    for index in (0..wiggle.frames.len()).step_by(step) {
        let frame = wiggle.frames[index].clone();
        let begun = Instant::now();
        let seen = tracker.see(frame, &wiggle.clamp).unwrap();
        took_ms.push(begun.elapsed().as_secs_f64() * 1e3);
        let Some(seen) = seen else {
            assert!(first.is_none(), "given up in frame {index}");
            continue;
        };
        first.get_or_insert(index);
        if seen.lost {
            lost += 1;
            continue;
        }
        let pairs = seen.points.iter().zip(&wiggle.truth[index]);
        for ((p, truth), confidence) in pairs.zip(&seen.confidence) {
            let error = (p[0] - truth[0]).hypot(p[1] - truth[1]);
            wrong += usize::from(error > WRONG_PX && *confidence > 0.5);
            errors.push(error);
        }
    }
    Outcome {
        first: first.expect("the rope is never found"),
        lost,
        error_px: [0.5, 0.95].map(|q| quantile(&errors, q)),
        wrong,
        took_ms: [0.5, 0.99, 1.0].map(|q| quantile(&took_ms, q)),
    }
}

#[test]
fn the_rope_is_found_and_followed_as_the_frames_come() {
    for name in ["a1", "a2"] {
        let Some(wiggle) = Wiggle::read(name) else {
            return;
        };
        let Outcome {
            first,
            lost,
            error_px: [median, p95],
            wrong,
            took_ms: [half, most, _],
        } = outcome(&wiggle, 1);
        println!(
            "{name}: found in frame {first}, lost in {lost}; median {median:.2}, p95 {p95:.2} px; \
             {half:.2} ms a frame, 99 % {most:.2} ms"
        );
        // A second of 60 frames.
        assert!(first <= 60 && lost <= 40, "{name}: {first}, {lost}");
        assert!(median <= 0.8 && p95 <= 2.0, "{name}: {median}, {p95}");
        assert_eq!(wrong, 0, "{name}");
        // Frames left out: a slower machine.
        let half = outcome(&wiggle, 2);
        println!("{name}, every other frame: {half:.2?}");
        assert!(half.error_px[0] <= 1.0, "{name}: {half:?}");
    }
}

#[test]
fn what_a_hand_hid_is_found_again() {
    let Some(wiggle) = Wiggle::read_first("a1", 200) else {
        return;
    };
    let outcome = outcome(&wiggle.covered(100..120), 1);
    println!("a hand: {outcome:.2?}");
    assert!(outcome.lost <= 40 && outcome.wrong == 0, "{outcome:?}");
    assert!(outcome.error_px[1] <= 2.5, "{outcome:?}");
}

#[test]
fn a_frame_of_another_size_or_time_is_refused() {
    let Some(wiggle) = Wiggle::read_first("a1", 2) else {
        return;
    };
    let mut tracker = OnePass::new(wiggle.camera.clone(), 20).unwrap();
    let frame = || wiggle.frames[0].clone();
    assert_eq!(tracker.see(frame(), &wiggle.clamp), Ok(None));
    let again = tracker.see(frame(), &wiggle.clamp);
    assert_eq!(again, Err(TrackError::Times { frame: 1 }));
    let mut narrow = wiggle.frames[1].clone();
    narrow.width_px /= 2;
    let other = tracker.see(narrow, &wiggle.clamp);
    assert!(matches!(other, Err(TrackError::Size { frame: 1, .. })));
    assert!(OnePass::new(wiggle.camera.clone(), 1).is_err());
}
