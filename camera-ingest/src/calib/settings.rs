//! `camera.toml`: which calibration and mode, the shutter, and where the left
//! camera stands in the world.

use std::path::{Path, PathBuf};

use arm_model::unit_hint;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use shared_types::{Shutter, StereoCamera};

use super::error::{CalibError, read_text, write_text};
use super::factory::write_factory_conf;
use super::mode::{StereoGeometry, VideoMode};
use crate::live::Exposure;

/// The file's fields.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraSettings {
    pub(super) calibration: PathBuf,
    /// ROS: the right image's file, where its name does not follow from the left's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) calibration_right: Option<PathBuf>,
    pub(super) mode: VideoMode,
    shutter: Shutter,
    exposure_s: f64,
    #[serde(default)]
    line_time_s: f64,
    extrinsics: Extrinsics,
    #[serde(default, skip_serializing_if = "ModelFiles::none")]
    models: ModelFiles,
    #[serde(default, skip_serializing_if = "is_untouched")]
    live: Exposure,
}

fn is_untouched(live: &Exposure) -> bool {
    *live == Exposure::default()
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Extrinsics {
    position_m: [f64; 3],
    /// Rows of the rotation camera to world.
    rotation: [[f64; 3]; 3],
}

impl Extrinsics {
    fn new(r_w_cam: &Matrix3<f64>, p_w_cam_m: &Vector3<f64>) -> Self {
        Self {
            position_m: (*p_w_cam_m).into(),
            rotation: r_w_cam.transpose().into(),
        }
    }
}

/// `[models]`, a learned model that stands in for a part of the tracker: ONNX files; what is
/// not named is built in.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelFiles {
    /// For following points of the rope through the film.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracker: Option<PathBuf>,
}

impl ModelFiles {
    fn none(&self) -> bool {
        *self == Self::default()
    }

    /// With the paths taken relative to a folder.
    fn within(self, folder: &Path) -> Self {
        Self {
            tracker: self.tracker.map(|p| folder.join(p)),
        }
    }
}

pub(super) fn read(path: &Path) -> Result<CameraSettings, CalibError> {
    let parsed: Result<CameraSettings, _> = toml::from_str(&read_text(path)?);
    let settings = parsed.map_err(|e| CalibError::settings(path, e))?;
    let times_s = [settings.exposure_s, settings.line_time_s];
    let position_m = &settings.extrinsics.position_m;
    check_place(times_s, &settings.rotation(), position_m)
        .map_err(|reason| CalibError::settings(path, reason))?;
    Ok(settings)
}

/// The models that a `camera.toml` names, relative to its folder.
///
/// # Errors
/// The file is missing or malformed.
pub fn load_model_files(path: &Path) -> Result<ModelFiles, CalibError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    Ok(read(path)?.models.within(folder))
}

/// What a `camera.toml` sets a device to that is opened to film a run.
///
/// # Errors
/// The file is missing or malformed.
pub fn load_exposure(path: &Path) -> Result<Exposure, CalibError> {
    Ok(read(path)?.live)
}

/// Farthest that a camera stands from the arm's base, in each direction (m).
const FAR_M: f64 = 20.0;

/// Times of the shutter (exposure, row to row, s) and the camera's place make sense.
fn check_place(times_s: [f64; 2], r: &Matrix3<f64>, position_m: &[f64; 3]) -> Result<(), String> {
    // 0.2 s is longer than any frame of any mode.
    for (name, value) in ["exposure_s", "line_time_s"].into_iter().zip(times_s) {
        if !(0.0..=0.2).contains(&value) {
            let hint = unit_hint(name, value, 0.2);
            return Err(format!("{name} = {value} must lie in 0 to 0.2 s{hint}"));
        }
    }
    let off = (r * r.transpose() - Matrix3::identity()).norm();
    if !(off < 1e-3 && r.determinant() > 0.0) {
        return Err(format!(
            "extrinsics.rotation is not a rotation matrix (R R^T differs from 1 by {off:.2e}, \
             determinant {:.3}); give the 3x3 rows of camera to world",
            r.determinant()
        ));
    }
    match position_m.iter().find(|v| v.is_nan() || v.abs() > FAR_M) {
        None => Ok(()),
        Some(far) => Err(format!(
            "extrinsics.position_m has a coordinate of {far} m, but at most {FAR_M} m make sense{}",
            unit_hint("position_m", *far, FAR_M)
        )),
    }
}

/// Whether a camera that was not read by [`super::load_camera`] can be one.
///
/// # Errors
/// What cannot be: size, focal lengths, distortion, place or times.
pub fn check_camera(camera: &StereoCamera) -> Result<(), String> {
    let sizes = [camera.width_px, camera.height_px];
    if sizes.iter().any(|px| !(16..=10_000).contains(px)) {
        return Err(format!("an image of {} x {} px", sizes[0], sizes[1]));
    }
    for image in [&camera.left, &camera.right] {
        let focal = [image.fx, image.fy];
        let rest = [image.cx, image.cy].into_iter().chain(image.distortion);
        if !focal.iter().all(|f| f.is_finite() && *f > 1.0) || !rest.into_iter().all(f64::is_finite)
        {
            return Err(format!(
                "focal lengths {focal:?} px, or a value that is not a number"
            ));
        }
    }
    let r = &camera.r_right_left;
    let apart = camera.t_right_left_m.norm();
    if !((r * r.transpose() - Matrix3::identity()).norm() < 1e-3 && apart.is_finite()) {
        return Err("the right camera's pose is invalid".to_owned());
    }
    let times_s = [camera.exposure_s, camera.line_time_s];
    check_place(times_s, &camera.r_w_cam, &camera.p_w_cam_m.into())
}

impl CameraSettings {
    fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.extrinsics.rotation[row][column])
    }

    pub(super) fn camera(&self, images: StereoGeometry) -> StereoCamera {
        let (width_px, height_px) = self.mode.size_px();
        StereoCamera {
            width_px,
            height_px,
            left: images.left,
            right: images.right,
            r_right_left: images.r_right_left,
            t_right_left_m: images.t_right_left_m,
            r_w_cam: self.rotation(),
            p_w_cam_m: Vector3::from(self.extrinsics.position_m),
            shutter: self.shutter,
            exposure_s: self.exposure_s,
            line_time_s: match self.shutter {
                Shutter::Global => 0.0,
                Shutter::Rolling => self.line_time_s,
            },
        }
    }
}

/// Writes the calibration of a camera into a folder, as a laboratory keeps it: `camera.toml`, here
/// `toml`, and beside it the vendor's file, `camera.conf`.
///
/// # Errors
/// Images of a size that no mode has, or a file cannot be written.
pub fn keep_calibration(toml: &Path, camera: &StereoCamera) -> Result<(), CalibError> {
    let mode = VideoMode::of_camera(camera).map_err(|why| CalibError::settings(toml, why))?;
    let conf = Path::new("camera.conf");
    write_factory_conf(&toml.with_file_name(conf), camera, mode)?;
    write_camera_toml(toml, camera, mode, conf)
}

/// Writes `camera.toml` for a camera; `calibration` is taken relative to `path`.
///
/// # Errors
/// The file cannot be written.
pub fn write_camera_toml(
    path: &Path,
    camera: &StereoCamera,
    mode: VideoMode,
    calibration: &Path,
) -> Result<(), CalibError> {
    let settings = CameraSettings {
        calibration: calibration.to_owned(),
        calibration_right: None,
        mode,
        shutter: camera.shutter,
        exposure_s: camera.exposure_s,
        line_time_s: camera.line_time_s,
        extrinsics: Extrinsics::new(&camera.r_w_cam, &camera.p_w_cam_m),
        models: ModelFiles::default(),
        live: Exposure::default(),
    };
    write_text(path, &text(path, &settings)?)
}

fn text(path: &Path, settings: &CameraSettings) -> Result<String, CalibError> {
    toml::to_string(settings).map_err(|e| CalibError::settings(path, e))
}

/// The text of a `camera.toml` for `path`: the settings of `from` with another place
/// of the camera. Calibration files stay where they are.
///
/// # Errors
/// `from` cannot be read, or there is no folder for `path`.
pub fn placed_camera_toml(
    path: &Path,
    from: &Path,
    r_w_cam: &Matrix3<f64>,
    p_w_cam_m: &Vector3<f64>,
) -> Result<String, CalibError> {
    let mut settings = read(from)?;
    let folder = |p: &Path| {
        let parent = p.parent().filter(|f| !f.as_os_str().is_empty());
        std::fs::canonicalize(parent.unwrap_or(Path::new(".")))
    };
    let io = CalibError::io(path);
    let (here, there) = (folder(path).map_err(&io)?, folder(from).map_err(&io)?);
    if here != there {
        settings.calibration = there.join(&settings.calibration);
        settings.calibration_right = settings.calibration_right.map(|p| there.join(p));
        settings.models = settings.models.within(&there);
    }
    settings.extrinsics = Extrinsics::new(r_w_cam, p_w_cam_m);
    text(path, &settings)
}
