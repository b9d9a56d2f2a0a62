//! The live preview: follows the rope while frames come, and publishes where it is.
//!
//! It looks at the newest frame and lets all others pass. It copies a frame's left image
//! out and gives the frame back before it begins to work, so that it holds none; nothing
//! waits for it. In frames of a motion that began from rest it looks for a hypothesis about
//! the rope, as the tracker of films does, on a thread of its own; once there is one, it
//! simulates that rope under the joints as they are reported. The result is for display
//! only: identification uses the film.

mod arm;
mod step;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use arm_model::Cell;
use serde::{Deserialize, Serialize};
use shared_types::ipc::{
    Bus, FRAME_SERVICE, FrameHeader, FrameSubscriber, IpcError, JOINT_SERVICE, JointSubscriber,
    PIXEL_FORMAT_YUYV, PREVIEW_SERVICE, PreviewFrame, PreviewPublisher, PreviewState,
};

use crate::calib::{CalibError, load_camera};
use crate::frame::ImageFrame;
use crate::track::{TrackError, USUAL_KEYPOINTS};
pub use step::{Answer, Preview, Search};

/// Pause between two looks for a frame.
const TURN: Duration = Duration::from_millis(2);
/// Time without frames after which the camera counts as gone, and between two signs of
/// life then.
const SILENCE: Duration = Duration::from_millis(500);

/// Configuration of the process. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreviewConfig {
    /// Shared-memory domain.
    pub domain: String,
    /// The camera's calibration and extrinsics, `camera.toml`.
    pub camera: PathBuf,
    /// Keypoints per frame, clamp and lead centre included (2 to 32).
    #[serde(default = "usual_keypoints")]
    pub keypoints: usize,
    /// The cell, for its pole.
    #[serde(default)]
    pub cell: Cell,
}

fn usual_keypoints() -> usize {
    USUAL_KEYPOINTS
}

impl PreviewConfig {
    /// The usual one for a camera in a cell.
    #[must_use]
    pub fn new(domain: &str, camera: PathBuf, cell: Cell) -> Self {
        Self {
            domain: domain.to_owned(),
            camera,
            keypoints: USUAL_KEYPOINTS,
            cell,
        }
    }
}

/// Why the preview did not start or did not go on.
#[derive(Debug, thiserror::Error)]
pub enum PreviewError {
    /// Without a calibration nothing can be followed.
    #[error(transparent)]
    Calibration(#[from] CalibError),
    /// Too many or few keypoints.
    #[error(transparent)]
    Keypoints(#[from] TrackError),
    /// Shared memory failed.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The system gives no thread.
    #[error("cannot start the thread that looks for the rope: {0}")]
    Thread(#[source] std::io::Error),
}

/// Runs until `stop` is set.
///
/// # Errors
/// No calibration, a bad number of keypoints, shared memory that cannot be used, or no
/// thread to look for the rope.
pub fn run(config: &PreviewConfig, stop: &AtomicBool) -> Result<(), PreviewError> {
    let camera = load_camera(&config.camera)?;
    let image_px = [camera.width_px, camera.height_px];
    let mut preview = Preview::new(camera, config.cell.pole, config.keypoints)?;
    let bus = Bus::join(&config.domain)?;
    let ports = Ports::open(&bus)?;
    tracing::info!(domain = config.domain, "preview is ready");
    let mut searcher = Searcher::default();
    let (mut received, mut state) = (Instant::now(), None);
    while !stop.load(Ordering::Relaxed) {
        searcher.look_after(&mut preview)?;
        let found = match ports.newest()? {
            Some(Ok(frame)) => {
                received = Instant::now();
                ports.take_joints(&mut preview)?;
                preview.see(frame)
            }
            Some(Err(head)) => {
                received = Instant::now();
                preview.unfit(head.sequence, head.stamp_ns)
            }
            None => {
                // Reports would pile up and be lost.
                ports.take_joints(&mut preview)?;
                if received.elapsed() < SILENCE {
                    thread::sleep(TURN);
                    continue;
                }
                received = Instant::now();
                preview.without_camera()
            }
        };
        if state != Some(found.state()) {
            state = Some(found.state());
            tell(&found, image_px);
        }
        ports.publish(&PreviewFrame {
            took_us: match found.state() {
                PreviewState::NoCamera => 0,
                _ => u32::try_from(received.elapsed().as_micros()).unwrap_or(u32::MAX),
            },
            ..found
        })?;
    }
    Ok(())
}

/// Says in the log what it does or waits for from now on.
fn tell(found: &PreviewFrame, [width_px, height_px]: [u32; 2]) {
    let words = found.state().words();
    match found.state() {
        PreviewState::Unfit => tracing::warn!(
            "{words}: packed YUYV of {}x{height_px} px is expected",
            2 * width_px
        ),
        PreviewState::NoCamera | PreviewState::NoArm => tracing::warn!("{words}"),
        PreviewState::Looking | PreviewState::Following => {
            tracing::info!(frame = found.rope.sequence, "{words}");
        }
    }
}

/// Looks for the rope on one thread, which has this one's priority.
#[derive(Debug, Default)]
struct Searcher(Option<JoinHandle<Answer>>);

impl Searcher {
    /// Brings an answer, and starts the next search that is due.
    fn look_after(&mut self, preview: &mut Preview) -> Result<(), PreviewError> {
        if let Some(thread) = self.0.take_if(|thread| thread.is_finished()) {
            match thread.join() {
                Ok(answer) => preview.take(answer),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        if self.0.is_none()
            && let Some(search) = preview.search()
        {
            let thread = thread::Builder::new().name("search".to_owned());
            let thread = thread.spawn(|| search.run());
            self.0 = Some(thread.map_err(PreviewError::Thread)?);
        }
        Ok(())
    }
}

/// The connections.
struct Ports {
    frames: FrameSubscriber,
    joints: JointSubscriber,
    out: PreviewPublisher,
}

impl Ports {
    fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            out: bus.preview_publisher()?,
            frames: bus.frame_subscriber()?,
            joints: bus.joint_subscriber()?,
        })
    }

    /// The left image of the newest frame, or the header of one that does not fit; all
    /// frames have gone back to the camera then.
    fn newest(&self) -> Result<Option<Result<ImageFrame, FrameHeader>>, IpcError> {
        let failed = IpcError::transfer(FRAME_SERVICE);
        let mut newest = None;
        while let Some(sample) = self.frames.receive().map_err(&failed)? {
            newest = Some(sample);
        }
        Ok(newest.map(|sample| {
            let head = *sample.user_header();
            let size = [head.width_px as usize, head.height_px as usize];
            if head.pixel_format != PIXEL_FORMAT_YUYV {
                return Err(head);
            }
            let yuyv = sample.payload();
            ImageFrame::left_from_yuyv(yuyv, size, head.stamp_ns, head.sequence).map_err(|_e| head)
        }))
    }

    fn take_joints(&self, preview: &mut Preview) -> Result<(), IpcError> {
        let failed = IpcError::transfer(JOINT_SERVICE);
        while let Some(report) = self.joints.receive().map_err(&failed)? {
            preview.report(report.stamp_ns, &report.q);
        }
        Ok(())
    }

    fn publish(&self, found: &PreviewFrame) -> Result<(), IpcError> {
        let sent = self.out.send_copy(*found);
        sent.map_err(IpcError::transfer(PREVIEW_SERVICE))
            .map(|_| ())
    }
}
