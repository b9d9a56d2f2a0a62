//! Camera settings and the factory's calibration beside them.

use crate::folder;
use camera_ingest::calib::load_camera;
use std::fs::write;

/// Between settings and calibration.
const BREAK: &[u8] = b"\n=====\n";

/// Reads the two parts of `data` as `camera.toml` and `camera.conf`.
pub fn run(data: &[u8]) {
    let at = data.windows(BREAK.len()).position(|w| w == BREAK);
    let (settings, factory) = match at {
        Some(at) => (&data[..at], &data[at + BREAK.len()..]),
        None => (SETTINGS.as_bytes(), data),
    };
    let path = folder().join("camera.toml");
    // The settings name the file; whatever else they name is not there.
    write(&path, settings).expect("settings");
    write(folder().join("camera.conf"), factory).expect("calibration");
    let _ = load_camera(&path);
}

const SETTINGS: &str = "calibration = \"camera.conf\"\nmode = \"VGA\"\nshutter = \"global\"\n\
    exposure_s = 0.008\nline_time_s = 2e-5\n[extrinsics]\nposition_m = [1, 2.5, 3]\n\
    rotation = [[1,0,0],[0,1,0],[0,0,1]]\n";
const FACTORY: &str = "[LEFT_CAM_VGA]\nfx=350.94\nfy=350.94\ncx=332.1\ncy=190.2\nk1=-0.175\nk2=0.028\n\
    [RIGHT_CAM_VGA]\nfx=350.1\nfy=350.1\ncx=331.5\ncy=184.4\nk1=0\nk2=0\n\
    [STEREO]\nBaseline=62.97\nTY=0.5\nTZ=-0.25\nCV_VGA=0.006\nRX_VGA=-0.0009\nRZ_VGA=0.001\n";

/// Both files together, and the calibration alone.
pub fn seeds() -> Vec<Vec<u8>> {
    vec![
        [SETTINGS.as_bytes(), BREAK, FACTORY.as_bytes()].concat(),
        FACTORY.as_bytes().to_vec(),
    ]
}
