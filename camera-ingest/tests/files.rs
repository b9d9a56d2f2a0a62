//! Calibrations as YAML are read, films of keypoints written: files of other programs'
//! kinds.
#![cfg(test)]
#![allow(missing_docs, clippy::float_cmp, reason = "a test")]

use camera_ingest::calib::CalibError;
use camera_ingest::film::keypoint_film;
use camera_ingest::source::{FrameSource, StereoSource};
use camera_ingest::{ImageFrame, load_camera, open_video};
use nalgebra::Vector3;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};

const SETTINGS: &str = "\
    calibration = \"FILE\"\nmode = \"VGA\"\nshutter = \"global\"\n\
    exposure_s = 0.008\n[extrinsics]\nposition_m = [1, 2.5, 3]\n\
    rotation = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]\n";

/// A ROS eye with the given focal length and projection offset.
fn ros(fx: f64, offset: f64, distortion: &str) -> String {
    format!(
        "image_width: 672\nimage_height: 376\ncamera_name: eye\n\
         camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{fx}, 0, 332, 0, 350.2, 190.5, 0, 0, 1]\n\
         distortion_model: {distortion}\n\
         distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.17, 0.03, 1e-4, -2e-4, 0]\n\
         rectification_matrix:\n  rows: 3\n  cols: 3\n  \
         data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n\
         projection_matrix:\n  rows: 3\n  cols: 4\n  \
         data: [350, 0, 330, {offset}, 0, 350, 190, 0, 0, 0, 1, 0]\n"
    )
}

fn load_files(name: &str, files: &[(&str, &str)]) -> Result<StereoCamera, CalibError> {
    let folder = std::env::temp_dir().join(format!("yaml-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (file, text) in files {
        std::fs::write(folder.join(file), text).unwrap();
    }
    let settings = SETTINGS.replace("FILE", files[0].0);
    std::fs::write(folder.join("camera.toml"), settings).unwrap();
    let camera = load_camera(&folder.join("camera.toml"));
    std::fs::remove_dir_all(&folder).unwrap();
    camera
}

#[test]
fn camera_info_of_two_eyes_is_read() {
    let (left, right) = (
        ros(351.0, 0.0, "plumb_bob"),
        ros(352.0, -22.05, "plumb_bob"),
    );
    let files = [("left.yaml", left.as_str()), ("right.yaml", &right)];
    let camera = load_files("ros", &files).unwrap();
    assert_eq!((camera.left.fx, camera.right.fx), (351.0, 352.0));
    assert_eq!(camera.left.distortion, [-0.17, 0.03, 1e-4, -2e-4, 0.0]);
    assert!((camera.t_right_left_m - Vector3::new(0.063, 0.0, 0.0)).norm() < 1e-12);
    let fisheye = ros(352.0, -22.05, "equidistant");
    let refused = load_files("fisheye", &[files[0], ("right.yaml", &fisheye)]);
    assert!(refused.unwrap_err().to_string().contains("equidistant"));
    let millimetres = ros(352.0, -22050.0, "plumb_bob");
    let refused = load_files("mm", &[files[0], ("right.yaml", &millimetres)]);
    assert!(refused.unwrap_err().to_string().contains("metres"));
    let refused = load_files("alone", &files[..1]).unwrap_err().to_string();
    assert!(refused.contains("right.yaml"), "{refused}");
}

#[test]
fn a_stereo_calibration_of_opencv_is_read() {
    let matrix = |name: &str, rows: u32, cols: u32, data: &str| {
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   \
             data: [ {data} ]\n"
        )
    };
    let k = "351., 0., 332., 0., 350.5, 190.25, 0., 0., 1.";
    let d = "-1.7e-01, 3.0e-02, 1.0e-04, -2.0e-04, 0., 0., 0., 0.";
    let intrinsics = [
        "%YAML:1.0\n---\n".to_owned(),
        matrix("M1", 3, 3, k),
        matrix("D1", 1, 8, d),
        matrix("M2", 3, 3, k),
        matrix("D2", 1, 8, d),
    ]
    .concat();
    let extrinsics = [
        "%YAML:1.0\n---\n".to_owned(),
        matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1."),
        matrix("T", 3, 1, "-0.0629, 1.0e-04, 0."),
    ]
    .concat();
    let files = [
        ("intrinsics.yml", intrinsics.as_str()),
        ("extrinsics.yml", &extrinsics),
    ];
    let camera = load_files("opencv", &files).unwrap();
    assert_eq!((camera.left.fy, camera.right.cy), (350.5, 190.25));
    // OpenCV adds T where the factory file subtracts.
    assert!((camera.t_right_left_m - Vector3::new(0.0629, -1e-4, 0.0)).norm() < 1e-12);
    let rational = intrinsics.replacen("0., 0., 0., 0. ]", "0., 0.2, 0., 0. ]", 1);
    let refused = load_files("rational", &[("intrinsics.yml", &rational), files[1]]);
    assert!(refused.unwrap_err().to_string().contains("D1"));
    let alone = load_files("half", &files[..1]).unwrap_err().to_string();
    assert!(alone.contains("extrinsics.yml"), "{alone}");
}

#[test]
fn a_film_reads_back_with_its_rate_and_the_rope_drawn_in() {
    let grey = |i: u64| ImageFrame {
        stamp_ns: 5 + i * 20_000_000,
        sequence: i,
        ..ImageFrame::grey([64, 32], 90)
    };
    let tracked = |lost: bool| TrackedFrame {
        t_s: 0.0,
        points: vec![[10.0, 5.0], [10.0, 25.0]],
        confidence: vec![1.0; 2],
        lost,
    };
    let track = KeypointTrack {
        keypoints: 2,
        frames: vec![tracked(false), tracked(true), tracked(false)],
        unconfirmed: Vec::new(),
    };
    let bytes = keypoint_film(&[grey(0), grey(1), grey(2)], &track).unwrap();
    let path = std::env::temp_dir().join(format!("film-{}.avi", std::process::id()));
    std::fs::write(&path, bytes).unwrap();
    let film = open_video(&path, None);
    std::fs::remove_file(&path).unwrap();
    let mut film = film.unwrap();
    assert_eq!(film.len(), 3);
    let (kept, lost) = (film.read(0).unwrap().0, film.read(1).unwrap().0);
    assert_eq!((lost.width_px, lost.height_px), (64, 32));
    assert_eq!(lost.stamp_ns, 20_000_000);
    // Cyan dots where the rope is followed, red ones where it is lost.
    let near = |film: &ImageFrame| {
        let around = (6..15).flat_map(|u| (1..10).map(move |v| (u, v)));
        let red = around.map(|(u, v)| film.ycc(u, v)[2]);
        (red.clone().min(), red.max())
    };
    assert!(near(&kept).0 < Some(110) && near(&kept).1 < Some(140));
    assert!(near(&lost).1 > Some(150) && near(&lost).0 > Some(116));
    assert!(kept.ycc(40, 15)[0].abs_diff(90) < 4);
    assert!(keypoint_film(&[], &track).is_err());
}
