//! Why a fault script is refused.

use std::path::{Path, PathBuf};

/// Why a fault script is refused.
#[derive(Debug, thiserror::Error)]
pub enum FaultScriptError {
    /// The file cannot be read.
    #[error("cannot read the fault script {path}", path = .path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something about one file.
    #[error("fault script {path}: {error}", path = .path.display())]
    InFile {
        /// File.
        path: PathBuf,
        /// What is wrong.
        error: Box<FaultScriptError>,
    },
    /// No TOML.
    #[error("not valid TOML: {0}")]
    Toml(String),
    /// Something else than a list of faults at the top.
    #[error("`{key}` at the top; a script is a list of [[fault]] and nothing else")]
    Top {
        /// Key found.
        key: String,
    },
    /// A field that is needed is missing.
    #[error("fault {entry}: `{field}` is missing; give {allowed}")]
    Missing {
        /// Entry, from 1.
        entry: usize,
        /// Field.
        field: &'static str,
        /// What may stand there.
        allowed: String,
    },
    /// A field has a value that is not allowed.
    #[error("fault {entry}: `{field}` is {found}; allowed is {allowed}")]
    Value {
        /// Entry, from 1.
        entry: usize,
        /// Field.
        field: &'static str,
        /// What stands there.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A field that means nothing there.
    #[error("fault {entry}: `{field}` means nothing for `{kind}`; possible are {allowed}")]
    Unknown {
        /// Entry, from 1.
        entry: usize,
        /// Field.
        field: String,
        /// Kind of the fault.
        kind: &'static str,
        /// Fields that mean something.
        allowed: String,
    },
}

impl FaultScriptError {
    pub(super) fn in_file(self, path: &Path) -> Self {
        Self::InFile {
            path: path.to_owned(),
            error: Box::new(self),
        }
    }
}
