//! Tracks what `render_wiggle` wrote and prints the error against its truth:
//! `track_rendered FOLDER`.

use camera_ingest::source::{YuyvSource, read_left};
use camera_ingest::track::{ClampPath, TrackOptions};
use camera_ingest::{load_camera, track};
use serde::Deserialize;
use std::error::Error;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

#[derive(Deserialize)]
struct Truth {
    rope: shared_types::RopeParams,
    nodes_left_px: Vec<Vec<[f64; 2]>>,
}

fn quantiles(mut px: Vec<f64>) -> String {
    px.sort_by(f64::total_cmp);
    let at = |percent: usize| px[(px.len() - 1) * percent / 100];
    let (median, p95, max) = (at(50), at(95), at(100));
    format!("median {median:.2}  p95 {p95:.2}  max {max:.2} px")
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args()
        .nth(1)
        .ok_or("usage: track_rendered FOLDER")?
        .into();
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
    let error = |frame: usize, node: usize| {
        let (a, b) = (
            found.track.frames[frame].points[node],
            truth.nodes_left_px[frame][node],
        );
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let nodes = options.keypoints;
    let all = (0..frames.len()).flat_map(|f| (0..nodes).map(move |n| (f, n)));
    println!(
        "all nodes: {}",
        quantiles(all.map(|(f, n)| error(f, n)).collect())
    );
    let tips = (0..frames.len()).map(|f| error(f, nodes - 1));
    println!("tip:       {}", quantiles(tips.collect()));
    println!("lost {:.1} %", 100.0 * found.track.lost_part());
    println!("rope {:?}", truth.rope);
    println!("seen {:?}", found.appearance);
    Ok(())
}
