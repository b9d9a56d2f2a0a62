//! `wag calib`: where the camera stands, from a printed board or from the lead that
//! the arm shows at known places.

use super::score::not_scored;
use crate::cli::{CalibCommand, ShownArgs};
use anyhow::{Context, bail};
use camera_ingest::calib::board::{Board, BoardError};
use camera_ingest::calib::extrinsics::{Correspondence, Residual, residual, solve};
use camera_ingest::calib::placed_camera_toml;
use camera_ingest::score::sight_lead;
use camera_ingest::source::FrameSource;
use camera_ingest::{load_camera, open_video};
use cli_output::{OrInput, Outcome, Stage};
use nalgebra::Vector3;
use run_log::files;
use serde_json::{Value, json};
use shared_types::StereoCamera;
use std::path::Path;

/// Frames of a video in which the board is looked for.
const FRAMES: usize = 12;

pub fn run(command: &CalibCommand) -> Outcome<Option<Value>> {
    match command {
        CalibCommand::Extrinsics { shown, out } => extrinsics(shown, out),
        CalibCommand::Check { shown, limit_px } => check(shown, *limit_px),
    }
}

/// Rows `frame,x,y,z`.
fn read_shown(path: &Path, frames: usize) -> anyhow::Result<Vec<(usize, Vector3<f64>)>> {
    let name = path.display();
    let mut reader = csv::Reader::from_path(path).with_context(|| format!("`{name}`"))?;
    let mut shown = Vec::new();
    for row in reader.deserialize::<(usize, f64, f64, f64)>() {
        let (frame, x, y, z) =
            row.with_context(|| format!("`{name}`: expected rows frame,x,y,z"))?;
        if frame >= frames {
            bail!("`{name}`: frame {frame}, but the video has {frames}");
        }
        let p_w_m = Vector3::new(x, y, z);
        if !p_w_m.iter().all(|v| v.is_finite()) {
            bail!("`{name}`: frame {frame} has a number that is not finite");
        }
        shown.push((frame, p_w_m));
    }
    Ok(shown)
}

/// What the camera saw of what it was shown.
fn look(args: &ShownArgs, camera: &StereoCamera, stage: &Stage) -> Outcome<Vec<Correspondence>> {
    let mut video = open_video(&args.film.video, args.film.fps).or_input()?;
    stage.say("looking");
    match (&args.board, &args.lead, args.lead_rgb) {
        (Some(path), _, _) => {
            let board = Board::read(path).or_input()?;
            match board.look(&mut video, FRAMES) {
                Err(e @ BoardError::NotFound { .. }) => Err(e).or_failed(),
                other => other.or_input(),
            }
        }
        (None, Some(path), Some(rgb)) => {
            let shown = read_shown(path, video.len()).or_input()?;
            sight_lead(&mut video, camera, rgb.0, &shown)
                .map_err(|error| not_scored(error, &args.film.video))
        }
        _ => Err(bad_input!(
            "name what the camera is shown: --board, or --lead with --lead-rgb"
        )),
    }
}

fn reported(residual: &Residual) -> String {
    format!(
        "{} points in both images, {:.2} px RMS (max {:.2} px, epipolar {:.2} px)",
        residual.points, residual.rms_px, residual.worst_px, residual.epipolar_px
    )
}

fn extrinsics(shown: &ShownArgs, out: &Path) -> Outcome<Option<Value>> {
    let camera = load_camera(&shown.film.camera).or_input()?;
    let stage = Stage::begin("calib extrinsics");
    let points = look(shown, &camera, &stage)?;
    let found = solve(&camera, &points).or_failed()?;
    let (r, p) = (&found.r_w_cam, &found.p_w_cam_m);
    let text = placed_camera_toml(out, &shown.film.camera, r, p).or_failed()?;
    files::write_atomic(out, text.as_bytes()).or_failed()?;
    stage.done(&reported(&found.residual));
    println!(
        "left camera at ({:.4}, {:.4}, {:.4}) m, standard error {:.1} mm and {:.2} degrees",
        p.x,
        p.y,
        p.z,
        1e3 * found.position_error_m,
        found.attitude_error_rad.to_degrees()
    );
    println!("written to `{}`", out.display());
    let rotation: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| r[(i, k)]));
    Ok(Some(json!({
        "ok": true, "command": "calib extrinsics", "out": out,
        "position_m": [p.x, p.y, p.z],
        "rotation": rotation,
        "residual": found.residual, "position_error_m": found.position_error_m,
        "attitude_error_rad": found.attitude_error_rad,
    })))
}

fn check(shown: &ShownArgs, limit_px: f64) -> Outcome<Option<Value>> {
    let camera = load_camera(&shown.film.camera).or_input()?;
    let stage = Stage::begin("calib check");
    let points = look(shown, &camera, &stage)?;
    let here = residual(&camera, &points);
    // The sign of the turn between the eyes is easily mistaken in a calibration.
    let turned = StereoCamera {
        r_right_left: camera.r_right_left.transpose(),
        ..camera.clone()
    };
    let turned_px = residual(&turned, &points).epipolar_px;
    stage.done(&reported(&here));
    if turned_px < here.epipolar_px {
        return Err(failed!(
            "both images show the points {:.2} px apart, and {turned_px:.2} px with the turn \
             between them reversed: its sign is wrong in the calibration",
            here.epipolar_px
        ));
    }
    if here.rms_px > limit_px {
        return Err(failed!(
            "what is seen is {:.2} px (RMS) from where it should be, more than {limit_px} px; \
             estimate the extrinsics again with `wag calib extrinsics`",
            here.rms_px
        ));
    }
    Ok(Some(json!({
        "ok": true, "command": "calib check", "residual": here, "limit_px": limit_px,
        "epipolar_turned_px": turned_px,
    })))
}
