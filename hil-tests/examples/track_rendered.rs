//! Tracks what `render_wiggle` wrote and prints the error against its truth:
//! `track_rendered FOLDER...`, one line per folder.

use camera_ingest::source::{YuyvSource, read_left};
use camera_ingest::track::{ClampPath, TrackOptions};
use camera_ingest::{load_camera, track};
use serde::Deserialize;
use shared_types::{KeypointTrack, RopeParams};
use std::error::Error;
use std::fs::File;
use std::io::BufReader;
use std::ops::Range;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct Truth {
    seed: u64,
    rope: RopeParams,
    nodes_left_px: Vec<Vec<[f64; 2]>>,
}

/// Median, 95th percentile and maximum.
fn quantiles(mut px: Vec<f64>) -> [f64; 3] {
    px.sort_by(f64::total_cmp);
    [50, 95, 100].map(|percent: usize| px[(px.len() - 1) * percent / 100])
}

/// Distance of a tracked node from the true one (px), for the chosen nodes of all frames.
fn errors(track: &KeypointTrack, truth: &[Vec<[f64; 2]>], nodes: Range<usize>) -> Vec<f64> {
    let frames = track.frames.iter().zip(truth);
    let pairs = frames.flat_map(|(found, truth)| found.points.iter().zip(truth).enumerate());
    pairs
        .filter(|(node, _)| nodes.contains(node))
        .map(|(_, (a, b))| (a[0] - b[0]).hypot(a[1] - b[1]))
        .collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    for folder in std::env::args().skip(1).map(PathBuf::from) {
        if let Err(error) = report(&folder) {
            println!("{}: {error}", folder.display());
        }
    }
    Ok(())
}

/// Tracks one folder and prints its line.
fn report(folder: &Path) -> Result<(), Box<dyn Error>> {
    let truth: Truth =
        serde_json::from_reader(BufReader::new(File::open(folder.join("truth.json"))?))?;
    let camera = load_camera(&folder.join("camera.toml"))?;
    let clamp = ClampPath::from_pose_csv(&folder.join("pose.csv"))?;
    let size = [camera.width_px as usize * 2, camera.height_px as usize];
    let mut source = YuyvSource::open(&folder.join("video.yuyv"), size, 16_666_667)?;
    let frames = read_left(&mut source)?;
    let options = TrackOptions {
        keypoints: truth.rope.links as usize + 1,
        ..TrackOptions::default()
    };
    let found = track(&frames, &camera, &clamp, &options)?;
    let nodes = options.keypoints;
    let [median, p95, max] = quantiles(errors(&found.track, &truth.nodes_left_px, 0..nodes));
    let [_, tip_p95, _] = quantiles(errors(&found.track, &truth.nodes_left_px, nodes - 1..nodes));
    let (seen, rope) = (&found.appearance, &truth.rope);
    let off = |seen: f64, truth: f64| 100.0 * (seen / truth - 1.0);
    println!(
        "seed {:2}: median {median:.2}  p95 {p95:.2}  max {max:5.2}  tip p95 {tip_p95:.2} px;  \
         rope {:4.1} of {:4.1} mm ({:+3.0} %)  lead {:4.1} of {:4.1} mm ({:+3.0} %)  length {:+.2} %;  \
         lost {:.1} %  {:.2} ms a frame",
        truth.seed,
        seen.rope_radius_m * 1e3,
        rope.radius_m * 1e3,
        off(seen.rope_radius_m, rope.radius_m),
        seen.lead_radius_m * 1e3,
        rope.lead_radius_m * 1e3,
        off(seen.lead_radius_m, rope.lead_radius_m),
        off(seen.length_m, rope.length_m),
        100.0 * found.track.lost_part(),
        found.times.follow.as_secs_f64() * 1e3 / frames.len() as f64,
    );
    Ok(())
}
