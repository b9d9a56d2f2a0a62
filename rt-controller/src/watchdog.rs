//! Signs of life for the service manager that started this process, if one did: that it is
//! ready, and, where the unit has a `WatchdogSec`, that its work goes on.

use crate::error::ControllerError;
use sd_notify::{NotifyState, notify, watchdog_enabled};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts what a process does over and over; what no longer counts no longer lives. RT-safe.
#[derive(Debug, Clone, Default)]
pub(crate) struct Progress(Arc<AtomicU64>);

impl Progress {
    /// Tells how often it was done.
    pub(crate) fn reached(&self, count: u64) {
        self.0.store(count, Ordering::Relaxed);
    }

    /// Says that the process is ready, and from then on that it lives as long as it gets on. A
    /// thread of its own says it, which ends with the process: nothing waits for a manager that
    /// does not listen.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(crate) fn report(&self) -> Result<(), ControllerError> {
        if let Err(reason) = notify(&[NotifyState::Ready]) {
            tracing::warn!(%reason, "the service manager does not hear that this process is ready");
        }
        let Some(within) = watchdog_enabled() else {
            return Ok(());
        };
        let count = Arc::clone(&self.0);
        let mut before = None;
        let body = move || {
            loop {
                let now = count.load(Ordering::Relaxed);
                if before.replace(now) != Some(now) {
                    // It hears the next one, or ends this process.
                    let _ = notify(&[NotifyState::Watchdog]);
                }
                std::thread::sleep(within / 4);
            }
        };
        let thread = std::thread::Builder::new().name("watchdog".to_owned());
        thread
            .spawn(body)
            .map(drop)
            .map_err(ControllerError::Thread)
    }
}
