//! Recordings as sources of frames.
//!
//! Every source is randomly accessible, because each frame of the formats read
//! here stands for itself; the tracker uses that to look at frames spread over
//! the whole recording before it starts.

mod avi;
mod error;
mod frames;
mod images;
mod stamps;
mod stored;
mod yuyv;

use std::io::Read;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

pub use error::SourceError;
pub use frames::{AnySource, BothImages, FrameSource, StereoSource, read_film};

/// Opens a recording by what it is: a folder with `video.avi` and perhaps
/// `timestamps.csv`, a folder of side-by-side pictures in the order of their names, a raw
/// file `NAME_WIDTHxHEIGHT.yuyv`, or else an AVI file.
///
/// `rate_hz` is the frame rate of a recording without times; of an AVI it takes the
/// place of the header's. It must be positive.
///
/// # Errors
/// A file is missing, truncated or of another kind, or a run's file, which has the left image
/// only; the frame times are unknown, or given both by a CSV and by `rate_hz`.
pub fn open_video(path: &Path, rate_hz: Option<f64>) -> Result<Box<dyn StereoSource>, SourceError> {
    let device = |m: std::fs::Metadata| m.file_type().is_char_device();
    if std::fs::metadata(path).is_ok_and(device) {
        let reason = "it is a device, not a recording; record a camera first, with `wag film`";
        return Err(SourceError::video(path, reason));
    }
    if let Some(path) = run_file(path) {
        let reason = "it is a run's file, which holds the left image only; use the recording of \
                      both images; `wag track` and `wag identify` take a run's file";
        return Err(SourceError::video(&path, reason));
    }
    let raw = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("yuyv"));
    Ok(Box::new(if path.is_dir() {
        let (video, csv) = (path.join("video.avi"), path.join("timestamps.csv"));
        match rate_hz {
            _ if !video.exists() => images::open(path, rate_hz)?,
            Some(hz) if csv.exists() => return Err(stamps::twice(&video, &csv, hz)),
            _ => avi::open(&video, csv.exists().then_some(csv.as_path()), rate_hz)?,
        }
    } else if raw {
        yuyv::open(path, rate_hz)?
    } else {
        // Its times count as much when it is named itself as when its folder is.
        let csv = path.with_file_name("timestamps.csv");
        let timed = rate_hz.is_none() && path.ends_with("video.avi") && csv.exists();
        avi::open(path, timed.then_some(csv.as_path()), rate_hz)?
    }))
}

/// The run's file (MCAP) that a path names, or that lies in a folder without any video.
#[must_use]
pub fn run_file(path: &Path) -> Option<PathBuf> {
    const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
    let path = match path.is_dir() {
        true if path.join("video.avi").exists() => return None,
        true => path.join("run.mcap"),
        false => path.to_owned(),
    };
    // Reading from a device would begin to film.
    if !path.is_file() {
        return None;
    }
    let mut front = [0; MAGIC.len()];
    let mut file = std::fs::File::open(&path).ok()?;
    file.read_exact(&mut front).ok()?;
    (front == *MAGIC).then_some(path)
}
