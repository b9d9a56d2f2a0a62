//! Who touched an obstacle first, and when.

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

/// Notes in each lane's summary of one body who touched it first; `links` and `lead` are the
/// largest forces over their contact points in this step (N).
#[inline(always)]
pub(crate) fn note_touch<V: Lanes>(
    summaries: &mut [ContactSummary],
    [links, lead]: [V; 2],
    ends: &[StepEnd],
) {
    let largest = links.max(lead);
    if !V::any_less(V::splat(0.0), largest) {
        return;
    }
    for (lane, (summary, end)) in summaries.iter_mut().zip(ends).enumerate() {
        if end.running && largest.get(lane) > 0.0 {
            let part = if lead.get(lane) > 0.0 {
                RopePart::Lead
            } else {
                RopePart::Links
            };
            summary.first.get_or_insert((end.time_s, part));
        }
    }
}
