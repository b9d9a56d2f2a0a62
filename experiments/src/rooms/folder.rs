//! A rendered wiggle as a folder of files, as a camera and an arm leave it behind, with
//! the truth beside them.

use anyhow::Context;
use camera_ingest::calib::keep_calibration;
use camera_ingest::film::{film, jpeg_of_yuyv};
use rig_sim::room::Kind;
use rig_sim::room_film::{FRAME_RATE_HZ, RoomFilm};
use rope_sim::npy;
use run_log::files;
use serde::{Deserialize, Serialize};
use shared_types::Shutter;
use std::fmt::Write as _;
use std::path::Path;

/// `scene.json`: what was drawn, for tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Scene {
    pub(super) kind: String,
    pub(super) seed: u64,
    pub(super) wall: String,
    pub(super) rope: String,
    /// Colour of the tip weight.
    pub(super) lead: String,
    pub(super) weave: String,
    pub(super) shiny: bool,
    pub(super) shadows: String,
    pub(super) hardships: Vec<String>,
    pub(super) rolling: bool,
    pub(super) exposure_s: f64,
    pub(super) jpeg_quality: u8,
    pub(super) noise_levels: f32,
    pub(super) film_late_s: f64,
    pub(super) joints_late_s: f64,
    pub(super) rope_radius_m: f64,
    pub(super) lead_radius_m: f64,
}

impl Scene {
    fn of(film: &RoomFilm, seed: u64) -> Self {
        let (room, setting) = (&film.room, &film.setting);
        Self {
            kind: room.kind.name().to_owned(),
            seed,
            wall: room.wall.to_owned(),
            rope: room.rope.rope.name.to_owned(),
            lead: room.rope.tip.name.to_owned(),
            weave: room.rope.weave.to_owned(),
            shiny: room.rope.shiny,
            shadows: room.shadows.to_owned(),
            hardships: room.hardships.iter().map(|h| (*h).to_owned()).collect(),
            rolling: setting.camera.shutter == Shutter::Rolling,
            exposure_s: setting.camera.exposure_s,
            jpeg_quality: room.picture.jpeg_quality,
            noise_levels: room.picture.noise_levels,
            film_late_s: setting.film_late_s,
            joints_late_s: setting.joints_late_s,
            rope_radius_m: setting.rope.radius_m,
            lead_radius_m: setting.rope.lead_radius_m,
        }
    }
}

/// Renders the film of a seed into a folder, which is made. `scene.json` comes last: a
/// folder with it is whole.
pub(super) fn write(folder: &Path, seed: u64, kind: Kind) -> anyhow::Result<Scene> {
    std::fs::create_dir_all(folder).with_context(|| format!("folder `{}`", folder.display()))?;
    let mut rendered = RoomFilm::draw(seed, kind)?;
    let scene = Scene::of(&rendered, seed);
    let camera = rendered.setting.calibrated.clone();
    keep_calibration(&folder.join(files::CAMERA), &camera)?;
    let joints = rendered.reported_joints();
    files::write_joints(&folder.join("joints_measured.csv"), joints.into_iter())?;
    let mut stamps = String::from("frame,sequence,monotonic_ns\n");
    for (i, stamp_ns) in rendered.stamps_ns().into_iter().enumerate() {
        let _ = writeln!(stamps, "{i},{i},{stamp_ns}");
    }
    files::write_atomic(&folder.join("timestamps.csv"), stamps.as_bytes())?;
    let size_px = [
        u16::try_from(camera.width_px * 2)?,
        u16::try_from(camera.height_px)?,
    ];
    let (mut jpegs, mut truth, mut points) = (Vec::new(), Vec::new(), 0);
    for frame in &mut rendered {
        jpegs.push(jpeg_of_yuyv(&frame.yuyv, size_px, scene.jpeg_quality)?);
        points = frame.truth_px.len();
        truth.extend(frame.truth_px.iter().flatten().map(|v| *v as f32));
    }
    let frame_us = (1e6 / FRAME_RATE_HZ).round() as u32;
    files::write_atomic(&folder.join("video.avi"), &film(&jpegs, size_px, frame_us)?)?;
    let mut array = Vec::new();
    npy::write_f32(&mut array, &[jpegs.len(), points, 2], &truth)?;
    files::write_atomic(&folder.join("truth_nodes_left_px.npy"), &array)?;
    files::write_json(&folder.join("scene.json"), &scene)?;
    Ok(scene)
}

/// The scene in a folder, if its film is whole.
pub(super) fn scene(folder: &Path) -> anyhow::Result<Option<Scene>> {
    let path = folder.join("scene.json");
    path.exists().then(|| files::read_json(&path)).transpose()
}
