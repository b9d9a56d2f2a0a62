//! Scores a recorded throw: `score_error FOLDER R,G,B(tip) R,G,B(target) [strobe.png]`.
#![allow(clippy::expect_used, reason = "a measuring tool may fail loudly")]

use std::path::Path;

use camera_ingest::overlay::{still_scene, strobe};
use camera_ingest::{EyeFrame, FrameSource, ScoreOptions, load_camera, open_video, score};

fn rgb(text: &str) -> [u8; 3] {
    let parts: Vec<u8> = text.split(',').filter_map(|p| p.parse().ok()).collect();
    parts.try_into().expect("a colour R,G,B")
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let [_, folder, tip, target, picture @ ..] = &args[..] else {
        eprintln!("usage: score_error FOLDER R,G,B R,G,B [strobe.png]");
        std::process::exit(2);
    };
    let folder = Path::new(folder);
    let camera = load_camera(&folder.join("camera.toml")).expect("camera");
    let mut source = open_video(folder, None).expect("video");
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
    if let Some(path) = picture.first() {
        let frames: Vec<EyeFrame> = (0..source.len())
            .step_by(5)
            .map(|i| source.read(i).expect("frame").left())
            .collect();
        let scene = still_scene(&frames).expect("scene");
        let chosen: Vec<&EyeFrame> = frames.iter().collect();
        let mut composite = strobe(&scene, &chosen).expect("strobe");
        let pixels = |p: &[f64; 3]| camera.project_left(&(*p).into());
        let tips: Vec<[f64; 2]> = score
            .tip_path
            .iter()
            .filter_map(|(_, p)| pixels(p))
            .collect();
        composite.polyline(&tips, [255, 255, 0], [255, 0, 255]);
        if let Some(target) = pixels(&score.target_m) {
            composite.cross(target, 12, [255, 0, 0]);
        }
        composite.write_png(Path::new(path)).expect("picture");
    }
}
