//! The rendered recordings with their exact truth, as tests use them.
#![allow(dead_code, reason = "not every test file uses everything")]

#[path = "../../../hil-tests/support/missing.rs"]
pub(crate) mod missing;

use std::path::{Path, PathBuf};

use arm_model::{JointVector, Pole};
use camera_ingest::source::{FrameSource, read_film};
use camera_ingest::{Film, ImageFrame, TrackError, TrackResult, load_camera, open_video, track};
use rope_sim::{AttachMotion, MeasuredArm, PoseRow, PoseTrack};
use shared_types::StereoCamera;

/// A file of the shared data; `None`, with a message, where it is missing.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    missing::shared(&format!("data/{name}"))
}

/// Folder of a wiggle or a throw.
pub(crate) fn folder(name: &str) -> Option<PathBuf> {
    shared(&format!("wiggle/{name}"))
}

/// What a recording shows.
pub(crate) fn truth_json(name: &str) -> serde_json::Value {
    let path = folder(name).unwrap().join("truth.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// float32 .npy of shape (frames, nodes, width).
pub(crate) fn read_npy(path: &Path) -> (Vec<usize>, Vec<f32>) {
    let bytes = std::fs::read(path).unwrap();
    let head = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let text = String::from_utf8_lossy(&bytes[10..10 + head]).into_owned();
    assert!(text.contains("<f4") && text.contains("False"), "{text}");
    let shape = text.split(['(', ')']).nth(1).unwrap();
    let shape = shape
        .split(',')
        .filter_map(|s| s.trim().parse().ok())
        .collect();
    let values = bytes[10 + head..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    (shape, values)
}

/// Pixels of the nodes per frame.
pub(crate) fn read_nodes(path: &Path) -> Vec<Vec<[f64; 2]>> {
    let (shape, values) = read_npy(path);
    let pixel = |p: &[f32]| [f64::from(p[0]), f64::from(p[1])];
    let frames = values.chunks_exact(2 * shape[1]);
    frames
        .map(|frame| frame.chunks_exact(2).map(pixel).collect())
        .collect()
}

/// The numbers of a table without its head.
fn rows(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| line.split(',').map(|c| c.trim().parse().unwrap()).collect();
    text.lines().skip(1).map(row).collect()
}

/// Poses of the attach frame, `t,x,y,z,qw,qx,qy,qz`.
fn read_poses(path: &Path) -> Vec<PoseRow> {
    let pose = |r: &Vec<f64>| PoseRow {
        t_s: r[0],
        p_m: [r[1], r[2], r[3]],
        q_wxyz: [r[4], r[5], r[6], r[7]],
    };
    rows(path).iter().map(pose).collect()
}

/// The attach frame's motion in a folder: from measured joints where there are some, else
/// from poses.
pub(crate) fn motion(folder: &Path) -> Box<dyn AttachMotion> {
    let joints = folder.join("joints_measured.csv");
    if !joints.exists() {
        return Box::new(PoseTrack::new(&read_poses(&folder.join("pose.csv"))).unwrap());
    }
    let rows = rows(&joints);
    let times_s: Vec<f64> = rows.iter().map(|r| r[0]).collect();
    let q = |r: &Vec<f64>| JointVector::from(core::array::from_fn(|i| r[i + 1]));
    let q: Vec<JointVector> = rows.iter().map(q).collect();
    Box::new(MeasuredArm::new(&times_s, &q, Pole::default()).unwrap())
}

/// A wiggle in memory: left image, camera, clamp and truth.
#[derive(Clone)]
pub(crate) struct Wiggle {
    pub(crate) frames: Vec<ImageFrame>,
    /// Right images, where a test looks at them.
    pub(crate) right: Vec<ImageFrame>,
    pub(crate) camera: StereoCamera,
    /// Poses of the clamp.
    pub(crate) poses: Vec<PoseRow>,
    /// Pixels of the nodes per frame.
    pub(crate) truth: Vec<Vec<[f64; 2]>>,
}

impl Wiggle {
    /// Reads a recording.
    pub(crate) fn read(name: &str) -> Option<Self> {
        Self::read_first(name, usize::MAX)
    }

    /// Reads both images of a recording.
    pub(crate) fn read_both(name: &str) -> Option<Self> {
        let mut video = open_video(&folder(name)?, None).unwrap();
        Some(Self {
            right: read_film(&mut *video).unwrap().right,
            ..Self::read(name)?
        })
    }

    /// Reads the first frames of a recording, `most` of them.
    pub(crate) fn read_first(name: &str, most: usize) -> Option<Self> {
        let folder = folder(name)?;
        let mut truth = read_nodes(&folder.join("nodes_left_px.npy"));
        let mut video = open_video(&folder, None).unwrap();
        let count = most.min(video.len());
        truth.truncate(count);
        Some(Self {
            frames: (0..count).map(|i| video.read(i).unwrap().left()).collect(),
            right: Vec::new(),
            camera: load_camera(&folder.join("camera.toml")).unwrap(),
            poses: read_poses(&folder.join("pose.csv")),
            truth,
        })
    }

    pub(crate) fn nodes(&self) -> usize {
        self.truth[0].len()
    }

    /// Tracked with a keypoint for every node.
    pub(crate) fn track(&self) -> Result<TrackResult, TrackError> {
        let motion = PoseTrack::new(&self.poses).unwrap();
        let film = Film {
            left: &self.frames,
            right: &self.right,
        };
        track(film, &self.camera, &motion, self.nodes())
    }

    /// Distance of every keypoint from its node, frame by frame (px).
    pub(crate) fn errors(&self, result: &TrackResult) -> Vec<Vec<f64>> {
        assert_eq!(result.track.frames.len(), self.truth.len());
        let frames = result.track.frames.iter().zip(&self.truth);
        frames
            .map(|(frame, truth)| {
                assert_eq!(frame.points.len(), truth.len());
                let pairs = frame.points.iter().zip(truth);
                pairs
                    .map(|(p, t)| (p[0] - t[0]).hypot(p[1] - t[1]))
                    .collect()
            })
            .collect()
    }
}

/// The value below which the part `q` lies.
pub(crate) fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * q) as usize]
}

/// Median over every seventh frame.
pub(crate) fn median(frames: &[ImageFrame]) -> ImageFrame {
    let chosen: Vec<&ImageFrame> = frames.iter().step_by(7).collect();
    let plane = |pick: fn(&ImageFrame) -> &Vec<u8>| -> Vec<u8> {
        (0..pick(chosen[0]).len())
            .map(|at| {
                let mut values: Vec<u8> = chosen.iter().map(|f| pick(f)[at]).collect();
                values.sort_unstable();
                values[values.len() / 2]
            })
            .collect()
    };
    ImageFrame {
        luma: plane(|f| &f.luma),
        cb: plane(|f| &f.cb),
        cr: plane(|f| &f.cr),
        ..frames[0].clone()
    }
}
