//! The motions in the control cycles of a run.

use shared_types::MonotonicNs;
use shared_types::ipc::{ControllerMode, CycleRecord};

/// Fewer cycles than this are nothing to look at.
const CYCLES_MIN: usize = 25;

/// The cycles of each motion that was asked for, in order; moves to a start pose are the
/// controller's own.
pub(crate) fn motions(cycles: &[CycleRecord]) -> Vec<&[CycleRecord]> {
    let streams = |c: &CycleRecord| c.mode == ControllerMode::Streaming as u8;
    cycles
        .chunk_by(|a, b| a.mode == b.mode && b.trajectory_s >= a.trajectory_s)
        .filter(|run| streams(&run[0]) && run.len() >= CYCLES_MIN)
        .collect()
}

/// When a motion began.
pub(crate) fn begin(motion: &[CycleRecord]) -> MonotonicNs {
    MonotonicNs(motion[0].deadline_ns).plus_s(-motion[0].trajectory_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_a_row_of_streaming_cycles() {
        let run = |mode: ControllerMode, count: u32| {
            (0..count).map(move |i| CycleRecord {
                mode: mode as u8,
                trajectory_s: f64::from(i),
                ..CycleRecord::default()
            })
        };
        // The third and the fourth follow each other without a pause.
        let cycles: Vec<CycleRecord> = run(ControllerMode::Moving, 60)
            .chain(run(ControllerMode::Streaming, 40))
            .chain(run(ControllerMode::Idle, 30))
            .chain(run(ControllerMode::Streaming, 50))
            .chain(run(ControllerMode::Streaming, 30))
            .chain(run(ControllerMode::Streaming, 3))
            .collect();
        let lengths: Vec<usize> = motions(&cycles).iter().map(|m| m.len()).collect();
        assert_eq!(lengths, [40, 50, 30]);
    }
}
