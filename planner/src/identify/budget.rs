//! What an identification has spent, and how far it has come.

use super::error::IdentifyError;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Counts simulations and reports progress.
pub(super) struct Budget<'a> {
    pub(super) simulations: usize,
    pub(super) steps: usize,
    pub(super) steps_max: usize,
    pub(super) progress: &'a mut dyn FnMut(Progress) -> ControlFlow<()>,
}

impl Budget<'_> {
    pub(super) fn step(
        &mut self,
        simulations: usize,
        residual_px: f64,
    ) -> Result<(), IdentifyError> {
        self.simulations += simulations;
        self.steps += 1;
        let count = |steps: usize| u32::try_from(steps).unwrap_or(u32::MAX);
        let report = Progress {
            done: count(self.steps),
            total: count(self.steps_max.max(self.steps)),
            value: residual_px,
            label: "residual px".to_owned(),
        };
        if (self.progress)(report).is_break() {
            return Err(IdentifyError::Cancelled(self.steps));
        }
        Ok(())
    }
}
