//! What a rollout says about each obstacle.

use crate::lanes::Lanes;
use crate::scene::{ContactSummary, RopePart};

/// End of the current step in one lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepEnd {
    /// Time at its end, and its length (s).
    pub(crate) time_s: f64,
    pub(crate) step_s: f64,
    /// Whether the lane still counts.
    pub(crate) running: bool,
}

/// Largest forces over the contact points of one obstacle in one step (N).
pub(crate) struct Tally<V> {
    links: V,
    lead: V,
}

impl<V: Lanes> Tally<V> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = V::splat(0.0);
        Self {
            links: zero,
            lead: zero,
        }
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, force: V, is_lead: bool) {
        if is_lead {
            self.lead = self.lead.max(force);
        } else {
            self.links = self.links.max(force);
        }
    }
}

/// Summaries by body, then lane.
pub(crate) struct Summaries {
    all: Vec<Vec<ContactSummary>>,
}

impl Summaries {
    pub(crate) fn new(bodies: usize, lanes: usize) -> Self {
        Self {
            all: vec![vec![ContactSummary::default(); lanes]; bodies],
        }
    }

    /// Takes in one step of one body.
    #[inline(always)]
    pub(crate) fn add<V: Lanes>(&mut self, body: usize, tally: &Tally<V>, lanes: &[StepEnd]) {
        let largest = tally.links.max(tally.lead);
        if !V::any_less(V::splat(0.0), largest) {
            return;
        }
        for (lane, end) in lanes.iter().enumerate() {
            if end.running && largest.get(lane) > 0.0 {
                let part = if tally.lead.get(lane) > 0.0 {
                    RopePart::Lead
                } else {
                    RopePart::Links
                };
                self.all[body][lane].first.get_or_insert((end.time_s, part));
            }
        }
    }

    /// Summaries of one lane for the first `bodies` bodies.
    pub(crate) fn of(&self, lane: usize, bodies: usize) -> Vec<ContactSummary> {
        let lanes = self.all.iter().take(bodies);
        lanes
            .map(|b| b.get(lane).copied().unwrap_or_default())
            .collect()
    }
}
