//! How well the rope has been seen of late: a thin one, or a fast one, is seen less.

use std::collections::VecDeque;

use super::state::State;

/// Frames that tell.
const LATE_FRAMES: usize = 61;

/// Coverage of the rope in the last frames that were clear and not in doubt.
#[derive(Debug, Clone, Default)]
pub(super) struct Sight {
    late: VecDeque<f64>,
}

impl Sight {
    /// Takes note of a clear frame.
    pub(super) fn note(&mut self, state: &State) {
        if self.late.len() == LATE_FRAMES {
            self.late.pop_front();
        }
        self.late.push_back(state.score());
    }

    /// The median; 1 while nothing is known.
    pub(super) fn usual(&self) -> f64 {
        let mut late: Vec<f64> = self.late.iter().copied().collect();
        late.sort_by(f64::total_cmp);
        late.get(late.len() / 2).copied().unwrap_or(1.0)
    }
}
