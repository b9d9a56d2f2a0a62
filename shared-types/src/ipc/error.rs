//! What can go wrong where processes meet.

use std::fmt::{Debug, Display};
use std::path::Path;

/// Why shared memory could not be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IpcError {
    /// The domain name cannot be part of a file name.
    #[error("shared-memory domain `{0}` must be 1 to 40 letters, digits, `-` or `_`")]
    Domain(String),
    /// Shared memory cannot be joined, a message not be sent or received, or nobody answered
    /// in time.
    #[error("{0}")]
    Failed(String),
    /// A service could not be opened.
    #[error(
        "cannot open shared-memory service `{service}`: {reason}; all processes must run as the same user and be of the same version"
    )]
    Open {
        /// Service name.
        service: &'static str,
        /// What the library said.
        reason: String,
    },
    /// A message could not be understood.
    #[error("a message on `{service}` is damaged or of another version: {reason}")]
    Message {
        /// Service name.
        service: &'static str,
        /// What was wrong.
        reason: String,
    },
    /// The other end is gone.
    #[error("the process behind `{service}` is not there any more")]
    Gone {
        /// Service name.
        service: &'static str,
    },
}

impl IpcError {
    /// Why the folder in which this user's processes meet cannot be used.
    pub(super) fn folder(folder: &Path, reason: impl Display) -> Self {
        Self::Failed(format!(
            "cannot use `{}`, where the processes of one user meet: {reason}; remove it or have it removed",
            folder.display()
        ))
    }

    /// What the library said about a domain.
    pub(super) fn join(domain: &str, folder: &Path, reason: impl Debug) -> Self {
        Self::Failed(format!(
            "cannot join shared memory (domain `{domain}`): {reason:?}; all processes must run as the same \
             user, `{}` and /dev/shm must be writable with some 100 MB free",
            folder.display()
        ))
    }

    /// What the library said about sending or receiving on a service.
    pub fn transfer<E: Debug>(service: &'static str) -> impl Fn(E) -> Self {
        move |error| {
            Self::Failed(format!(
                "shared-memory service `{service}` failed: {error:?}"
            ))
        }
    }
}
