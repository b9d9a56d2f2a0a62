//! `experiments bench track --live`: time per frame of the tracker that sees each frame once.

use super::spent::least;
use camera_ingest::source::{StereoSource, read_left};
use camera_ingest::track::OnePass;
use camera_ingest::{ClampPath, TrackOptions};
use cli_output::Machine;
use cli_output::Stage;
use cli_output::{OrInput, Outcome};
use serde_json::{Value, json};
use shared_types::StereoCamera;
use std::path::Path;

/// The value below which a part of the sorted ones lies.
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "some hundred values"
)]
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    let at = (last as f64 * part).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

/// Times of a recording's frames, decoding left out.
pub(super) fn run(
    folder: &Path,
    (video, camera, clamp): (&mut dyn StereoSource, StereoCamera, &ClampPath),
    quiet: bool,
) -> Outcome<Option<Value>> {
    let stage = Stage::begin("bench", quiet);
    let frames = read_left(video).or_input()?;
    let keypoints = TrackOptions::default().keypoints;
    let mut tracker = OnePass::new(camera, keypoints).or_failed()?;
    let (mut took_ms, mut first, mut lost) = (Vec::new(), None, 0);
    for (index, frame) in frames.iter().enumerate() {
        // The copy is not the tracker's work.
        let frame = frame.clone();
        let mut frame = Some(frame);
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
    took_ms.sort_by(f64::total_cmp);
    let [p50_ms, p99_ms, max_ms] = [0.5, 0.99, 1.0].map(|part| quantile(&took_ms, part));
    let machine = Machine::here();
    if !quiet {
        println!(
            "{machine}\n{} frames of `{}`",
            frames.len(),
            folder.display()
        );
        match first {
            Some(first) => println!("rope found in frame {first}, lost in {lost} after it"),
            None => println!("rope never found"),
        }
        println!(
            "a frame takes {p50_ms:.2} ms, 99 % {p99_ms:.2} ms, at most {max_ms:.2} ms\n\
             (processor time)"
        );
    }
    Ok(Some(json!({
        "ok": first.is_some(), "command": "bench track --live", "machine": machine,
        "video": folder, "frames": frames.len(), "first_frame": first, "lost": lost,
        "p50_cpu_ms": p50_ms, "p99_cpu_ms": p99_ms, "max_cpu_ms": max_ms,
    })))
}
