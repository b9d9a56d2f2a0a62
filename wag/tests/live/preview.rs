//! The live preview with real processes: a rendered wiggle is published as the camera and
//! the controller do, a page starts the preview, a subscriber compares what it tells with
//! the rope in the film.

use super::client::{Watch, read_answer};
use super::support::{
    self, Running, alone, beside_others, calibrate, command, process_of, said, send,
};
use rig_sim::CameraConfig;
use rig_sim::wiggle_film::{WiggleFilm, joints};
use rustix::process::Signal;
use serde_json::Value;
use shared_types::StereoCamera;
use shared_types::ipc::{
    Bus, DomainSweep, FrameHeader, FramePublisher, JointPublisher, JointReport, PAYLOAD_VERSION,
    PIXEL_FORMAT_YUYV, PreviewFrame, PreviewState, PreviewSubscriber,
};
use std::io::BufReader;
use std::thread::sleep;
use std::time::{Duration, Instant};

const SEED: u64 = 4;
/// Longest wait for anything on a busy machine.
const PATIENCE: Duration = Duration::from_secs(240);
/// Longest wait for what is told about a frame.
const FRAME_PATIENCE: Duration = Duration::from_millis(500);
/// Time from a frame to the next while the rope is searched for.
const UNHURRIED: Duration = Duration::from_millis(100);
const RATE_HZ: f64 = 30.0;
/// Joint reports per frame.
const REPORTS: u64 = 8;
/// Part of the films before the wiggle (s).
const REST_S: f64 = 0.8;

fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    support::until(what, PATIENCE, look)
}

/// Asks for the page's next picture; what is drawn over it.
fn over(watch: &Watch) -> impl FnOnce() -> Value + use<> {
    let stream = watch.connect();
    watch.get(&stream, "picture?after=0");
    move || {
        let answer = read_answer(&mut BufReader::new(stream));
        let over = answer.line("X-Over");
        over.map_or(Value::Null, |over| serde_json::from_str(over).unwrap())
    }
}

/// The value below which a part of them lies.
fn quantile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * part) as usize]
}

/// Distance of a pixel from a polyline (px).
fn off_px(p: [f32; 2], line: &[[f64; 2]]) -> f64 {
    let p = p.map(f64::from);
    let to = |pair: &[[f64; 2]]| {
        let d = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let e = [p[0] - pair[0][0], p[1] - pair[0][1]];
        let part = (d[0] * e[0] + d[1] * e[1]) / (d[0] * d[0] + d[1] * d[1]).max(1e-9);
        let part = part.clamp(0.0, 1.0);
        (e[0] - part * d[0]).hypot(e[1] - part * d[1])
    };
    line.windows(2).map(to).fold(f64::INFINITY, f64::min)
}

/// Camera and controller, frame by frame: the next one comes when this one was looked at.
struct Stage {
    frames: FramePublisher,
    joints: JointPublisher,
    previews: PreviewSubscriber,
    camera: StereoCamera,
    film: WiggleFilm,
    /// Frames published, and those before this film.
    sequence: u64,
    before: u64,
    /// Errors of the keypoints since somebody looked (px).
    errors_px: Vec<f64>,
}

impl Stage {
    fn new(bus: &Bus) -> Self {
        let camera = CameraConfig::default().stereo_camera();
        let bytes = camera.width_px as usize * camera.height_px as usize * 4;
        Self {
            frames: bus.frame_publisher(bytes).unwrap(),
            joints: bus.joint_publisher().unwrap(),
            previews: bus.preview_subscriber().unwrap(),
            film: Self::film(),
            camera,
            sequence: 0,
            before: 0,
            errors_px: Vec::new(),
        }
    }

    fn film() -> WiggleFilm {
        let config = CameraConfig {
            frame_rate_hz: RATE_HZ,
            ..CameraConfig::default()
        };
        WiggleFilm::new(&config, SEED, None, -REST_S).unwrap()
    }

    /// Begins the wiggle again, as if the rope had come to rest.
    fn again(&mut self) {
        self.film = Self::film();
        self.before = self.sequence;
    }

    fn stamp_ns(t_s: f64) -> u64 {
        (t_s * 1e9) as u64
    }

    /// Publishes the next frame and the reports before it; where the rope is in it.
    fn publish(&mut self) -> Vec<[f64; 2]> {
        let filmed = self.film.next().unwrap();
        let start_s = 10.0 + self.sequence as f64 / RATE_HZ;
        for part in 0..REPORTS {
            let early_s = (REPORTS - 1 - part) as f64 / (REPORTS as f64 * RATE_HZ);
            let report = JointReport {
                version: PAYLOAD_VERSION,
                stamp_ns: Self::stamp_ns(start_s - early_s),
                q: joints(filmed.start_s - early_s),
                ..JointReport::default()
            };
            self.joints.send_copy(report).unwrap();
        }
        let mut frame = self.frames.loan_slice(filmed.yuyv.len()).unwrap();
        self.sequence += 1;
        *frame.user_header_mut() = FrameHeader {
            version: PAYLOAD_VERSION,
            pixel_format: PIXEL_FORMAT_YUYV,
            width_px: self.camera.width_px * 2,
            height_px: self.camera.height_px,
            sequence: self.sequence,
            stamp_ns: Self::stamp_ns(start_s),
        };
        frame.payload_mut().copy_from_slice(&filmed.yuyv);
        frame.send().unwrap();
        let nodes = filmed.nodes.iter();
        nodes
            .map(|p| self.camera.project_left(p).unwrap())
            .collect()
    }

    /// Shows the next frame; what the preview tells about it, if it does in time.
    fn step(&mut self) -> Option<PreviewFrame> {
        let line = self.publish();
        let began = Instant::now();
        while began.elapsed() < FRAME_PATIENCE {
            match self.previews.receive().unwrap() {
                Some(reported) if reported.rope.sequence == self.sequence => {
                    let off = reported.rope.points().iter().map(|p| off_px(*p, &line));
                    self.errors_px.extend(off);
                    return Some(*reported);
                }
                Some(_) => (),
                None => sleep(Duration::from_millis(1)),
            }
        }
        None
    }

    /// Shows frames until the preview tells something.
    fn reported(&mut self) -> PreviewFrame {
        until("a word about a frame", || self.step())
    }
}

#[test]
fn the_rope_is_found_in_a_wiggle_and_followed_whatever_happens_to_the_preview() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let camera = CameraConfig::default().stereo_camera();
    let camera = calibrate(folder.path(), &camera);
    let domain = format!("preview-film-{}", std::process::id());
    let _sweep = DomainSweep::new(&domain);
    let mut stage = Stage::new(&Bus::join(&domain).unwrap());
    let args = format!("--domain {domain} --preview --camera {}", camera.display());
    let page = Watch::start(&args);
    let pid = || process_of(&page.pid().to_string(), "preview").unwrap();
    // A frame may come to it before the first joints do.
    until("a preview that looks for the rope", || {
        (stage.reported().state() == PreviewState::Looking).then_some(())
    });
    // Killed, it is started again by the page.
    let first = pid();
    send(first, Signal::KILL);
    until("another preview", || {
        stage.step().filter(|reported| reported.seen <= 5)
    });
    assert_ne!(pid(), first);
    // It finds the rope in a wiggle.
    stage.again();
    let looked = (RATE_HZ * 7.0) as u64;
    until("a rope that is followed", || {
        let reported = stage.reported();
        if stage.sequence - stage.before > looked {
            sleep(UNHURRIED);
        }
        (reported.state() == PreviewState::Following).then_some(())
    });
    // It follows it through the next one; what it tells is drawn.
    stage.again();
    stage.errors_px.clear();
    for _ in 0..(RATE_HZ * 3.0) as usize {
        assert_eq!(stage.reported().state(), PreviewState::Following);
    }
    let drawn = until("a picture with keypoints", || {
        let picture = over(&page);
        // The page shows a picture one picture later.
        for _ in 0..4 {
            stage.reported();
            sleep(UNHURRIED);
        }
        let over = picture();
        let enough = over["keypoints"].as_array().is_some_and(|k| k.len() > 10);
        enough.then_some(over)
    });
    let caption = drawn["caption"].as_str().unwrap_or_default();
    assert!(caption.contains("the preview's keypoints"), "{drawn}");
    // Kept from running now and then, as on a busy machine, it leaves frames out.
    let before = stage.reported().skipped;
    for _ in 0..3 {
        send(pid(), Signal::STOP);
        for _ in 0..10 {
            stage.publish();
        }
        send(pid(), Signal::CONT);
        for _ in 0..10 {
            assert_eq!(stage.reported().state(), PreviewState::Following);
        }
    }
    let last = stage.reported();
    assert!(last.skipped - before >= 20, "{last:?}");
    let [half, most] = [0.5, 0.95].map(|part| quantile(&mut stage.errors_px, part));
    println!(
        "{} keypoints, {half:.2} px, 95 % {most:.2} px",
        stage.errors_px.len()
    );
    assert!(half < 2.0 && most < 8.0, "{half}, {most} px");
    assert_eq!(page.end(), Some(0));
}

#[test]
fn a_preview_alone_says_what_it_waits_for_and_needs_a_calibration() {
    let _turn = beside_others();
    let folder = tempfile::tempdir().unwrap();
    let domain = format!("preview-alone-{}", std::process::id());
    let config = folder.path().join("preview.toml");
    let camera = folder.path().join("camera.toml");
    let text = format!("domain = \"{domain}\"\ncamera = \"{}\"\n", camera.display());
    std::fs::write(&config, text).unwrap();
    let process = || command(&format!("process preview --config {}", config.display()));
    let refused = process().output().unwrap();
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(said(&refused).contains("camera.toml"), "{}", said(&refused));
    let sees = CameraConfig::default().stereo_camera();
    calibrate(folder.path(), &sees);
    let _sweep = DomainSweep::new(&domain);
    let bus = Bus::join(&domain).unwrap();
    let previews = bus.preview_subscriber().unwrap();
    let mut preview = Running(process().spawn().unwrap());
    for _ in 0..2 {
        let reported = until("a sign of life", || previews.receive().unwrap().map(|t| *t));
        assert_eq!(reported.state(), PreviewState::NoCamera);
        assert_eq!(reported.seen, 0);
    }
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", preview.0.id())).unwrap();
    let nice = stat.rsplit_once(')').unwrap().1.split_whitespace().nth(16);
    assert_eq!(nice, Some("19"), "{stat}");
    preview.end(Signal::INT);
}
