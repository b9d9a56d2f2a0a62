//! Calibration files - the vendor's factory `.conf`, ROS and OpenCV YAML, and this
//! system's `camera.toml` - and where the camera stands, found from a printed
//! board.
//!
//! It is *not* the place for estimating lenses: those come from the files.

pub mod board;
mod corners;
mod error;
pub mod extrinsics;
mod factory;
mod ini;
mod mode;
mod settings;
mod yaml;

/// The markers of a dictionary by its name, for whoever prints a board.
#[cfg(feature = "calibration")]
pub use calib_targets_charuco::resolve_dictionary;
use std::path::Path;

pub use error::CalibError;
pub use factory::write_factory_conf;
pub use mode::VideoMode;
pub use settings::{
    ModelFiles, check_camera, keep_calibration, load_exposure, load_model_files,
    placed_camera_toml, write_camera_toml,
};
use shared_types::StereoCamera;

/// Reads `camera.toml` and the calibration it names (relative to it).
///
/// # Errors
/// A file is missing or malformed, a mode is absent from the calibration, or a
/// number is impossible; the message names file, section and key.
pub fn load_camera(path: &Path) -> Result<StereoCamera, CalibError> {
    let settings = settings::read(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let calibration = folder.join(&settings.calibration);
    let is_yaml = calibration
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"));
    let images = if is_yaml {
        let right = settings.calibration_right.as_ref().map(|p| folder.join(p));
        yaml::read(&calibration, right.as_deref(), settings.mode)?
    } else {
        factory::read(&calibration, settings.mode)?
    };
    Ok(settings.camera(images))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::{Exposure, LiveSettings};
    use nalgebra::{Matrix3, Rotation3, Vector3};
    use shared_types::{Intrinsics, Shutter};

    #[test]
    fn the_example_is_a_camera_that_films_the_arms_plane() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../configs/camera/example.toml"
        );
        let camera = load_camera(Path::new(path)).unwrap();
        assert_eq!((camera.width_px, camera.height_px), (672, 376));
        let ahead = Vector3::new(0.72, 0.0, 0.14);
        let in_camera = camera.r_w_cam.transpose() * (ahead - camera.p_w_cam_m);
        assert!((in_camera - Vector3::new(0.0, 0.0, 1.40)).norm() < 1e-9);
    }

    const CONF: &str = "\
        [left_cam_vga]\nfx=350.94\nfy=350.94\ncx=332.1\ncy=190.2\nk1=-0.175\nk2=0.028\n\
        [RIGHT_CAM_VGA]\nfx=350.1\nfy=350.1\ncx=331.5\ncy=184.4\nk1=0\nk2=0\n\
        [STEREO]\nBaseline=62.97\nTY=0.5\nTZ=-0.25\nCV_VGA=0.006\nRX_VGA=-0.0009\nRZ_VGA=0.001\n";
    const SETTINGS: &str = "\
        calibration = \"camera.conf\"\nmode = \"VGA\"\nshutter = \"global\"\n\
        exposure_s = 0.008\nline_time_s = 2e-5\n[extrinsics]\nposition_m = [1, 2.5, 3]\n\
        rotation = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]\n";

    fn load(conf: &str, settings: &str) -> Result<StereoCamera, CalibError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("camera.conf"), conf).unwrap();
        std::fs::write(folder.path().join("camera.toml"), settings).unwrap();
        load_camera(&folder.path().join("camera.toml"))
    }

    #[test]
    fn lengths_are_metres_and_ty_counts_without_mode() {
        let camera = load(CONF, SETTINGS).unwrap();
        assert!((camera.t_right_left_m - Vector3::new(0.06297, 5e-4, -2.5e-4)).norm() < 1e-12);
        let turn = Rotation3::from_matrix_unchecked(camera.r_right_left).scaled_axis();
        assert!((turn - Vector3::new(-9e-4, 6e-3, 1e-3)).norm() < 1e-12);
        assert_eq!((camera.width_px, camera.height_px), (672, 376));
        assert_eq!(camera.left.distortion, [-0.175, 0.028, 0.0, 0.0, 0.0]);
        // A rectified camera is not corrupt; a global shutter has no line time.
        assert_eq!(camera.right.distortion, [0.0; 5]);
        assert_eq!(camera.line_time_s, 0.0);
        let by_mode = CONF.replace("TY=0.5", "TY_VGA=0.7");
        let camera = load(&by_mode, SETTINGS).unwrap();
        assert!((camera.t_right_left_m.y - 7e-4).abs() < 1e-12);
    }

    #[test]
    fn what_is_wrong_is_named() {
        type Case = ([&'static str; 2], [&'static str; 2]);
        let cases: [Case; 7] = [
            (["cx=332.1", ""], ["LEFT_CAM_VGA", "cx"]),
            (["350.94", "350,94"], ["350,94", "decimal point"]),
            (["k2=0.028", "garbage"], ["line 7", "garbage"]),
            (
                [
                    "[extrinsics]",
                    "[models]\nsegmentor = \"rope.onnx\"\n[extrinsics]",
                ],
                ["segmentor", "camera.toml"],
            ),
            (["\"VGA\"", "\"HD\""], ["LEFT_CAM_HD", "mode"]),
            (["[1, 0, 0]", "[2, 0, 0]"], ["rotation", "camera.toml"]),
            (["camera.conf", "left.yaml"], ["left.yaml", "path"]),
        ];
        for ([right, wrong], words) in cases {
            let [conf, settings] = [CONF, SETTINGS].map(|text| text.replace(right, wrong));
            let said = load(&conf, &settings).unwrap_err().to_string();
            assert!(words.iter().all(|word| said.contains(word)), "{said}");
        }
        let absent = load_camera(Path::new("/nowhere/camera.toml")).unwrap_err();
        assert!(absent.to_string().contains("/nowhere/camera.toml"));
    }

    #[test]
    fn what_is_written_reads_back() {
        let image = Intrinsics {
            fx: 700.1,
            fy: 700.2,
            cx: 640.5,
            cy: 360.25,
            distortion: [-0.17, 0.03, 1e-4, -2e-4, 1e-3],
        };
        let camera = StereoCamera {
            width_px: 1280,
            height_px: 720,
            left: image,
            right: Intrinsics { cx: 633.0, ..image },
            r_right_left: *Rotation3::new(Vector3::new(-9e-4, 6e-3, 1e-3)).matrix(),
            t_right_left_m: Vector3::new(0.063, 1e-4, -2e-4),
            r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
            p_w_cam_m: Vector3::new(0.6, -1.2, 0.2),
            shutter: Shutter::Rolling,
            exposure_s: 0.003,
            line_time_s: 15.7e-6,
        };
        let folder = tempfile::tempdir().unwrap();
        let at = |name| folder.path().join(name);
        let (toml, conf) = (at("camera.toml"), at("sn.conf"));
        write_factory_conf(&conf, &camera, VideoMode::Hd).unwrap();
        write_camera_toml(&toml, &camera, VideoMode::Hd, Path::new("sn.conf")).unwrap();
        let back = load_camera(&toml).unwrap();
        assert!((back.r_right_left - camera.r_right_left).norm() < 1e-12);
        assert!((back.t_right_left_m - camera.t_right_left_m).norm() < 1e-12);
        assert_eq!((back.left, back.right), (camera.left, camera.right));
        assert_eq!(
            (back.r_w_cam, back.p_w_cam_m),
            (camera.r_w_cam, camera.p_w_cam_m)
        );
        assert_eq!(
            (back.shutter, back.exposure_s),
            (camera.shutter, camera.exposure_s)
        );
        assert_eq!(back.line_time_s, camera.line_time_s);
    }

    #[test]
    fn a_file_sets_the_exposure_of_the_device_that_films() {
        let folder = tempfile::tempdir().unwrap();
        let toml = folder.path().join("camera.toml");
        let example = include_str!("../../../configs/camera/example.toml");
        let with = |live: &str| {
            std::fs::write(&toml, format!("{example}\n{live}")).unwrap();
            load_exposure(&toml)
        };
        assert_eq!(with("").unwrap(), Exposure::default());
        let fixed = with("[live]\nexposure_raw = 400\nsensor_gain_raw = 12\n").unwrap();
        let device = LiveSettings::new("/dev/video7".into(), VideoMode::Vga, 60, fixed).unwrap();
        assert_eq!(
            (device.exposure_raw, device.sensor_gain_raw),
            (Some(400), Some(12))
        );
        let refused = with("[live]\nexposure = 400\n").unwrap_err().to_string();
        assert!(refused.contains("exposure"), "{refused}");
        // A new place of the camera leaves it as it is.
        with("[live]\nexposure_raw = 400\n").unwrap();
        let place = (Matrix3::identity(), Vector3::zeros());
        let moved = placed_camera_toml(&toml, &toml, &place.0, &place.1).unwrap();
        assert!(moved.contains("exposure_raw = 400"), "{moved}");
    }
}
