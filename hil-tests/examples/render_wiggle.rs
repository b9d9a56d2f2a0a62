//! Renders a wiggle without robot and without threads, into a folder a tracker
//! can be tested on:
//!
//! ```text
//! render_wiggle OUT [SEED] [FRAMES] [VGA|HD] [ROPE_MM LEAD_MM]
//! ```
//!
//! The rope is the seed's; two more numbers replace its radius and its lead's.
//!
//! Writes `video.yuyv` (side-by-side frames, one after the other),
//! `timestamps.csv`, `pose.csv` (attach frame at 1 kHz), `camera.toml` with
//! `camera.conf`, `truth.json` (rope, colours, nodes per frame in metres and
//! left-eye pixels) and some frames as PNG.

use camera_ingest::StereoFrame;
use camera_ingest::calib::{VideoMode, write_camera_toml, write_factory_conf};
use nalgebra::{Rotation3, UnitQuaternion};
use rig_sim::wiggle_film::{WiggleFilm, attach};
use rig_sim::{CameraConfig, Resolution};
use shared_types::StereoCamera;
use std::error::Error;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// Frames written as PNG.
const PICTURES: usize = 8;

struct Arguments {
    out: PathBuf,
    seed: u64,
    frames: usize,
    mode: VideoMode,
    /// Radii of rope and lead (m).
    radii_m: Option<[f64; 2]>,
}

fn arguments() -> Result<Arguments, Box<dyn Error>> {
    let mut given = std::env::args().skip(1);
    let out = given
        .next()
        .ok_or("usage: render_wiggle OUT [SEED] [FRAMES] [VGA|HD] [ROPE_MM LEAD_MM]")?;
    Ok(Arguments {
        out: out.into(),
        seed: given.next().map_or(Ok(1), |s| s.parse())?,
        frames: given.next().map_or(Ok(400), |s| s.parse())?,
        mode: match given.next().as_deref() {
            None | Some("VGA") => VideoMode::Vga,
            Some("HD") => VideoMode::Hd,
            Some(other) => return Err(format!("there is no mode {other}; use VGA or HD").into()),
        },
        radii_m: match (given.next(), given.next()) {
            (Some(rope), Some(lead)) => {
                Some([rope.parse::<f64>()? * 1e-3, lead.parse::<f64>()? * 1e-3])
            }
            _ => None,
        },
    })
}

fn save_png(path: &Path, yuyv: &[u8], camera: &StereoCamera) -> Result<(), Box<dyn Error>> {
    let size = [camera.width_px as usize * 2, camera.height_px as usize];
    let eye = StereoFrame::from_yuyv(yuyv, size, 0, 0)?.left();
    let file = BufWriter::new(File::create(path)?);
    let mut encoder = png::Encoder::new(file, camera.width_px, camera.height_px);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&eye.to_rgb())?;
    Ok(())
}

fn write_pose(path: &Path, duration_s: f64) -> std::io::Result<()> {
    let mut text = String::from("t,x,y,z,qw,qx,qy,qz\n");
    let mut t_s = 0.0;
    while t_s <= duration_s {
        let pose = attach(t_s);
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(pose.r));
        let p = pose.p_m;
        let _ = writeln!(
            text,
            "{t_s:.4},{:.9},{:.9},{:.9},{:.12},{:.12},{:.12},{:.12}",
            p.x, p.y, p.z, q.w, q.i, q.j, q.k
        );
        t_s += 1e-3;
    }
    fs::write(path, text)
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments {
        out,
        seed,
        frames,
        mode,
        radii_m,
    } = arguments()?;
    fs::create_dir_all(&out)?;
    let settings = CameraConfig {
        resolution: match mode {
            VideoMode::Hd => Resolution::Hd,
            _ => Resolution::Vga,
        },
        ..CameraConfig::default()
    };
    let camera = settings.stereo_camera();
    write_factory_conf(&out.join("camera.conf"), &camera, mode)?;
    let toml = out.join("camera.toml");
    write_camera_toml(&toml, &camera, mode, Path::new("camera.conf"))?;
    write_pose(
        &out.join("pose.csv"),
        frames as f64 / settings.frame_rate_hz + 0.1,
    )?;

    let film = WiggleFilm::new(&settings, seed, radii_m, 0.0)?;
    let (rope, colours) = (film.rope, film.appearance);
    let mut video = BufWriter::new(File::create(out.join("video.yuyv"))?);
    let mut stamps = String::from("frame,sequence,monotonic_ns\n");
    let (mut nodes_px, mut nodes_m) = (Vec::new(), Vec::new());
    for (index, frame) in film.take(frames).enumerate() {
        video.write_all(&frame.yuyv)?;
        let _ = writeln!(stamps, "{index},{index},{}", (frame.start_s * 1e9).round());
        let pixels = frame.nodes.iter().map(|p| camera.project_left(p));
        nodes_px.push(pixels.collect::<Vec<_>>());
        nodes_m.push(
            frame
                .nodes
                .iter()
                .map(|p| [p.x, p.y, p.z])
                .collect::<Vec<_>>(),
        );
        if index % (frames / PICTURES).max(1) == 0 {
            let picture = out.join(format!("frame_{index:04}.png"));
            save_png(&picture, &frame.yuyv, &camera)?;
        }
    }
    video.flush()?;
    fs::write(out.join("timestamps.csv"), stamps)?;
    let truth = serde_json::json!({
        "seed": seed, "rope": rope, "appearance": colours,
        "nodes_left_px": nodes_px, "nodes_world_m": nodes_m,
    });
    fs::write(out.join("truth.json"), serde_json::to_string(&truth)?)?;
    println!("{frames} frames in {}", out.display());
    Ok(())
}
