//! What an identification has spent, and how far it has come.

use super::error::IdentifyError;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// How far a fit has come, reported after every generation or step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitProgress {
    /// Generations done.
    pub generation: usize,
    /// Most generations.
    pub generations: usize,
    /// Mean (Huber) distance of the best candidate so far (px).
    pub residual_px: f64,
    /// Wiggles simulated so far.
    pub simulations: usize,
}

impl From<FitProgress> for Progress {
    fn from(p: FitProgress) -> Self {
        Self {
            done: u32::try_from(p.generation).unwrap_or(u32::MAX),
            total: u32::try_from(p.generations).unwrap_or(u32::MAX),
            value: p.residual_px,
            label: "residual px".to_owned(),
        }
    }
}

/// Counts simulations and reports progress.
pub(super) struct Budget<'a> {
    pub(super) simulations: usize,
    pub(super) steps: usize,
    pub(super) steps_max: usize,
    pub(super) progress: &'a mut dyn FnMut(FitProgress) -> ControlFlow<()>,
}

impl Budget<'_> {
    pub(super) fn step(
        &mut self,
        simulations: usize,
        residual_px: f64,
    ) -> Result<(), IdentifyError> {
        self.simulations += simulations;
        self.steps += 1;
        let report = FitProgress {
            generation: self.steps,
            generations: self.steps_max.max(self.steps),
            residual_px,
            simulations: self.simulations,
        };
        if (self.progress)(report).is_break() {
            return Err(IdentifyError::Cancelled {
                generation: self.steps,
            });
        }
        Ok(())
    }
}
