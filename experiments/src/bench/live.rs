//! `experiments bench track --live`: time per frame of the tracker that sees each frame once.

use super::report::report;
use super::spent::least;
use crate::args::BenchArgs;
use camera_ingest::source::{StereoSource, read_left};
use camera_ingest::track::OnePass;
use camera_ingest::{ClampPath, TrackOptions};
use cli_output::{OrInput, Outcome, Stage};
use experiments::trials::quantile;
use serde_json::{Value, json};
use shared_types::StereoCamera;
use std::path::Path;

/// Times of a recording's frames, decoding left out.
pub(super) fn run(
    (args, quiet): (&BenchArgs, bool),
    folder: &Path,
    (video, camera, clamp): (&mut dyn StereoSource, StereoCamera, &ClampPath),
) -> Outcome<Option<Value>> {
    let stage = Stage::begin("bench", quiet);
    let frames = read_left(video).or_input()?;
    let keypoints = TrackOptions::default().keypoints;
    let mut tracker = OnePass::new(camera, keypoints).or_failed()?;
    let (mut took_ms, mut first, mut lost) = (Vec::new(), None, 0);
    for (index, frame) in frames.iter().enumerate() {
        // The copy is not the tracker's work.
        let mut frame = Some(frame.clone());
        let (spent, found) = least(1, || {
            let frame = frame.take();
            frame.map_or(Ok(None), |frame| tracker.see(frame, clamp))
        })
        .or_input()?;
        took_ms.push(spent.cpu_s * 1e3);
        if let Some(found) = found {
            first.get_or_insert(index);
            lost += usize::from(found.lost);
        }
    }
    stage.done(&format!("{} frames", frames.len()));
    let [p50_ms, p99_ms, max_ms] = [0.5, 0.99, 1.0].map(|q| quantile(took_ms.iter().copied(), q));
    let own = json!({
        "ok": first.is_some(), "video": folder, "frames": frames.len(), "first_frame": first,
        "lost": lost, "p50_cpu_ms": p50_ms, "p99_cpu_ms": p99_ms, "max_cpu_ms": max_ms,
    });
    Ok(report((args, quiet), "bench track --live", own, || {
        println!("{} frames of `{}`", frames.len(), folder.display());
        match first {
            Some(first) => println!("rope found in frame {first}, lost in {lost} after it"),
            None => println!("rope never found"),
        }
        println!(
            "processor time per frame: median {p50_ms:.2} ms, p99 {p99_ms:.2} ms, max {max_ms:.2} ms"
        );
    }))
}
