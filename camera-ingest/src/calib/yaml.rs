//! Calibrations as YAML: ROS `camera_info`, one file per eye, and OpenCV's
//! stereo calibration.
//!
//! ROS: the stereo geometry is in the rectification matrices and in the right
//! eye's projection matrix (`P[3] = -fx B`). OpenCV: `M1 D1 M2 D2` and `R T` with
//! `X_right = R X_left + T`, in one file or, as its sample program writes them,
//! `intrinsics.yml` and `extrinsics.yml`. Lengths are metres.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use shared_types::Intrinsics;

use super::factory::{Eyes, VideoMode};
use super::{CalibError, read_text};

/// Baselines of stereo cameras (m); outside it, lengths are no metres.
const BASELINE_M: [f64; 2] = [0.005, 1.0];

#[derive(Debug, Deserialize)]
struct Matrix {
    data: Vec<f64>,
}

#[derive(Debug, Deserialize)]
struct RosEye {
    image_width: u32,
    image_height: u32,
    #[serde(default)]
    distortion_model: String,
    camera_matrix: Matrix,
    distortion_coefficients: Matrix,
    rectification_matrix: Matrix,
    projection_matrix: Matrix,
}

#[derive(Debug, Default, Deserialize)]
struct OpenCv {
    #[serde(rename = "M1")]
    m1: Option<Matrix>,
    #[serde(rename = "D1")]
    d1: Option<Matrix>,
    #[serde(rename = "M2")]
    m2: Option<Matrix>,
    #[serde(rename = "D2")]
    d2: Option<Matrix>,
    #[serde(rename = "R")]
    r: Option<Matrix>,
    #[serde(rename = "T")]
    t: Option<Matrix>,
}

/// What tells the two kinds apart.
#[derive(Debug, Deserialize)]
struct Kind {
    #[serde(rename = "M1")]
    m1: Option<Matrix>,
    image_width: Option<u32>,
}

/// Reads a calibration; `right` names the right eye's ROS file, by default the
/// left one's name with `left` replaced by `right`.
pub(super) fn read(path: &Path, right: Option<&Path>, mode: VideoMode) -> Result<Eyes, CalibError> {
    let file = YamlFile::open(path)?;
    let kind: Kind = file.parse()?;
    let eyes = if kind.m1.is_some() {
        opencv(&file)?
    } else if kind.image_width.is_some() {
        ros(&file, right, mode)?
    } else {
        return Err(file.bad(
            "neither a ROS camera_info (image_width, camera_matrix ...) nor OpenCV's stereo \
             calibration (M1, D1, M2, D2, R, T)",
        ));
    };
    let baseline_m = eyes.t_right_left_m.norm();
    if !(BASELINE_M[0]..=BASELINE_M[1]).contains(&baseline_m) {
        return Err(file.bad(&format!(
            "the eyes are {baseline_m:.4} apart; {} to {} m are expected (were lengths \
             calibrated in other units than metres?)",
            BASELINE_M[0], BASELINE_M[1]
        )));
    }
    let r = eyes.r_right_left;
    if (r * r.transpose() - Matrix3::identity()).norm() > 1e-3 {
        return Err(file.bad("the rotation between the eyes is no rotation matrix"));
    }
    Ok(eyes)
}

struct YamlFile {
    path: PathBuf,
    text: String,
}

impl YamlFile {
    fn open(path: &Path) -> Result<Self, CalibError> {
        // OpenCV begins with a directive and tags that YAML parsers refuse.
        let text = read_text(path)?
            .lines()
            .filter(|line| !line.starts_with("%YAML"))
            .map(|line| line.replace("!!opencv-matrix", ""))
            .collect::<Vec<_>>()
            .join("\n");
        Ok(Self {
            path: path.to_owned(),
            text,
        })
    }

    fn parse<'de, T: Deserialize<'de>>(&'de self) -> Result<T, CalibError> {
        serde_saphyr::from_str(&self.text).map_err(|e| self.bad(&e.to_string()))
    }

    fn bad(&self, reason: &str) -> CalibError {
        CalibError::Yaml {
            path: self.path.clone(),
            reason: reason.to_owned(),
        }
    }

    fn numbers<const N: usize>(&self, name: &str, matrix: &Matrix) -> Result<[f64; N], CalibError> {
        let found = matrix.data.len();
        <[f64; N]>::try_from(matrix.data.clone())
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
        matrix: &Matrix,
        distortion: &Matrix,
    ) -> Result<Intrinsics, CalibError> {
        let k: [f64; 9] = self.numbers(matrix_name, matrix)?;
        if !(k[0] > 0.0 && k[4] > 0.0) {
            return Err(self.bad(&format!(
                "{matrix_name}: the focal lengths must be positive (px)"
            )));
        }
        let d = &distortion.data;
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

fn ros(file: &YamlFile, right: Option<&Path>, mode: VideoMode) -> Result<Eyes, CalibError> {
    let name = file.path.file_name().and_then(|n| n.to_str()).unwrap_or("");
    let beside = match right {
        Some(path) => path.to_owned(),
        None if name.contains("left") => {
            file.path.with_file_name(name.replacen("left", "right", 1))
        }
        None => {
            return Err(file.bad(
                "which file is the right eye's? name it in camera.toml as `calibration_right`",
            ));
        }
    };
    let other = YamlFile::open(&beside)?;
    let (left, right): (RosEye, RosEye) = (file.parse()?, other.parse()?);
    for (file, eye) in [(file, &left), (&other, &right)] {
        let (width, height) = mode.size_px();
        if (eye.image_width, eye.image_height) != (width, height) {
            return Err(file.bad(&format!(
                "it is for {}x{} px, the mode `{}` has {width}x{height}",
                eye.image_width,
                eye.image_height,
                mode.name()
            )));
        }
        if !matches!(eye.distortion_model.as_str(), "" | "plumb_bob") {
            return Err(file.bad(&format!(
                "distortion_model `{}` is not read; calibrate with `plumb_bob`",
                eye.distortion_model
            )));
        }
    }
    let names = ["camera_matrix", "distortion_coefficients"];
    let turn = |file: &YamlFile, eye: &RosEye| -> Result<Matrix3<f64>, CalibError> {
        let r: [f64; 9] = file.numbers("rectification_matrix", &eye.rectification_matrix)?;
        Ok(Matrix3::from_row_slice(&r))
    };
    let (r_left, r_right) = (turn(file, &left)?, turn(&other, &right)?);
    let p: [f64; 12] = other.numbers("projection_matrix", &right.projection_matrix)?;
    let baseline = Vector3::new(-p[3] / p[0], 0.0, 0.0);
    Ok(Eyes {
        left: file.intrinsics(names, &left.camera_matrix, &left.distortion_coefficients)?,
        right: other.intrinsics(names, &right.camera_matrix, &right.distortion_coefficients)?,
        r_right_left: r_right.transpose() * r_left,
        t_right_left_m: r_right.transpose() * baseline,
    })
}

fn opencv(file: &YamlFile) -> Result<Eyes, CalibError> {
    let all: OpenCv = file.parse()?;
    let need = |name: &str, matrix: Option<Matrix>| {
        matrix.ok_or_else(|| file.bad(&format!("it has no `{name}`")))
    };
    let (m1, d1) = (need("M1", all.m1)?, need("D1", all.d1)?);
    let (m2, d2) = (need("M2", all.m2)?, need("D2", all.d2)?);
    let (geometry, r, t) = match (all.r, all.t) {
        (Some(r), Some(t)) => (None, r, t),
        _ => {
            let beside = YamlFile::open(&file.path.with_file_name("extrinsics.yml"))?;
            let more: OpenCv = beside.parse()?;
            let (Some(r), Some(t)) = (more.r, more.t) else {
                return Err(beside.bad("it has no `R` and `T`"));
            };
            (Some(beside), r, t)
        }
    };
    let geometry = geometry.as_ref().unwrap_or(file);
    let r: [f64; 9] = geometry.numbers("R", &r)?;
    let t: [f64; 3] = geometry.numbers("T", &t)?;
    Ok(Eyes {
        left: file.intrinsics(["M1", "D1"], &m1, &d1)?,
        right: file.intrinsics(["M2", "D2"], &m2, &d2)?,
        r_right_left: Matrix3::from_row_slice(&r),
        t_right_left_m: -Vector3::from(t),
    })
}
