//! The process that writes the file: it subscribes, writes what comes, and finishes
//! the file when it is told to end or its parent is gone.

use super::channel::Channel;
use super::clock::{Clock, Thinned};
use super::counts::{Gaps, RecordingCounts};
use super::film::{AHEAD, CAMERA};
use super::image::left_jpeg;
use super::messages::{self, Level};
use super::results::{Results, SimulateRope};
use super::scene::{arm_frames, calibration, camera_place, room};
use super::urdf::urdf;
use super::writer::McapFile;
use crate::explanation::is_orderly_end;
use crate::files;
use anyhow::{Context, Result, ensure};
use arm_model::{Cell, Limits, Pole};
use rt_controller::recording::{Item, LogReader, Read};
use serde::{Deserialize, Serialize};
use serde_json::json;
use shared_types::ipc::{
    Bus, ChunkSubscriber, ControllerMode, CycleRecord, CycleSubscriber, FrameHeader,
    FrameSubscriber, JointReport, JointSubscriber, KeypointSubscriber,
};
use shared_types::{FaultCode, StereoCamera};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Pause between two looks.
const TURN: Duration = Duration::from_millis(10);
/// Pause between two looks at the run folder.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Below everything that moves an arm.
const NICE: i32 = 5;
/// As much as waits for a subscriber at most.
const BUFFER: usize = 1024;
/// A picture that is older is left out, so that a machine that is too slow for all of
/// it records everything else.
const PICTURE_LATE_NS: u64 = 150_000_000;
/// Frames looked at, and pictures compressed, before everything else is looked at again:
/// while a slow machine compresses one picture the next frame comes, without end.
const FRAMES_AT_ONCE: usize = 16;
const PICTURES_AT_ONCE: usize = 1;
/// Frames of the arm's links per second.
const FRAMES_HZ: f64 = 50.0;

/// Quality of the pictures as JPEG. They are the left eye's: the rope is tracked in it, and
/// the right eye would double the file.
const QUALITY: u8 = 75;
/// Most pictures a second in the recording of a run: half of what the camera gives,
/// because each costs milliseconds of a core.
const PICTURES_HZ: f64 = 30.0;

/// What to record, and into what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecorderConfig {
    /// Shared-memory domain.
    pub domain: String,
    /// The file; it must not exist.
    pub file: PathBuf,
    /// Run folder whose results are taken in.
    pub run: PathBuf,
    /// Most pictures a second; each takes milliseconds to compress.
    pub pictures_hz: f64,
    /// Target (m).
    pub target_m: Option<[f64; 3]>,
    /// Limits of the arm.
    pub limits: Limits,
    /// The cell, for its pole.
    #[serde(default)]
    pub cell: Cell,
    /// The camera, where there is one.
    pub camera: Option<StereoCamera>,
}

impl RecorderConfig {
    /// Records the run of a folder; the camera and the target are told in it where they
    /// are known.
    pub fn of_run(domain: &str, run: &Path, limits: &Limits, cell: Cell) -> Self {
        Self {
            domain: domain.to_owned(),
            file: run.join(files::RUN),
            run: run.to_owned(),
            pictures_hz: PICTURES_HZ,
            target_m: None,
            limits: limits.clone(),
            cell,
            camera: None,
        }
    }
}

/// Connections to everything worth keeping.
struct Ports {
    chunks: ChunkSubscriber,
    cycles: CycleSubscriber,
    joints: JointSubscriber,
    keypoints: KeypointSubscriber,
    frames: FrameSubscriber,
}

impl Ports {
    fn open(bus: &Bus) -> Result<Self> {
        Ok(Self {
            chunks: bus.chunk_subscriber()?,
            cycles: bus.cycle_subscriber()?,
            joints: bus.joint_subscriber()?,
            keypoints: bus.keypoint_subscriber()?,
            frames: bus.frame_subscriber()?,
        })
    }
}

/// What the end of a session looks like to the loop, and a stop by its operator then.
const ENDED: &str = "commanded to stop while the arm was at rest";
const CANNOT_RECEIVE: &str = "cannot receive from shared memory";

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

/// A recording under way.
struct Recording {
    file: McapFile,
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

impl Recording {
    fn begin(config: &RecorderConfig) -> Result<Self> {
        let clock = Clock::compare();
        let mut file = McapFile::create(&config.file)?;
        let at_ns = clock.now_ns();
        file.metadata(
            AHEAD[0],
            &[
                ("version", shared_types::VERSION.to_owned()),
                ("domain", config.domain.clone()),
                (AHEAD[1], clock.ahead_ns.to_string()),
                ("pictures_hz", config.pictures_hz.to_string()),
            ],
        )?;
        let arm = urdf(&config.limits, &config.cell.pole);
        file.attach(at_ns, "robot.urdf", "application/xml", arm.as_bytes())?;
        let room = room(at_ns, &config.cell.pole, config.target_m);
        file.json(Channel::Scene, at_ns, &room)?;
        if let Some(camera) = &config.camera {
            let text = serde_json::to_string(camera)?;
            file.metadata(CAMERA[0], &[(CAMERA[1], text)])?;
            let sees = calibration(at_ns, camera);
            file.json(Channel::Calibration, at_ns, &sees)?;
            let stands = json!({ "transforms": [camera_place(at_ns, camera)] });
            file.json(Channel::Frames, at_ns, &stands)?;
        }
        Ok(Self {
            file,
            counts: RecordingCounts::default(),
            clock,
            mode: None,
            fault: 0,
            pole: config.cell.pole,
            arm: Thinned::at(FRAMES_HZ),
            pictures: Thinned::at(config.pictures_hz),
            frames: Gaps::default(),
            pictures_late: 0,
            cycles: Gaps::default(),
        })
    }

    /// Takes in what has arrived.
    fn drain(&mut self, ports: &Ports) -> Result<()> {
        // The exact recording first: the rest can be made from it.
        each(|| Ok(ports.chunks.receive()?), |chunk| self.chunk(&chunk))?;
        each(|| Ok(ports.cycles.receive()?), |cycle| self.cycle(&cycle))?;
        each(
            || Ok(ports.joints.receive()?),
            |report| self.report(&report),
        )?;
        each(
            || Ok(ports.keypoints.receive()?),
            |frame| {
                let at_ns = self.clock.wall_ns(frame.stamp_ns);
                let message = messages::keypoints(at_ns, &frame);
                self.file.json(Channel::Keypoints, at_ns, &message)
            },
        )
    }

    /// Takes in frames that have arrived, and compresses `most` of them.
    fn pictures(&mut self, ports: &Ports, most: usize) -> Result<()> {
        let mut compressed = 0;
        for _ in 0..FRAMES_AT_ONCE {
            let Some(frame) = ports.frames.receive().context(CANNOT_RECEIVE)? else {
                break;
            };
            compressed += usize::from(self.frame(frame.user_header(), &frame)?);
            if compressed >= most {
                break;
            }
        }
        Ok(())
    }

    fn log(&mut self, at_ns: u64, level: Level, text: &str) -> Result<()> {
        let message = messages::log(at_ns, level, text);
        self.file.json(Channel::Log, at_ns, &message)
    }

    fn chunk(&mut self, bytes: &[u8]) -> Result<()> {
        self.counts.count(bytes);
        self.file
            .bytes(Channel::Replay, self.clock.now_ns(), bytes)?;
        for read in LogReader::open(bytes).into_iter().flatten() {
            if let Read::Item(Item::Cause(cause)) = read {
                let at_ns = self.clock.wall_ns(cause.stamp_ns);
                if is_orderly_end(&cause) {
                    self.log(at_ns, Level::Info, ENDED)?;
                } else {
                    self.log(at_ns, Level::Error, &messages::cause(&cause))?;
                }
            }
        }
        Ok(())
    }

    fn cycle(&mut self, cycle: &CycleRecord) -> Result<()> {
        let at_ns = self.clock.wall_ns(cycle.deadline_ns);
        self.cycles.count(cycle.cycle);
        self.file
            .json(Channel::Cycles, at_ns, &messages::cycle(at_ns, cycle))?;
        if cycle.sent != 0 {
            let message = messages::commanded(at_ns, cycle);
            self.file.json(Channel::Commanded, at_ns, &message)?;
        }
        // Told as what it is when its record comes.
        let ended = self.mode == Some(ControllerMode::Idle as u8)
            && cycle.fault == FaultCode::OperatorStop as u16;
        if ended {
            (self.mode, self.fault) = (Some(cycle.mode), cycle.fault);
        }
        if self.mode != Some(cycle.mode) {
            let now = ControllerMode::from_raw(cycle.mode);
            self.log(at_ns, Level::Info, &format!("mode {now:?}"))?;
            self.mode = Some(cycle.mode);
        }
        if self.fault != cycle.fault {
            let fault = FaultCode::from_raw(cycle.fault).unwrap_or_default();
            let level = match fault {
                FaultCode::None => Level::Info,
                _ => Level::Error,
            };
            let text = format!("fault {fault:?}: {}", fault.explain());
            self.log(at_ns, level, &text)?;
            self.fault = cycle.fault;
        }
        Ok(())
    }

    fn report(&mut self, report: &JointReport) -> Result<()> {
        let at_ns = self.clock.wall_ns(report.stamp_ns);
        self.file
            .json(Channel::Measured, at_ns, &messages::measured(at_ns, report))?;
        if self.arm.takes(report.stamp_ns)
            && let Some(frames) = arm_frames(at_ns, &report.q, &self.pole)
        {
            self.file.json(Channel::Frames, at_ns, &frames)?;
        }
        Ok(())
    }

    /// Records a frame; whether it was compressed.
    fn frame(&mut self, header: &FrameHeader, pixels: &[u8]) -> Result<bool> {
        self.frames.count(header.sequence);
        if !self.pictures.takes(header.stamp_ns) {
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
                self.file.json(Channel::Image, at_ns, &picture)?;
            }
            Err(reason) => tracing::warn!("a picture is not recorded: {reason:#}"),
        }
        Ok(true)
    }
}

/// A recording that has ended; everything that came is in the file, which can be read.
pub struct Recorded {
    recording: Recording,
    results: Results,
}

impl std::fmt::Debug for Recorded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Recorded").field(&self.counts()).finish()
    }
}

impl Recorded {
    /// What became of the exact recording.
    pub const fn counts(&self) -> RecordingCounts {
        self.recording.counts
    }

    /// Finishes the file with the run's results, and the rope that `simulate` makes of them.
    pub fn finish(self, simulate: SimulateRope) -> Result<()> {
        let (mut recording, mut results) = (self.recording, self.results);
        results.look(&mut recording.file, recording.clock)?;
        results.simulate(&mut recording.file, recording.clock, simulate)?;
        let counts = recording.counts;
        recording.file.metadata(
            "recorder",
            &[
                ("chunks", counts.chunks.to_string()),
                ("chunks_lost", counts.lost_chunks.to_string()),
                ("cycles_lost", recording.cycles.lost.to_string()),
                ("frames_lost", recording.frames.lost.to_string()),
                ("pictures_left_out", recording.pictures_late.to_string()),
            ],
        )?;
        recording.file.finish()
    }
}

/// Records until `stop` is set; then finishes the file, with the rope that `simulate`
/// makes of the run's results.
///
/// # Errors
/// Shared memory cannot be joined, or the disk takes nothing any more; what is in the file
/// by then can be recovered.
pub fn run(config: &RecorderConfig, simulate: SimulateRope, stop: &AtomicBool) -> Result<()> {
    listen(config, stop)?.finish(simulate)
}

/// Records until `stop` is set; fails as [`run`] does.
pub(super) fn listen(config: &RecorderConfig, stop: &AtomicBool) -> Result<Recorded> {
    if let Err(reason) = rustix::process::nice(NICE) {
        tracing::warn!(%reason, "the recorder runs with ordinary priority");
    }
    let rate_hz = config.pictures_hz;
    ensure!(
        rate_hz.is_finite() && rate_hz > 0.0,
        "pictures_hz must be a number above zero, found {rate_hz}"
    );
    let bus = Bus::join(&config.domain)?;
    let ports = Ports::open(&bus)?;
    // Its appearance tells the parent that nothing is missed from here on.
    let mut recording = Recording::begin(config)?;
    let mut results = Results::of(&config.run);
    let mut looked = Instant::now();
    loop {
        // Looked at before draining: what came before the request to stop is kept.
        let last = stop.load(Ordering::SeqCst);
        recording.drain(&ports)?;
        let most = if last {
            FRAMES_AT_ONCE
        } else {
            PICTURES_AT_ONCE
        };
        recording.pictures(&ports, most)?;
        if last {
            recording.file.flush()?;
            return Ok(Recorded { recording, results });
        }
        if looked.elapsed() >= LOOK_EVERY {
            results.look(&mut recording.file, recording.clock)?;
            looked = Instant::now();
        }
        recording.file.turn()?;
        std::thread::sleep(TURN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::{DomainSweep, PAYLOAD_VERSION, PIXEL_FORMAT_YUYV};

    #[test]
    fn frames_that_never_end_do_not_keep_it_from_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        let domain = format!("pictures-{}", std::process::id());
        let _sweep = DomainSweep::new(&domain);
        let bus = Bus::join(&domain).unwrap();
        let camera = bus.frame_publisher(64 * 16 * 2).unwrap();
        let ports = Ports::open(&bus).unwrap();
        let config =
            RecorderConfig::of_run(&domain, folder.path(), &Limits::default(), Cell::default());
        let mut recording = Recording::begin(&config).unwrap();
        // Far in the future, so that none of them is late.
        let begin_ns = recording.clock.now_ns();
        let mut sequence = 0;
        // As many as come while a slow machine compresses: there is always one more.
        let mut send = || {
            let mut frame = camera.loan_slice(64 * 16 * 2).unwrap();
            *frame.user_header_mut() = FrameHeader {
                version: PAYLOAD_VERSION,
                pixel_format: PIXEL_FORMAT_YUYV,
                sequence,
                stamp_ns: begin_ns + sequence * 100_000_000,
                width_px: 64,
                height_px: 16,
            };
            frame.send().unwrap();
            sequence += 1;
        };
        for _ in 0..8 {
            send();
        }
        recording.pictures(&ports, 1).unwrap();
        assert_eq!(recording.frames.next, Some(1), "one, then the rest");
        recording.pictures(&ports, FRAMES_AT_ONCE).unwrap();
        assert_eq!(recording.frames.next, Some(8));
    }
}
