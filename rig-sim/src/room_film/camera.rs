//! The camera of a film, and what a calibration says about it.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Normal};
use shared_types::{Intrinsics, Shutter, StereoCamera};

const SIZE_PX: [u32; 2] = [672, 376];
/// Time from one row to the next of a ZED 2 (s).
const LINE_TIME_S: f64 = 26.1e-6;
/// Time for the last row of a frame to end (s).
const FRAME_S: f64 = 0.0166;
/// Room between what must be seen and the picture's edge (px).
const MARGIN_PX: f64 = 14.0;
/// Cameras tried.
const TRIES: u32 = 2000;

/// Typical errors of a calibration.
const POSITION_STD_M: f64 = 0.003;
const ATTITUDE_STD_RAD: f64 = 0.005;
const FOCAL_STD: f64 = 0.0012;
const CENTRE_STD_PX: f64 = 0.4;

/// A camera that sees all of `points_m` with both eyes.
pub(super) fn draw(rng: &mut impl Rng, points_m: &[Vector3<f64>]) -> StereoCamera {
    let mut camera = candidate(rng, 0.0);
    for i in 1..TRIES {
        if sees(&camera, points_m) {
            break;
        }
        camera = candidate(rng, f64::from(i) / f64::from(TRIES));
    }
    camera
}

/// One of the cameras there may be, further off the more have been tried.
fn candidate(rng: &mut impl Rng, tried: f64) -> StereoCamera {
    let mut image = || Intrinsics {
        fx: rng.random_range(345.0..357.0),
        fy: rng.random_range(345.0..357.0),
        cx: 335.5 + rng.random_range(-8.0..8.0),
        cy: 187.5 + rng.random_range(-8.0..8.0),
        distortion: [
            rng.random_range(-0.182..-0.166),
            rng.random_range(0.024..0.031),
            rng.random_range(-4e-4..4e-4),
            rng.random_range(-4e-4..4e-4),
            rng.random_range(-0.002..0.001),
        ],
    };
    let left = image();
    let right = Intrinsics {
        fx: left.fx,
        fy: left.fy,
        ..image()
    };
    let left = Intrinsics {
        fy: left.fx * 0.9995,
        ..left
    };
    let position_m = Vector3::new(
        0.66 + rng.random_range(-0.35..0.45),
        -rng.random_range(0.75..1.35) - 0.5 * tried,
        rng.random_range(-0.25..0.35),
    );
    let looks_at_m = Vector3::new(
        0.62 + rng.random_range(-0.18..0.22),
        0.0,
        rng.random_range(-0.15..0.12),
    );
    let rolling = rng.random_bool(0.5);
    let exposure_s = rng.random_range(0.003..0.009);
    let longest_line_s = (FRAME_S - exposure_s) / f64::from(SIZE_PX[1]);
    let small = |rng: &mut _, max: f64| RngExt::random_range(rng, -max..max);
    let turn = Vector3::new(small(rng, 2e-3), small(rng, 7e-3), small(rng, 2e-3));
    let baseline_m = if rng.random() { 0.063 } else { 0.12 };
    StereoCamera {
        width_px: SIZE_PX[0],
        height_px: SIZE_PX[1],
        left,
        right,
        r_right_left: *Rotation3::new(turn).matrix(),
        t_right_left_m: Vector3::new(baseline_m, small(rng, 1e-4), small(rng, 2e-4)),
        r_w_cam: looking(&(looks_at_m - position_m), small(rng, 0.035)),
        p_w_cam_m: position_m,
        shutter: if rolling {
            Shutter::Rolling
        } else {
            Shutter::Global
        },
        exposure_s,
        line_time_s: if rolling {
            LINE_TIME_S.min(longest_line_s)
        } else {
            0.0
        },
    }
}

/// Attitude of a camera that looks along `way`, rolled a little (camera to world).
fn looking(way: &Vector3<f64>, roll_rad: f64) -> Matrix3<f64> {
    let ahead = Unit::new_normalize(*way);
    let right = ahead.cross(&Vector3::z()).normalize();
    let down = ahead.cross(&right);
    let level = Matrix3::from_columns(&[right, down, *ahead]);
    Rotation3::from_axis_angle(&ahead, roll_rad).matrix() * level
}

/// Whether both eyes see all points.
pub(super) fn sees(camera: &StereoCamera, points_m: &[Vector3<f64>]) -> bool {
    let [width, height] = [camera.width_px, camera.height_px].map(f64::from);
    let inside = |pixel: Option<[f64; 2]>| {
        pixel.is_some_and(|[u, v]| {
            u > MARGIN_PX && v > MARGIN_PX && u < width - MARGIN_PX && v < height - MARGIN_PX
        })
    };
    points_m
        .iter()
        .all(|p| inside(camera.project_left(p)) && inside(camera.project_right(p)))
}

/// What a calibration says about a camera: its place off by about 5 mm and half a
/// degree, the lens by a little.
pub(super) fn calibrated(rng: &mut impl Rng, truth: &StereoCamera) -> StereoCamera {
    let mut normal = |std: f64| Normal::new(0.0, std).map_or(0.0, |n| n.sample(rng));
    let mut vector = |std: f64| Vector3::new(normal(std), normal(std), normal(std));
    let (shift_m, turn_rad) = (vector(POSITION_STD_M), vector(ATTITUDE_STD_RAD));
    let focal = 1.0 + vector(FOCAL_STD).x;
    let mut image = |k: &Intrinsics| {
        let centre = vector(CENTRE_STD_PX);
        let [k1, k2, p1, p2, k3] = k.distortion;
        Intrinsics {
            fx: k.fx * focal,
            fy: k.fy * focal,
            cx: k.cx + centre.x,
            cy: k.cy + centre.y,
            distortion: [k1 + 0.002 * centre.z, k2, p1, p2, k3],
        }
    };
    StereoCamera {
        left: image(&truth.left),
        right: image(&truth.right),
        r_w_cam: Rotation3::new(turn_rad).matrix() * truth.r_w_cam,
        p_w_cam_m: truth.p_w_cam_m + shift_m,
        ..truth.clone()
    }
}
