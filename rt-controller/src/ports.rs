//! The in-process rings between the control loop and the other threads:
//! single-producer single-consumer, lock-free, sized once.

use crate::control::{ArmCodes, ControlEvent, Motion};
use crate::driver::CommandMsg;
use crate::recording::{RecordedCycle, Snapshot};
use rtrb::{Consumer, Producer, RingBuffer};
use shared_types::ipc::{CycleRecord, InputRecord, JointReport};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// Cycle records kept while the bridge is busy: sixteen seconds at 250 Hz.
const RECORDS: usize = 4096;
/// Whole states kept for the bridge, one a second.
const STATES: usize = 4;
/// Joint reports kept for the bridge: the same time.
const REPORTS: usize = 4096;
/// Joint reports kept for the loop; it takes them all every cycle.
pub(crate) const NEWEST_REPORTS: usize = 16;
/// Commands, events and retired things are few.
const FEW: usize = 64;

/// Something the loop is done with, to be dropped by the bridge.
#[derive(Debug)]
pub enum Retired<T> {
    /// A motion that ended or was refused.
    Motion(Box<Motion>),
    /// A link that broke or was replaced.
    Link(Box<T>),
}

/// The loop's ends. A full ring loses what is pushed.
#[derive(Debug)]
pub struct RtPorts<T> {
    /// Commands in, one taken per cycle.
    pub commands: Consumer<CommandMsg<T>>,
    /// Joint reports in; the newest counts.
    pub reports: Consumer<JointReport>,
    /// The arm's codes in; the newest counts.
    pub codes: Consumer<ArmCodes>,
    /// Count of reports that had to be dropped, wrapping.
    pub broken: Arc<AtomicU32>,
    /// Events out.
    pub events: Producer<ControlEvent>,
    /// The inputs of each cycle, out, before its record.
    pub inputs: Producer<InputRecord>,
    /// Whole states before a cycle, out, before that cycle's record.
    pub states: Producer<Snapshot>,
    /// Cycle records out.
    pub records: Producer<CycleRecord>,
    /// What is to be dropped, out.
    pub retired: Producer<Retired<T>>,
    /// Records lost so far because the bridge was too slow.
    pub dropped: u32,
}

/// The bridge's ends.
#[derive(Debug)]
pub struct BridgePorts<T> {
    /// Commands out.
    pub commands: Producer<CommandMsg<T>>,
    /// Joint reports in, every one.
    pub reports: Consumer<JointReport>,
    /// The arm's codes in, all of them.
    pub codes: Consumer<ArmCodes>,
    /// Events in.
    pub events: Consumer<ControlEvent>,
    /// The inputs of each cycle, in.
    pub inputs: Consumer<InputRecord>,
    /// Whole states, in.
    pub states: Consumer<Snapshot>,
    /// Cycle records in.
    pub records: Consumer<CycleRecord>,
    /// What is to be dropped, in.
    pub retired: Consumer<Retired<T>>,
}

impl<T> BridgePorts<T> {
    /// The inputs of the cycle of a record, joined with that record; `None` if
    /// they got lost.
    pub fn recorded(&mut self, record: CycleRecord) -> Option<RecordedCycle> {
        while self.inputs.peek().ok()?.cycle < record.cycle {
            let _ = self.inputs.pop();
        }
        if self.inputs.peek().ok()?.cycle != record.cycle {
            return None;
        }
        let input = self.inputs.pop().ok()?;
        Some(RecordedCycle { input, record })
    }

    /// The state before a cycle, if it was passed on.
    pub fn state_before(&mut self, cycle: u64) -> Option<Snapshot> {
        while self.states.peek().is_ok_and(|s| s.next_cycle <= cycle) {
            let found = self.states.pop().ok().filter(|s| s.next_cycle == cycle);
            if found.is_some() {
                return found;
            }
        }
        None
    }
}

/// All rings of a controller.
#[derive(Debug)]
pub struct Rings<T> {
    /// The loop's ends.
    pub rt: RtPorts<T>,
    /// The bridge's ends.
    pub bridge: BridgePorts<T>,
    /// The joint report receiver's ways to the loop and to the bridge.
    pub reports: [Producer<JointReport>; 2],
    /// The ways of the arm's codes to the loop and to the bridge.
    pub codes: [Producer<ArmCodes>; 2],
}

/// Makes all rings. Not RT-safe.
#[must_use]
pub fn rings<T>() -> Rings<T> {
    let (commands_in, commands) = RingBuffer::new(FEW);
    let (events, events_out) = RingBuffer::new(FEW);
    let (records, records_out) = RingBuffer::new(RECORDS);
    let (inputs, inputs_out) = RingBuffer::new(RECORDS);
    let (states, states_out) = RingBuffer::new(STATES);
    let (retired, retired_out) = RingBuffer::new(FEW);
    let (reports_to_rt, newest) = RingBuffer::new(NEWEST_REPORTS);
    let (reports_to_bridge, reports) = RingBuffer::new(REPORTS);
    let (codes_to_rt, newest_codes) = RingBuffer::new(NEWEST_REPORTS);
    let (codes_to_bridge, codes) = RingBuffer::new(FEW);
    Rings {
        rt: RtPorts {
            commands,
            reports: newest,
            codes: newest_codes,
            broken: Arc::default(),
            events,
            inputs,
            states,
            records,
            retired,
            dropped: 0,
        },
        bridge: BridgePorts {
            commands: commands_in,
            reports,
            codes,
            events: events_out,
            inputs: inputs_out,
            states: states_out,
            records: records_out,
            retired: retired_out,
        },
        reports: [reports_to_rt, reports_to_bridge],
        codes: [codes_to_rt, codes_to_bridge],
    }
}
