//! Taking a camera's frames, and counting those that are lost.

use std::io;
use std::time::{Duration, Instant};

use super::abi;
use super::device::Device;
use super::kernel::KernelDevice;
use super::setup::{Setup, cannot_open};
use super::{LiveError, LiveSettings, Losses};

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
    /// Both images side by side, `YUYV`.
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
            KernelDevice::open(&settings.device).map_err(|e| cannot_open(&settings.device, &e))?;
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
                Err(e) => return Err(self.failed("taking a frame", &e)),
            };
            if filled.index >= self.buffers {
                let no_buffer = io::ErrorKind::InvalidData.into();
                return Err(self.failed("taking a frame", &no_buffer));
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
                let reason = "its time stamps are of another clock than CLOCK_MONOTONIC, so its frames \
                              cannot be laid beside the arm's motion";
                return Err(LiveError::unfit(&self.settings.device, reason));
            }
            self.held = Some(filled.index);
            let bytes = self
                .device
                .bytes(filled.index)
                .get(..wanted)
                .unwrap_or_default();
            return Ok(LiveFrame {
                bytes,
                stamp_ns: filled.stamp_ns(),
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
            .map_err(|e| self.failed("waiting for a frame", &e))
    }

    fn queue(&mut self, index: u32) -> Result<(), LiveError> {
        self.device
            .queue(index)
            .map_err(|e| self.failed("giving a buffer back", &e))
    }

    fn silent(&self, began: Instant) -> LiveError {
        let (waited_ms, good) = (began.elapsed().as_millis(), self.count.good);
        let Losses {
            missed,
            damaged,
            short,
            unordered,
        } = self.count.losses;
        let reason = format!(
            "no good frame for {waited_ms} ms (after {good} good ones; {missed} missed, {damaged} \
             damaged, {short} short, {unordered} out of order); check cable and USB port"
        );
        LiveError::failed(&self.settings.device, reason)
    }

    fn failed(&self, what: &str, source: &io::Error) -> LiveError {
        LiveError::system(&self.settings.device, what, source, self.count.good)
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
    fn take(&mut self, filled: &abi::Buffer, frame_bytes: usize) -> Option<u64> {
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
        let stamp_ns = filled.stamp_ns();
        let later = self.stamp_ns.is_none_or(|last| stamp_ns > last);
        let lost = if filled.flags & abi::FLAG_ERROR != 0 {
            &mut self.losses.damaged
        } else if filled.bytesused as usize != frame_bytes {
            &mut self.losses.short
        } else if !later {
            &mut self.losses.unordered
        } else {
            self.stamp_ns = Some(stamp_ns);
            self.good += 1;
            return Some(sequence);
        };
        *lost += 1;
        None
    }
}
