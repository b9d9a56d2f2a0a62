//! A loopback bench of the real loop on this machine: how late it wakes, how long it
//! computes, how long its system calls take.
//!
//! The loop is the real one, with its blackboards, rings and command link over
//! TCP; it streams a motion of joint 7 all the time. Only the arm is missing: a
//! thread answers each request and does nothing else. The loop runs in slices,
//! so that something else can have its core in between.

mod bare;
mod cyclictest;
mod link;
mod load;
mod side_by_side;

use crate::control::{ControlCommand, ControlState};
use crate::driver::CommandMsg;
use crate::error::ControllerError;
use crate::os::{RealTimeSettings, now_ns};
use crate::ports::{BridgePorts, rings};
use crate::process::start_loop;
use crate::transport::tcp::{LinkSettings, TcpLink};
use crate::warm_up::{patient, report, swinging};
use arm_model::joint::START_POSE;
use arm_model::{JointVector, Limits, TrajectoryError};
use link::{TimedLink, start_answerer};
use rtrb::{Consumer, Producer, RingBuffer};
use shared_types::ipc::{
    Bus, ControllerMode, CycleRecord, DomainSweep, IpcError, JointReport, OperatorEnd,
};
use shared_types::{FaultCode, MonotonicNs};
pub use side_by_side::SideBySide;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The loop's period.
const PERIOD: Duration = Duration::from_millis(4);
/// Priority of the loop and of all that it is compared with.
const PRIORITY: u8 = 80;
/// Pause between two turns of the part that the bridge would do.
const TURN: Duration = Duration::from_millis(2);
/// Longest wait for the loop to begin to move.
const BEGIN_WAIT: Duration = Duration::from_secs(10);
/// Connection to the answering thread.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);
/// Poll times on their way out of the loop.
const POLLS: usize = 4096;
/// Cycles at the begin of a slice that do not count: caches and branch
/// predictors are another program's.
const WARM_UP: usize = 5;

/// Why nothing can be measured.
#[derive(Debug, thiserror::Error)]
pub enum LoopbackError {
    /// No shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The loop cannot be set up.
    #[error(transparent)]
    Loop(#[from] ControllerError),
    /// No socket or thread.
    #[error("the loopback bench cannot begin: {0}")]
    System(#[from] std::io::Error),
    /// The motion of the bench; a defect.
    #[error(transparent)]
    Motion(#[from] TrajectoryError),
    /// The loop does not move; a defect, or a machine that does not run it.
    #[error(
        "the control loop does not move (mode {mode:?}: {}); look whether the \
         machine is overloaded",
        .fault.explain()
    )]
    Still {
        /// Where it is.
        mode: ControllerMode,
        /// What stopped it last.
        fault: FaultCode,
    },
    /// The loop's thread ended.
    #[error("the control loop ended by itself")]
    Ended,
}

/// Times of one cycle (ns).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleTimes {
    /// From the deadline to the first instruction after the sleep.
    pub wake_ns: u64,
    /// The receive call and what it brought.
    pub receive_ns: u64,
    /// Everything else up to the setpoint: inputs, core, record.
    pub compute_ns: u64,
    /// The send call.
    pub send_ns: u64,
    /// Cycles skipped before this one.
    pub missed: u32,
}

impl CycleTimes {
    /// Of a cycle whose poll took `poll_ns`.
    fn of(record: &CycleRecord, poll_ns: u32) -> Self {
        Self {
            wake_ns: record.wake_late_ns.into(),
            receive_ns: poll_ns.into(),
            compute_ns: record.compute_ns.saturating_sub(poll_ns).into(),
            send_ns: record.send_ns.saturating_sub(record.compute_ns).into(),
            missed: record.missed,
        }
    }
}

/// The loop in its thread, at rest between slices.
#[derive(Debug)]
struct LoopbackBench {
    /// Real-time properties that could not be had, in words.
    warnings: Vec<String>,
    go: Option<mpsc::Sender<()>>,
    quit: Arc<AtomicBool>,
    rested: mpsc::Receiver<()>,
    thread: Option<JoinHandle<()>>,
    bridge: BridgePorts<TimedLink>,
    reports: Producer<JointReport>,
    polls: Option<Producer<u32>>,
    polled: Consumer<u32>,
    operator: OperatorEnd,
    answerer: SocketAddr,
    period_ns: u64,
    mode: ControllerMode,
    fault: FaultCode,
    q: JointVector,
    /// Deadline of the newest setpoint that a report may follow (ns).
    due_ns: u64,
    motions: u64,
    _bus: Bus,
    _sweep: DomainSweep,
}

impl LoopbackBench {
    /// Sets the loop up in a shared-memory domain of its own. It takes what it
    /// can have of `real_time`; see `warnings`.
    fn new(domain: &str, real_time: &RealTimeSettings) -> Result<Self, LoopbackError> {
        let sweep = DomainSweep::new(domain);
        let bus = Bus::join(domain)?;
        let limits = Limits::default();
        let period_ns = MonotonicNs(0).plus_s(limits.period_s()).0;
        let all = rings();
        let [reports_to_loop, _] = all.reports;
        let (polls, polled) = RingBuffer::new(POLLS);
        let (go, begin) = mpsc::channel();
        let (rest, rested) = mpsc::channel();
        let quit = Arc::new(AtomicBool::new(false));
        let its_quit = Arc::clone(&quit);
        let control = ControlState::new(limits, patient());
        let (thread, warnings) = start_loop(domain, real_time, control, all.rt, move |mut rt| {
            while begin.recv().is_ok() {
                rt.run(&its_quit);
                let _ = rest.send(());
            }
        })?;
        Ok(Self {
            warnings,
            go: Some(go),
            quit,
            rested,
            thread: Some(thread),
            bridge: all.bridge,
            reports: reports_to_loop,
            polls: Some(polls),
            polled,
            operator: OperatorEnd::take(&bus)?,
            answerer: start_answerer()?,
            period_ns,
            mode: ControllerMode::Offline,
            fault: FaultCode::None,
            q: START_POSE,
            due_ns: 0,
            motions: 0,
            _bus: bus,
            _sweep: sweep,
        })
    }

    /// Runs the loop for `span`, then lets it rest; times of the cycles in which
    /// it moved.
    fn slice(&mut self, span: Duration) -> Result<Vec<CycleTimes>, LoopbackError> {
        self.quit.store(false, Ordering::Relaxed);
        let go = self.go.as_ref().ok_or(LoopbackError::Ended)?;
        go.send(()).map_err(|_gone| LoopbackError::Ended)?;
        let ran = self.follow(span);
        self.quit.store(true, Ordering::Relaxed);
        self.rested.recv().map_err(|_gone| LoopbackError::Ended)?;
        let mut times = ran?;
        times.drain(..WARM_UP.min(times.len()));
        Ok(times)
    }

    /// Does the bridge's part, keeps the arm moving and collects.
    fn follow(&mut self, span: Duration) -> Result<Vec<CycleTimes>, LoopbackError> {
        let (began, mut moving_since) = (Instant::now(), None);
        let mut times = Vec::new();
        self.prompt()?;
        loop {
            std::thread::sleep(TURN);
            self.operator.beat();
            while self.bridge.retired.pop().is_ok() {}
            while self.bridge.events.pop().is_ok() {}
            while self.bridge.inputs.pop().is_ok() {}
            while self.bridge.states.pop().is_ok() {}
            while let Ok(record) = self.bridge.records.pop() {
                let before = self.mode;
                self.mode = ControllerMode::from_raw(record.mode);
                self.fault = FaultCode::from_raw(record.fault).unwrap_or(FaultCode::None);
                self.q = record.q_c;
                self.due_ns = record.deadline_ns;
                // Without a link nothing is polled.
                let linked = [before, self.mode] != [ControllerMode::Offline; 2];
                let poll_ns = if linked {
                    self.polled.pop().unwrap_or(0)
                } else {
                    0
                };
                if self.mode == ControllerMode::Streaming && before == self.mode {
                    times.push(CycleTimes::of(&record, poll_ns));
                }
                if self.mode != before && !self.mode.is_moving() {
                    self.prompt()?;
                }
            }
            // Of a new pose only: one from before a pause would jump.
            let due_ns = core::mem::take(&mut self.due_ns);
            if due_ns > 0 {
                let _ = self
                    .reports
                    .push(report(self.q, patient().interface, due_ns, now_ns()));
            }
            if self.mode == ControllerMode::Streaming {
                moving_since.get_or_insert_with(Instant::now);
            }
            if moving_since.is_some_and(|since: Instant| since.elapsed() >= span) {
                return Ok(times);
            }
            if moving_since.is_none() && began.elapsed() > BEGIN_WAIT {
                return Err(self.still());
            }
        }
    }

    const fn still(&self) -> LoopbackError {
        LoopbackError::Still {
            mode: self.mode,
            fault: self.fault,
        }
    }

    /// Orders what leads to a moving arm from where the loop is.
    fn prompt(&mut self) -> Result<(), LoopbackError> {
        let mut link = None;
        let command = match self.mode {
            // Acknowledged: the bench measures, whatever the machine did to it.
            ControllerMode::Faulted => ControlCommand::Engage { hold: self.q },
            ControllerMode::Offline => {
                let Some(polls) = self.polls.take() else {
                    return Err(self.still());
                };
                let settings = LinkSettings::new(250, self.period_ns);
                let tcp = TcpLink::connect(self.answerer, CONNECT_TIMEOUT, settings)?;
                link = Some(Box::new(TimedLink::new(tcp, polls)));
                ControlCommand::Engage { hold: START_POSE }
            }
            ControllerMode::Idle => {
                self.motions += 1;
                ControlCommand::Run {
                    id: self.motions,
                    motion: Box::new(swinging(self.q)?),
                }
            }
            ControllerMode::Moving | ControllerMode::Streaming | ControllerMode::Braking => {
                return Ok(());
            }
        };
        let pushed = self.bridge.commands.push(CommandMsg { command, link });
        pushed.map_err(|_full| LoopbackError::Ended)
    }
}

impl Drop for LoopbackBench {
    fn drop(&mut self) {
        // Without a sender the thread ends.
        self.go = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_runs_in_slices_and_times_every_cycle_in_parts() {
        let domain = format!("test_loopback_{}", std::process::id());
        let settings = RealTimeSettings {
            warm_up_us: 100,
            ..RealTimeSettings::ordinary()
        };
        let mut bench = LoopbackBench::new(&domain, &settings).unwrap();
        assert!(bench.warnings.is_empty());
        for _ in 0..3 {
            // Something else has the core in between.
            std::thread::sleep(Duration::from_millis(300));
            let times = bench.slice(Duration::from_millis(400)).unwrap();
            assert!(times.len() > 3, "{}", times.len());
            for t in &times {
                // On a busy machine a setpoint may grow too old before it is sent, and is
                // held back.
                let old = t.wake_ns + t.receive_ns + t.compute_ns > 200_000;
                let sent = t.send_ns > 0 || old;
                assert!(t.receive_ns > 0 && t.compute_ns > 0 && sent, "{t:?}");
            }
            assert!(times.iter().any(|t| t.send_ns > 0), "{times:?}");
        }
    }
}
