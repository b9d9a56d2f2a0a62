//! The camera process: frames from the driver's memory into shared memory.

use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};
use shared_types::ipc::{
    Bus, FRAME_SERVICE, FrameHeader, IpcError, PAYLOAD_VERSION, PIXEL_FORMAT_YUYV,
};

use super::{LiveCamera, LiveError, LiveSettings, PATIENCE};

/// Losses are logged at most every so many frames.
const LOG_EVERY: u64 = 300;

/// Configuration of the process. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// Shared-memory domain.
    pub domain: String,
    /// The camera.
    pub camera: LiveSettings,
}

/// Why the process ended.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// The camera's fault.
    #[error(transparent)]
    Camera(#[from] LiveError),
    /// Shared memory's.
    #[error(transparent)]
    Bus(#[from] IpcError),
}

/// Publishes frames until `stop` is set.
///
/// # Errors
/// The camera cannot be opened or fails; shared memory cannot be used.
pub fn run(config: &CameraConfig, stop: &AtomicBool) -> Result<(), PublishError> {
    let camera = LiveCamera::open(config.camera.clone())?;
    publish(camera, &config.domain, stop)
}

pub(super) fn publish(
    mut camera: LiveCamera,
    domain: &str,
    stop: &AtomicBool,
) -> Result<(), PublishError> {
    let bus = Bus::join(domain)?;
    let [width_px, height_px] = camera.settings().size_px();
    let frame_bytes = camera.settings().frame_bytes();
    let publisher = bus.frame_publisher(frame_bytes)?;
    tracing::info!(domain, device = %camera.settings().device.display(), "the camera runs");
    let mut logged = 0;
    while !stop.load(Ordering::Relaxed) {
        let frame = camera.next(PATIENCE)?;
        let mut sample = publisher
            .loan_slice_uninit(frame_bytes)
            .map_err(IpcError::transfer(FRAME_SERVICE))?;
        *sample.user_header_mut() = FrameHeader {
            version: PAYLOAD_VERSION,
            pixel_format: PIXEL_FORMAT_YUYV,
            sequence: frame.sequence,
            stamp_ns: frame.stamp_ns,
            width_px,
            height_px,
        };
        sample
            .write_from_slice(frame.bytes)
            .send()
            .map_err(IpcError::transfer(FRAME_SERVICE))?;
        let lost = camera.losses();
        if lost.total() > logged && camera.frames().is_multiple_of(LOG_EVERY) {
            tracing::warn!(?lost, frames = camera.frames(), "the camera loses frames");
            logged = lost.total();
        }
    }
    Ok(())
}
