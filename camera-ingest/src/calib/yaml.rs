//! Calibrations as YAML: ROS `camera_info`, one file per camera, and OpenCV's
//! stereo calibration.
//!
//! ROS: the stereo geometry is in the rectification matrices and in the right
//! camera's projection matrix (`P[3] = -fx B`). OpenCV: `M1 D1 M2 D2` and `R T` with
//! `X_right = R X_left + T`, in one file or, as its sample program writes them,
//! `intrinsics.yml` and `extrinsics.yml`. Lengths are metres.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};
use shared_types::Intrinsics;
use yaml_rust2::{Yaml, YamlLoader};

use super::error::{CalibError, read_text};
use super::mode::{StereoGeometry, VideoMode};

/// Baselines of stereo cameras (m); outside it, lengths are no metres.
const BASELINE_M: [f64; 2] = [0.005, 1.0];

/// Reads a calibration; `right` names the right image's ROS file, by default the
/// left one's name with `left` replaced by `right`.
pub(super) fn read(
    path: &Path,
    right: Option<&Path>,
    mode: VideoMode,
) -> Result<StereoGeometry, CalibError> {
    let file = YamlFile::open(path)?;
    let images = if file.has("M1") {
        opencv(&file)?
    } else if file.has("image_width") {
        ros(&file, right, mode)?
    } else {
        return Err(file.bad(
            "neither a ROS camera_info (image_width, camera_matrix ...) nor OpenCV's stereo \
             calibration (M1, D1, M2, D2, R, T)",
        ));
    };
    let baseline_m = images.t_right_left_m.norm();
    if !(BASELINE_M[0]..=BASELINE_M[1]).contains(&baseline_m) {
        return Err(file.bad(&format!(
            "the two images' optical centres are {baseline_m:.4} apart; {} to {} m are expected \
             (were lengths calibrated in other units than metres?)",
            BASELINE_M[0], BASELINE_M[1]
        )));
    }
    let r = images.r_right_left;
    if (r * r.transpose() - Matrix3::identity()).norm() > 1e-3 {
        return Err(file.bad("the rotation between left and right is not a rotation matrix"));
    }
    Ok(images)
}

struct YamlFile {
    path: PathBuf,
    document: Yaml,
}

impl YamlFile {
    fn open(path: &Path) -> Result<Self, CalibError> {
        // OpenCV begins with a directive that YAML parsers refuse.
        let text = read_text(path)?
            .lines()
            .filter(|line| !line.starts_with("%YAML"))
            .collect::<Vec<_>>()
            .join("\n");
        let parsed = YamlLoader::load_from_str(&text);
        let file = |document| Self {
            path: path.to_owned(),
            document,
        };
        match parsed.map(|documents| documents.into_iter().next()) {
            Ok(document) => Ok(file(document.unwrap_or(Yaml::Null))),
            Err(e) => Err(file(Yaml::Null).bad(&e.to_string())),
        }
    }

    fn bad(&self, reason: &str) -> CalibError {
        CalibError::calibration(&self.path, reason)
    }

    fn has(&self, name: &str) -> bool {
        !self.document[name].is_badvalue()
    }

    /// The field `name`, read by `what`.
    fn field<'a, T>(
        &'a self,
        name: &str,
        what: impl FnOnce(&'a Yaml) -> Option<T>,
    ) -> Result<T, CalibError> {
        if !self.has(name) {
            return Err(self.bad(&format!("it has no `{name}`")));
        }
        what(&self.document[name])
            .ok_or_else(|| self.bad(&format!("`{name}` is not of the expected kind")))
    }

    fn pixels(&self, name: &str) -> Result<u32, CalibError> {
        self.field(name, |value| u32::try_from(value.as_i64()?).ok())
    }

    /// The numbers of a matrix, row by row.
    fn matrix(&self, name: &str) -> Result<Vec<f64>, CalibError> {
        self.field(name, |value| {
            let numbers = value["data"].as_vec()?.iter();
            numbers.map(number).collect()
        })
    }

    fn numbers<const N: usize>(&self, name: &str) -> Result<[f64; N], CalibError> {
        let data = self.matrix(name)?;
        let found = data.len();
        <[f64; N]>::try_from(data)
            .ok()
            .filter(|numbers| numbers.iter().all(|x| x.is_finite()))
            .ok_or_else(|| {
                self.bad(&format!(
                    "{name} has {found} numbers; {N} finite ones are needed"
                ))
            })
    }

    fn intrinsics(
        &self,
        [matrix_name, distortion_name]: [&str; 2],
    ) -> Result<Intrinsics, CalibError> {
        let k: [f64; 9] = self.numbers(matrix_name)?;
        if !(k[0] > 0.0 && k[4] > 0.0) {
            return Err(self.bad(&format!(
                "{matrix_name}: the focal lengths must be positive (px)"
            )));
        }
        let d = self.matrix(distortion_name)?;
        if d.iter().skip(5).any(|x| *x != 0.0) || d.iter().any(|x| !x.is_finite()) {
            return Err(self.bad(&format!(
                "{distortion_name} has more than the five coefficients k1 k2 p1 p2 k3; calibrate \
                 with the plumb-bob model"
            )));
        }
        Ok(Intrinsics {
            fx: k[0],
            fy: k[4],
            cx: k[2],
            cy: k[5],
            distortion: core::array::from_fn(|i| d.get(i).copied().unwrap_or(0.0)),
        })
    }
}

fn ros(
    file: &YamlFile,
    right: Option<&Path>,
    mode: VideoMode,
) -> Result<StereoGeometry, CalibError> {
    let name = file.path.file_name().and_then(|n| n.to_str()).unwrap_or("");
    let beside = match right {
        Some(path) => path.to_owned(),
        None if name.contains("left") => {
            file.path.with_file_name(name.replacen("left", "right", 1))
        }
        None => {
            return Err(file.bad(
                "the right camera's file is unknown; name it in camera.toml as `calibration_right`",
            ));
        }
    };
    let other = YamlFile::open(&beside)?;
    for image in [file, &other] {
        let (width, height) = mode.size_px();
        let found = (image.pixels("image_width")?, image.pixels("image_height")?);
        if found != (width, height) {
            return Err(image.bad(&format!(
                "it is for {}x{} px, the mode `{}` has {width}x{height}",
                found.0,
                found.1,
                mode.name()
            )));
        }
        let model = image.document["distortion_model"].as_str().unwrap_or("");
        if !matches!(model, "" | "plumb_bob") {
            return Err(image.bad(&format!(
                "distortion_model `{model}` is not read; calibrate with `plumb_bob`"
            )));
        }
    }
    let names = ["camera_matrix", "distortion_coefficients"];
    let turn = |image: &YamlFile| -> Result<Matrix3<f64>, CalibError> {
        let r: [f64; 9] = image.numbers("rectification_matrix")?;
        Ok(Matrix3::from_row_slice(&r))
    };
    let (r_left, r_right) = (turn(file)?, turn(&other)?);
    let p: [f64; 12] = other.numbers("projection_matrix")?;
    let baseline = Vector3::new(-p[3] / p[0], 0.0, 0.0);
    Ok(StereoGeometry {
        left: file.intrinsics(names)?,
        right: other.intrinsics(names)?,
        r_right_left: r_right.transpose() * r_left,
        t_right_left_m: r_right.transpose() * baseline,
    })
}

fn opencv(file: &YamlFile) -> Result<StereoGeometry, CalibError> {
    let beside = if file.has("R") && file.has("T") {
        None
    } else {
        Some(YamlFile::open(&file.path.with_file_name("extrinsics.yml"))?)
    };
    let geometry = beside.as_ref().unwrap_or(file);
    let r: [f64; 9] = geometry.numbers("R")?;
    let t: [f64; 3] = geometry.numbers("T")?;
    Ok(StereoGeometry {
        left: file.intrinsics(["M1", "D1"])?,
        right: file.intrinsics(["M2", "D2"])?,
        r_right_left: Matrix3::from_row_slice(&r),
        t_right_left_m: -Vector3::from(t),
    })
}

/// A number, whole or not.
fn number(value: &Yaml) -> Option<f64> {
    let whole = value.as_i64().map(|whole| whole as f64);
    whole.or_else(|| value.as_f64())
}
