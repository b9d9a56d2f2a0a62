//! `experiments bench track`: time per frame of each stage of tracking a recorded wiggle, and
//! the memory it takes.

use super::spent::{Spent, least};
use crate::args::BenchArgs;
use crate::report::report;
use anyhow::Context;
use arm_model::Pole;
use camera_ingest::source::{FrameSource, StereoSource, read_film};
use camera_ingest::{USUAL_KEYPOINTS, load_camera, open_video, track};
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome, Stage};
use rope_sim::{AttachMotion, MeasuredArm, PoseTrack};
use run_log::files::{self, read_joints, read_pose};
use serde_json::{Map, Value, json};
use shared_types::StereoCamera;
use std::path::Path;
use std::time::Duration;

/// Most memory wanted (MB, 10^6 bytes).
const LIMIT_MB: f64 = 400.0;
/// Parts of the tracker that it times itself.
const STAGES: [&str; 3] = ["background", "searching", "reading"];

/// Most memory this process has held so far (MB), where the system reports it.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0 / 1e6)
}

/// What one pass over a recording took.
struct Pass {
    decoding: Spent,
    tracking: Spent,
    stages: [Duration; 3],
    lost_fraction: f64,
}

impl Pass {
    /// Reads and tracks a recording; the frames are gone afterwards, so that a second
    /// pass takes no more memory than the first.
    fn over(
        video: &mut dyn StereoSource,
        camera: &StereoCamera,
        motion: &dyn AttachMotion,
    ) -> Outcome<Self> {
        let (decoding, images) = least(1, || read_film(video)).or_input()?;
        let follow = || track(images.film(), camera, motion, USUAL_KEYPOINTS);
        let (tracking, result) = least(1, follow).or_failed()?;
        let times = result.times;
        Ok(Self {
            decoding,
            tracking,
            stages: [times.background, times.searching, times.reading],
            lost_fraction: result.track.lost_fraction(),
        })
    }

    /// The smaller of both passes' times, each by itself.
    fn or_less(self, other: &Self) -> Self {
        Self {
            decoding: self.decoding.or_less(other.decoding),
            tracking: self.tracking.or_less(other.tracking),
            stages: std::array::from_fn(|i| self.stages[i].min(other.stages[i])),
            ..self
        }
    }
}

/// The clamp's motion, from measured joints where there are some, else from poses.
fn motion(folder: &Path) -> Outcome<Box<dyn AttachMotion>> {
    let joints = folder.join("joints.csv");
    if joints.exists() {
        let csv = read_joints(&joints).or_input()?;
        let arm = MeasuredArm::new(&csv.times_s, &csv.q, Pole::default())
            .with_context(|| format!("`{}`", joints.display()))
            .or_input()?;
        return Ok(Box::new(arm));
    }
    let path = folder.join("pose.csv");
    let track = PoseTrack::new(&read_pose(&path).or_input()?)
        .with_context(|| format!("`{}`", path.display()))
        .or_input()?;
    Ok(Box::new(track))
}

pub(super) fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    let folder = args.video.as_ref().ok_or_else(|| {
        bad_input!(
            "`experiments bench track` needs a recorded wiggle: --video FOLDER with video.avi, \
             camera.toml and pose.csv or joints.csv"
        )
    })?;
    let camera = load_camera(&folder.join(files::CAMERA)).or_input()?;
    let mut video = open_video(folder, None).or_input()?;
    let motion = motion(folder)?;
    let stage = Stage::begin("bench");
    let mut least = Pass::over(&mut video, &camera, &*motion)?;
    let peak_mb = peak_mb();
    for _ in 1..if args.quick { 1 } else { 3 } {
        least = least.or_less(&Pass::over(&mut video, &camera, &*motion)?);
    }
    let frames = video.len();
    stage.done(&format!("{frames} frames"));
    let per_frame = |s: f64| 1e3 * s / frames as f64;
    let together = Spent {
        cpu_s: least.decoding.cpu_s + least.tracking.cpu_s,
        wall_s: least.decoding.wall_s + least.tracking.wall_s,
    };
    let stages: Map<String, Value> = STAGES
        .iter()
        .zip(least.stages)
        .map(|(name, t)| ((*name).to_owned(), json!(per_frame(t.as_secs_f64()))))
        .collect();
    let own = json!({
        "video": folder, "frames": frames,
        "decoding_cpu_ms": per_frame(least.decoding.cpu_s),
        "tracking_cpu_ms": per_frame(least.tracking.cpu_s),
        "together_cpu_ms": per_frame(together.cpu_s),
        "together_wall_ms": per_frame(together.wall_s),
        "stages_wall_ms": stages,
        "peak_memory_mb": peak_mb, "limit_mb": LIMIT_MB, "lost_fraction": least.lost_fraction,
    });
    Ok(report(args, "bench track", own, || {
        println!("{frames} frames of `{}`", folder.display());
        let ms = |s: f64| format!("{:.2}", per_frame(s));
        let row = |name: &str, t: Spent| [name.to_owned(), ms(t.cpu_s), ms(t.wall_s)];
        let mut rows = vec![row("decoding", least.decoding)];
        for (name, t) in STAGES.iter().zip(least.stages) {
            let stage = format!("tracking: {name}");
            rows.push([stage, String::new(), ms(t.as_secs_f64())]);
        }
        rows.push(row("tracking", least.tracking));
        rows.push(row("together", together));
        let header = ["stage", "processor (ms/frame)", "wall (ms/frame)"];
        println!("{}", numbers(header, 0, rows));
        if let Some(mb) = peak_mb {
            println!("peak memory {mb:.0} MB (limit: {LIMIT_MB} MB)");
        }
    }))
}
