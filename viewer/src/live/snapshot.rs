//! What a page is told, twenty-five times a second.

use super::ask::Ask;
use super::stage::Stage;
use crate::report::Histogram;
use arm_model::Cell;
use serde::Serialize;
use shared_types::ipc::ControllerMode;
use shared_types::{FaultCode, OperatingMode};

/// One moment.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Snapshot {
    /// What is watched, in words.
    pub title: String,
    /// What is missing or wrong, in words; empty when all is well.
    pub note: String,
    pub controller: Option<ControllerView>,
    /// Joints' origins from the base to the pole's end (0.1 mm); empty before any.
    pub arm: Vec<i32>,
    /// The rope's nodes (0.1 mm); empty when no rope is known.
    pub rope: Vec<i32>,
    pub rope_is: &'static str,
    /// Radius of the rope and of its lead (m).
    pub radii_m: [f64; 2],
    pub cell: Cell,
    pub target_m: Option<[f64; 3]>,
    /// Histograms of the control loop, now and then; `None` in between.
    pub jitter: Option<Vec<Histogram>>,
    /// Cycles missed since somebody watches.
    pub missed: u64,
    /// Whether a camera's frames come.
    pub camera: bool,
    /// The stage that a run is in; none where there is no run folder.
    pub stage: Option<Stage>,
    /// Each request, and why it may not be asked for now.
    pub asks: Vec<(Ask, Option<&'static str>)>,
}

#[derive(Debug, Serialize)]
pub(crate) struct ControllerView {
    pub mode: ControllerMode,
    /// What motions are armed.
    pub operating_mode: Option<OperatingMode>,
    /// Whether its loop has real-time priority and locked memory.
    pub real_time: bool,
    pub cycle: u64,
    /// Whether its cycles go on.
    pub alive: bool,
    /// Whether an operator's program gives signs of life.
    pub operator: bool,
    /// The last stop since somebody watches.
    pub stop: Option<StopView>,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct StopView {
    pub code: FaultCode,
    /// What happened and what to do.
    pub words: &'static str,
    /// Cycle in which it was seen first.
    pub cycle: u64,
    pub latched: bool,
}

/// Keeps the newest stop: a code that is latched, and that it was once.
pub(crate) fn note_stop(stop: &mut Option<StopView>, raw: u16, cycle: u64) {
    let code = FaultCode::from_raw(raw).unwrap_or_default();
    match stop {
        Some(known) if code == FaultCode::None => known.latched = false,
        Some(known) if known.latched && known.code == code => {}
        _ if code == FaultCode::None => {}
        _ => {
            *stop = Some(StopView {
                code,
                words: code.explain(),
                cycle,
                latched: true,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_kept_after_it_was_acknowledged_and_until_the_next() {
        let mut stop = None;
        note_stop(&mut stop, 0, 1);
        assert!(stop.is_none());
        for (raw, cycle) in [(1, 10), (1, 11), (0, 12)] {
            note_stop(&mut stop, raw, cycle);
        }
        let kept = stop.clone().unwrap();
        assert_eq!(kept.code, FaultCode::OperatorStop);
        assert_eq!((kept.cycle, kept.latched), (10, false));
        note_stop(&mut stop, 1, 20);
        let again = stop.unwrap();
        assert_eq!((again.cycle, again.latched), (20, true));
    }
}
