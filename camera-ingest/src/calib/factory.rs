//! The vendor's factory calibration `SNxxxx.conf`.
//!
//! Traps of real files that this reader handles: `TY`/`TZ` or `TY_<mode>`, all
//! distortion zero (a rectified camera, not a corrupt file), lengths in mm,
//! section names in any case.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{Rotation3, Vector3};
use shared_types::{Intrinsics, StereoCamera};

use super::error::{CalibError, read_text, write_text};
use super::ini::Ini;
use super::mode::{StereoGeometry, VideoMode};

const M_PER_MM: f64 = 1e-3;

pub(super) fn read(path: &Path, mode: VideoMode) -> Result<StereoGeometry, CalibError> {
    let ini = Ini::parse(path, &read_text(path)?)?;
    let stereo = |key: &str| -> Result<f64, CalibError> {
        // Newer files give a value per mode, older ones a single value.
        let by_mode = ini.number("STEREO", &format!("{key}_{}", mode.name()))?;
        let value = match by_mode {
            None => ini.number("STEREO", key)?,
            some => some,
        };
        Ok(value.unwrap_or(0.0))
    };
    let baseline_mm = ini.need("STEREO", "Baseline", mode)?;
    if baseline_mm <= 0.0 {
        return Err(ini.bad("STEREO", "Baseline", "must be positive (mm)"));
    }
    let turn = Vector3::new(stereo("RX")?, stereo("CV")?, stereo("RZ")?);
    Ok(StereoGeometry {
        left: intrinsics(&ini, "LEFT_CAM", mode)?,
        right: intrinsics(&ini, "RIGHT_CAM", mode)?,
        r_right_left: *Rotation3::new(turn).matrix(),
        t_right_left_m: Vector3::new(baseline_mm, stereo("TY")?, stereo("TZ")?) * M_PER_MM,
    })
}

fn intrinsics(ini: &Ini, image: &str, mode: VideoMode) -> Result<Intrinsics, CalibError> {
    let section = format!("{image}_{}", mode.name());
    let or_zero =
        |key: &str| -> Result<f64, CalibError> { Ok(ini.number(&section, key)?.unwrap_or(0.0)) };
    let focal = |key: &str| -> Result<f64, CalibError> {
        let value = ini.need(&section, key, mode)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(ini.bad(&section, key, "must be positive (px)"))
        }
    };
    Ok(Intrinsics {
        fx: focal("fx")?,
        fy: focal("fy")?,
        cx: ini.need(&section, "cx", mode)?,
        cy: ini.need(&section, "cy", mode)?,
        distortion: [
            or_zero("k1")?,
            or_zero("k2")?,
            or_zero("p1")?,
            or_zero("p2")?,
            or_zero("k3")?,
        ],
    })
}

/// Writes the calibration of one mode in the factory layout; the other modes'
/// sections are left out.
///
/// # Errors
/// The file cannot be written.
pub fn write_factory_conf(
    path: &Path,
    camera: &StereoCamera,
    mode: VideoMode,
) -> Result<(), CalibError> {
    let name = mode.name();
    let mut text = String::new();
    // Writing to a String cannot fail.
    for (image, k) in [("LEFT", &camera.left), ("RIGHT", &camera.right)] {
        let [k1, k2, p1, p2, k3] = k.distortion;
        let _ = writeln!(
            text,
            "[{image}_CAM_{name}]\nfx={}\nfy={}\ncx={}\ncy={}\n\
             k1={k1}\nk2={k2}\np1={p1}\np2={p2}\nk3={k3}\n",
            k.fx, k.fy, k.cx, k.cy
        );
    }
    let t_mm = camera.t_right_left_m / M_PER_MM;
    let turn = Rotation3::from_matrix_unchecked(camera.r_right_left).scaled_axis();
    let _ = writeln!(
        text,
        "[STEREO]\nBaseline={}\nTY={}\nTZ={}\nCV_{name}={}\nRX_{name}={}\nRZ_{name}={}\n\n\
         [MISC]\nSensor_ID=0",
        t_mm.x, t_mm.y, t_mm.z, turn.y, turn.x, turn.z
    );
    write_text(path, &text)
}
