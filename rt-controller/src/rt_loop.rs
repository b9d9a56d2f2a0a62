//! The real-time loop: one setpoint per period, at absolute deadlines.
//!
//! The thread runs under `SCHED_FIFO` with locked memory where it may. Its
//! system calls are one clock sleep, one non-blocking receive and one send at
//! most per cycle; no allocation, no lock, no log. Both are counted over every
//! mode and fault in `tests/no_alloc.rs` and `tests/system_calls.rs`. Everything that allocates, opens
//! or may fail for a human reason happened before, in the bridge thread, and
//! came through the rings of [`RtPorts`]. The cycle itself is [`crate::driver`], maths and
//! policy are in [`crate::control`]; here are the thread's clock, boards and rings.
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

use crate::control::{ArmCodes, ControlState, CycleOutput};
use crate::driver::{CommandMsg, CycleDriver, CycleIo};
use crate::os::Clock;
use crate::ports::{NEWEST_REPORTS, Retired, RtPorts};
use crate::recording::Snapshot;
use crate::transport::ArmTransport;
use crate::warm_up::CacheWarmUp;
use shared_types::ipc::{
    ControllerBoards, ControllerState, CycleRecord, GuardianBeat, InputRecord, OperatorBeat,
    Reports,
};
use std::sync::atomic::{AtomicBool, Ordering};

/// Cycles from one whole state that is passed on to the next.
const STATE_EVERY: u64 = 250;

/// The loop and all it owns.
#[derive(Debug)]
pub struct RtLoop<T, C> {
    driver: CycleDriver<T>,
    io: RtIo<T, C>,
    warm_up: Option<CacheWarmUp>,
}

/// What the cycle of a real thread lives in.
#[derive(Debug)]
struct RtIo<T, C> {
    clock: C,
    boards: ControllerBoards,
    ports: RtPorts<T>,
    /// Broken reports counted so far.
    broken: u32,
    pid: u32,
    real_time: bool,
}

impl<T: ArmTransport, C: Clock> RtLoop<T, C> {
    /// A loop without an arm; `boards` were created in the calling thread.
    pub fn new(
        control: ControlState,
        clock: C,
        boards: ControllerBoards,
        ports: RtPorts<T>,
    ) -> Self {
        let mut io = RtIo {
            broken: ports.broken.load(Ordering::Relaxed),
            clock,
            boards,
            ports,
            pid: std::process::id(),
            real_time: false,
        };
        io.put_state(&control);
        Self {
            driver: CycleDriver::new(control, io.now_ns()),
            io,
            warm_up: None,
        }
    }

    /// The clock it lives by.
    pub const fn clock(&self) -> &C {
        &self.io.clock
    }

    /// Says whether the thread has real-time priority and locked memory.
    pub const fn set_real_time(&mut self, real_time: bool) {
        self.io.real_time = real_time;
    }

    /// Warms the caches for each cycle from now on, if that is to be any time ahead.
    pub fn set_warm_up(&mut self, warm_up: CacheWarmUp) {
        self.warm_up = Some(warm_up).filter(|r| r.ahead_ns > 0);
    }

    /// Runs until `quit` is set.
    pub fn run(&mut self, quit: &AtomicBool) {
        self.driver.begin(self.io.clock.now_ns());
        while !quit.load(Ordering::Relaxed) {
            self.wait_until(self.driver.deadline_ns());
            let woke_ns = self.io.clock.now_ns();
            self.driver.run_due(woke_ns, &mut self.io);
        }
    }

    /// Sleeps until the deadline, or until it is time to warm up; woken with less
    /// than a fifth of that time left, it does without.
    fn wait_until(&mut self, deadline_ns: u64) {
        let clock = &mut self.io.clock;
        let Some(warm_up) = &mut self.warm_up else {
            return clock.sleep_until(deadline_ns);
        };
        let ahead_ns = warm_up.ahead_ns;
        clock.sleep_until(deadline_ns.saturating_sub(ahead_ns));
        let latest_ns = deadline_ns.saturating_sub(ahead_ns / 5);
        if clock.now_ns() < latest_ns {
            let (operator, guardian) = (self.io.boards.operator(), self.io.boards.guardian());
            warm_up.cycle(deadline_ns, operator, guardian);
        }
        while clock.now_ns() < deadline_ns {
            core::hint::spin_loop();
        }
    }

    /// One cycle by itself, see [`CycleDriver::cycle`]. RT-safe.
    pub fn cycle(&mut self, deadline_ns: u64, missed: u32, woke_ns: u64) -> u64 {
        self.driver
            .cycle(deadline_ns, missed, woke_ns, &mut self.io)
    }
}

impl<T, C: Clock> CycleIo<T> for RtIo<T, C> {
    fn now_ns(&self) -> u64 {
        self.clock.now_ns()
    }

    fn operator(&mut self) -> OperatorBeat {
        self.boards.operator()
    }

    fn guardian(&mut self) -> GuardianBeat {
        self.boards.guardian()
    }

    fn next_command(&mut self) -> Option<CommandMsg<T>> {
        self.ports.commands.pop().ok()
    }

    fn new_reports(&mut self) -> Reports {
        let mut reports = Reports::default();
        for report in (0..NEWEST_REPORTS).map_while(|_| self.ports.reports.pop().ok()) {
            reports.push(report);
        }
        reports
    }

    fn new_broken_reports(&mut self) -> u32 {
        let broken = self.ports.broken.load(Ordering::Relaxed);
        broken.wrapping_sub(core::mem::replace(&mut self.broken, broken))
    }

    fn new_codes(&mut self) -> Option<ArmCodes> {
        (0..NEWEST_REPORTS)
            .map_while(|_| self.ports.codes.pop().ok())
            .last()
    }

    fn put_input(&mut self, input: InputRecord) {
        // When the ring is full, so is that of the records, which counts losses.
        let _ = self.ports.inputs.push(input);
    }

    fn publish(&mut self, state: ControllerState) {
        self.boards.publish(ControllerState {
            real_time: u8::from(self.real_time),
            pid: self.pid,
            ..state
        });
    }

    fn put_output(&mut self, out: CycleOutput) {
        let ports = &mut self.ports;
        let record = CycleRecord {
            dropped: ports.dropped,
            ..out.record
        };
        if ports.records.push(record).is_err() {
            ports.dropped = ports.dropped.saturating_add(1);
        }
        for event in out.events {
            let _ = ports.events.push(event);
        }
        for motion in out.retired {
            let _ = ports.retired.push(Retired::Motion(motion));
        }
    }

    fn put_state(&mut self, control: &ControlState) {
        if control.cycle().is_multiple_of(STATE_EVERY)
            && !self.ports.states.is_full()
            && let Some(snapshot) = Snapshot::of(control)
        {
            let _ = self.ports.states.push(snapshot);
        }
    }

    fn retire_link(&mut self, link: Box<T>) {
        let _ = self.ports.retired.push(Retired::Link(link));
    }
}
