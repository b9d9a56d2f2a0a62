//! Cycles and reports as columns, for who works on them as arrays: one home for their names.

use crate::cycles::Cycles;
use arm_model::{JOINTS, JointVector};
use shared_types::FaultCode;
use shared_types::ipc::{ControllerMode, CycleRecord, JointReport};

/// A column, a value per row. Times in ns are those of CLOCK_MONOTONIC; units are the ends of the
/// names.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Whether something is so.
    Flags(Vec<bool>),
    /// Counts and short times.
    U32(Vec<u32>),
    /// Counts and instants.
    U64(Vec<u64>),
    /// Numbers.
    F64(Vec<f64>),
    /// A number per joint.
    Joints(Vec<[f64; JOINTS]>),
    /// Words.
    Texts(Vec<String>),
}

/// A value of each row.
fn each<R, T>(rows: &[R], of: impl Fn(&R) -> T) -> Vec<T> {
    rows.iter().map(of).collect()
}

fn fault(cycle: &CycleRecord) -> String {
    match FaultCode::from_raw(cycle.fault) {
        Some(fault) => format!("{fault:?}"),
        None => format!("unknown fault {}", cycle.fault),
    }
}

fn joints<R>(rows: &[R], of: fn(&R) -> &JointVector) -> Column {
    Column::Joints(each(rows, |row| of(row).0))
}

impl Cycles {
    /// The control cycles: when each was due, what it did, how long that took, and its setpoint.
    pub fn cycle_columns(&self) -> [(&'static str, Column); 13] {
        use Column::{F64, Flags, Texts, U32, U64};
        let rows = &self.cycles[..];
        let mode = |c: &CycleRecord| format!("{:?}", ControllerMode::from_raw(c.mode));
        [
            ("cycle", U64(each(rows, |c| c.cycle))),
            ("deadline_ns", U64(each(rows, |c| c.deadline_ns))),
            ("mode", Texts(each(rows, mode))),
            ("fault", Texts(each(rows, fault))),
            ("sent", Flags(each(rows, |c| c.sent != 0))),
            ("held_back", Flags(each(rows, CycleRecord::held_back))),
            ("wake_late_ns", U32(each(rows, |c| c.wake_late_ns))),
            ("compute_ns", U32(each(rows, |c| c.compute_ns))),
            ("send_ns", U32(each(rows, |c| c.send_ns))),
            ("reply_ns", U32(each(rows, |c| c.reply_ns))),
            ("missed", U32(each(rows, |c| c.missed))),
            ("trajectory_s", F64(each(rows, |c| c.trajectory_s))),
            ("q_commanded_rad", joints(rows, |c| &c.q_c)),
        ]
    }

    /// The joint reports, in order of time and each once, as [`Cycles::reports`] has them.
    pub fn report_columns(&self) -> [(&'static str, Column); 5] {
        use Column::U64;
        let rows = &self.reports()[..];
        [
            ("stamp_ns", U64(each(rows, |r: &JointReport| r.stamp_ns))),
            ("arrival_ns", U64(each(rows, |r| r.arrival_ns))),
            ("q_rad", joints(rows, |r| &r.q)),
            ("qd_rad_s", joints(rows, |r| &r.qd)),
            ("q_target_rad", joints(rows, |r| &r.q_target)),
        ]
    }
}
