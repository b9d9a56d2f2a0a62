//! The process that writes the file: it subscribes, writes what comes, and finishes
//! the file when it is told to end or its parent is gone.

use super::counts::RecordingCounts;
use super::feed::{FRAMES_AT_ONCE, Feed, StandingScene, Told};
use super::film::{AHEAD, CAMERA};
use super::results::{Results, SimulateRope};
use super::urdf::urdf;
use super::writer::McapFile;
use crate::files;
use anyhow::{Result, ensure};
use arm_model::{Cell, Limits};
use serde::{Deserialize, Serialize};
use shared_types::StereoCamera;
use shared_types::ipc::Bus;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Pause between two looks.
const TURN: Duration = Duration::from_millis(10);
/// Pause between two looks at the run folder.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Below everything that moves an arm.
const NICE: i32 = 5;
/// Pictures compressed before everything else is looked at again.
const PICTURES_AT_ONCE: usize = 1;
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

/// A recording under way.
struct Recording {
    file: McapFile,
    feed: Feed,
}

impl Recording {
    fn begin(config: &RecorderConfig, bus: &Bus) -> Result<Self> {
        // Connected before the file appears, which tells the parent that nothing is missed from
        // here on.
        let pole = config.cell.pole;
        let feed = Feed::with_recording(bus, pole, config.pictures_hz)?;
        let clock = feed.told().clock();
        let mut file = McapFile::create(&config.file)?;
        file.metadata(
            AHEAD[0],
            &[
                ("version", shared_types::VERSION.to_owned()),
                ("domain", config.domain.clone()),
                (AHEAD[1], clock.ahead_ns.to_string()),
                ("pictures_hz", config.pictures_hz.to_string()),
            ],
        )?;
        let arm = urdf(&config.limits, &pole);
        file.attach(
            clock.now_ns(),
            "robot.urdf",
            "application/xml",
            arm.as_bytes(),
        )?;
        if let Some(camera) = &config.camera {
            let text = serde_json::to_string(camera)?;
            file.metadata(CAMERA[0], &[(CAMERA[1], text)])?;
        }
        let scene = StandingScene {
            pole,
            target_m: config.target_m,
            camera: config.camera.clone(),
        };
        scene.tell(&mut file)?;
        Ok(Self { file, feed })
    }

    /// Takes in what has arrived; of the camera's frames as many as `pictures`.
    fn turn(&mut self, pictures: usize) -> Result<()> {
        self.feed.turn(pictures, &mut self.file)
    }
}

/// A recording that has ended; everything that came is in the file, which can be read.
pub struct Recorded {
    file: McapFile,
    told: Told,
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
        self.told.counts()
    }

    /// Finishes the file with the run's results, and the rope that `simulate` makes of them.
    pub fn finish(self, simulate: SimulateRope) -> Result<()> {
        let Self {
            mut file,
            told,
            mut results,
        } = self;
        let clock = told.clock();
        results.look(&mut file, clock)?;
        results.simulate(&mut file, clock, simulate)?;
        let counts = told.counts();
        let chunks = [
            ("chunks", counts.chunks),
            ("chunks_lost", counts.lost_chunks),
        ];
        let lost = chunks.into_iter().chain(told.lost());
        let lost: Vec<_> = lost.map(|(name, n)| (name, n.to_string())).collect();
        file.metadata("recorder", &lost)?;
        file.finish()
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
    let mut recording = Recording::begin(config, &bus)?;
    let mut results = Results::of(&config.run);
    let mut looked = Instant::now();
    loop {
        // Looked at before draining: what came before the request to stop is kept.
        let last = stop.load(Ordering::SeqCst);
        recording.turn(if last {
            FRAMES_AT_ONCE
        } else {
            PICTURES_AT_ONCE
        })?;
        if last {
            recording.file.flush()?;
            return Ok(Recorded {
                file: recording.file,
                told: recording.feed.into_told(),
                results,
            });
        }
        if looked.elapsed() >= LOOK_EVERY {
            results.look(&mut recording.file, recording.feed.told().clock())?;
            looked = Instant::now();
        }
        recording.file.turn()?;
        std::thread::sleep(TURN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::{DomainSweep, FrameHeader, PAYLOAD_VERSION, PIXEL_FORMAT_YUYV};

    #[test]
    fn frames_that_never_end_do_not_keep_it_from_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        let domain = format!("pictures-{}", std::process::id());
        let _sweep = DomainSweep::new(&domain);
        let bus = Bus::join(&domain).unwrap();
        let camera = bus.frame_publisher(64 * 16 * 2).unwrap();
        let config =
            RecorderConfig::of_run(&domain, folder.path(), &Limits::default(), Cell::default());
        let mut recording = Recording::begin(&config, &bus).unwrap();
        // Far in the future, so that none of them is late.
        let begin_ns = recording.feed.told().clock().now_ns();
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
        let Recording { feed, file } = &mut recording;
        feed.pictures(1, file).unwrap();
        assert_eq!(feed.next_frame(), Some(1), "one, then the rest");
        feed.pictures(FRAMES_AT_ONCE, file).unwrap();
        assert_eq!(feed.next_frame(), Some(8));
    }
}
