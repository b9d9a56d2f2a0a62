//! What a running controller, its camera and its tracker publish, as messages: for the
//! recording, and for programs that look on.
//!
//! It only listens: where it is slow it loses records of its own, and holds nobody up.

use super::channel::Channel;
use super::clock::{Clock, Thinned};
use super::counts::{Gaps, RecordingCounts};
use super::image::left_jpeg;
use super::messages::{self, Level};
use super::scene::{arm_frames, calibration, camera_place, room};
use crate::explanation::is_orderly_end;
use anyhow::{Context, Result};
use arm_model::Pole;
use rt_controller::recording::{Item, LogReader, Read};
use serde_json::{Value, json};
use shared_types::ipc::{
    Bus, ChunkSubscriber, ControllerMode, CycleRecord, CycleSubscriber, FrameHeader,
    FrameSubscriber, JointReport, JointSubscriber, KeypointSubscriber,
};
use shared_types::{FaultCode, StereoCamera};

/// As much as waits for a subscriber at most.
const BUFFER: usize = 1024;
/// A picture that is older is left out, so that a machine that is too slow for all of
/// it tells everything else.
const PICTURE_LATE_NS: u64 = 150_000_000;
/// Frames looked at before everything else is looked at again: while a slow machine
/// compresses one picture the next frame comes, without end.
pub(super) const FRAMES_AT_ONCE: usize = 16;
/// Frames of the arm's links per second.
const FRAMES_HZ: f64 = 50.0;
/// Quality of the pictures as JPEG. They are the left eye's: the rope is tracked in it, and
/// the right eye would double the file.
const QUALITY: u8 = 75;

/// What the end of a session looks like to the loop, and a stop by its operator then.
const ENDED: &str = "commanded to stop while the arm was at rest";
const CANNOT_RECEIVE: &str = "cannot receive from shared memory";

/// Takes the messages of a run while it goes on.
pub trait Sink {
    /// Whether somebody wants messages of a channel. What nobody wants is not made.
    fn wants(&self, _channel: Channel) -> bool {
        true
    }

    /// Takes a message of the instant `at_ns` (wall clock).
    ///
    /// # Errors
    /// It can take nothing any more.
    fn message(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()>;

    /// Another run begins; what was told of the one before holds no longer.
    ///
    /// # Errors
    /// It can take nothing any more.
    fn begin_anew(&mut self) -> Result<()> {
        Ok(())
    }

    /// Takes a chunk of the exact recording, which only this program reads.
    ///
    /// # Errors
    /// It can take nothing any more.
    fn chunk(&mut self, _at_ns: u64, _bytes: &[u8]) -> Result<()> {
        Ok(())
    }
}

/// What does not move in a run.
#[derive(Debug, Clone, Default)]
pub struct StandingScene {
    /// The arm's pole.
    pub pole: Pole,
    /// The target (m, world frame), where there is one.
    pub target_m: Option<[f64; 3]>,
    /// The camera, where there is one.
    pub camera: Option<StereoCamera>,
}

impl StandingScene {
    /// Tells it: arm, pole and target, and the camera's calibration and pose.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn tell(&self, sink: &mut impl Sink) -> Result<()> {
        let at_ns = Clock::compare().now_ns();
        let mut tell = |channel, message: &dyn Fn() -> Value| match sink.wants(channel) {
            true => sink.message(channel, at_ns, &message()),
            false => Ok(()),
        };
        tell(Channel::Scene, &|| room(at_ns, &self.pole, self.target_m))?;
        let Some(camera) = &self.camera else {
            return Ok(());
        };
        tell(Channel::Calibration, &|| calibration(at_ns, camera))?;
        tell(
            Channel::Frames,
            &|| json!({ "transforms": [camera_place(at_ns, camera)] }),
        )
    }
}

/// Connections to everything worth telling.
#[derive(Debug)]
pub(super) struct Ports {
    /// None for those who only look on: the rest can be made from it, which takes its time.
    chunks: Option<ChunkSubscriber>,
    cycles: CycleSubscriber,
    joints: JointSubscriber,
    keypoints: KeypointSubscriber,
    frames: FrameSubscriber,
}

impl Ports {
    fn open(bus: &Bus, exact: bool) -> Result<Self> {
        Ok(Self {
            chunks: exact.then(|| bus.chunk_subscriber()).transpose()?,
            cycles: bus.cycle_subscriber()?,
            joints: bus.joint_subscriber()?,
            keypoints: bus.keypoint_subscriber()?,
            frames: bus.frame_subscriber()?,
        })
    }
}

/// Hands what has arrived to `take`, a whole buffer at most: on a machine that is too
/// slow there is always more.
fn each<T>(
    receive: impl Fn() -> Result<Option<T>>,
    mut take: impl FnMut(T) -> Result<()>,
) -> Result<()> {
    for _ in 0..BUFFER {
        let Some(sample) = receive().context(CANNOT_RECEIVE)? else {
            break;
        };
        take(sample)?;
    }
    Ok(())
}

/// What one domain publishes.
#[derive(Debug)]
pub struct Feed {
    ports: Ports,
    told: Told,
}

impl Feed {
    /// Subscribes to what those who look on are told in a domain, whether anybody publishes there
    /// yet or not. Of pictures there are `pictures_hz` at most; links are placed for an arm with
    /// this pole.
    ///
    /// # Errors
    /// Shared memory has no place for one more that listens.
    pub fn open(bus: &Bus, pole: Pole, pictures_hz: f64) -> Result<Self> {
        Self::of(Ports::open(bus, false)?, pole, pictures_hz)
    }

    /// The same with the exact recording, and the causes of stops that it tells.
    pub(super) fn with_recording(bus: &Bus, pole: Pole, pictures_hz: f64) -> Result<Self> {
        Self::of(Ports::open(bus, true)?, pole, pictures_hz)
    }

    fn of(ports: Ports, pole: Pole, pictures_hz: f64) -> Result<Self> {
        Ok(Self {
            ports,
            told: Told {
                counts: RecordingCounts::default(),
                clock: Clock::compare(),
                mode: None,
                fault: 0,
                pole,
                arm: Thinned::at(FRAMES_HZ),
                pictures: Thinned::at(pictures_hz),
                frames: Gaps::default(),
                pictures_late: 0,
                cycles: Gaps::default(),
            },
        })
    }

    /// Another controller begins: mode and fault are told anew.
    pub fn begin_anew(&mut self) {
        (self.told.mode, self.told.fault) = (None, 0);
    }

    /// Links are placed for an arm with this pole from now on.
    pub fn set_pole(&mut self, pole: Pole) {
        self.told.pole = pole;
    }

    /// Hands what has arrived to the sink; of the camera's frames as many as `pictures`.
    ///
    /// # Errors
    /// Shared memory cannot be read, or those of the sink.
    pub fn turn(&mut self, pictures: usize, sink: &mut impl Sink) -> Result<()> {
        self.drain(sink)?;
        self.pictures(pictures, sink)
    }

    fn drain(&mut self, sink: &mut impl Sink) -> Result<()> {
        let Self { ports, told } = self;
        // The exact recording first: the rest can be made from it.
        if let Some(chunks) = &ports.chunks {
            each(|| Ok(chunks.receive()?), |chunk| told.chunk(&chunk, sink))?;
        }
        each(
            || Ok(ports.cycles.receive()?),
            |cycle| told.cycle(&cycle, sink),
        )?;
        each(
            || Ok(ports.joints.receive()?),
            |report| told.report(&report, sink),
        )?;
        each(
            || Ok(ports.keypoints.receive()?),
            |frame| {
                if !sink.wants(Channel::Keypoints) {
                    return Ok(());
                }
                let at_ns = told.clock.wall_ns(frame.stamp_ns);
                let message = messages::keypoints(at_ns, &frame);
                sink.message(Channel::Keypoints, at_ns, &message)
            },
        )
    }

    /// Takes in frames that have arrived, and compresses `most` of them.
    pub(super) fn pictures(&mut self, most: usize, sink: &mut impl Sink) -> Result<()> {
        let mut compressed = 0;
        for _ in 0..FRAMES_AT_ONCE {
            let Some(frame) = self.ports.frames.receive().context(CANNOT_RECEIVE)? else {
                break;
            };
            compressed += usize::from(self.told.frame(frame.user_header(), &frame, sink)?);
            if compressed >= most {
                break;
            }
        }
        Ok(())
    }

    /// What has been told, without the connections, which stay in their thread.
    pub(super) fn into_told(self) -> Told {
        self.told
    }

    /// The same while it goes on.
    pub(super) fn told(&self) -> &Told {
        &self.told
    }

    /// Sequence number of the frame that comes next.
    #[cfg(test)]
    pub(super) fn next_frame(&self) -> Option<u64> {
        self.told.frames.next
    }
}

/// What has been told so far, and how.
#[derive(Debug)]
pub(super) struct Told {
    counts: RecordingCounts,
    clock: Clock,
    mode: Option<u8>,
    fault: u16,
    pole: Pole,
    arm: Thinned,
    pictures: Thinned,
    frames: Gaps,
    pictures_late: u64,
    cycles: Gaps,
}

/// Tells a line of the log.
fn log(sink: &mut impl Sink, at_ns: u64, level: Level, text: &str) -> Result<()> {
    if !sink.wants(Channel::Log) {
        return Ok(());
    }
    let message = messages::log(at_ns, level, text);
    sink.message(Channel::Log, at_ns, &message)
}

impl Told {
    /// From the run's clock to the wall's.
    pub(super) fn clock(&self) -> Clock {
        self.clock
    }

    /// What became of the exact recording.
    pub(super) const fn counts(&self) -> RecordingCounts {
        self.counts
    }

    /// Cycles that never came, frames that never came, pictures that were left out.
    pub(super) fn lost(&self) -> [(&'static str, u64); 3] {
        [
            ("cycles_lost", self.cycles.lost),
            ("frames_lost", self.frames.lost),
            ("pictures_left_out", self.pictures_late),
        ]
    }

    fn chunk(&mut self, bytes: &[u8], sink: &mut impl Sink) -> Result<()> {
        self.counts.count(bytes);
        sink.chunk(self.clock.now_ns(), bytes)?;
        for read in LogReader::open(bytes).into_iter().flatten() {
            if let Read::Item(Item::Cause(cause)) = read {
                let at_ns = self.clock.wall_ns(cause.stamp_ns);
                if is_orderly_end(&cause) {
                    log(sink, at_ns, Level::Info, ENDED)?;
                } else {
                    log(sink, at_ns, Level::Error, &messages::cause(&cause))?;
                }
            }
        }
        Ok(())
    }

    fn cycle(&mut self, cycle: &CycleRecord, sink: &mut impl Sink) -> Result<()> {
        let at_ns = self.clock.wall_ns(cycle.deadline_ns);
        self.cycles.count(cycle.cycle);
        if sink.wants(Channel::Cycles) {
            sink.message(Channel::Cycles, at_ns, &messages::cycle(at_ns, cycle))?;
        }
        if cycle.sent != 0 && sink.wants(Channel::Commanded) {
            sink.message(
                Channel::Commanded,
                at_ns,
                &messages::commanded(at_ns, cycle),
            )?;
        }
        // Told as what it is when its record comes.
        let ended = self.mode == Some(ControllerMode::Idle as u8)
            && cycle.fault == FaultCode::OperatorStop as u16;
        if ended {
            (self.mode, self.fault) = (Some(cycle.mode), cycle.fault);
        }
        if self.mode != Some(cycle.mode) {
            let now = ControllerMode::from_raw(cycle.mode);
            log(sink, at_ns, Level::Info, &format!("mode {now:?}"))?;
            self.mode = Some(cycle.mode);
        }
        if self.fault != cycle.fault {
            let fault = FaultCode::from_raw(cycle.fault).unwrap_or_default();
            let level = match fault {
                FaultCode::None => Level::Info,
                _ => Level::Error,
            };
            let text = format!("fault {fault:?}: {}", fault.explain());
            log(sink, at_ns, level, &text)?;
            self.fault = cycle.fault;
        }
        Ok(())
    }

    fn report(&mut self, report: &JointReport, sink: &mut impl Sink) -> Result<()> {
        let at_ns = self.clock.wall_ns(report.stamp_ns);
        if sink.wants(Channel::Measured) {
            let message = messages::measured(at_ns, report);
            sink.message(Channel::Measured, at_ns, &message)?;
        }
        if self.arm.takes(report.stamp_ns)
            && sink.wants(Channel::Frames)
            && let Some(frames) = arm_frames(at_ns, &report.q, &self.pole)
        {
            sink.message(Channel::Frames, at_ns, &frames)?;
        }
        Ok(())
    }

    /// Tells a frame; whether it was compressed.
    fn frame(&mut self, header: &FrameHeader, pixels: &[u8], sink: &mut impl Sink) -> Result<bool> {
        self.frames.count(header.sequence);
        if !sink.wants(Channel::Image) || !self.pictures.takes(header.stamp_ns) {
            return Ok(false);
        }
        let at_ns = self.clock.wall_ns(header.stamp_ns);
        if self.clock.now_ns().saturating_sub(at_ns) > PICTURE_LATE_NS {
            self.pictures_late += 1;
            return Ok(false);
        }
        match left_jpeg(header, pixels, 1, QUALITY) {
            Ok(jpeg) => {
                let picture = messages::image(at_ns, &jpeg);
                sink.message(Channel::Image, at_ns, &picture)?;
            }
            Err(reason) => tracing::warn!("a picture is left out: {reason:#}"),
        }
        Ok(true)
    }
}
