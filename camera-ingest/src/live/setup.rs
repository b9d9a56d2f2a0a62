//! Opening a camera and settling with its driver how it is to run.

use std::io;
use std::path::Path;

use super::abi;
use super::device::Device;
use super::exposure::{Sensor, SensorError};
use super::{LiveError, LiveSettings};

/// Buffers asked for: a reader may be late by five frames and loses none.
const BUFFERS: u32 = 6;
/// With fewer, a hiccup of 30 ms would lose frames.
const MIN_BUFFERS: u32 = 4;

/// The talk with a driver before the first frame.
pub(super) struct Setup<'a> {
    pub(super) settings: &'a LiveSettings,
    pub(super) device: &'a mut dyn Device,
}

impl Setup<'_> {
    /// Settles everything, starts the stream, and returns how many buffers there are.
    pub(super) fn run(mut self) -> Result<u32, LiveError> {
        let sensor = self
            .settings
            .sensor()
            .map_err(|reason| self.setting(reason))?;
        self.capture()?;
        self.format()?;
        self.rate()?;
        if let Some(gain) = self.settings.gain {
            self.gain(gain)?;
        }
        let buffers = self.buffers()?;
        self.device
            .stream(true)
            .map_err(|e| self.refused("starting the stream", e))?;
        if let Some(sensor) = sensor {
            self.sensor(sensor)?;
        }
        Ok(buffers)
    }

    fn capture(&mut self) -> Result<(), LiveError> {
        let unfit = |reason: String| LiveError::Unfit {
            device: self.settings.device.clone(),
            reason,
            remedy: "name the camera's own /dev/videoN (`ls -l /dev/v4l/by-id`); its second one \
                     holds metadata of frames, not frames",
        };
        let identity = match self.device.identity() {
            Ok(identity) => identity,
            Err(e) if e.raw_os_error() == Some(libc::ENOTTY) => {
                return Err(unfit("it is not a video device".to_owned()));
            }
            Err(e) => return Err(self.refused("asking what it is", e)),
        };
        let needed = abi::CAN_CAPTURE | abi::CAN_STREAM;
        if identity.capabilities & needed != needed {
            return Err(unfit(format!(
                "`{}` (driver {}) does not capture to mapped buffers",
                identity.card, identity.driver
            )));
        }
        Ok(())
    }

    fn format(&mut self) -> Result<(), LiveError> {
        let [width, height] = self.settings.size_px();
        let asked = abi::PixFormat {
            width,
            height,
            pixelformat: abi::YUYV,
            field: abi::FIELD_NONE,
            ..abi::PixFormat::default()
        };
        let granted = self
            .device
            .set_format(asked)
            .map_err(|e| self.refused("setting the picture format", e))?;
        let name = |p: &abi::PixFormat| {
            let letters = p.pixelformat.to_le_bytes();
            format!(
                "{}x{} {} in rows of {} bytes",
                p.width,
                p.height,
                String::from_utf8_lossy(&letters),
                p.bytesperline
            )
        };
        let wanted = abi::PixFormat {
            bytesperline: 2 * width,
            ..asked
        };
        let fits = granted.width == width
            && granted.height == height
            && granted.pixelformat == abi::YUYV
            && granted.bytesperline == 2 * width
            && granted.sizeimage as usize >= self.settings.frame_bytes();
        if fits {
            return Ok(());
        }
        Err(self.granted(
            "picture",
            name(&wanted),
            name(&granted),
            "choose a mode that the camera has (at USB 2 only VGA), both images side by side",
        ))
    }

    fn rate(&mut self) -> Result<(), LiveError> {
        let rate_hz = self.settings.rate_hz;
        let granted = self
            .device
            .set_rate([1, rate_hz])
            .map_err(|e| self.refused("setting the frame rate", e))?;
        let name = granted.map_or_else(
            || "one that cannot be chosen".to_owned(),
            |[n, d]| format!("{d}/{n}"),
        );
        match granted {
            // Tenths of a per cent are rounding: 1/60 may be granted as 166666/9999960.
            Some([n, d]) if n > 0 && d.abs_diff(n.saturating_mul(rate_hz)) <= d / 1000 => Ok(()),
            _ => Err(self.granted(
                "frames per second",
                rate_hz.to_string(),
                name,
                "choose a rate that the camera has in this mode",
            )),
        }
    }

    fn gain(&mut self, gain: i32) -> Result<(), LiveError> {
        let granted = self
            .device
            .set_control(abi::CONTROL_GAIN, gain)
            .map_err(|e| self.setting(format!("its gain cannot be set to {gain}: {e}")))?;
        if granted == gain {
            return Ok(());
        }
        Err(self.granted(
            "gain",
            gain.to_string(),
            granted.to_string(),
            "see its range with `v4l2-ctl --list-ctrls`",
        ))
    }

    fn buffers(&mut self) -> Result<u32, LiveError> {
        let granted = self
            .device
            .map_buffers(BUFFERS)
            .map_err(|e| self.refused("mapping buffers", e))?;
        if granted < MIN_BUFFERS {
            return Err(self.granted(
                "buffers",
                BUFFERS.to_string(),
                granted.to_string(),
                "fewer than four lose frames at every hiccup",
            ));
        }
        for index in 0..granted {
            self.device
                .queue(index)
                .map_err(|e| self.refused("giving a buffer to the driver", e))?;
        }
        Ok(granted)
    }

    fn sensor(&mut self, sensor: Sensor) -> Result<(), LiveError> {
        sensor.apply(self.device).map_err(|e| {
            self.setting(match e {
                SensorError::Unit(e) => format!(
                    "its exposure cannot be set, for the vendor's extension unit does not answer \
                     ({e}); leave out exposure_raw, or use a ZED"
                ),
                SensorError::Foreign(reason) => format!(
                    "its exposure cannot be set, for its extension unit is not a ZED's: {reason}; \
                     leave out exposure_raw"
                ),
            })
        })
    }

    fn setting(&self, reason: String) -> LiveError {
        LiveError::Setting {
            device: self.settings.device.clone(),
            reason,
        }
    }

    fn granted(
        &self,
        what: &'static str,
        asked: String,
        granted: String,
        remedy: &'static str,
    ) -> LiveError {
        LiveError::Granted {
            device: self.settings.device.clone(),
            what,
            asked,
            granted,
            remedy,
        }
    }

    fn refused(&self, what: &'static str, source: io::Error) -> LiveError {
        let device = &self.settings.device;
        match source.raw_os_error() {
            Some(libc::EBUSY) => LiveError::Unfit {
                device: device.clone(),
                reason: "another program uses it".to_owned(),
                remedy: "end that program (`fuser -v /dev/video*` names it)",
            },
            Some(libc::ENODEV) => LiveError::Unplugged {
                device: device.clone(),
                frames: 0,
            },
            _ => LiveError::system(device, what, source),
        }
    }
}

pub(super) fn cannot_open(device: &Path, source: io::Error) -> LiveError {
    let (reason, remedy) = match source.kind() {
        io::ErrorKind::NotFound => (
            "there is no such device",
            "plug it in, and see `ls -l /dev/v4l/by-id`",
        ),
        io::ErrorKind::PermissionDenied => (
            "no permission to open it",
            "join the group `video`, and install packaging/udev/60-wag-camera.rules",
        ),
        io::ErrorKind::ResourceBusy => (
            "another program uses it",
            "end that program (`fuser -v /dev/video*` names it)",
        ),
        _ if matches!(source.raw_os_error(), Some(libc::ENODEV | libc::ENXIO)) => (
            "nothing is plugged in behind that name",
            "plug it in, and see `ls -l /dev/v4l/by-id`",
        ),
        _ => return LiveError::system(device, "opening it", source),
    };
    LiveError::Unfit {
        device: device.to_owned(),
        reason: reason.to_owned(),
        remedy,
    }
}
