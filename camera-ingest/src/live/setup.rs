//! Opening a camera and settling with its driver how it is to run.

use std::fmt::Display;
use std::io;
use std::path::Path;

use super::abi;
use super::device::Device;
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
        let sensor = self.settings.sensor().map_err(|e| self.unfit(e))?;
        self.capture()?;
        self.format()?;
        self.rate()?;
        if let Some(gain) = self.settings.gain {
            self.gain(gain)?;
        }
        let buffers = self.buffers()?;
        let started = self.device.stream(true);
        started.map_err(|e| self.refused("starting the stream", &e))?;
        if let Some(sensor) = sensor {
            let set = sensor.apply(self.device);
            set.map_err(|e| self.unfit(format!("its exposure cannot be set, for {e}")))?;
        }
        Ok(buffers)
    }

    fn capture(&mut self) -> Result<(), LiveError> {
        const REMEDY: &str = "name the camera's own /dev/videoN (`ls -l /dev/v4l/by-id`); its second \
                              one holds metadata of frames, not frames";
        let identity = match self.device.identity() {
            Ok(identity) => identity,
            Err(e) if e.raw_os_error() == Some(libc::ENOTTY) => {
                return Err(self.unfit(format!("it is not a video device; {REMEDY}")));
            }
            Err(e) => return Err(self.refused("asking what it is", &e)),
        };
        let needed = abi::CAN_CAPTURE | abi::CAN_STREAM;
        if identity.capabilities & needed != needed {
            return Err(self.unfit(format!(
                "`{}` (driver {}) does not capture to mapped buffers; {REMEDY}",
                identity.card, identity.driver
            )));
        }
        Ok(())
    }

    fn format(&mut self) -> Result<(), LiveError> {
        let [width, height] = self.settings.size_px();
        let requested = abi::PixFormat {
            width,
            height,
            pixelformat: abi::YUYV,
            field: abi::FIELD_NONE,
            ..abi::PixFormat::default()
        };
        let granted = self.device.set_format(requested);
        let granted = granted.map_err(|e| self.refused("setting the picture format", &e))?;
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
            ..requested
        };
        let fits = granted.width == width
            && granted.height == height
            && granted.pixelformat == abi::YUYV
            && granted.bytesperline == 2 * width
            && granted.sizeimage as usize >= self.settings.frame_bytes();
        if fits {
            return Ok(());
        }
        Err(self.unfit(format!(
            "picture: {} requested, {} granted; choose a mode that the camera has (at USB 2 only VGA), \
             both images side by side",
            name(&wanted),
            name(&granted)
        )))
    }

    fn rate(&mut self) -> Result<(), LiveError> {
        let rate_hz = self.settings.rate_hz;
        let granted = self.device.set_rate([1, rate_hz]);
        let granted = granted.map_err(|e| self.refused("setting the frame rate", &e))?;
        let name = match granted {
            // Tenths of a per cent are rounding: 1/60 may be granted as 166666/9999960.
            Some([n, d]) if n > 0 && d.abs_diff(n.saturating_mul(rate_hz)) <= d / 1000 => {
                return Ok(());
            }
            Some([n, d]) => format!("{d}/{n}"),
            None => "one that cannot be chosen".to_owned(),
        };
        Err(self.unfit(format!(
            "frames per second: {rate_hz} requested, {name} granted; choose a rate that the camera has \
             in this mode"
        )))
    }

    fn gain(&mut self, gain: i32) -> Result<(), LiveError> {
        let granted = self.device.set_control(abi::CONTROL_GAIN, gain);
        let granted =
            granted.map_err(|e| self.unfit(format!("its gain cannot be set to {gain}: {e}")))?;
        if granted == gain {
            return Ok(());
        }
        Err(self.unfit(format!(
            "gain: {gain} requested, {granted} granted; see its range with `v4l2-ctl --list-ctrls`"
        )))
    }

    fn buffers(&mut self) -> Result<u32, LiveError> {
        let granted = self.device.map_buffers(BUFFERS);
        let granted = granted.map_err(|e| self.refused("mapping buffers", &e))?;
        if granted < MIN_BUFFERS {
            return Err(self.unfit(format!(
                "buffers: {BUFFERS} requested, {granted} granted; fewer than four lose frames at every \
                 hiccup"
            )));
        }
        for index in 0..granted {
            let queued = self.device.queue(index);
            queued.map_err(|e| self.refused("giving a buffer to the driver", &e))?;
        }
        Ok(granted)
    }

    fn unfit(&self, reason: impl Display) -> LiveError {
        LiveError::unfit(&self.settings.device, reason)
    }

    fn refused(&self, what: &str, source: &io::Error) -> LiveError {
        if source.raw_os_error() == Some(libc::EBUSY) {
            return self.unfit(IN_USE);
        }
        LiveError::system(&self.settings.device, what, source, 0)
    }
}

const IN_USE: &str = "another program uses it; end that program (`fuser -v /dev/video*` names it)";

pub(super) fn cannot_open(device: &Path, source: &io::Error) -> LiveError {
    let reason = match source.kind() {
        io::ErrorKind::NotFound => {
            "there is no such device; plug it in, and see `ls -l /dev/v4l/by-id`"
        }
        io::ErrorKind::PermissionDenied => {
            "no permission to open it; join the group `video`, and install \
             packaging/udev/60-wag-camera.rules"
        }
        io::ErrorKind::ResourceBusy => IN_USE,
        _ if matches!(source.raw_os_error(), Some(libc::ENODEV | libc::ENXIO)) => {
            "nothing is plugged in behind that name; plug it in, and see `ls -l /dev/v4l/by-id`"
        }
        _ => return LiveError::system(device, "opening it", source, 0),
    };
    LiveError::unfit(device, reason)
}
