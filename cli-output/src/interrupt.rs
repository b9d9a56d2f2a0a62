//! Ctrl-C and SIGTERM as a flag that a command looks at.

use anyhow::Context;
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C and SIGTERM end the command in order instead of at once.
///
/// # Errors
/// When the signals are watched for already or the system refuses.
pub fn watch_interrupts() -> anyhow::Result<()> {
    ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::SeqCst))
        .context("cannot watch for Ctrl-C")
}

/// The flag that Ctrl-C and SIGTERM set.
pub fn interrupted() -> &'static AtomicBool {
    &INTERRUPTED
}
