//! One control cycle around the core, wherever it runs: when it is due, what goes
//! into it, what of its answer goes out, and how long that took.
//!
//! ```text
//!  deadline k          ~10 us          ~40 us            deadline k+1
//!     |--late--|--poll, step--|--send, record--|-------------|
//!     wake     input          setpoint out                    one period later
//! ```
//!
//! The driver owns the core and the command link and decides; everything around
//! it is a [`CycleIo`]: the real loop's shared memory and rings, or a rig in
//! virtual time. Nothing here waits, allocates, locks or panics, as long as the
//! [`CycleIo`] does not.
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
use crate::control::{
    ArmCodes, ArmCommand, ControlCommand, ControlState, CycleInput, CycleOutput, LinkInput,
};
use crate::overrun::{StaleSetpointDrop, Wake, after_wake, next_wake, setpoint_late_ns};
use crate::transport::{ArmTransport, MAX_COMMANDS, request};
use crate::xarm::{Command, StateRequest};
use alloc::boxed::Box;
use shared_types::MonotonicNs;
use shared_types::ipc::{ControllerState, GuardianBeat, InputRecord, OperatorBeat, Reports};

/// A command for the cycle, with the command link that comes with an engagement.
#[derive(Debug)]
pub struct CommandMsg<T> {
    /// What to do.
    pub command: ControlCommand,
    /// A fresh link, which replaces the present one.
    pub link: Option<Box<T>>,
}

/// What surrounds the cycle: its clock, the state it shares with other processes,
/// and its ways to and from other threads. Under the real loop every call must be
/// RT-safe.
pub trait CycleIo<T> {
    /// Now (CLOCK_MONOTONIC, ns).
    fn now_ns(&self) -> u64;
    /// Newest heartbeat of the operator, with the dead-man switch.
    fn operator(&mut self) -> OperatorBeat;
    /// Newest heartbeat of the guardian.
    fn guardian(&mut self) -> GuardianBeat;
    /// The next command.
    fn next_command(&mut self) -> Option<CommandMsg<T>>;
    /// Joint reports that came since the last cycle, oldest first.
    fn new_reports(&mut self) -> Reports;
    /// Joint reports dropped as broken since the last cycle; asked after
    /// [`new_reports`](Self::new_reports).
    fn new_broken_reports(&mut self) -> u32;
    /// The arm's newest codes, if some came since the last cycle.
    fn new_codes(&mut self) -> Option<ArmCodes>;
    /// Takes the inputs of the cycle, before the core is stepped.
    fn put_input(&mut self, input: InputRecord);
    /// Shows the state to other processes, its process and its priority filled in
    /// here. The setpoint is out.
    fn publish(&mut self, state: ControllerState);
    /// Takes what the cycle produced.
    fn put_output(&mut self, out: CycleOutput);
    /// Takes the state before the next cycle.
    fn put_state(&mut self, control: &ControlState);
    /// Takes a link that broke or was replaced, to be dropped elsewhere.
    fn retire_link(&mut self, link: Box<T>);
}

/// The core with its command link and its pace.
#[derive(Debug)]
pub struct CycleDriver<T> {
    control: ControlState,
    /// Links are made and dropped elsewhere.
    link: Option<Box<T>>,
    /// The last send failed.
    link_lost: bool,
    held: StaleSetpointDrop,
    next: Wake,
    period_ns: u64,
}

impl<T: ArmTransport> CycleDriver<T> {
    /// Without a link; its first cycle is due one period after `now_ns`.
    #[must_use]
    pub fn new(control: ControlState, now_ns: u64) -> Self {
        let mut driver = Self {
            link: None,
            link_lost: false,
            held: StaleSetpointDrop::default(),
            next: Wake::default(),
            period_ns: MonotonicNs(0).plus_s(control.period_s()).0,
            control,
        };
        driver.begin(now_ns);
        driver
    }

    /// The next cycle is due one period after `now_ns`.
    pub const fn begin(&mut self, now_ns: u64) {
        self.next = Wake {
            deadline_ns: now_ns.saturating_add(self.period_ns),
            missed: 0,
        };
    }

    /// The core.
    #[must_use]
    pub const fn control(&self) -> &ControlState {
        &self.control
    }

    /// Whether there is a command link.
    #[must_use]
    pub const fn is_connected(&self) -> bool {
        self.link.is_some()
    }

    /// When the next cycle is due (CLOCK_MONOTONIC, ns).
    #[must_use]
    pub const fn deadline_ns(&self) -> u64 {
        self.next.deadline_ns
    }

    /// The cycle that is due, in a thread that woke at `woke_ns`; deadlines that
    /// have passed by a whole period are skipped and counted. RT-safe.
    pub fn run_due(&mut self, woke_ns: u64, io: &mut impl CycleIo<T>) {
        let due = after_wake(self.next.deadline_ns, woke_ns, self.period_ns);
        let missed = due.missed.saturating_add(self.next.missed);
        let sent_ns = self.cycle(due.deadline_ns, missed, woke_ns, io);
        self.next = next_wake(due.deadline_ns, sent_ns, io.now_ns(), self.period_ns);
    }

    /// One cycle, due at `deadline_ns` after `missed` skipped ones, in a thread
    /// that woke at `woke_ns`: take in, step, send, record; returns when it sent,
    /// its deadline if it held its setpoint back. RT-safe.
    pub fn cycle(
        &mut self,
        deadline_ns: u64,
        missed: u32,
        woke_ns: u64,
        io: &mut impl CycleIo<T>,
    ) -> u64 {
        let missed = missed.saturating_add(self.held.missed());
        let mut input = self.take_in(deadline_ns, missed, io);
        input.late_ns = setpoint_late_ns(deadline_ns, woke_ns, missed, self.period_ns);
        let cycle = self.control.cycle().wrapping_add(1);
        io.put_input(record_input(&input, cycle));
        let mut out = self.control.step(input);
        let computed_ns = io.now_ns();
        let held = out.command.is_some() && self.held.holds(woke_ns, computed_ns, self.period_ns);
        let command = out.command.filter(|_| !held);
        self.send(command, out.request, computed_ns);
        let sent_ns = io.now_ns();

        out.record.wake_late_ns = span_ns(deadline_ns, woke_ns);
        out.record.compute_ns = span_ns(woke_ns, computed_ns);
        out.record.send_ns = command.map_or(0, |_| span_ns(woke_ns, sent_ns));
        io.publish(ControllerState {
            stamp_ns: woke_ns,
            ..self.control.summary()
        });
        io.put_output(out);
        // It takes longer than all the rest, so it comes when the setpoint is out.
        io.put_state(&self.control);
        if held { deadline_ns } else { computed_ns }
    }

    /// Puts a fresh link, or none, in the place of the present one.
    fn replace_link(&mut self, fresh: Option<Box<T>>, io: &mut impl CycleIo<T>) {
        self.link_lost = false;
        if let Some(old) = core::mem::replace(&mut self.link, fresh) {
            io.retire_link(old);
        }
    }

    /// Sends a cycle's command and request for a state, in this order and at once. Called
    /// every cycle: without a command a question of the link's own may go out.
    fn send(&mut self, command: Option<ArmCommand>, state: Option<StateRequest>, now_ns: u64) {
        let interface = self.control.settings().interface;
        let Some(link) = self.link.as_mut() else {
            return;
        };
        let setpoint = command.and_then(|c| request(interface, &c));
        let state = state.map(Command::SetState);
        let mut commands: heapless::Vec<Command, MAX_COMMANDS> = heapless::Vec::new();
        for command in [setpoint, state].into_iter().flatten() {
            // Two at most: they fit.
            let _ = commands.push(command);
        }
        self.link_lost |= link.send(&commands, now_ns).is_err();
    }

    fn take_in(&mut self, deadline_ns: u64, missed: u32, io: &mut impl CycleIo<T>) -> CycleInput {
        let mut message = io.next_command();
        if let Some(fresh) = message.as_mut().and_then(|m| m.link.take()) {
            self.replace_link(Some(fresh), io);
        }
        // No link at all is a lost one.
        let none = LinkInput {
            lost: true,
            ..LinkInput::default()
        };
        let now_ns = io.now_ns();
        let mut link = self.link.as_mut().map_or(none, |link| link.poll(now_ns));
        link.lost |= self.link_lost;
        if link.lost {
            self.replace_link(None, io);
        }
        let reports = io.new_reports();
        CycleInput {
            deadline_ns,
            missed,
            late_ns: 0,
            command: message.map(|m| m.command),
            operator: io.operator(),
            guardian: io.guardian(),
            link,
            codes: io.new_codes(),
            reports,
            broken_reports: io.new_broken_reports(),
        }
    }
}

fn span_ns(from_ns: u64, to_ns: u64) -> u32 {
    u32::try_from(to_ns.saturating_sub(from_ns)).unwrap_or(u32::MAX)
}
