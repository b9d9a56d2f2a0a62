//! The rendered recordings with their exact truth, as tests use them.
#![allow(dead_code, reason = "not every test file uses everything")]

use std::path::{Path, PathBuf};

use camera_ingest::source::FrameSource;
use camera_ingest::track::Models;
use camera_ingest::{
    ClampPath, EyeFrame, TrackError, TrackOptions, TrackResult, load_camera, open_video, track_with,
};
use shared_types::StereoCamera;

/// Folder of a recording; `None`, with a message, where the data are missing.
pub(crate) fn folder(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/data/wiggle"
    ))
    .join(name);
    if path.exists() {
        Some(path)
    } else {
        println!("skipped: {} not found", path.display());
        None
    }
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

/// A wiggle in memory: left image, camera, clamp and truth.
#[derive(Clone)]
pub(crate) struct Wiggle {
    pub(crate) frames: Vec<EyeFrame>,
    pub(crate) camera: StereoCamera,
    pub(crate) clamp: ClampPath,
    /// Pixels of the nodes per frame.
    pub(crate) truth: Vec<Vec<[f64; 2]>>,
}

impl Wiggle {
    /// Reads a recording.
    pub(crate) fn read(name: &str) -> Option<Self> {
        Self::read_first(name, usize::MAX)
    }

    /// Reads the first frames of a recording, `most` of them.
    pub(crate) fn read_first(name: &str, most: usize) -> Option<Self> {
        let folder = folder(name)?;
        let (shape, truth) = read_npy(&folder.join("nodes_left_px.npy"));
        let pixel = |p: &[f32]| [f64::from(p[0]), f64::from(p[1])];
        let mut video = open_video(&folder, None).unwrap();
        let count = most.min(video.len());
        Some(Self {
            frames: (0..count).map(|i| video.read(i).unwrap().left()).collect(),
            camera: load_camera(&folder.join("camera.toml")).unwrap(),
            clamp: ClampPath::from_pose_csv(&folder.join("pose.csv")).unwrap(),
            truth: truth
                .chunks_exact(2 * shape[1])
                .take(count)
                .map(|frame| frame.chunks_exact(2).map(pixel).collect())
                .collect(),
        })
    }

    pub(crate) fn nodes(&self) -> usize {
        self.truth[0].len()
    }

    /// Tracked with a keypoint for every node.
    pub(crate) fn track(&self) -> Result<TrackResult, TrackError> {
        self.track_with(&mut Models::default())
    }

    /// The same with learned models.
    pub(crate) fn track_with(&self, models: &mut Models<'_>) -> Result<TrackResult, TrackError> {
        let options = TrackOptions {
            keypoints: self.nodes(),
            ..TrackOptions::default()
        };
        track_with(&self.frames, &self.camera, &self.clamp, &options, models)
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
