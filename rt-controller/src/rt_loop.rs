//! The real-time loop: one setpoint per period, at absolute deadlines.
//!
//! ```text
//!  deadline k          ~10 us          ~40 us            deadline k+1
//!     |--late--|--poll, step--|--send, record--|-- sleep, rehearse --|
//!     wake     input          setpoint out                     4 ms later
//! ```
//!
//! The thread runs under `SCHED_FIFO` with locked memory where it may. Its
//! system calls are one clock sleep, one non-blocking receive and one send at
//! most per cycle; no allocation, no lock, no log. Both are counted over every
//! mode and fault in `tests/no_alloc.rs` and `tests/system_calls.rs`. Everything that allocates, opens
//! or may fail for a human reason happened before, in the relay thread, and
//! came through the rings of [`RtPorts`]. Maths and policy are in
//! [`crate::control`], pacing in [`crate::overrun`].
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

use crate::control::record::record_input;
use crate::control::{ArmCodes, ControlState, CycleInput};
use crate::os::Clock;
use crate::overrun::{HoldBack, Wake, after_wake, next_wake, setpoint_late_ns};
use crate::ports::RtPorts;
use crate::rehearsal::Rehearsal;
use crate::transport::ArmTransport;
use crate::transport::slot::LinkSlot;
use shared_types::MonotonicNs;
use shared_types::ipc::{ControllerBoards, ControllerState};
use std::sync::atomic::{AtomicBool, Ordering};

/// The loop and all it owns.
#[derive(Debug)]
pub struct RtLoop<T, C> {
    control: ControlState,
    clock: C,
    boards: ControllerBoards,
    ports: RtPorts<T>,
    link: LinkSlot<T>,
    held: HoldBack,
    rehearsal: Option<Rehearsal>,
    /// Broken reports counted so far.
    broken: u32,
    pid: u32,
    /// Whether the thread has real-time priority and locked memory.
    pub real_time: bool,
}

impl<T: ArmTransport, C: Clock> RtLoop<T, C> {
    /// A loop without an arm; `boards` were created in the calling thread.
    pub fn new(
        control: ControlState,
        clock: C,
        boards: ControllerBoards,
        ports: RtPorts<T>,
    ) -> Self {
        let mut ports = ports;
        ports.put_state(&control);
        Self {
            link: LinkSlot::new(control.wire()),
            held: HoldBack::default(),
            rehearsal: None,
            broken: ports.broken.count(),
            control,
            clock,
            boards,
            ports,
            pid: std::process::id(),
            real_time: false,
        }
    }

    /// The clock it lives by.
    pub const fn clock(&self) -> &C {
        &self.clock
    }

    /// Rehearses each cycle from now on, if that is to be any time ahead.
    pub fn rehearse(&mut self, rehearsal: Rehearsal) {
        self.rehearsal = Some(rehearsal).filter(|r| r.ahead_ns > 0);
    }

    /// Runs until `quit` is set.
    pub fn run(&mut self, quit: &AtomicBool) {
        let period_ns = MonotonicNs(0).plus_s(self.control.period_s()).0;
        let mut next = Wake {
            deadline_ns: self.clock.now_ns().saturating_add(period_ns),
            missed: 0,
        };
        while !quit.load(Ordering::Relaxed) {
            self.wait_until(next.deadline_ns);
            let woke_ns = self.clock.now_ns();
            let due = after_wake(next.deadline_ns, woke_ns, period_ns);
            let missed = due.missed.saturating_add(next.missed);
            let sent_ns = self.cycle(due.deadline_ns, missed, woke_ns);
            next = next_wake(due.deadline_ns, sent_ns, self.clock.now_ns(), period_ns);
        }
    }

    /// Sleeps until the deadline, or until it is time to rehearse; woken with less
    /// than a fifth of that time left, it does without.
    fn wait_until(&mut self, deadline_ns: u64) {
        let Some(rehearsal) = &mut self.rehearsal else {
            return self.clock.sleep_until(deadline_ns);
        };
        let ahead_ns = rehearsal.ahead_ns;
        self.clock.sleep_until(deadline_ns.saturating_sub(ahead_ns));
        let latest_ns = deadline_ns.saturating_sub(ahead_ns / 5);
        if self.clock.now_ns() < latest_ns {
            let (operator, guardian) = (self.boards.operator(), self.boards.guardian());
            rehearsal.cycle(deadline_ns, operator, guardian);
        }
        while self.clock.now_ns() < deadline_ns {
            core::hint::spin_loop();
        }
    }

    /// One cycle, due at `deadline_ns` after `missed` skipped ones, that woke at
    /// `woke_ns`: take in, step, send, record; returns when it sent, its deadline
    /// if it held its setpoint back. RT-safe.
    pub fn cycle(&mut self, deadline_ns: u64, missed: u32, woke_ns: u64) -> u64 {
        let missed = missed.saturating_add(self.held.missed());
        let mut input = self.take_in(deadline_ns, missed);
        let period_ns = MonotonicNs(0).plus_s(self.control.period_s()).0;
        input.late_ns = setpoint_late_ns(deadline_ns, woke_ns, missed, period_ns);
        let next = self.control.cycle().wrapping_add(1);
        self.ports.put_input(record_input(&input, next));
        let mut out = self.control.step(input);
        let computed_ns = self.clock.now_ns();
        let held = out.command.is_some() && self.held.holds(woke_ns, computed_ns, period_ns);
        let command = out.command.filter(|_| !held);
        self.link.send(command, out.request, computed_ns);
        let sent_ns = self.clock.now_ns();

        out.record.wake_late_ns = span_ns(deadline_ns, woke_ns);
        out.record.compute_ns = span_ns(woke_ns, computed_ns);
        out.record.send_ns = command.map_or(0, |_| span_ns(woke_ns, sent_ns));
        self.boards.publish(ControllerState {
            stamp_ns: woke_ns,
            real_time: u8::from(self.real_time),
            pid: self.pid,
            ..self.control.summary()
        });
        self.ports.put_out(out);
        // The state before the next cycle. It takes longer than all the rest, so
        // it is written when the setpoint is out.
        self.ports.put_state(&self.control);
        if held { deadline_ns } else { computed_ns }
    }

    fn take_in(&mut self, deadline_ns: u64, missed: u32) -> CycleInput {
        let mut mail = self.ports.orders.pop().ok();
        if let Some(fresh) = mail.as_mut().and_then(|m| m.link.take()) {
            let old = self.link.replace(Some(fresh));
            self.ports.retire_link(old);
        }
        let link = self.link.poll(self.clock.now_ns());
        if link.lost {
            let broken = self.link.replace(None);
            self.ports.retire_link(broken);
        }
        let broken = self.ports.broken.count();
        let broken_reports = broken.wrapping_sub(core::mem::replace(&mut self.broken, broken));
        CycleInput {
            deadline_ns,
            missed,
            late_ns: 0,
            order: mail.map(|m| m.order),
            operator: self.boards.operator(),
            guardian: self.boards.guardian(),
            link,
            codes: self.ports.newest_status().map(ArmCodes::from),
            reports: self.ports.new_reports(),
            broken_reports,
        }
    }
}

fn span_ns(from_ns: u64, to_ns: u64) -> u32 {
    u32::try_from(to_ns.saturating_sub(from_ns)).unwrap_or(u32::MAX)
}
