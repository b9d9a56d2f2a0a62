//! Runs whose every number is known by a formula, in folders as `wag run` leaves them.

use rt_controller::recording::{ChunkWriter, RecordedCycle};
use run_log::{Channel, McapFile, files, left_jpeg};
use serde_json::json;
use shared_types::ipc::{FrameHeader, JointReport, PIXEL_FORMAT_YUYV};
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, MonotonicNs};
use std::fs;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};

/// When the controller began (CLOCK_MONOTONIC, ns), and how far the wall clock was ahead (ns).
const BEGIN_NS: u64 = 50_000_000_000;
const AHEAD_NS: u64 = 1_700_000_000_123_456_789;
const JOINTS: usize = 7;
/// Keypoints of a frame.
const KEYPOINTS: usize = 3;
/// The first cycle that sends, and the last cycle of all; one every 4 ms.
const CYCLES: [u64; 2] = [5, 600];
/// The last joint report; one every 5 ms.
const LAST_REPORT: u64 = 370;
/// Pictures in which the rope was tracked, but for one.
const TRACKED: RangeInclusive<u64> = 6..=30;
const LOST: u64 = 10;

/// A run that was recorded.
#[derive(Debug, Clone)]
pub(crate) struct Recorded {
    /// Where it lies.
    pub(crate) folder: PathBuf,
    /// Pictures a second.
    pub(crate) fps: u64,
    /// Of so many, the first 100 ms before the controller began.
    pub(crate) pictures: u64,
    /// Width and height of a picture (px).
    pub(crate) size_px: [u32; 2],
    /// Where the target hung (m).
    pub(crate) target_m: [f64; 3],
    /// Control cycles that are not in the recording, with the reports that came in them.
    pub(crate) lost_cycles: Range<u64>,
    /// Whether it ended well.
    pub(crate) is_ok: bool,
}

impl Recorded {
    /// A run in this folder, filmed thirty times a second.
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            fps: 30,
            pictures: 60,
            size_px: [16, 8],
            target_m: [0.6, -0.0001, 0.4],
            lost_cycles: 0..0,
            is_ok: true,
        }
    }

    /// Writes it.
    pub(crate) fn write(&self) {
        fs::create_dir(&self.folder).unwrap();
        fs::write(
            self.folder.join(files::CYCLES),
            recording(&self.lost_cycles),
        )
        .unwrap();
        let summary = json!({
            "ok": self.is_ok, "command": "run", "task": "strike", "target_m": self.target_m,
            "epoch_ns": self.stamp_ns(*TRACKED.start()),
        });
        files::write_json(&self.folder.join(files::SUMMARY), &summary).unwrap();
        if self.pictures > 0 {
            self.film();
            self.track();
        }
    }

    /// When a picture was taken (CLOCK_MONOTONIC, ns).
    pub(crate) fn stamp_ns(&self, picture: u64) -> u64 {
        BEGIN_NS - 100_000_000 + picture * 1_000_000_000 / self.fps
    }

    /// One that the recorder left out.
    pub(crate) const fn left_out() -> u64 {
        20
    }

    /// Luma, blue and red chroma of a picture, everywhere the same.
    pub(crate) fn colour(picture: u64) -> [u8; 3] {
        [
            40 + 2 * picture as u8,
            90 + picture as u8,
            160 - picture as u8,
        ]
    }

    /// A picture of the left eye.
    pub(crate) fn jpeg(&self, picture: u64) -> Vec<u8> {
        let [width, height] = self.size_px;
        let [y, cb, cr] = Self::colour(picture);
        let header = FrameHeader {
            pixel_format: PIXEL_FORMAT_YUYV,
            width_px: 2 * width,
            height_px: height,
            ..FrameHeader::default()
        };
        let yuyv = [y, cb, y, cr].repeat((width * height) as usize);
        left_jpeg(&header, &yuyv, 1, 90).unwrap()
    }

    fn film(&self) {
        let mut file = McapFile::create(&self.folder.join(files::RUN)).unwrap();
        let ahead = ("wall_minus_monotonic_ns", AHEAD_NS.to_string());
        file.metadata("wag", &[ahead]).unwrap();
        for picture in (0..self.pictures).filter(|picture| *picture != Self::left_out()) {
            let data = base64(&self.jpeg(picture));
            let at_ns = AHEAD_NS + self.stamp_ns(picture);
            let message = json!({ "data": data, "format": "jpeg" });
            file.json(Channel::Image, at_ns, &message).unwrap();
        }
        file.finish().unwrap();
    }

    fn track(&self) {
        let first = MonotonicNs(self.stamp_ns(*TRACKED.start()));
        let frames = TRACKED.map(|picture| TrackedFrame {
            t_s: MonotonicNs(self.stamp_ns(picture)).since_s(first),
            points: (0..KEYPOINTS).map(|i| keypoint(picture, i)).collect(),
            confidence: vec![1.0; KEYPOINTS],
            lost: picture == LOST,
        });
        let track = KeypointTrack {
            keypoints: KEYPOINTS,
            frames: frames.collect(),
            unconfirmed: Vec::new(),
        };
        files::write_json(&self.folder.join(files::KEYPOINTS), &track).unwrap();
    }

    /// What the frames must hold, as the check in Python reads it; pictures go to `pictures`.
    pub(crate) fn expected(&self, pictures: &Path) -> serde_json::Value {
        fs::create_dir(pictures).unwrap();
        // The first picture at which reports have come and setpoints are sent.
        let first = (0..)
            .find(|p| self.stamp_ns(*p) >= deadline_ns(CYCLES[0]))
            .unwrap();
        let begin_ns = self.stamp_ns(first);
        let instants = (0..).map(|frame| begin_ns + frame * 1_000_000_000 / self.fps);
        let last_ns = report_ns(LAST_REPORT).min(self.stamp_ns(self.pictures - 1));
        let frames = instants.take_while(|at_ns| *at_ns <= last_ns).enumerate();
        let frames = frames.map(|(frame, at_ns)| {
            let mut shown = first + frame as u64;
            shown -= u64::from(shown == Self::left_out());
            let path = pictures.join(format!("{shown}.jpg"));
            fs::write(&path, self.jpeg(shown)).unwrap();
            let is_tracked = TRACKED.contains(&shown) && shown != LOST;
            let points = (0..KEYPOINTS).map(|i| is_tracked.then(|| keypoint(shown, i)));
            let mut cycle = (at_ns - BEGIN_NS) / 4_000_000;
            while !is_sent(cycle) {
                cycle -= 1;
            }
            json!({
                "state": (0..JOINTS).map(|j| measured_rad(at_ns, j)).collect::<Vec<_>>(),
                "action": (0..JOINTS).map(|j| setpoint_rad(cycle, j)).collect::<Vec<_>>(),
                "keypoints": points.collect::<Vec<_>>(),
                "picture": path,
                "rgb": rgb(Self::colour(shown)),
            })
        });
        json!({ "frames": frames.collect::<Vec<_>>() })
    }
}

/// Red, green and blue (0 to 1) by the formulas of full-range BT.601.
fn rgb([y, cb, cr]: [u8; 3]) -> [f64; 3] {
    let [y, b, r] = [f64::from(y), f64::from(cb) - 128.0, f64::from(cr) - 128.0];
    let rgb = [
        y + 1.402 * r,
        y - 0.344_136 * b - 0.714_136 * r,
        y + 1.772 * b,
    ];
    rgb.map(|level| level.clamp(0.0, 255.0) / 255.0)
}

fn keypoint(picture: u64, i: usize) -> [f64; 2] {
    let (picture, i) = (picture as f64, i as f64);
    [picture + 0.25 * i, 100.0 - picture + 2.0 * i]
}

fn deadline_ns(cycle: u64) -> u64 {
    BEGIN_NS + cycle * 4_000_000
}

fn report_ns(report: u64) -> u64 {
    BEGIN_NS + 1_234_567 + report * 5_000_000
}

/// Not before the first, and every seventh not: half of these was never meant to be sent, half was
/// held up.
const fn is_sent(cycle: u64) -> bool {
    cycle >= CYCLES[0] && !cycle.is_multiple_of(7)
}

fn setpoint_rad(cycle: u64, joint: usize) -> f64 {
    if is_sent(cycle) {
        0.002 * cycle as f64 * (joint + 1) as f64 - 1.0
    } else {
        99.0
    }
}

/// Linear in time, so that what lies between two reports is known exactly.
fn measured_rad(at_ns: u64, joint: usize) -> f64 {
    0.3 * (joint + 1) as f64 * MonotonicNs(at_ns).since_s(MonotonicNs(BEGIN_NS)) - 0.7
}

/// The control cycles and joint reports of a run.
fn recording(lost_cycles: &Range<u64>) -> Vec<u8> {
    let (mut writer, mut bytes) = (ChunkWriter::default(), Vec::new());
    let mut reports = (0..=LAST_REPORT).peekable();
    for cycle in 0..=CYCLES[1] {
        let mut one = RecordedCycle::default();
        (one.input.cycle, one.record.cycle) = (cycle, cycle);
        one.record.deadline_ns = deadline_ns(cycle);
        one.record.compute_ns = 20_000;
        one.record.send_ns = 30_000 * u32::from(is_sent(cycle));
        one.record.sent = u8::from(is_sent(cycle) || cycle % 14 == 7);
        one.record.q_c.0 = std::array::from_fn(|joint| setpoint_rad(cycle, joint));
        while let Some(report) = reports.next_if(|r| report_ns(*r) <= deadline_ns(cycle)) {
            let mut told = JointReport {
                stamp_ns: report_ns(report),
                ..JointReport::default()
            };
            told.q.0 = std::array::from_fn(|joint| measured_rad(report_ns(report), joint));
            one.input.reports.push(told);
        }
        if lost_cycles.contains(&cycle) {
            continue;
        }
        bytes.extend(writer.cycle(&one).unwrap_or_default());
    }
    bytes.extend(writer.flush().unwrap_or_default());
    bytes
}

fn base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}
