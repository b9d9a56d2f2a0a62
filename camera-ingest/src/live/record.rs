//! A stretch of a camera's frames as a raw file that `wag track` and `wag score` read.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::whole_file::write_whole;

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
    #[error("film {0}: {1} (is there room, and permission?)")]
    File(PathBuf, io::Error),
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
    let [width_px, height_px] = camera.settings().size_px();
    let with = |ending: &str| {
        let mut path = name.as_os_str().to_owned();
        path.push(format!("_{width_px}x{height_px}.{ending}"));
        PathBuf::from(path)
    };
    let (film, times) = (with("yuyv"), with("csv"));
    let part = Unfinished(with("yuyv.part"));
    let failed = |path: &Path, source| RecordError::File(path.to_owned(), source);
    let before = camera.losses();
    let mut csv = "frame,sequence,monotonic_ns\n".to_owned();
    let file = File::create(&part.0).map_err(|e| failed(&part.0, e))?;
    let mut file = BufWriter::new(file);
    for index in 0..frames {
        if stop.load(Ordering::Relaxed) {
            return Err(RecordError::Stopped(index));
        }
        let frame = camera.next(PATIENCE)?;
        file.write_all(frame.bytes)
            .map_err(|e| failed(&part.0, e))?;
        csv.push_str(&format!("{index},{},{}\n", frame.sequence, frame.stamp_ns));
        progress(index + 1);
    }
    file.flush().map_err(|e| failed(&part.0, e))?;
    drop(file);
    // The times go first: a film without them is refused, times without a film do no harm.
    write_whole(&times, csv.as_bytes()).map_err(|e| failed(&times, e))?;
    std::fs::rename(&part.0, &film).map_err(|e| failed(&film, e))?;
    Ok(Recorded {
        film,
        times,
        frames,
        losses: camera.losses().since(before),
    })
}

/// A file that goes away unless it was renamed.
struct Unfinished(PathBuf);

impl Drop for Unfinished {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
