//! The controller being watched: its state on a blackboard, and its process.

use super::decision::Pulse;
use crate::os::process::{ProcessWatch, thread_lives, thread_of};
use crate::process::CONTROL_THREAD;
use shared_types::ipc::{Bus, ControllerMode, GuardianEnd, IpcError, StateReader};

/// A controller that was found, dead or alive.
#[derive(Debug)]
pub(super) struct Watched {
    state: StateReader,
    /// Where the guardian writes its own sign of life.
    pub(super) end: GuardianEnd,
    process: Option<ProcessWatch>,
    pid: u32,
    /// Its control thread, as the system counts.
    thread: Option<u32>,
}

impl Watched {
    /// Opens the blackboards of the domain's controller.
    pub(super) fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            state: StateReader::open(bus)?,
            end: GuardianEnd::take(bus)?,
            process: None,
            pid: 0,
            thread: None,
        })
    }

    /// Its sign of life, `None` before its first cycle.
    pub(super) fn pulse(&mut self) -> Option<Pulse> {
        let state = self.state.get();
        if state.pid != self.pid {
            // Without a watch (an older kernel, another name space of process
            // numbers) its silence still tells.
            self.pid = state.pid;
            self.process = ProcessWatch::new(state.pid).ok();
            self.thread = thread_of(state.pid, CONTROL_THREAD);
        }
        let mode = ControllerMode::from_raw(state.mode);
        (state.stamp_ns > 0).then(|| Pulse {
            stamp_ns: state.stamp_ns,
            moving: mode.is_moving(),
            ended: self.has_ended(),
            cut_off: mode == ControllerMode::Faulted && state.link_failed != 0,
        })
    }

    /// The control thread goes first when its process is killed: it has
    /// real-time priority, while the process as a whole is gone only when its
    /// last ordinary thread was given time to die and its memory is freed.
    fn has_ended(&self) -> bool {
        let thread_ended = self.thread.is_some_and(|id| !thread_lives(self.pid, id));
        thread_ended || self.process.as_ref().is_some_and(ProcessWatch::has_ended)
    }
}
