//! Prints the tracker's error against the rendered recordings' exact truth:
//! `track_error FOLDER [sheet.png [first last]]`; for a name that ends in `.avi` a
//! film of the keypoints is written.
#![allow(clippy::expect_used, reason = "a measuring tool may fail loudly")]

use std::path::Path;
use std::time::Instant;

use camera_ingest::film::keypoint_film;
use camera_ingest::source::read_left;
use camera_ingest::track::{ClampPath, TrackOptions};
use camera_ingest::{load_camera, open_video, overlay, track};

/// float32 .npy of three dimensions.
fn read_npy(path: &Path) -> (Vec<usize>, Vec<f32>) {
    let bytes = std::fs::read(path).expect("truth file");
    let head = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let text = String::from_utf8_lossy(&bytes[10..10 + head]).into_owned();
    let inner = text.split(['(', ')']).nth(1).expect("shape");
    let shape = inner
        .split(',')
        .filter_map(|s| s.trim().parse().ok())
        .collect();
    let values = bytes[10 + head..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    (shape, values)
}

fn quantiles(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values[((values.len() - 1) as f64 * q) as usize];
    format!(
        "median {:.2}  p95 {:.2}  max {:.2} px",
        at(0.5),
        at(0.95),
        at(1.0)
    )
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let folder = Path::new(
        args.get(1)
            .expect("usage: track_error FOLDER [sheet.png [first last]]"),
    );
    let camera = load_camera(&folder.join("camera.toml")).expect("camera");
    let clamp = ClampPath::from_pose_csv(&folder.join("pose.csv")).expect("pose");
    let (shape, truth) = read_npy(&folder.join("nodes_left_px.npy"));
    let start = Instant::now();
    let mut source = open_video(folder, None).expect("video");
    let frames = read_left(&mut source).expect("frames");
    let per_frame = |d: std::time::Duration| d.as_secs_f64() * 1e3 / frames.len() as f64;
    println!("decode {:.2} ms a frame", per_frame(start.elapsed()));
    let options = TrackOptions {
        keypoints: shape[1],
        ..TrackOptions::default()
    };
    let result = track(&frames, &camera, &clamp, &options).expect("tracked");
    let t = result.times;
    println!(
        "background {:.2}, first frame {:.2}, follow {:.2} ms a frame",
        per_frame(t.background),
        per_frame(t.first_frame),
        per_frame(t.follow)
    );
    println!("{:?}\n{:?}", result.appearance, result.clamp);
    println!("lost {:.1} %", 100.0 * result.track.lost_part());
    let error = |frame: usize, node: usize| -> f64 {
        let at = (frame * shape[1] + node) * 2;
        let p = result.track.frames[frame].points[node];
        (p[0] - f64::from(truth[at])).hypot(p[1] - f64::from(truth[at + 1]))
    };
    let all = |frame: usize| (0..shape[1]).map(move |node| (frame, node));
    println!(
        "first frame: {}",
        quantiles(all(0).map(|(f, n)| error(f, n)).collect())
    );
    println!(
        "all nodes:   {}",
        quantiles(
            (0..shape[0])
                .flat_map(all)
                .map(|(f, n)| error(f, n))
                .collect()
        )
    );
    println!(
        "tip:         {}",
        quantiles((0..shape[0]).map(|f| error(f, shape[1] - 1)).collect())
    );
    let mut worst: Vec<(usize, f64)> = (0..shape[0])
        .map(|f| (f, all(f).map(|(f, n)| error(f, n)).fold(0.0, f64::max)))
        .collect();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (f, e) in worst.iter().take(8) {
        print!(
            "frame {f} {e:.1} px (residual {:.2}); ",
            result.residual[*f]
        );
    }
    println!();
    if let Some(name) = args.get(2).filter(|name| name.ends_with(".avi")) {
        let film = keypoint_film(&frames, &result.track).expect("film");
        std::fs::write(name, film).expect("film");
    } else if let Some(sheet) = args.get(2) {
        let chosen: Vec<usize> = if args.len() > 3 {
            args[3..].iter().filter_map(|a| a.parse().ok()).collect()
        } else {
            worst.iter().take(6).map(|w| w.0).collect()
        };
        overlay::keypoint_sheet(&frames, &result.track, &chosen, 2)
            .and_then(|p| p.write_png(Path::new(sheet)))
            .expect("sheet");
    }
}
