//! `wag track`: keypoints of the rope from a recording.

use super::film_input::FilmInput;
use super::learned::{Learned, classify};
use crate::cli::TrackArgs;
use camera_ingest::film::keypoint_film;
use camera_ingest::overlay::{OverlayError, keypoint_sheet};
use camera_ingest::track::ClampFit;
use camera_ingest::{ImageFrame, TrackResult, track};
use cli_output::{OrInput, Outcome, Stage};
use run_log::files;
use serde_json::{Value, json};
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, MonotonicNs};
use std::path::Path;

/// Tracks the rope through a film; a learned tracker reads it where there is one. The
/// left-eye frames, and what was found in them.
pub fn track_video(
    filmed: &mut FilmInput,
    learned: &mut Learned,
    keypoints: usize,
    stage: &Stage,
) -> Outcome<(Vec<ImageFrame>, TrackResult)> {
    let motion = filmed.motion.attach().or_input()?;
    stage.say("reading frames");
    let images = filmed.frames()?;
    if let (Some(first), Some(last)) = (images.left.first(), images.left.last()) {
        let film_s = MonotonicNs(last.stamp_ns).since_s(MonotonicNs(first.stamp_ns));
        filmed.motion.check_covers(film_s).or_input()?;
    }
    stage.say(format!("tracking through {} frames", images.left.len()));
    let explained = track(images.film(), &filmed.camera, &*motion, keypoints);
    let result = explained
        .and_then(|result| match learned.tracker() {
            Some(tracker) => result.by_points(&images.left, tracker),
            None => Ok(result),
        })
        .map_err(|error| classify(error, &filmed.path))?;
    Ok((images.left, result))
}

/// A film for a name that ends in `.avi`, else a contact sheet.
pub fn overlay(
    path: &Path,
    frames: &[ImageFrame],
    track: &KeypointTrack,
) -> Result<Vec<u8>, OverlayError> {
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("avi"))
    {
        return keypoint_film(frames, track);
    }
    keypoint_sheet(frames, track)?.to_png()
}

/// Clocks so many standard errors apart are not together.
const FAR_STDS: f64 = 4.0;

/// What the film says about time and place of the clamp.
fn said(clamp: &ClampFit) -> String {
    format!(
        "the film is {:.1} ± {:.1} ms behind the motion given for the clamp; the clamp is seen \
         {:.1} ± {:.1} mm to the right of where it should be ({} frames)",
        clamp.time_offset_s * 1e3,
        clamp.time_std_s * 1e3,
        clamp.aside_m * 1e3,
        clamp.aside_std_m * 1e3,
        clamp.frames
    )
}

pub fn run(args: &TrackArgs) -> Outcome<Option<Value>> {
    if !(2..=shared_types::keypoints::MAX_KEYPOINTS).contains(&args.keypoints) {
        return Err(bad_input!(
            "--keypoints is {}, but must be from 2 to {}",
            args.keypoints,
            shared_types::keypoints::MAX_KEYPOINTS
        ));
    }
    let mut filmed = FilmInput::open(&args.video, args.fps, &args.scene)?;
    filmed.warn();
    let file = args.scene.camera.as_deref();
    let mut learned = Learned::load(Some(&args.models), file)?;
    let stage = Stage::begin("track");
    let (frames, result) = track_video(&mut filmed, &mut learned, args.keypoints, &stage)?;
    files::write_json(&args.out, &result.track).or_failed()?;
    if let Some(path) = &args.overlay {
        files::write_atomic(path, &overlay(path, &frames, &result.track).or_failed()?)
            .or_failed()?;
    }
    let count = result.track.frames.len();
    let frames_in = |wanted: fn(&TrackedFrame) -> bool| {
        result.track.frames.iter().filter(|f| wanted(f)).count()
    };
    let lost = frames_in(|f| f.lost);
    let unconfirmed_frames = frames_in(|f| !f.lost && f.confidence.iter().all(|c| *c <= 0.5));
    let seconds = stage.done(&format!(
        "{count} frames, rope lost in {lost}, unconfirmed in {unconfirmed_frames}"
    ));
    for reason in &result.track.unconfirmed {
        eprintln!("warning: the track is unconfirmed: {reason}");
    }
    if let Some(clamp) = result.clamp {
        println!("{}", said(&clamp));
        if clamp.time_offset_s.abs() > FAR_STDS * clamp.time_std_s {
            let late_ms = args.scene.film_late_ms + clamp.time_offset_s * 1e3;
            println!("--film-late-ms {late_ms:.1} takes that out of the times");
        }
    }
    println!("keypoints written to `{}`", args.out.display());
    Ok(Some(json!({
        "ok": true, "command": "track", "out": args.out, "frames": count,
        "lost": lost, "unconfirmed_frames": unconfirmed_frames, "unconfirmed": result.track.unconfirmed, "warnings": filmed.warnings, "seconds": seconds, "models": learned.report(),
        "rope_radius_m": result.appearance.rope_radius_m,
        "lead_radius_m": result.appearance.lead_radius_m,
        "clamp": result.clamp.map(|c| json!({
            "time_offset_s": c.time_offset_s, "time_std_s": c.time_std_s,
            "aside_m": c.aside_m, "aside_std_m": c.aside_std_m, "frames": c.frames,
        })),
    })))
}
