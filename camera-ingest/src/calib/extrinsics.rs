//! Where the camera stands, from points known in the world and seen by both images.
//!
//! The points, triangulated with the calibration at hand, are laid on the known
//! ones (Kabsch); from there the pose that minimises the distances in both raw
//! images, distortion included, is found by Levenberg-Marquardt.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};
use serde::Serialize;
use shared_types::StereoCamera;

/// A point known in the world and seen by both images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correspondence {
    /// Place in the world (m).
    pub p_w_m: Vector3<f64>,
    /// Raw pixels in the left and the right image.
    pub pixels: [[f64; 2]; 2],
}

/// Pose of a camera and how sure it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extrinsics {
    /// Attitude of the left optical frame, camera to world.
    pub r_w_cam: Matrix3<f64>,
    /// Left optical centre in the world (m).
    pub p_w_cam_m: Vector3<f64>,
    /// What is left in the images.
    pub residual: Residual,
    /// Standard error of the position (m).
    pub position_error_m: f64,
    /// Standard error of the attitude (rad).
    pub attitude_error_rad: f64,
}

/// Distances between where points are seen and where they should be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Residual {
    /// Points, each seen by both images.
    pub points: usize,
    /// Root of the mean square over both images (px).
    pub rms_px: f64,
    /// Largest (px).
    pub worst_px: f64,
    /// Root of the mean square gap between the two images' rays, as pixels: what no
    /// place of the camera can explain, only its calibration.
    pub epipolar_px: f64,
}

/// Why a pose cannot be found, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("camera pose: {0}")]
pub struct ExtrinsicsError(String);

/// Fewest points for a pose.
const MIN_POINTS: usize = 6;
/// Largest residual that is still a fit (px, RMS).
const MAX_RESIDUAL_PX: f64 = 1.5;

/// Finds the pose of a camera; the one it has does not matter.
///
/// # Errors
/// Too few points, points on a line, or no pose that fits.
pub fn solve(
    camera: &StereoCamera,
    points: &[Correspondence],
) -> Result<Extrinsics, ExtrinsicsError> {
    if points.len() < MIN_POINTS {
        return Err(ExtrinsicsError(format!(
            "{} points are seen in both images, at least {MIN_POINTS} are needed",
            points.len()
        )));
    }
    let line = "the points lie on a line; show them spread over the picture";
    let mut camera = lay_on(camera, points).ok_or_else(|| ExtrinsicsError(line.to_owned()))?;
    let mut damping = 1e-3;
    let mut cost = square_sum(&camera, points);
    for _ in 0..50 {
        let (normal, gradient) = normal_equations(&camera, points);
        let damped = normal + Matrix6::from_diagonal(&(normal.diagonal() * damping));
        let Some(step) = damped.lu().solve(&-gradient) else {
            break;
        };
        let next = moved(&camera, &step);
        let next_cost = square_sum(&next, points);
        if next_cost < cost {
            let gained = cost - next_cost;
            (camera, cost, damping) = (next, next_cost, (damping * 0.2).max(1e-12));
            if gained < 1e-12 * cost {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    let residual = residual(&camera, points);
    if residual.rms_px.is_nan() || residual.rms_px > MAX_RESIDUAL_PX {
        return Err(ExtrinsicsError(format!(
            "{:.1} px are left between seen and expected points (limit {MAX_RESIDUAL_PX} px); check the \
             board's size and pose, and the camera's mode and calibration",
            residual.rms_px
        )));
    }
    let (normal, _) = normal_equations(&camera, points);
    let freedom = (4 * points.len() - 6) as f64;
    let spread = normal
        .try_inverse()
        .map_or(f64::INFINITY * Vector6::repeat(1.0), |inverse| {
            inverse.diagonal() * (cost / freedom)
        });
    Ok(Extrinsics {
        r_w_cam: camera.r_w_cam,
        p_w_cam_m: camera.p_w_cam_m,
        residual,
        position_error_m: spread.fixed_rows::<3>(3).sum().sqrt(),
        attitude_error_rad: spread.fixed_rows::<3>(0).sum().sqrt(),
    })
}

/// What is left in the images with the pose the camera has.
#[must_use]
pub fn residual(camera: &StereoCamera, points: &[Correspondence]) -> Residual {
    let mut squares = 0.0;
    let (mut worst_px, mut gaps) = (0.0_f64, 0.0);
    for point in points {
        let off = errors(camera, point);
        for image in off.chunks_exact(2) {
            worst_px = worst_px.max(image[0].hypot(image[1]));
            squares += image[0] * image[0] + image[1] * image[1];
        }
        if let Some(found) = camera.triangulate(point.pixels[0], point.pixels[1]) {
            let depth_m = camera.to_left(&found.p_w_m).z.max(0.1);
            gaps += (found.gap_m * camera.left.fx / depth_m).powi(2);
        }
    }
    let count = points.len().max(1) as f64;
    Residual {
        points: points.len(),
        rms_px: (squares / (2.0 * count)).sqrt(),
        worst_px,
        epipolar_px: (gaps / count).sqrt(),
    }
}

/// Differences of expected and seen pixels; far off behind the camera.
fn errors(camera: &StereoCamera, point: &Correspondence) -> [f64; 4] {
    const FAR_PX: f64 = 1e4;
    let [left, right] = [
        camera.project_left(&point.p_w_m),
        camera.project_right(&point.p_w_m),
    ]
    .map(|p| p.unwrap_or([FAR_PX; 2]));
    [
        left[0] - point.pixels[0][0],
        left[1] - point.pixels[0][1],
        right[0] - point.pixels[1][0],
        right[1] - point.pixels[1][1],
    ]
}

fn square_sum(camera: &StereoCamera, points: &[Correspondence]) -> f64 {
    let all = points.iter().flat_map(|p| errors(camera, p));
    all.map(|e| e * e).sum()
}

/// The camera turned by a small rotation vector (world axes) and shifted.
fn moved(camera: &StereoCamera, step: &Vector6<f64>) -> StereoCamera {
    let turn = Rotation3::new(step.fixed_rows::<3>(0).into_owned());
    StereoCamera {
        r_w_cam: turn * camera.r_w_cam,
        p_w_cam_m: camera.p_w_cam_m + step.fixed_rows::<3>(3),
        ..camera.clone()
    }
}

/// `J^T J` and `J^T r`, the slopes by central differences.
fn normal_equations(
    camera: &StereoCamera,
    points: &[Correspondence],
) -> (Matrix6<f64>, Vector6<f64>) {
    const STEP: f64 = 1e-6;
    let shifted: Vec<[StereoCamera; 2]> = (0..6)
        .map(|k| {
            let step = Vector6::ith(k, STEP);
            [moved(camera, &step), moved(camera, &-step)]
        })
        .collect();
    let (mut normal, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
    for point in points {
        let here = errors(camera, point);
        let slopes: Vec<[f64; 4]> = shifted
            .iter()
            .map(|[up, down]| {
                let (up, down) = (errors(up, point), errors(down, point));
                core::array::from_fn(|i| (up[i] - down[i]) / (2.0 * STEP))
            })
            .collect();
        for i in 0..4 {
            let row = Vector6::from_fn(|k, _| slopes[k][i]);
            normal += row * row.transpose();
            gradient += row * here[i];
        }
    }
    (normal, gradient)
}

/// The camera put so that the points it triangulates lie on the known ones.
fn lay_on(camera: &StereoCamera, points: &[Correspondence]) -> Option<StereoCamera> {
    let (seen_c, known_w): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = points
        .iter()
        .filter_map(|p| {
            let found = camera.triangulate(p.pixels[0], p.pixels[1])?;
            Some((camera.to_left(&found.p_w_m), p.p_w_m))
        })
        .unzip();
    let middle =
        |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let (middle_c, middle_w) = (middle(&seen_c), middle(&known_w));
    let spread = seen_c
        .iter()
        .zip(&known_w)
        .fold(Matrix3::zeros(), |m, (c, w)| {
            m + (w - middle_w) * (c - middle_c).transpose()
        });
    let svd = spread.svd(true, true);
    let values = svd.singular_values;
    if values[1] < 1e-3 * values[0] || values[0] <= 0.0 {
        return None;
    }
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let r_w_cam = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    Some(StereoCamera {
        p_w_cam_m: middle_w - r_w_cam * middle_c,
        r_w_cam,
        ..camera.clone()
    })
}
