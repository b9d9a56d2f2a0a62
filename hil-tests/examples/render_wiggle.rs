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
use hil_tests::hidden::hidden_rope;
use hil_tests::render::{Appearance, Renderer, RopeShape, ScenePose};
use hil_tests::rig::{CameraConfig, Resolution};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rope_sim::LiveRope;
use shared_types::kinematics::{FrameMotion, attach_motion};
use shared_types::plan::START_POSE;
use shared_types::{JointState, JointVector, StereoCamera};
use std::error::Error;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

const RATE_HZ: f64 = 60.0;
const AMPLITUDE_DEG: f64 = 16.5;
const FREQUENCY_HZ: f64 = 1.3;
const DURATION_S: f64 = 5.6;
const RAMP_S: f64 = 2.8;
const PHYSICS_STEP_S: f64 = 1e-4;
/// Frames written as PNG.
const PICTURES: usize = 8;

/// Quintic step from 0 to 1, flat at both ends.
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

/// Joints of the shipped wiggle: a sine of joint 6, faded in and out, from
/// t = 0 with the rope hanging still.
fn joints(t_s: f64) -> JointVector {
    let fade = smooth_step(t_s / RAMP_S) * smooth_step((DURATION_S - t_s) / RAMP_S);
    let swing = (core::f64::consts::TAU * FREQUENCY_HZ * t_s).sin();
    let mut q = START_POSE;
    q[5] += AMPLITUDE_DEG.to_radians() * swing * fade;
    q
}

/// The attach frame with velocities and accelerations by central differences.
fn attach(t_s: f64) -> FrameMotion {
    const H: f64 = 1e-3;
    let (before, now, after) = (joints(t_s - H), joints(t_s), joints(t_s + H));
    attach_motion(&JointState {
        q: now,
        qd: (after - before).map(|d| d / (2.0 * H)),
        qdd: (after + before - now - now).map(|d| d / (H * H)),
    })
}

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
    write_pose(&out.join("pose.csv"), frames as f64 / RATE_HZ + 0.1)?;

    let (mut rope, colours) = (hidden_rope(seed), Appearance::from_seed(seed));
    if let Some([radius_m, lead_radius_m]) = radii_m {
        (rope.radius_m, rope.lead_radius_m) = (radius_m, lead_radius_m);
    }
    let mut renderer = Renderer::new(&camera, RopeShape::from(&rope), colours, 1.6, seed);
    renderer.place_target(Some(Vector3::new(1.10, 0.0, 0.45)));
    let mut live = LiveRope::new(&rope, &attach(0.0), PHYSICS_STEP_S)?;
    let mut pose_at = |t_s: f64| {
        live.advance(&attach, t_s);
        ScenePose {
            q: joints(t_s),
            nodes: live.nodes().to_vec(),
        }
    };

    let mut video = BufWriter::new(File::create(out.join("video.yuyv"))?);
    let mut stamps = String::from("frame,sequence,monotonic_ns\n");
    let (mut nodes_px, mut nodes_m) = (Vec::new(), Vec::new());
    let mut pixels = vec![0; renderer.frame_bytes()];
    let mut drawing = std::time::Duration::ZERO;
    for frame in 0..frames {
        let start_s = frame as f64 / RATE_HZ;
        let eighth = |i: usize| start_s + camera.exposure_s * (i as f64 + 0.5) / 8.0;
        let all: Vec<_> = (0..8).map(|i| pose_at(eighth(i))).collect();
        // Enough of the eight poses for the motion in this frame.
        let every = (8 / renderer.sub_frames(&all[0], &all[7]).min(8)).max(1);
        let poses: Vec<_> = all.iter().skip(every / 2).step_by(every).cloned().collect();
        let began = std::time::Instant::now();
        renderer.render(&poses, frame as u64, &mut pixels);
        drawing += began.elapsed();
        video.write_all(&pixels)?;
        let _ = writeln!(stamps, "{frame},{frame},{}", (start_s * 1e9).round());
        let middle: Vec<_> = (0..all[0].nodes.len())
            .map(|i| (all[3].nodes[i] + all[4].nodes[i]) / 2.0)
            .collect();
        nodes_px.push(
            middle
                .iter()
                .map(|p| camera.project_left(p))
                .collect::<Vec<_>>(),
        );
        nodes_m.push(middle.iter().map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>());
        if frame % (frames / PICTURES).max(1) == 0 {
            save_png(&out.join(format!("frame_{frame:04}.png")), &pixels, &camera)?;
        }
    }
    video.flush()?;
    fs::write(out.join("timestamps.csv"), stamps)?;
    let truth = serde_json::json!({
        "seed": seed, "rope": rope, "appearance": colours,
        "nodes_left_px": nodes_px, "nodes_world_m": nodes_m,
    });
    fs::write(out.join("truth.json"), serde_json::to_string(&truth)?)?;
    let per_frame_ms = drawing.as_secs_f64() * 1e3 / frames as f64;
    println!(
        "{frames} frames in {}, {per_frame_ms:.2} ms each to draw",
        out.display()
    );
    Ok(())
}
