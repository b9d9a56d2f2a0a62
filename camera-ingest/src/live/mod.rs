//! A stereo camera that runs: UVC through V4L2, side-by-side YUYV in buffers that the
//! driver fills and this process maps.
//!
//! The driver fills whatever buffers it has and drops frames when it has none: a slow
//! reader loses frames, which are counted, and never slows the camera.

mod abi;
mod camera;
mod device;
mod exposure;
mod kernel;
mod publish;
mod record;
mod setup;
#[cfg(test)]
mod tests;

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use crate::raw_film::FilmError;
pub use camera::{LiveCamera, LiveFrame};
pub use publish::{CameraConfig, PublishError, run};
pub use record::{RecordError, Recorded, record};
use serde::{Deserialize, Serialize};

use crate::calib::VideoMode;
use exposure::Sensor;

/// How long a camera may take for a frame.
const PATIENCE: Duration = Duration::from_secs(2);

/// How a camera is to run. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LiveSettings {
    /// Device, `/dev/videoN`.
    pub device: PathBuf,
    /// Picture size.
    pub mode: VideoMode,
    /// Frames per second.
    pub rate_hz: u32,
    /// The camera's ordinary control for gain; without it, it stays as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<i32>,
    /// Exposure in the sensor's own units, which ends automatic exposure; ZED only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_raw: Option<u32>,
    /// Gain in the sensor's own units; only with `exposure_raw`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_gain_raw: Option<u32>,
}

/// `[live]` of a `camera.toml`: what a device that is opened to film a run is set to. Keys as in
/// [`LiveSettings`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exposure {
    /// The camera's ordinary control for gain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<i32>,
    /// Exposure in the sensor's own units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_raw: Option<u32>,
    /// Gain in the sensor's own units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_gain_raw: Option<u32>,
}

impl LiveSettings {
    /// A device with the pictures and the exposure that it is to have.
    ///
    /// # Errors
    /// What is out of range at that rate.
    pub fn new(
        device: PathBuf,
        mode: VideoMode,
        rate_hz: u32,
        exposure: Exposure,
    ) -> Result<Self, String> {
        let settings = Self {
            device,
            mode,
            rate_hz,
            gain: exposure.gain,
            exposure_raw: exposure.exposure_raw,
            sensor_gain_raw: exposure.sensor_gain_raw,
        };
        settings.sensor()?;
        Ok(settings)
    }

    /// Width of both images together and height (px).
    #[must_use]
    pub fn size_px(&self) -> [u32; 2] {
        let (width_px, height_px) = self.mode.size_px();
        [2 * width_px, height_px]
    }

    /// Bytes of one frame.
    #[must_use]
    pub fn frame_bytes(&self) -> usize {
        let [width_px, height_px] = self.size_px();
        2 * width_px as usize * height_px as usize
    }

    /// What the sensors are to be set to, or what is out of range.
    fn sensor(&self) -> Result<Option<Sensor>, String> {
        if !(1..=240).contains(&self.rate_hz) {
            return Err(format!("rate_hz is {}, it must be 1 to 240", self.rate_hz));
        }
        let sensor = match (self.exposure_raw, self.sensor_gain_raw) {
            (None, None) => return Ok(None),
            (None, Some(_)) => {
                let why = "sensor_gain_raw needs exposure_raw beside it: automatic exposure would \
                           change both";
                return Err(why.to_owned());
            }
            (Some(exposure_raw), gain_raw) => Sensor {
                exposure_raw,
                gain_raw,
            },
        };
        sensor.check(self.rate_hz)?;
        Ok(Some(sensor))
    }
}

/// Frames that a camera took and that were lost, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Losses {
    /// Left out of the driver's count: no buffer was free, or the bus was too slow.
    pub missed: u64,
    /// Marked as damaged by the driver.
    pub damaged: u64,
    /// Of another length than a frame has.
    pub short: u64,
    /// With a time stamp that was not later than the one before.
    pub unordered: u64,
}

impl Losses {
    /// All together.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.missed + self.damaged + self.short + self.unordered
    }

    /// Those after `before`.
    #[must_use]
    fn since(&self, before: Self) -> Self {
        Self {
            missed: self.missed - before.missed,
            damaged: self.damaged - before.damaged,
            short: self.short - before.short,
            unordered: self.unordered - before.unordered,
        }
    }
}

/// Why a camera gives no frames: which one, what is wrong, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// It cannot be had as asked: it is no camera, another program uses it, or it does not
    /// do what is asked of it.
    #[error("{0}")]
    Unfit(String),
    /// It was unplugged or fell silent, or the system refused something that should go.
    #[error("{0}")]
    Failed(String),
}

impl LiveError {
    fn unfit(device: &Path, reason: impl Display) -> Self {
        Self::Unfit(format!("camera {}: {reason}", device.display()))
    }

    fn failed(device: &Path, reason: impl Display) -> Self {
        Self::Failed(format!("camera {}: {reason}", device.display()))
    }

    /// The system refused `what`; `frames` good ones came before.
    fn system(device: &Path, what: &str, source: &io::Error, frames: u64) -> Self {
        if source.raw_os_error() == Some(libc::ENODEV) {
            return Self::Failed(format!(
                "camera {} was unplugged after {frames} frames; check plug, cable and power",
                device.display()
            ));
        }
        Self::failed(device, format!("{what} failed: {source}"))
    }
}
