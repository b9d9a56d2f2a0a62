//! A printed board drawn in both images: the drawing is independent of the detector but for
//! the markers' bits.

use camera_ingest::calib::board::{Board, BoardPose};
use camera_ingest::calib::resolve_dictionary;
use camera_ingest::{ImageFrame, StereoFrame};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use shared_types::{Intrinsics, Shutter, StereoCamera};

const DICTIONARY: &str = "DICT_4X4_50";

/// An HD camera with distortion, a little tilted.
pub(crate) fn camera() -> StereoCamera {
    let image = Intrinsics {
        fx: 700.9,
        fy: 701.2,
        cx: 637.8,
        cy: 362.0,
        distortion: [-0.174, 0.0264, 1.6e-4, 5e-5, 0.0],
    };
    let tilt = Rotation3::new(Vector3::new(0.12, -0.2, 0.05));
    StereoCamera {
        width_px: 1280,
        height_px: 720,
        left: image,
        right: Intrinsics {
            cx: 643.9,
            cy: 369.4,
            ..image
        },
        r_right_left: *Rotation3::new(Vector3::new(-1.4e-3, -4.3e-3, 9e-4)).matrix(),
        t_right_left_m: Vector3::new(0.0627, 2e-5, -6e-6),
        r_w_cam: tilt.matrix() * Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.30, -1.10, 0.55),
        shutter: Shutter::Global,
        exposure_s: 0.004,
        line_time_s: 0.0,
    }
}

/// A board that hangs upright before the camera, a little turned.
pub(crate) fn board() -> Board {
    let r = Rotation3::new(Vector3::new(0.15, 0.1, 0.3)).matrix()
        * Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    Board {
        rows: 5,
        columns: 7,
        square_m: 0.06,
        marker_m: 0.045,
        dictionary: DICTIONARY.to_owned(),
        pose: BoardPose {
            position_m: [0.22, -0.05, 0.72],
            rotation: core::array::from_fn(|i| core::array::from_fn(|k| r[(i, k)])),
        },
    }
}

/// Brightness of the board at a place on it (m), 0 to 1; white around it.
fn ink(board: &Board, x: f64, y: f64) -> f64 {
    let (column, row) = ((x / board.square_m).floor(), (y / board.square_m).floor());
    if column < 0.0
        || row < 0.0
        || column >= f64::from(board.columns)
        || row >= f64::from(board.rows)
    {
        return 1.0;
    }
    let (column, row) = (column as usize, row as usize);
    if (column + row) % 2 == 0 {
        return 0.0;
    }
    // Markers are counted over the white squares, row by row.
    let before: usize = (0..row * board.columns as usize + column)
        .filter(|i| (i % board.columns as usize + i / board.columns as usize) % 2 == 1)
        .count();
    let rim = (board.square_m - board.marker_m) / 2.0;
    let (mx, my) = (
        x - column as f64 * board.square_m - rim,
        y - row as f64 * board.square_m - rim,
    );
    let dictionary = resolve_dictionary(DICTIONARY).unwrap();
    let side = dictionary.marker_size();
    let cell = board.marker_m / (side + 2) as f64;
    let (i, j) = ((mx / cell).floor(), (my / cell).floor());
    let outside = |k: f64| k < 0.0 || k >= (side + 2) as f64;
    if outside(i) || outside(j) {
        return 1.0;
    }
    let (i, j) = (i as usize, j as usize);
    if i == 0 || j == 0 || i > side || j > side {
        return 0.0;
    }
    // Row by row from the lowest bit, black is 1.
    let bit = (j - 1) * side + i - 1;
    1.0 - (dictionary.codes()[before] >> bit & 1) as f64
}

/// One image's picture, four samples a pixel, with noise.
fn image(
    board: &Board,
    intrinsics: &Intrinsics,
    r_w_eye: &Matrix3<f64>,
    p_w_eye_m: &Vector3<f64>,
    seed: u64,
) -> ImageFrame {
    let (width_px, height_px) = (1280, 720);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, 2.0).unwrap();
    let r = Matrix3::from_fn(|i, k| board.pose.rotation[i][k]);
    let (right, down, normal) = (r.column(0), r.column(1), r.column(2));
    let origin = Vector3::from(board.pose.position_m);
    let mut luma = vec![0; width_px * height_px];
    for (at, value) in luma.iter_mut().enumerate() {
        let (u, v) = ((at % width_px) as f64, (at / width_px) as f64);
        let mut sum = 0.0;
        for (du, dv) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
            let [x, y] = intrinsics.undistort([u + du, v + dv]);
            let ray = r_w_eye * Vector3::new(x, y, 1.0);
            let along = (origin - p_w_eye_m).dot(&normal) / ray.dot(&normal);
            let p = p_w_eye_m + ray * along - origin;
            sum += 40.0 + 170.0 * ink(board, p.dot(&right), p.dot(&down));
        }
        *value = (sum / 4.0 + noise.sample(&mut rng))
            .round()
            .clamp(0.0, 255.0) as u8;
    }
    ImageFrame {
        stamp_ns: seed * 16_666_667,
        sequence: seed,
        luma,
        ..ImageFrame::grey([width_px, height_px], 0)
    }
}

fn side_by_side(left: &ImageFrame, right: &ImageFrame) -> StereoFrame {
    let join = |a: &[u8], b: &[u8], width: usize| -> Vec<u8> {
        let rows = a.chunks_exact(width).zip(b.chunks_exact(width));
        rows.flat_map(|(a, b)| a.iter().chain(b).copied()).collect()
    };
    let w = left.width_px;
    StereoFrame(ImageFrame {
        width_px: 2 * w,
        luma: join(&left.luma, &right.luma, w),
        cb: join(&left.cb, &right.cb, w / 2),
        cr: join(&left.cr, &right.cr, w / 2),
        ..*left
    })
}

/// So many frames of the board as the camera sees it, noise apart.
pub(crate) fn film(board: &Board, camera: &StereoCamera, frames: u64) -> Vec<StereoFrame> {
    let r_w_right = camera.r_w_cam * camera.r_right_left.transpose();
    let p_w_right_m = camera.p_w_cam_m + r_w_right * camera.t_right_left_m;
    (0..frames)
        .map(|seed| {
            let left = image(
                board,
                &camera.left,
                &camera.r_w_cam,
                &camera.p_w_cam_m,
                2 * seed,
            );
            let right = image(board, &camera.right, &r_w_right, &p_w_right_m, 2 * seed + 1);
            side_by_side(&left, &right)
        })
        .collect()
}
