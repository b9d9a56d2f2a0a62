//! The camera's place from a rendered board.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod printed_board;

use camera_ingest::calib::board::BoardError;
use camera_ingest::calib::extrinsics::{residual, solve};
use nalgebra::{Matrix3, Rotation3, Vector3};
use printed_board::{board, camera, film};
use shared_types::StereoCamera;

#[test]
fn a_board_tells_where_the_camera_stands() {
    let (board, truth) = (board(), camera());
    let mut film = film(&board, &truth, 2);
    // Where the camera is thought to stand before does not matter.
    let elsewhere = StereoCamera {
        r_w_cam: Matrix3::identity(),
        p_w_cam_m: Vector3::new(5.0, 1.0, 0.0),
        ..truth.clone()
    };
    let points = board.look(&mut film, 2).unwrap();
    assert!(points.len() >= 40, "{} corners", points.len());
    let found = solve(&elsewhere, &points).unwrap();
    let off_m = (found.p_w_cam_m - truth.p_w_cam_m).norm();
    let turn = Rotation3::from_matrix_unchecked(found.r_w_cam.transpose() * truth.r_w_cam);
    let off_degrees = turn.angle().to_degrees();
    println!(
        "{} points, {:.2} mm and {off_degrees:.3} degrees off; {:.3} px RMS, worst {:.2}; said \
         {:.2} mm, {:.3} degrees",
        points.len(),
        1e3 * off_m,
        found.residual.rms_px,
        found.residual.worst_px,
        1e3 * found.position_error_m,
        found.attitude_error_rad.to_degrees()
    );
    assert!(off_m < 0.003 && off_degrees < 0.2);
    assert!(found.residual.rms_px < 0.3 && found.residual.epipolar_px < 0.3);
    assert!(off_m < 4.0 * found.position_error_m, "honest about itself");
    // The check: the true place fits, one a centimetre off does not.
    assert!(residual(&truth, &points).rms_px < 0.3);
    let mut shifted = truth.clone();
    shifted.p_w_cam_m.z += 0.01;
    assert!(residual(&shifted, &points).rms_px > 3.0);
    // Eyes turned the other way against each other do not see the same points.
    let mut swapped = truth.clone();
    swapped.r_right_left = truth.r_right_left.transpose();
    assert!(residual(&swapped, &points).epipolar_px > 0.5);
    // A board of another size is noticed.
    let mut wrong = points.clone();
    wrong.iter_mut().for_each(|p| p.p_w_m *= 1.1);
    let line = vec![points[0]; 8];
    for (points, said) in [
        (&wrong[..], "px are left between seen and expected points"),
        (&points[..5], "5 points are seen in both images"),
        (&line, "on a line"),
    ] {
        let error = solve(&elsewhere, points).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn a_picture_without_the_board_is_refused() {
    let mut empty = board();
    empty.pose.position_m[0] += 3.0;
    let mut film = film(&empty, &camera(), 2);
    let error = board().look(&mut film, 2).unwrap_err();
    assert!(
        matches!(error, BoardError::NotFound { frames: 2, .. }),
        "{error}"
    );
}
