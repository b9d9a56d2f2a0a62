//! What the eyes' commands read and write, from files to files.

use super::support::{are_refused_in, json_in, shared};
use arm_model::Cell;
use arm_model::joint::START_POSE;
use camera_ingest::calib::{VideoMode, write_camera_toml, write_factory_conf};
use camera_ingest::frame::StereoFrame;
use camera_ingest::source::read_film;
use camera_ingest::{load_camera, open_video, track};
use nalgebra::{Rotation3, Vector3};
use rig_sim::CameraConfig;
use rig_sim::render::{Appearance, Renderer, RopeShape, ScenePose};
use rope_sim::PoseTrack;
use run_log::files::read_pose;
use shared_types::{KeypointTrack, StereoCamera};
use std::fs;
use std::path::Path;

/// Frames of a recording that are enough to follow the rope.
const FRAMES: usize = 120;

/// Bodies of the first pictures of an AVI.
fn jpegs(avi: &[u8], count: usize) -> Vec<&[u8]> {
    let word = |at: usize| u32::from_le_bytes(avi[at..at + 4].try_into().unwrap()) as usize;
    let mut at = avi.windows(4).position(|w| w == b"movi").unwrap() + 4;
    let mut bodies = Vec::new();
    while bodies.len() < count {
        assert_eq!(&avi[at..at + 4], b"00dc");
        let size = word(at + 4);
        bodies.push(&avi[at + 8..at + 8 + size]);
        at += 8 + size + size % 2;
    }
    bodies
}

/// The beginning of a recording as a folder of JPEGs and as one raw file, with all
/// that a command wants beside it.
fn excerpt(from: &Path) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    for name in ["camera.toml", "camera.conf", "pose.csv"] {
        fs::copy(from.join(name), at(name)).unwrap();
    }
    let stamps = fs::read_to_string(from.join("timestamps.csv")).unwrap();
    let rows: Vec<&str> = stamps.lines().take(FRAMES + 1).collect();
    fs::write(at("timestamps.csv"), rows.join("\n")).unwrap();
    fs::write(at("raw_1344x376.csv"), rows.join("\n")).unwrap();
    let avi = fs::read(from.join("video.avi")).unwrap();
    let mut raw = Vec::new();
    for (index, jpeg) in jpegs(&avi, FRAMES).into_iter().enumerate() {
        fs::write(at(&format!("f{index:04}.jpg")), jpeg).unwrap();
        raw.extend(StereoFrame::from_jpeg(jpeg, 0, 0).unwrap().to_yuyv());
    }
    fs::write(at("raw_1344x376.yuyv"), raw).unwrap();
    dir
}

/// Keypoints of the beginning of a recording, by the library from the film.
fn keypoints(from: &Path) -> KeypointTrack {
    let camera = load_camera(&from.join("camera.toml")).unwrap();
    let motion = PoseTrack::new(&read_pose(&from.join("pose.csv")).unwrap()).unwrap();
    let mut video = open_video(from, None).unwrap();
    let all: Vec<StereoFrame> = (0..FRAMES).map(|i| video.read(i).unwrap()).collect();
    let images = read_film(&mut { all }).unwrap();
    track(images.film(), &camera, &motion, 20).unwrap().track
}

#[test]
fn pictures_and_raw_files_are_tracked_like_the_film() {
    let Some(from) = shared("data/wiggle/a1") else {
        return;
    };
    let dir = excerpt(&from);
    // A picture beside the frames would be one of them.
    fs::create_dir(dir.path().join("drawn")).unwrap();
    let expected = keypoints(&from);
    let own = "--camera camera.toml --pose pose.csv";
    let track = |video: &str, overlay: &str| {
        let line = format!("track --video {video} {own} --overlay {overlay} --out k.json");
        assert_eq!(json_in(dir.path(), &line)["frames"], FRAMES);
        let text = fs::read_to_string(dir.path().join("k.json")).unwrap();
        serde_json::from_str::<KeypointTrack>(&text).unwrap()
    };
    assert!(track("raw_1344x376.yuyv", "drawn/film.avi") == expected);
    assert!(track(".", "drawn/sheet.png") == expected);
    let unconfirmed = KeypointTrack {
        unconfirmed: vec!["the rope's end is not confirmed".to_owned()],
        ..expected
    };
    let text = serde_json::to_string(&unconfirmed).unwrap();
    fs::write(dir.path().join("unconfirmed.json"), text).unwrap();
    let case = "identify --keypoints unconfirmed.json --out r.toml";
    let words = "end is not confirmed | --accept-unconfirmed";
    are_refused_in(dir.path(), 1, &format!("{case} {own} => {words}"));
    let film = open_video(&dir.path().join("drawn/film.avi"), None).unwrap();
    assert_eq!(film.len(), FRAMES);
    let sheet = fs::read(dir.path().join("drawn/sheet.png")).unwrap();
    assert!(sheet.starts_with(b"\x89PNG"));

    let refused = |video: &str, words: &str| {
        let case = format!("track --video {video} {own} --out k2.json => {words}");
        are_refused_in(dir.path(), 2, &case);
    };
    refused(". --fps 60", "leave out the frame rate");
    fs::rename(dir.path().join("f0100.jpg"), dir.path().join("kept")).unwrap();
    refused(".", "timestamps.csv | 119");
    fs::remove_file(dir.path().join("timestamps.csv")).unwrap();
    refused(".", "give the frame rate");
    refused(". --fps 0", "--fps");
    let (raw, unnamed) = ("raw_1344x376.yuyv", "raw.yuyv");
    fs::copy(dir.path().join(raw), dir.path().join(unnamed)).unwrap();
    refused("raw.yuyv --fps 60", "raw.yuyv | name");
}

#[test]
fn a_film_on_another_clock_is_told_and_put_right() {
    let Some(from) = shared("data/wiggle/a1") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let late = |late_ms: &str| {
        let folder = from.display();
        let files = format!("--camera {folder}/camera.toml --pose {folder}/pose.csv");
        let line = format!("track --video {folder} {files} --film-late-ms {late_ms} --out k.json");
        let report = json_in(dir.path(), &line);
        let number = |name: &str| report["clamp"][name].as_f64().unwrap();
        (number("time_offset_s"), number("time_std_s"))
    };
    // It is not late in truth: what is taken out too much is missing.
    let (offset_s, std_s) = late("25");
    assert!((offset_s + 0.025).abs() < 3.0 * std_s, "{offset_s} {std_s}");
    assert!(std_s < 0.004, "{std_s}");
    let (offset_s, std_s) = late("0");
    assert!(offset_s.abs() < 3.0 * std_s, "{offset_s} {std_s}");
}

/// A camera's settings, thought to stand elsewhere, and some frames of it.
pub(super) fn film_of(
    frames: &[StereoFrame],
    camera: &StereoCamera,
    mode: VideoMode,
) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let raw: Vec<u8> = frames.iter().flat_map(StereoFrame::to_yuyv).collect();
    let size = format!("{}x{}", 2 * camera.width_px, camera.height_px);
    fs::write(at(&format!("film_{size}.yuyv")), raw).unwrap();
    write_factory_conf(&at("sn.conf"), camera, mode).unwrap();
    let turned = StereoCamera {
        r_right_left: camera.r_right_left.transpose(),
        ..camera.clone()
    };
    write_factory_conf(&at("turned.conf"), &turned, mode).unwrap();
    let elsewhere = StereoCamera {
        p_w_cam_m: camera.p_w_cam_m + Vector3::new(0.01, 0.0, 0.0),
        ..camera.clone()
    };
    let conf = Path::new("sn.conf");
    write_camera_toml(&at("thought.toml"), &elsewhere, mode, conf).unwrap();
    let conf = Path::new("turned.conf");
    write_camera_toml(&at("turned.toml"), camera, mode, conf).unwrap();
    dir
}

/// How far a camera found stands from the true one (m, degrees).
pub(super) fn off(found: &Path, truth: &StereoCamera) -> (f64, f64) {
    let found = load_camera(found).unwrap();
    let turn = Rotation3::from_matrix_unchecked(found.r_w_cam.transpose() * truth.r_w_cam);
    let away_m = (found.p_w_cam_m - truth.p_w_cam_m).norm();
    let (away_mm, degrees) = (1e3 * away_m, turn.angle().to_degrees());
    println!("{away_mm:.2} mm and {degrees:.3} degrees off");
    (away_m, degrees)
}

#[test]
fn the_lead_at_known_places_tells_where_the_camera_stands() {
    let camera = CameraConfig::default().stereo_camera();
    let appearance = Appearance::from_seed(4);
    let shape = RopeShape {
        radius_m: 0.005,
        lead_radius_m: 0.015,
    };
    let mut renderer = Renderer::new(&camera, &Cell::default(), shape, appearance, 1.6, 4);
    let resting = ScenePose {
        q: START_POSE,
        nodes: Vec::new(),
    };
    let (mut frames, mut rows) = (Vec::new(), "frame,x,y,z\n".to_owned());
    for index in 0..14_u32 {
        let i = f64::from(index);
        let p = Vector3::new(
            0.75 + 0.3 * (2.4 * i).cos(),
            -0.25 + 0.035 * i,
            0.15 + 0.3 * (2.4 * i).sin(),
        );
        renderer.place_target(Some(p));
        let mut bytes = vec![0; renderer.frame_bytes()];
        renderer.render(std::slice::from_ref(&resting), u64::from(index), &mut bytes);
        let size = [2 * camera.width_px as usize, camera.height_px as usize];
        frames.push(StereoFrame::from_yuyv(&bytes, size, 0, 0).unwrap());
        rows += &format!("{index},{},{},{}\n", p.x, p.y, p.z);
    }
    let dir = film_of(&frames, &camera, VideoMode::Vga);
    fs::write(dir.path().join("shown.csv"), rows).unwrap();
    let colour = appearance.target_rgb.map(|c| c.to_string()).join(",");
    let command = "calib extrinsics --video film_1344x376.yuyv --fps 30 --camera thought.toml \
                   --lead shown.csv --out found.toml --lead-rgb";
    let report = json_in(dir.path(), &format!("{command} {colour}"));
    println!("{report}");
    let (away_m, away_degrees) = off(&dir.path().join("found.toml"), &camera);
    assert!(away_m <= 0.01 && away_degrees <= 0.5);
    let seen = report["residual"]["points"].as_u64().unwrap();
    assert!(seen >= 12, "{report}");
    // Grey is no colour to be found by.
    are_refused_in(dir.path(), 2, &format!("{command} 120,120,120 => grey"));
}
