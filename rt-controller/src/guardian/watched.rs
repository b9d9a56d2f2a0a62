//! The controller being watched: its state on a blackboard, and its process.

use super::decision::Pulse;
use crate::os::process::ProcessWatch;
use shared_types::ipc::{Bus, ControllerMode, GuardianBeat, GuardianEnd, IpcError, StateReader};

/// A controller that was found, dead or alive.
#[derive(Debug)]
pub(super) struct Watched {
    state: StateReader,
    end: GuardianEnd,
    process: Option<ProcessWatch>,
    pid: u32,
}

impl Watched {
    /// Opens the blackboards of the domain's controller.
    pub(super) fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            state: StateReader::open(bus)?,
            end: GuardianEnd::take(bus)?,
            process: None,
            pid: 0,
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
        }
        (state.stamp_ns > 0).then(|| Pulse {
            stamp_ns: state.stamp_ns,
            moving: ControllerMode::from_raw(state.mode).is_moving(),
            ended: self.process.as_ref().is_some_and(ProcessWatch::has_ended),
        })
    }

    /// Writes a sign of life of the guardian.
    pub(super) fn beat(&mut self, beat: GuardianBeat) {
        self.end.beat(beat);
    }
}
