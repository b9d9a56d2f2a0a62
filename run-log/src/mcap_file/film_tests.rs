//! A rendered wiggle written as a run's file, read back and tracked.

use super::*;
use crate::mcap_file::clock::Clock;
use crate::mcap_file::image::left_jpeg;
use crate::mcap_file::messages;
use crate::mcap_file::writer::McapFile;
use arm_model::Pole;
use camera_ingest::{Film, track};
use rig_sim::CameraConfig;
use rig_sim::wiggle_film::{Frame, WiggleFilm, joints};
use rope_sim::MeasuredArm;
use shared_types::ipc::{CycleRecord, FrameHeader, JointReport, PIXEL_FORMAT_YUYV};
use std::ops::Range;

/// Monotonic time at which the wiggle begins (ns).
const BEGIN_NS: u64 = 7_000_000_000;
/// Motion of the wiggle that is filmed, and what lies before and after it (s).
const WIGGLE_S: f64 = 2.5;
const STILL_S: f64 = 0.4;

fn at_ns(t_s: f64) -> u64 {
    (BEGIN_NS as f64 + t_s * 1e9).round() as u64
}

/// Every second frame of a wiggle, as a recorder takes them.
fn frames(camera: &CameraConfig) -> Vec<Frame> {
    let count = ((STILL_S + WIGGLE_S + 0.2) * camera.frame_rate_hz) as usize;
    let film = WiggleFilm::new(camera, 7, None, -STILL_S).unwrap();
    film.take(count).step_by(2).collect()
}

/// The control cycles of a whole file.
const ALL: Range<i32> = -100..900;

/// A run's file: still, the wiggle, still, a motion that no picture shows; of that `cycles`.
fn write(path: &Path, camera: &CameraConfig, frames: &[Frame], cycles: Range<i32>) {
    let mut file = McapFile::create(path).unwrap();
    let sees = camera.stereo_camera();
    let text = serde_json::to_string(&sees).unwrap();
    file.metadata(CAMERA[0], &[(CAMERA[1], text)]).unwrap();
    let clock = Clock::compare();
    for cycle in cycles {
        let t_s = f64::from(cycle) * 4e-3;
        let now_ns = clock.wall_ns(at_ns(t_s));
        let streams = (0.0..=WIGGLE_S).contains(&t_s) || t_s > 3.2;
        let mode = if streams {
            ControllerMode::Streaming
        } else {
            ControllerMode::Idle
        };
        let record = CycleRecord {
            mode: mode as u8,
            ..CycleRecord::default()
        };
        let reported = messages::cycle(now_ns, &record);
        file.json(Channel::Cycles, now_ns, &reported).unwrap();
        let report = JointReport {
            q: joints(t_s),
            ..JointReport::default()
        };
        let reported = messages::measured(now_ns, &report);
        file.json(Channel::Measured, now_ns, &reported).unwrap();
    }
    for frame in frames {
        let header = FrameHeader {
            pixel_format: PIXEL_FORMAT_YUYV,
            width_px: 2 * sees.width_px,
            height_px: sees.height_px,
            ..FrameHeader::default()
        };
        let jpeg = left_jpeg(&header, &frame.yuyv, 1, 75).unwrap();
        let now_ns = clock.wall_ns(at_ns(frame.start_s));
        let reported = messages::image(now_ns, &jpeg);
        file.json(Channel::Image, now_ns, &reported).unwrap();
    }
    file.finish().unwrap();
}

#[test]
fn the_wiggle_of_a_run_is_found_and_tracked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let config = CameraConfig::default();
    let filmed = frames(&config);
    write(&path, &config, &filmed, ALL);
    let mut part = RunFilm::read(&path).unwrap().part(1).unwrap();
    let camera = part.camera.clone().unwrap().unwrap();
    assert_eq!(part.warnings, Vec::<String>::new());
    assert_eq!(camera, config.stereo_camera());
    // From the last picture before it begins to the last one while it goes on.
    let shown: Vec<&Frame> = {
        let before = filmed.iter().rposition(|f| f.start_s <= 0.0).unwrap();
        let until = |f: &&Frame| f.start_s <= WIGGLE_S;
        filmed[before..].iter().take_while(until).collect()
    };
    assert_eq!(part.len(), shown.len());
    let first_s = part.joints.times_s[0];
    assert!((-0.5..-0.35).contains(&first_s), "{first_s}");

    let arm = MeasuredArm::new(&part.joints.times_s, &part.joints.q, Pole::default()).unwrap();
    let frames: Vec<ImageFrame> = (0..part.len())
        .map(|i| part.read_left(i).unwrap())
        .collect();
    let film = Film {
        left: &frames,
        right: &[],
    };
    let found = track(film, &camera, &arm, shown[0].nodes.len()).unwrap();
    assert_eq!(found.track.lost_fraction(), 0.0);
    let mut errors_px: Vec<f64> = Vec::new();
    for (frame, truth) in found.track.frames.iter().zip(&shown) {
        for (point, node) in frame.points.iter().zip(&truth.nodes) {
            let [u, v] = camera.project_left(node).unwrap();
            errors_px.push((point[0] - u).hypot(point[1] - v));
        }
    }
    errors_px.sort_by(f64::total_cmp);
    let part_px = |part: f64| errors_px[(errors_px.len() as f64 * part) as usize];
    println!("median {:.2}, 95 % {:.2} px", part_px(0.5), part_px(0.95));
    assert!(part_px(0.5) < 1.0 && part_px(0.95) < 2.5);
}

#[test]
fn what_a_file_does_not_hold_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let config = CameraConfig::default();
    write(&path, &config, &[], ALL);
    let refused = |number| {
        let part = RunFilm::read(&path).unwrap().part(number);
        part.unwrap_err().to_string()
    };
    assert!(refused(0).contains("2 motions"), "{}", refused(0));
    assert!(refused(3).contains("--part is 3"), "{}", refused(3));
    assert!(refused(1).contains("no picture"), "{}", refused(1));
    std::fs::remove_file(&path).unwrap();
    // The wiggle begins before anything was recorded.
    write(&path, &config, &[], 100..900);
    let said = refused(1);
    assert!(said.contains("beginning of motion 1"), "{said}");
    std::fs::write(&path, b"words").unwrap();
    let error = format!("{:#}", RunFilm::read(&path).unwrap_err());
    let named = error.contains("run.mcap") && error.contains("MCAP");
    assert!(named, "{error}");
}

#[test]
fn a_damaged_file_is_read_as_far_as_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let config = CameraConfig::default();
    let mut film = WiggleFilm::new(&config, 7, None, -0.1).unwrap();
    let frames: Vec<Frame> = (0..12).filter_map(|_| film.next()).collect();
    write(&path, &config, &frames, ALL);
    let whole = std::fs::read(&path).unwrap();
    let pictures = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        RunFilm::read(&path).map(|film| film.pictures.len())
    };
    assert_eq!(pictures(&whole).unwrap(), frames.len());
    let part = RunFilm::read(&path).unwrap().part(1).unwrap();
    assert!(part.warnings.is_empty(), "{:?}", part.warnings);
    // Cut off: what came before is there.
    let mut seen = 0;
    for tenth in 1..10 {
        let count = pictures(&whole[..whole.len() * tenth / 10]).unwrap();
        assert!((seen..=frames.len()).contains(&count));
        seen = count;
    }
    std::fs::write(&path, &whole[..whole.len() * 19 / 20]).unwrap();
    let part = RunFilm::read(&path).unwrap().part(1).unwrap();
    let [said] = &part.warnings[..] else {
        panic!("{:?}", part.warnings)
    };
    assert!(said.contains("breaks off"), "{said}");
    // A wrong byte costs a chunk at most, or the file is refused; nothing panics.
    for k in 0..200 {
        let mut bytes = whole.clone();
        let at = (k * 2_654_435_761_usize) % bytes.len();
        bytes[at] ^= 1 << (k % 8);
        let count = pictures(&bytes).unwrap_or(0);
        assert!(count <= frames.len());
    }
}
