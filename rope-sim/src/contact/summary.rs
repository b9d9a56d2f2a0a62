//! What a rollout says about each obstacle.

use super::StepEnd;
use crate::lanes::Lanes;
use crate::scene::{ContactSummary, RopePart};

/// Largest numbers over the contact points of one obstacle in one step.
pub(crate) struct Tally<V> {
    links_force: V,
    lead_force: V,
    depth: V,
}

impl<V: Lanes> Tally<V> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = V::splat(0.0);
        Self {
            links_force: zero,
            lead_force: zero,
            depth: zero,
        }
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, force: V, depth: V, is_lead: bool) {
        if is_lead {
            self.lead_force = self.lead_force.max(force);
        } else {
            self.links_force = self.links_force.max(force);
        }
        self.depth = self.depth.max(depth);
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
        let largest = tally.links_force.max(tally.lead_force);
        if !V::any_less(V::splat(0.0), largest) {
            return;
        }
        for (lane, end) in lanes.iter().enumerate() {
            let force_n = largest.get(lane);
            if !(end.running && force_n > 0.0) {
                continue;
            }
            let summary = &mut self.all[body][lane];
            let lead = tally.lead_force.get(lane) > 0.0;
            let part = if lead {
                RopePart::Lead
            } else {
                RopePart::Links
            };
            summary.first = summary.first.or(Some((end.time_s, part)));
            summary.lead_touched |= lead;
            summary.links_touched |= tally.links_force.get(lane) > 0.0;
            summary.in_touch_s += end.step_s;
            summary.peak_normal_force_n = summary.peak_normal_force_n.max(force_n);
            let depth_m = tally.depth.get(lane);
            summary.greatest_penetration_m = summary.greatest_penetration_m.max(depth_m);
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
