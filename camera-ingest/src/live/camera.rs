//! Opening a camera, checking what it grants, and taking its frames.

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use super::abi;
use super::device::{Device, Filled};
use super::exposure::{Sensor, SensorError};
use super::kernel::KernelDevice;
use super::{LiveError, LiveSettings, Losses};

/// Buffers asked for: a reader may be late by five frames and loses none.
const BUFFERS: u32 = 6;
/// With fewer, a hiccup of 30 ms would lose frames.
const LEAST_BUFFERS: u32 = 4;

/// A running camera.
#[derive(Debug)]
pub struct LiveCamera {
    settings: LiveSettings,
    device: Box<dyn Device>,
    /// Buffers mapped.
    buffers: u32,
    /// The buffer of the frame that was given last.
    held: Option<u32>,
    count: Count,
}

/// A frame in the driver's memory, until the next one is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiveFrame<'a> {
    /// Both eyes side by side, `YUYV`.
    pub bytes: &'a [u8],
    /// The driver's stamp (CLOCK_MONOTONIC, ns). Drivers say that it is the start of
    /// exposure; by default it is when the frame began to arrive.
    pub stamp_ns: u64,
    /// The driver's count of frames; gaps are frames lost.
    pub sequence: u64,
}

impl LiveCamera {
    /// Opens a camera and starts it.
    ///
    /// # Errors
    /// No such device, no permission, no camera; it is in use; it does not grant what
    /// is asked.
    pub fn open(settings: LiveSettings) -> Result<Self, LiveError> {
        let device =
            KernelDevice::open(&settings.device).map_err(|e| cannot_open(&settings.device, e))?;
        Self::start(settings, Box::new(device))
    }

    /// Settles everything with a device and starts it.
    pub(super) fn start(
        settings: LiveSettings,
        mut device: Box<dyn Device>,
    ) -> Result<Self, LiveError> {
        let setup = Setup {
            settings: &settings,
            device: device.as_mut(),
        };
        let buffers = setup.run()?;
        Ok(Self {
            settings,
            device,
            buffers,
            held: None,
            count: Count::default(),
        })
    }

    /// What it was opened with.
    #[must_use]
    pub fn settings(&self) -> &LiveSettings {
        &self.settings
    }

    /// Good frames given so far.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.count.good
    }

    /// Frames lost so far.
    #[must_use]
    pub fn losses(&self) -> Losses {
        self.count.losses
    }

    /// The next good frame; the one before goes back to the driver.
    ///
    /// # Errors
    /// None comes within `patience`; the camera was unplugged; the driver fails.
    pub fn next(&mut self, patience: Duration) -> Result<LiveFrame<'_>, LiveError> {
        let began = Instant::now();
        if let Some(index) = self.held.take() {
            self.queue(index)?;
        }
        loop {
            let filled = match self.device.dequeue() {
                Ok(filled) => filled,
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    self.wait(began, patience)?;
                    continue;
                }
                Err(e) => return Err(self.failed("taking a frame", e)),
            };
            if filled.index >= self.buffers {
                return Err(self.failed("taking a frame", io::ErrorKind::InvalidData.into()));
            }
            let wanted = self.settings.frame_bytes();
            let Some(sequence) = self.count.take(&filled, wanted) else {
                self.queue(filled.index)?;
                // Frame after bad frame must not hold anybody up for ever.
                if began.elapsed() > patience {
                    return Err(self.silent(began));
                }
                continue;
            };
            if filled.flags & abi::FLAG_CLOCK != abi::CLOCK_MONOTONIC {
                return Err(LiveError::Setting {
                    device: self.settings.device.clone(),
                    reason: "its time stamps are of another clock than CLOCK_MONOTONIC, so its \
                             frames cannot be laid beside the arm's motion"
                        .to_owned(),
                });
            }
            self.held = Some(filled.index);
            let bytes = self
                .device
                .bytes(filled.index)
                .get(..wanted)
                .unwrap_or_default();
            return Ok(LiveFrame {
                bytes,
                stamp_ns: filled.stamp_ns,
                sequence,
            });
        }
    }

    fn wait(&self, began: Instant, patience: Duration) -> Result<(), LiveError> {
        let left = patience.saturating_sub(began.elapsed());
        if left.is_zero() {
            return Err(self.silent(began));
        }
        self.device
            .wait(left)
            .map(drop)
            .map_err(|e| self.failed("waiting for a frame", e))
    }

    fn queue(&mut self, index: u32) -> Result<(), LiveError> {
        self.device
            .queue(index)
            .map_err(|e| self.failed("giving a buffer back", e))
    }

    fn silent(&self, began: Instant) -> LiveError {
        LiveError::Silent {
            device: self.settings.device.clone(),
            waited_ms: began.elapsed().as_millis(),
            frames: self.count.good,
            losses: self.count.losses,
        }
    }

    fn failed(&self, what: &'static str, source: io::Error) -> LiveError {
        if source.raw_os_error() == Some(libc::ENODEV) {
            return LiveError::Unplugged {
                device: self.settings.device.clone(),
                frames: self.count.good,
            };
        }
        LiveError::system(&self.settings.device, what, source)
    }
}

/// What came, and what did not.
#[derive(Debug, Default)]
struct Count {
    good: u64,
    losses: Losses,
    /// Sequence as the driver counts, extended to where it does not wrap.
    sequence: Option<u64>,
    stamp_ns: Option<u64>,
}

impl Count {
    /// Counts a buffer; the sequence of a good frame.
    fn take(&mut self, filled: &Filled, frame_bytes: usize) -> Option<u64> {
        let sequence = match self.sequence {
            None => u64::from(filled.sequence),
            Some(last) => {
                let low = u32::try_from(last & u64::from(u32::MAX)).unwrap_or_default();
                let step = filled.sequence.wrapping_sub(low);
                if step == 0 || step > u32::MAX / 2 {
                    self.losses.unordered += 1;
                    return None;
                }
                self.losses.missed += u64::from(step - 1);
                last + u64::from(step)
            }
        };
        self.sequence = Some(sequence);
        let later = self.stamp_ns.is_none_or(|last| filled.stamp_ns > last);
        let lost = if filled.flags & abi::FLAG_ERROR != 0 {
            &mut self.losses.damaged
        } else if filled.bytesused as usize != frame_bytes {
            &mut self.losses.short
        } else if !later {
            &mut self.losses.unordered
        } else {
            self.stamp_ns = Some(filled.stamp_ns);
            self.good += 1;
            return Some(sequence);
        };
        *lost += 1;
        None
    }
}

/// The talk with a driver before the first frame.
struct Setup<'a> {
    settings: &'a LiveSettings,
    device: &'a mut dyn Device,
}

impl Setup<'_> {
    fn run(mut self) -> Result<u32, LiveError> {
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
                     holds notes about frames, no frames",
        };
        let identity = match self.device.identity() {
            Ok(identity) => identity,
            Err(e) if e.raw_os_error() == Some(libc::ENOTTY) => {
                return Err(unfit("it is no video device".to_owned()));
            }
            Err(e) => {
                return Err(LiveError::system(
                    &self.settings.device,
                    "asking what it is",
                    e,
                ));
            }
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
        let [width, height] = self.settings.size_px().map(picture_side);
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
            "choose a mode that the camera has (at USB 2 only VGA), both eyes side by side",
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
                "frames a second",
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
        if granted < LEAST_BUFFERS {
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

/// A width or height (px).
pub(super) fn picture_side(px: usize) -> u32 {
    u32::try_from(px).unwrap_or(u32::MAX)
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
        _ if source.raw_os_error() == Some(libc::ENODEV)
            || source.raw_os_error() == Some(libc::ENXIO) =>
        {
            (
                "nothing is plugged in behind that name",
                "plug it in, and see `ls -l /dev/v4l/by-id`",
            )
        }
        _ => return LiveError::system(device, "opening it", source),
    };
    LiveError::Unfit {
        device: device.to_owned(),
        reason: reason.to_owned(),
        remedy,
    }
}
