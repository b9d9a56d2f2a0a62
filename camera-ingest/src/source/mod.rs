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

pub use avi::AviSource;
pub use error::SourceError;
pub use frames::{AnySource, BothEyes, FrameSource, StereoSource, read_film, read_left};
pub use images::ImageSource;
pub use yuyv::YuyvSource;

/// Opens a recording by what it is: a folder with `video.avi` and perhaps
/// `timestamps.csv`, a folder of pictures ([`ImageSource`]), a raw file
/// `NAME_WIDTHxHEIGHT.yuyv` ([`YuyvSource`]), or else an AVI file.
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
        return Err(SourceError::Container {
            path: path.to_owned(),
            reason: "it is a device, not a recording".to_owned(),
            remedy: "record a camera first, with `wag film`",
        });
    }
    if let Some(path) = run_file(path) {
        return Err(SourceError::Container {
            path,
            reason: "it is a run's file, which holds the left image only".to_owned(),
            remedy: "use the recording of both images; `wag track` and `wag identify` take a \
                     run's file",
        });
    }
    if path.is_dir() {
        let video = path.join("video.avi");
        if !video.exists() {
            return Ok(Box::new(ImageSource::open(path, rate_hz)?));
        }
        let csv = path.join("timestamps.csv");
        if !csv.exists() {
            return open_film(&video, rate_hz);
        }
        if let Some(hz) = rate_hz {
            return Err(SourceError::Times {
                path: video,
                reason: stamps::twice(&csv, hz),
            });
        }
        return Ok(Box::new(AviSource::open(&video, Some(&csv))?));
    }
    let raw = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("yuyv"));
    if raw {
        return Ok(Box::new(YuyvSource::open_named(path, rate_hz)?));
    }
    // Its times count as much when it is named itself as when its folder is.
    let csv = path.with_file_name("timestamps.csv");
    if rate_hz.is_none() && path.ends_with("video.avi") && csv.exists() {
        return Ok(Box::new(AviSource::open(path, Some(&csv))?));
    }
    open_film(path, rate_hz)
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

fn open_film(path: &Path, rate_hz: Option<f64>) -> Result<Box<dyn StereoSource>, SourceError> {
    let film = AviSource::open(path, None)?;
    Ok(Box::new(match rate_hz {
        Some(hz) => film.at_rate(hz),
        None => film,
    }))
}
