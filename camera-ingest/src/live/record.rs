//! A stretch of a camera's frames as a raw file that `wag track` and `wag score` read.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::raw_film::{FilmError, RawFilm};

use super::{LiveCamera, LiveError, Losses, PATIENCE};

/// What was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// The raw frames, `NAME_WIDTHxHEIGHT.yuyv`.
    pub film: PathBuf,
    /// Their times, the same name with `.csv`.
    pub times: PathBuf,
    /// Frames written.
    pub frames: u64,
    /// Frames lost meanwhile.
    pub losses: Losses,
}

/// Why nothing was recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The camera's fault.
    #[error(transparent)]
    Camera(#[from] LiveError),
    /// The file's.
    #[error(transparent)]
    File(#[from] FilmError),
    /// It was stopped.
    #[error("stopped after {0} frames; nothing was written")]
    Stopped(u64),
}

/// Records `frames` frames of a camera as `NAME_WIDTHxHEIGHT.yuyv` and a CSV of times
/// beside it. Both appear whole or not at all. A disk that is too slow costs frames,
/// which are counted. `progress` gets the number of frames so far.
///
/// # Errors
/// The camera fails, the files cannot be written, or `stop` was set.
pub fn record(
    camera: &mut LiveCamera,
    frames: u64,
    name: &Path,
    stop: &AtomicBool,
    mut progress: impl FnMut(u64),
) -> Result<Recorded, RecordError> {
    let size_px = camera.settings().size_px().map(|px| px as usize);
    let before = camera.losses();
    let mut raw = RawFilm::create(name, size_px)?;
    for index in 0..frames {
        if stop.load(Ordering::Relaxed) {
            return Err(RecordError::Stopped(index));
        }
        let frame = camera.next(PATIENCE)?;
        raw.push(frame.bytes, frame.sequence, frame.stamp_ns)?;
        progress(index + 1);
    }
    let (film, times) = raw.finish()?;
    Ok(Recorded {
        film,
        times,
        frames,
        losses: camera.losses().since(before),
    })
}
