//! The real-time loop: one setpoint per period, at absolute deadlines.
//!
//! ```text
//!  deadline k          ~10 us          ~40 us            deadline k+1
//!     |--late--|--poll, step--|--send, record--|-- sleep --|
//!     wake     input          setpoint out                 4 ms later
//! ```
//!
//! The thread runs under `SCHED_FIFO` with locked memory where it may. Its
//! system calls are one clock sleep, one send and a few non-blocking receives
//! per cycle; no allocation, no lock, no log. Everything that allocates, opens
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

use crate::control::{ControlState, CycleInput, CycleOutput};
use crate::os::Clock;
use crate::overrun::{Wake, after_wake, next_wake};
use crate::ports::{Retired, RtPorts};
use crate::transport::ArmTransport;
use crate::xarm::Command;
use shared_types::MonotonicNs;
use shared_types::ipc::{ControllerBoards, ControllerState, CycleRecord};
use std::sync::atomic::{AtomicBool, Ordering};

/// Joint reports taken in one cycle at most.
const MAX_REPORTS: usize = 16;

/// The loop and all it owns.
#[derive(Debug)]
pub struct RtLoop<T, C> {
    /// Pure core.
    pub control: ControlState,
    /// Clock it lives by.
    pub clock: C,
    /// Blackboards, created in the loop's own thread.
    pub boards: ControllerBoards,
    /// Rings.
    pub ports: RtPorts<T>,
    /// Whether the thread has real-time priority and locked memory.
    pub real_time: bool,
    link: Option<Box<T>>,
    lost: bool,
    dropped: u32,
}

impl<T: ArmTransport, C: Clock> RtLoop<T, C> {
    /// A loop without an arm.
    pub fn new(
        control: ControlState,
        clock: C,
        boards: ControllerBoards,
        ports: RtPorts<T>,
    ) -> Self {
        let (real_time, link, lost, dropped) = (false, None, false, 0);
        Self {
            control,
            clock,
            boards,
            ports,
            real_time,
            link,
            lost,
            dropped,
        }
    }

    /// Runs until `quit` is set.
    pub fn run(&mut self, quit: &AtomicBool) {
        let period_ns = MonotonicNs(0).plus_s(self.control.period_s()).0;
        let mut next = Wake {
            deadline_ns: self.clock.now_ns().saturating_add(period_ns),
            missed: 0,
        };
        while !quit.load(Ordering::Relaxed) {
            self.clock.sleep_until(next.deadline_ns);
            let woke_ns = self.clock.now_ns();
            let due = after_wake(next.deadline_ns, woke_ns, period_ns);
            self.cycle(
                due.deadline_ns,
                due.missed.saturating_add(next.missed),
                woke_ns,
            );
            next = next_wake(due.deadline_ns, woke_ns, self.clock.now_ns(), period_ns);
        }
    }

    /// One cycle: take in, step, send, record. RT-safe.
    pub fn cycle(&mut self, deadline_ns: u64, missed: u32, woke_ns: u64) {
        let input = self.take_in(deadline_ns, missed);
        let mut out = self.control.step(input);
        let computed_ns = self.clock.now_ns();
        self.send(&out, computed_ns);
        let sent_ns = self.clock.now_ns();
        let span = |to: u64, from: u64| u32::try_from(to.saturating_sub(from)).unwrap_or(u32::MAX);
        out.record.wake_late_ns = span(woke_ns, deadline_ns);
        out.record.compute_ns = span(computed_ns, woke_ns);
        out.record.send_ns = out.setpoint.map_or(0, |_| span(sent_ns, woke_ns));
        self.put_out(out, woke_ns);
    }

    fn take_in(&mut self, deadline_ns: u64, missed: u32) -> CycleInput {
        let mut mail = self.ports.orders.pop().ok();
        if let Some(fresh) = mail.as_mut().and_then(|m| m.link.take()) {
            self.replace_link(Some(fresh));
        }
        let now_ns = self.clock.now_ns();
        let mut link = self
            .link
            .as_mut()
            .map(|l| l.poll(now_ns))
            .unwrap_or_default();
        link.lost |= core::mem::take(&mut self.lost);
        if link.lost {
            self.replace_link(None);
        }
        let mut report = None;
        for _ in 0..MAX_REPORTS {
            let Ok(newer) = self.ports.reports.pop() else {
                break;
            };
            report = Some(newer);
        }
        let (order, operator) = (mail.map(|m| m.order), self.boards.operator());
        CycleInput {
            deadline_ns,
            missed,
            order,
            operator,
            link,
            report,
        }
    }

    fn replace_link(&mut self, fresh: Option<Box<T>>) {
        if let Some(old) = core::mem::replace(&mut self.link, fresh) {
            let _ = self.ports.retired.push(Retired::Link(old));
        }
    }

    fn send(&mut self, out: &CycleOutput, now_ns: u64) {
        let Some(link) = self.link.as_mut() else {
            return;
        };
        let setpoint = out.setpoint.map(Command::ServoJoint);
        for command in [setpoint, out.request.map(Command::SetState)]
            .into_iter()
            .flatten()
        {
            self.lost |= link.send(&command, now_ns).is_err();
        }
    }

    fn put_out(&mut self, out: CycleOutput, stamp_ns: u64) {
        let real_time = u8::from(self.real_time);
        self.boards.publish(ControllerState {
            stamp_ns,
            real_time,
            ..self.control.summary()
        });
        let record = CycleRecord {
            dropped: self.dropped,
            ..out.record
        };
        if self.ports.records.push(record).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }
        for event in out.events {
            let _ = self.ports.events.push(event);
        }
        for motion in out.retired {
            let _ = self.ports.retired.push(Retired::Motion(motion));
        }
    }
}
