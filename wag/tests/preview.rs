//! The live preview with real processes: a demo on the rig, a page that starts the
//! preview, a subscriber that compares what it tells with the rope that hangs there.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

mod support;

use arm_model::JointVector;
use arm_model::Pole;
use rig_sim::hidden::hidden_rope;
use rope_sim::{Candidate, FrameTimes, MeasuredArm, Precision, SimOptions, Start, Watch, roll_out};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use shared_types::ipc::{
    Bus, DomainSweep, JointReport, JointSubscriber, PreviewFrame, PreviewState, PreviewSubscriber,
};
use shared_types::{MonotonicNs, StereoCamera};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use support::{command, process_of, said, send};

const SEED: u64 = 4;
/// Longest wait for a stage of a demo on a busy machine.
const PATIENCE: Duration = Duration::from_secs(240);
/// What a demo says that gave up because other programs kept the machine busy.
const TOO_BUSY: [&str; 2] = [
    "on this machine; stop other programs",
    "no camera frame arrived",
];
/// Faster than this the wiggling joint counts as moving (rad/s).
const MOVES_RAD_S: f64 = 0.05;

/// A process that ends with the test.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.0), Signal::INT);
        let began = Instant::now();
        while began.elapsed() < Duration::from_secs(10) {
            if self.0.try_wait().unwrap().is_some() {
                return;
            }
            sleep(Duration::from_millis(10));
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    support::until(what, PATIENCE, look)
}

/// `wag watch RUN --preview`, and the address of its page.
fn watch(run: &Path) -> (Ends, String) {
    let mut child = command(&format!("watch --preview --json {}", run.display()))
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    let mut text = String::new();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    while !text.ends_with("}\n") {
        text += &lines.next().unwrap().unwrap();
        text.push('\n');
    }
    let told: Value = serde_json::from_str(&text).unwrap();
    (Ends(child), told["url"].as_str().unwrap().to_owned())
}

/// What is drawn over the page's next picture.
fn over(url: &str) -> Value {
    let host = url.split('/').nth(2).unwrap();
    let home = &url["http://".len() + host.len()..];
    let mut stream = TcpStream::connect(host).unwrap();
    write!(
        stream,
        "GET {home}picture?after=0 HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let text = String::from_utf8_lossy(&answer);
    let line = text.lines().find_map(|l| l.strip_prefix("X-Over: "));
    line.map_or(Value::Null, |over| serde_json::from_str(over).unwrap())
}

/// Everything that was heard.
#[derive(Default)]
struct Heard {
    told: Vec<PreviewFrame>,
    joints: Vec<JointReport>,
}

impl Heard {
    /// Frames in which a rope is followed and not lost, after the `from`-th told.
    fn followed(&self, from: usize) -> usize {
        let frames = self.told[from.min(self.told.len())..].iter();
        frames.filter(|told| is_followed(told)).count()
    }

    /// Whether the arm moved in a frame.
    fn moves(&self, told: &PreviewFrame) -> bool {
        let next = self
            .joints
            .partition_point(|r| r.stamp_ns < told.rope.stamp_ns);
        let report = self.joints.get(next).or(self.joints.last());
        report.is_some_and(|report| report.qd.max_abs() > MOVES_RAD_S)
    }
}

fn is_followed(told: &PreviewFrame) -> bool {
    told.state() == PreviewState::Following && !told.rope.is_lost()
}

/// The rope's true pixels at the frames' exposures: the hidden rope simulated under the
/// joints as measured, from rest.
fn truth(camera: &StereoCamera, joints: &[JointReport], stamps: &[u64]) -> Vec<Vec<[f64; 2]>> {
    let zero = MonotonicNs(joints[0].stamp_ns);
    let times: Vec<f64> = joints
        .iter()
        .map(|r| MonotonicNs(r.stamp_ns).since_s(zero))
        .collect();
    let q: Vec<JointVector> = joints.iter().map(|r| r.q).collect();
    let arm = MeasuredArm::new(&times, &q, Pole::default()).unwrap();
    let rope = hidden_rope(SEED);
    let last_s = *times.last().unwrap();
    // A rope every millisecond; the exposure's middle is nearest to one of them.
    let options = SimOptions {
        step_s: 1e-3,
        precision: Precision::F64,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1e-3,
            count: (last_s * 1e3) as usize,
        },
        watch: Watch::NOTHING,
        horizon_s: last_s,
        threads: 1,
    };
    let whole = roll_out(&[Candidate::new(&rope, &arm)], &options).unwrap();
    let nodes = &whole[0].nodes;
    let at = |stamp: u64| {
        let t_s = MonotonicNs(stamp).since_s(zero) + camera.row_time_s(0.0);
        let index = (t_s * 1e3).round().clamp(0.0, last_s * 1e3 - 1.0) as usize;
        (0..nodes.nodes())
            .map(|node| camera.project_left(&nodes.position(index, node)).unwrap())
            .collect()
    };
    stamps.iter().map(|stamp| at(*stamp)).collect()
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

/// The value below which a part of the sorted ones lies.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * part) as usize]
}

/// Errors of the keypoints with more than this confidence, those of frames at rest and
/// those of frames in motion (px).
fn errors(camera: &StereoCamera, heard: &Heard, least: f32) -> [Vec<f64>; 2] {
    let frames: Vec<&PreviewFrame> = heard.told.iter().filter(|t| is_followed(t)).collect();
    let stamps: Vec<u64> = frames.iter().map(|t| t.rope.stamp_ns).collect();
    let mut out = [Vec::new(), Vec::new()];
    for (told, line) in frames.iter().zip(truth(camera, &heard.joints, &stamps)) {
        let pairs = told.rope.points().iter().zip(told.rope.confidences());
        let sure = pairs.filter(|(_, confidence)| **confidence > least);
        let off = sure.map(|(p, _)| off_px(*p, &line));
        out[usize::from(heard.moves(told))].extend(off);
    }
    for errors in &mut out {
        errors.sort_by(f64::total_cmp);
    }
    out
}

/// A demo that is listened to.
struct Stand<'a> {
    demo: &'a mut Ends,
    previews: PreviewSubscriber,
    joints: JointSubscriber,
    heard: Heard,
}

impl Stand<'_> {
    /// Takes in what has come; whether the demo has ended.
    fn listen(&mut self) -> bool {
        while let Some(told) = self.previews.receive().unwrap() {
            self.heard.told.push(*told);
        }
        let joints = &mut self.heard.joints;
        while let Some(report) = self.joints.receive().unwrap() {
            let last_ns = joints.last().map_or(0, |last| last.stamp_ns);
            if report.stamp_ns > last_ns + 1_000_000 {
                joints.push(*report);
            }
        }
        self.demo.0.try_wait().unwrap().is_some()
    }

    /// Waits until the rope was followed in so many frames from now on; `None` when the
    /// demo ended before.
    fn follows(&mut self, frames: usize) -> Option<()> {
        let from = self.heard.told.len();
        until("a rope that is followed", || {
            let ended = self.listen();
            let enough = self.heard.followed(from) >= frames;
            (enough || ended).then_some(enough)
        })
        .then_some(())
    }

    /// Waits until the rope was followed while the arm stood and while it moved; `None`
    /// when the demo ended before.
    fn sees_rest_and_motion(&mut self) -> Option<()> {
        until("rest and motion", || {
            let ended = self.listen();
            let heard = &self.heard;
            let frames = || heard.told.iter().filter(|told| is_followed(told));
            let moving = frames().filter(|told| heard.moves(told)).count();
            let enough = moving.min(frames().count() - moving) >= LEAST;
            (enough || ended).then_some(enough)
        })
        .then_some(())
    }
}

/// Frames of each kind in which the rope must be followed.
const LEAST: usize = 50;

/// What a demo's preview did; `None` when the demo ended too soon.
fn rehearse(demo: &mut Ends, run: &Path) -> Option<Heard> {
    let config = run.join("config/rt-controller.toml");
    until("the controller's configuration", || {
        (config.exists() || demo.0.try_wait().unwrap().is_some()).then_some(())
    });
    if !config.exists() {
        return None;
    }
    let domain = format!("run-{}", demo.0.id());
    let _sweep = DomainSweep::new(&domain);
    let bus = Bus::join(&domain).unwrap();
    let mut stand = Stand {
        demo,
        previews: bus.preview_subscriber().unwrap(),
        joints: bus.joint_subscriber().unwrap(),
        heard: Heard::default(),
    };
    let (page, url) = watch(run);
    stand.follows(60)?;
    // Killed, it is started again by the page and finds the rope again.
    let first = process_of(&page.0.id().to_string(), "preview").unwrap();
    send(first, Signal::KILL);
    stand.listen();
    let killed_at = stand.heard.told.len();
    stand.follows(60)?;
    let second = process_of(&page.0.id().to_string(), "preview").unwrap();
    assert_ne!(first, second);
    assert!(stand.heard.told[killed_at..].iter().any(|t| t.seen <= 5));
    // What it tells is drawn.
    let drawn = until("a picture with keypoints", || {
        let over = over(&url);
        let enough = over["keypoints"].as_array().is_some_and(|k| k.len() > 10);
        (enough || stand.listen()).then_some(over)
    });
    let caption = drawn["caption"].as_str().unwrap_or_default();
    assert!(caption.contains("the preview's keypoints"), "{drawn}");
    // Kept from running now and then, as on a busy machine, it leaves frames out.
    let before = stand.heard.told.last().unwrap().skipped;
    for _ in 0..3 {
        send(second, Signal::STOP);
        sleep(Duration::from_millis(300));
        send(second, Signal::CONT);
        sleep(Duration::from_millis(300));
    }
    stand.listen();
    stand.follows(120)?;
    let skipped = stand.heard.told.last().unwrap().skipped - before;
    assert!(skipped >= 30, "{skipped}");
    stand.sees_rest_and_motion()?;
    Some(stand.heard)
}

#[test]
fn the_rope_is_followed_at_rest_and_in_motion_whatever_happens_to_the_preview() {
    let folder = tempfile::tempdir().unwrap();
    for attempt in 0..3 {
        let run = folder.path().join(format!("run-{attempt}"));
        let line = format!("demo --seed {SEED} --json --out {}", run.display());
        let child = command(&line).spawn().unwrap();
        let mut demo = Ends(child);
        let Some(heard) = rehearse(&mut demo, &run) else {
            let said = told(demo);
            let busy = TOO_BUSY.iter().any(|cause| said.contains(cause));
            assert!(busy, "the demo ended before enough was seen: {said}");
            continue;
        };
        drop(demo);
        let camera = camera_ingest::load_camera(&run.join("camera.toml")).unwrap();
        for (least, most_px) in [(-1.0, 6.0), (0.5, 6.0)] {
            let [rest, motion] = errors(&camera, &heard, least);
            for (what, errors) in [("at rest", &rest), ("in motion", &motion)] {
                let count = errors.len();
                assert!(count > 24 * LEAST / 2, "{what}: {count} keypoints");
                let [half, most] = [0.5, 0.95].map(|part| quantile(errors, part));
                println!(
                    "{what}, confidence above {least}: {count} keypoints, {half:.2} px, \
                     95 % {most:.2} px"
                );
                assert!(half < 1.0 && most < most_px, "{what}: {half}, {most} px");
            }
        }
        return;
    }
    panic!("three demos found the machine too busy");
}

/// What a demo that ended by itself said.
fn told(mut demo: Ends) -> String {
    let _ = demo.0.wait();
    let mut text = String::new();
    for pipe in [
        demo.0.stdout.take().map(|p| Box::new(p) as Box<dyn Read>),
        demo.0.stderr.take().map(|p| Box::new(p) as Box<dyn Read>),
    ] {
        let _ = pipe.unwrap().read_to_string(&mut text);
    }
    text
}

#[test]
fn a_preview_alone_says_what_it_waits_for_and_needs_a_calibration() {
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
    let sees = rig_sim::CameraConfig::default().stereo_camera();
    let conf = folder.path().join("camera.conf");
    let mode = camera_ingest::calib::VideoMode::Vga;
    camera_ingest::calib::write_factory_conf(&conf, &sees, mode).unwrap();
    camera_ingest::calib::write_camera_toml(&camera, &sees, mode, Path::new("camera.conf"))
        .unwrap();
    let _sweep = DomainSweep::new(&domain);
    let bus = Bus::join(&domain).unwrap();
    let previews = bus.preview_subscriber().unwrap();
    let preview = Ends(process().spawn().unwrap());
    for _ in 0..2 {
        let told = until("a sign of life", || previews.receive().unwrap().map(|t| *t));
        assert_eq!((told.state(), told.seen), (PreviewState::NoCamera, 0));
    }
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", preview.0.id())).unwrap();
    let nice = stat.rsplit_once(')').unwrap().1.split_whitespace().nth(16);
    assert_eq!(nice, Some("19"), "{stat}");
}
