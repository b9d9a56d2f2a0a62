//! Work on a kept recording: tracking with publication, scoring.

use super::answer::answer;
use super::keep::Recording;
use crate::frame::ImageFrame;
use crate::overlay::{Strike, keypoint_sheet, throw_picture};
use crate::raw_film::RawFilm;
use crate::score::Score;
use crate::source::{FrameSource, StereoSource};
use crate::track::TrackResult;
use arm_model::{JointVector, Pole};
use nalgebra::Vector3;
use rope_sim::MeasuredArm;
use shared_types::ipc::KeypointPublisher;
use shared_types::ipc::message::{CameraEvent, CameraRequest, CameraRpc, Progress, RopeAppearance};
use shared_types::ipc::rpc::Call;
use shared_types::keypoints::KeypointFrame;
use shared_types::{MonotonicNs, StereoCamera};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// How far a film is shown of a strike that was not measured, and of a throw after which the rope
/// comes to rest (s).
const UNSEEN_S: f64 = 1.4;
const RESTS_S: f64 = 3.0;

type Failure = Box<dyn std::error::Error>;

/// Writes the recording of both images as a raw film, unless it is told to stop meanwhile.
pub(super) fn keep(
    recording: &mut Recording,
    name: &str,
    stop: &AtomicBool,
) -> Result<CameraEvent, Failure> {
    let first = recording.read(0)?.0;
    let mut raw = RawFilm::create(Path::new(name), [first.width_px, first.height_px])?;
    for index in 0..recording.len() {
        if stop.load(Ordering::Relaxed) {
            return Err("stopped before the film was written".into());
        }
        let frame = recording.read(index)?;
        raw.push(&frame.to_yuyv(), frame.0.sequence, frame.0.stamp_ns)?;
    }
    raw.finish()?;
    Ok(CameraEvent::Kept)
}

/// Tracks the rope and publishes its keypoints.
pub(super) fn track(
    recording: &mut Recording,
    call: &Call<CameraRpc>,
    publisher: &KeypointPublisher,
) -> Result<CameraEvent, Failure> {
    let CameraRequest::Track {
        camera,
        joints,
        pole,
        keypoints,
        overlay,
    } = &call.request
    else {
        return Err("not a request to track".into());
    };
    let first_stamp_ns = recording.first_stamp_ns();
    let film = recording.film();
    let film = film.ok_or("nothing is recorded for tracking; record first")?;
    let frames = film.left;
    let progress = Progress {
        done: 0,
        total: 1,
        value: frames.len() as f64,
        label: "frames".to_owned(),
    };
    answer(call, &CameraEvent::Progress(progress));
    let began = Instant::now();
    let motion = attach_motion(joints, first_stamp_ns, pole)?;
    let result = crate::track::track(film, camera, &motion, *keypoints as usize)?;
    let ms_per_frame = began.elapsed().as_secs_f64() * 1e3 / frames.len() as f64;
    publish(frames, &result, publisher)?;
    if let Some(path) = overlay {
        keypoint_sheet(frames, &result.track)?.write_png(Path::new(path))?;
    }
    let appearance = RopeAppearance {
        rope_radius_m: Some(result.appearance.rope_radius_m),
        lead_radius_m: Some(result.appearance.lead_radius_m),
        rope_rgb: result.appearance.rope_rgb,
        lead_rgb: result.appearance.lead_rgb,
    };
    Ok(CameraEvent::Tracked {
        first_stamp_ns,
        frames: u32::try_from(frames.len())?,
        lost_fraction: result.track.lost_fraction(),
        appearance,
        ms_per_frame,
        unconfirmed: result.track.unconfirmed,
    })
}

/// The attach frame's motion, time 0 at the first frame.
fn attach_motion(
    joints: &[(u64, JointVector)],
    first_stamp_ns: u64,
    pole: &Pole,
) -> Result<MeasuredArm, Failure> {
    let since_s = |t: &u64| MonotonicNs(*t).since_s(MonotonicNs(first_stamp_ns));
    let (times_s, q): (Vec<f64>, Vec<JointVector>) =
        joints.iter().map(|(t, q)| (since_s(t), *q)).unzip();
    Ok(MeasuredArm::new(&times_s, &q, *pole)?)
}

fn publish(
    frames: &[ImageFrame],
    result: &TrackResult,
    publisher: &KeypointPublisher,
) -> Result<(), Failure> {
    for (frame, tracked) in frames.iter().zip(&result.track.frames) {
        let sample = publisher.loan_uninit().map_err(|e| format!("{e:?}"))?;
        let sample =
            sample.write_payload(KeypointFrame::new(frame.sequence, frame.stamp_ns, tracked));
        sample.send().map_err(|e| format!("{e:?}"))?;
    }
    Ok(())
}

/// Measures the closest approach in a throw.
pub(super) fn score(
    recording: &mut Recording,
    call: &Call<CameraRpc>,
) -> Result<CameraEvent, Failure> {
    let CameraRequest::Score {
        camera,
        tip_rgb,
        target_rgb,
        strobe: picture,
    } = &call.request
    else {
        return Err("not a request to score".into());
    };
    if !recording.has_both() {
        return Err("nothing is recorded for scoring; record first, both images".into());
    }
    // The picture is worth having even when the score fails.
    let found = crate::score::score(recording, camera, *tip_rgb, *target_rgb);
    let drawn = picture.as_ref().map_or(Ok(()), |path| {
        write_throw(
            recording,
            (found.as_ref().ok(), UNSEEN_S),
            camera,
            Path::new(path),
        )
    });
    // The first error is reported; a picture is the lesser loss.
    let found = found?;
    drawn?;
    Ok(CameraEvent::Scored((&found).into()))
}

/// Tells where the tip is in a throw after which it comes to rest.
pub(super) fn look(
    recording: &mut Recording,
    call: &Call<CameraRpc>,
) -> Result<CameraEvent, Failure> {
    let CameraRequest::Look {
        camera,
        tip_rgb,
        domino,
        span_ns,
        strobe: picture,
    } = &call.request
    else {
        return Err("not a request to look".into());
    };
    if !recording.has_both() {
        return Err("nothing is recorded to look at; record first, both images".into());
    }
    let seen = crate::score::look(recording, camera, *tip_rgb, domino.as_ref(), *span_ns);
    let drawn = picture.as_ref().map_or(Ok(()), |path| {
        write_throw(recording, (None, RESTS_S), camera, Path::new(path))
    });
    let seen = seen?;
    drawn?;
    Ok(CameraEvent::Seen(seen))
}

/// Writes the picture of the throw.
fn write_throw(
    recording: &mut Recording,
    (found, unseen_s): (Option<&Score>, f64),
    camera: &StereoCamera,
    path: &Path,
) -> Result<(), Failure> {
    let frames: Vec<ImageFrame> = (0..recording.len())
        .map(|i| recording.read(i).map(|frame| frame.left()))
        .collect::<Result<_, _>>()?;
    let px = |m: &[f64; 3]| camera.project_left(&Vector3::from(*m));
    let strike = found.and_then(|score| {
        let tip = |(t, m): &(f64, [f64; 3])| Some((*t, px(m)?));
        Some(Strike {
            time_s: score.time_s,
            target_px: px(&score.target_m)?,
            tip_px: score.tip_path.iter().filter_map(tip).collect(),
        })
    });
    throw_picture(&frames, strike.as_ref(), unseen_s)?.write_png(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::StereoFrame;
    use crate::source::open_video;

    #[test]
    fn a_recording_is_kept_to_the_bit_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let name = folder.path().join("throw").display().to_string();
        let frame = |number: u64| {
            let bytes: Vec<u8> = (0..64).map(|k| number as u8 * 64 + k).collect();
            StereoFrame::from_yuyv(&bytes, [8, 4], 1000 * number, number).unwrap()
        };
        let mut recording = Recording::begin(2, true);
        let stop = AtomicBool::new(false);
        assert!(keep(&mut recording, &name, &stop).is_err(), "it is empty");
        recording.keep(frame(1));
        recording.keep(frame(2));
        stop.store(true, Ordering::Relaxed);
        assert!(keep(&mut recording, &name, &stop).is_err());
        stop.store(false, Ordering::Relaxed);
        assert!(keep(&mut recording, &format!("{name}/of"), &stop).is_err());
        assert_eq!(files(), 0, "nothing is left behind");
        keep(&mut recording, &name, &stop).unwrap();
        assert_eq!(files(), 2);
        let mut film = open_video(Path::new(&format!("{name}_8x4.yuyv")), None).unwrap();
        assert_eq!(film.len(), 2);
        assert_eq!([0, 1].map(|i| film.read(i).unwrap()), [frame(1), frame(2)]);
        // Another does not take its place.
        let again = keep(&mut recording, &name, &stop).unwrap_err();
        assert!(again.to_string().contains("not replaced"), "{again}");
        std::fs::remove_file(format!("{name}_8x4.yuyv")).unwrap();
        assert!(keep(&mut recording, &name, &stop).is_err(), "nor its times");
        keep(&mut recording, &format!("{name}-2"), &stop).unwrap();
        assert_eq!(files(), 3);
    }
}
