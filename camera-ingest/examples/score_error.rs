//! Scores a recorded throw: `score_error FOLDER R,G,B(tip) R,G,B(target)`.
#![allow(clippy::expect_used, reason = "a measuring tool may fail loudly")]

use std::path::Path;

use camera_ingest::{ScoreOptions, load_camera, open_video, score};

fn rgb(text: &str) -> [u8; 3] {
    let parts: Vec<u8> = text.split(',').filter_map(|p| p.parse().ok()).collect();
    parts.try_into().expect("a colour R,G,B")
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let [_, folder, tip, target] = &args[..] else {
        eprintln!("usage: score_error FOLDER R,G,B R,G,B");
        std::process::exit(2);
    };
    let folder = Path::new(folder);
    let camera = load_camera(&folder.join("camera.toml")).expect("camera");
    let mut source = open_video(folder).expect("video");
    let options = ScoreOptions::default();
    let score = score(&mut source, &camera, rgb(tip), rgb(target), &options).expect("score");
    println!(
        "closest {:.1} mm ({:.1} to {:.1}) at {:.4} s, target {:?}, tip seen in {} frames",
        score.closest_m * 1e3,
        score.interval_m[0] * 1e3,
        score.interval_m[1] * 1e3,
        score.time_s,
        score.target_m,
        score.tip_path.len()
    );
}
