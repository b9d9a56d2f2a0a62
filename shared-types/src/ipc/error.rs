//! What can go wrong where processes meet.

use std::fmt::{Debug, Display};
use std::path::Path;

/// Why shared memory could not be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IpcError {
    /// The domain name cannot be part of a file name.
    #[error("shared-memory domain `{domain}` must be 1 to 40 letters, digits, `-` or `_`")]
    Domain {
        /// Name given.
        domain: String,
    },
    /// The process cannot join shared memory at all.
    #[error("{0}")]
    Join(String),
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
    /// A message could not be sent or received.
    #[error("shared-memory service `{service}` failed: {reason}")]
    Transfer {
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
    /// Nobody answered in time.
    #[error("the process behind `{service}` did not answer within {timeout_s} s")]
    TimedOut {
        /// Service name.
        service: &'static str,
        /// How long was waited (s).
        timeout_s: u64,
    },
}

impl IpcError {
    /// Makes [`Self::Join`] of why the folder in which this user's processes meet cannot be
    /// used.
    pub(super) fn folder(folder: &Path, reason: impl Display) -> Self {
        Self::Join(format!(
            "cannot use `{}`, where the processes of one user meet: {reason}; remove it or have it removed",
            folder.display()
        ))
    }

    /// Makes [`Self::Join`] of what the library said about a domain.
    pub(super) fn join(domain: &str, folder: &Path, reason: impl Debug) -> Self {
        Self::Join(format!(
            "cannot join shared memory (domain `{domain}`): {reason:?}; all processes must run as the same \
             user, `{}` and /dev/shm must be writable with some 100 MB free",
            folder.display()
        ))
    }

    /// Makes [`Self::Transfer`] of what the library said about a service.
    pub fn transfer<E: Debug>(service: &'static str) -> impl Fn(E) -> Self {
        move |error| Self::Transfer {
            service,
            reason: format!("{error:?}"),
        }
    }
}
