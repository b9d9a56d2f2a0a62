//! Why a recording or a file of a run cannot be read or written.

use rt_controller::recording::LogError;
use shared_types::ipc::IpcError;
use shared_types::rope::RopeError;
use std::io;
use std::path::{Path, PathBuf};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong; each text names the file and, where there is one, the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system does not let the file be read.
    #[error("cannot read `{}`; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The system does not let the file be written.
    #[error("cannot write `{}`; check that its folder exists and is writable", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// There is no such run.
    #[error(
        "`{}` does not exist; name a run folder as made by wag demo, throw, wiggle or record",
        .0.display()
    )]
    NoRun(PathBuf),
    /// A folder or a file without a recording.
    #[error(
        "`{}` is no run folder or file with recorded control cycles: {} (of older versions {}) \
         is not there, or its recorder died before it wrote any",
        .0.display(), crate::files::RUN, crate::files::CYCLES
    )]
    NoRecording(PathBuf),
    /// Something else than an MCAP file.
    #[error("this is no MCAP file: it does not begin like one")]
    NotMcap,
    /// An MCAP file of another program.
    #[error("the MCAP file holds no channel `{0}`: it was not recorded by this program")]
    NoChannel(&'static str),
    /// The run's film does not show what is asked for.
    #[error("run file `{}`: {problem}", path.display())]
    Film {
        /// The run's file.
        path: PathBuf,
        /// What is missing.
        problem: String,
    },
    /// A picture that cannot be stored or read.
    #[error("{0}")]
    Picture(String),
    /// A table whose contents are wrong; the text names line and column.
    #[error("`{}`{problem}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// What to record cannot be recorded as asked.
    #[error("{0}")]
    Recorder(String),
    /// The exact recording of the control cycles cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The MCAP library.
    #[error(transparent)]
    Mcap(#[from] mcap::McapError),
    /// JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// TOML read.
    #[error(transparent)]
    Toml(#[from] toml::de::Error),
    /// TOML written.
    #[error(transparent)]
    ToToml(#[from] toml::ser::Error),
    /// A rope's parameters are out of range.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// Text that cannot be put together.
    #[error(transparent)]
    Text(#[from] std::fmt::Error),
    /// CSV.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// An error with the place where it was met.
    #[error("{what}")]
    At {
        /// The place.
        what: String,
        /// The error.
        source: Box<Error>,
    },
}

impl Error {
    /// A failure to read `path`.
    pub(crate) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        |source| Self::Read {
            path: path.to_owned(),
            source,
        }
    }

    /// A failure to write `path`.
    pub(crate) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        |source| Self::Write {
            path: path.to_owned(),
            source,
        }
    }
}

/// Says where an error was met.
pub(crate) trait At<T> {
    /// Adds the place.
    fn at<S: Into<String>>(self, what: impl FnOnce() -> S) -> Result<T>;
}

impl<T, E: Into<Error>> At<T> for std::result::Result<T, E> {
    fn at<S: Into<String>>(self, what: impl FnOnce() -> S) -> Result<T> {
        self.map_err(|error| Error::At {
            what: what().into(),
            source: Box::new(error.into()),
        })
    }
}
