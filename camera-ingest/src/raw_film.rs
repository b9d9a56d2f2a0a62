//! A raw film as it is written: packed frames in `NAME_WIDTHxHEIGHT.yuyv`, and a CSV of their
//! times beside it, which `wag track` and `wag score` read.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::whole_file::write_whole;

/// A film that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("film {path}: {}", self.why())]
pub struct FilmError {
    path: PathBuf,
    source: io::Error,
}

impl FilmError {
    fn why(&self) -> String {
        match self.source.kind() {
            io::ErrorKind::AlreadyExists => {
                "is there already, and a film is not replaced: name another".to_owned()
            }
            _ => format!("{} (is there room, and permission?)", self.source),
        }
    }
}

/// A film under way. Both files appear whole or not at all.
pub(crate) struct RawFilm {
    film: PathBuf,
    times: PathBuf,
    part: Unfinished,
    file: BufWriter<File>,
    csv: String,
    frames: u64,
}

impl RawFilm {
    /// Begins `NAME_WIDTHxHEIGHT.yuyv`; the size is that of both images together. One that is
    /// there already is not replaced: what was filmed cannot be repeated.
    pub(crate) fn create(
        name: &Path,
        [width_px, height_px]: [usize; 2],
    ) -> Result<Self, FilmError> {
        let with = |ending: &str| {
            let mut path = name.as_os_str().to_owned();
            path.push(format!("_{width_px}x{height_px}.{ending}"));
            PathBuf::from(path)
        };
        let (film, times) = (with("yuyv"), with("csv"));
        for there in [&film, &times] {
            if there.try_exists().unwrap_or(true) {
                return Err(cannot(there)(io::ErrorKind::AlreadyExists.into()));
            }
        }
        let part = Unfinished(with("yuyv.part"));
        let file = File::create(&part.0).map_err(cannot(&part.0))?;
        Ok(Self {
            film,
            times,
            part,
            file: BufWriter::new(file),
            csv: "frame,sequence,monotonic_ns\n".to_owned(),
            frames: 0,
        })
    }

    /// Adds a frame of packed YUYV.
    pub(crate) fn push(
        &mut self,
        yuyv: &[u8],
        sequence: u64,
        stamp_ns: u64,
    ) -> Result<(), FilmError> {
        let written = self.file.write_all(yuyv);
        written.map_err(cannot(&self.part.0))?;
        let row = format!("{},{sequence},{stamp_ns}\n", self.frames);
        self.csv.push_str(&row);
        self.frames += 1;
        Ok(())
    }

    /// Both files: frames and times.
    pub(crate) fn finish(mut self) -> Result<(PathBuf, PathBuf), FilmError> {
        self.file.flush().map_err(cannot(&self.part.0))?;
        drop(self.file);
        // The times go first: a film without them is refused, times without a film do no harm.
        write_whole(&self.times, self.csv.as_bytes()).map_err(cannot(&self.times))?;
        std::fs::rename(&self.part.0, &self.film).map_err(cannot(&self.film))?;
        Ok((self.film, self.times))
    }
}

fn cannot(path: &Path) -> impl Fn(io::Error) -> FilmError {
    let path = path.to_owned();
    move |source| FilmError {
        path: path.clone(),
        source,
    }
}

/// A file that goes away unless it was renamed.
struct Unfinished(PathBuf);

impl Drop for Unfinished {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
