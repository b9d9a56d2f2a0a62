//! The report receiver: a thread that listens to the arm's joint reports.
//!
//! It is not the real-time thread. It connects to the real-time report (port
//! 30000, 250 Hz, with the arm's own clock) or, where that is refused, to the
//! real report (port 30003, 100 Hz, without), decodes, stamps, and passes each
//! report on through two rings: to the control loop and to the relay. Lost
//! connections are opened again for as long as the controller runs.

use crate::clock_map::ClockMap;
use crate::os::{now_ns, schedule::set_fifo};
use crate::xarm::ReportReader;
use crate::xarm::report::{ForceReport, RealtimeReport};
use rtrb::Producer;
use shared_types::JointVector;
use shared_types::ipc::{JointReport, PAYLOAD_VERSION};
use std::io::{ErrorKind, Read};
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest wait for a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);
/// Pause before a new attempt.
const RETRY: Duration = Duration::from_millis(200);
/// Longest wait for bytes before `quit` is looked at again.
const READ_TIMEOUT: Duration = Duration::from_millis(100);
/// Silence after which the connection is given up and opened again.
const SILENCE_NS: u64 = 2_000_000_000;

/// Where the reports are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReportSource {
    /// Address of the arm.
    pub arm: IpAddr,
    /// Real-time report port.
    pub realtime_port: u16,
    /// Real report port, used when the other one refuses.
    pub fallback_port: u16,
    /// `SCHED_FIFO` priority of the receiver, if it may have one.
    pub priority: Option<u8>,
}

/// Layout of the reports of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    Realtime,
    Force,
}

/// Starts the receiver; it ends soon after `quit` is set.
///
/// # Errors
/// When the system has no more threads.
pub fn spawn(
    source: ReportSource,
    to_loop: Producer<JointReport>,
    to_relay: Producer<JointReport>,
    quit: Arc<AtomicBool>,
) -> std::io::Result<JoinHandle<()>> {
    let mut receiver = Receiver {
        source,
        to_loop,
        to_relay,
        quit,
    };
    std::thread::Builder::new()
        .name("arm reports".to_owned())
        .spawn(move || receiver.run())
}

struct Receiver {
    source: ReportSource,
    to_loop: Producer<JointReport>,
    to_relay: Producer<JointReport>,
    quit: Arc<AtomicBool>,
}

impl Receiver {
    fn run(&mut self) {
        if let Some(priority) = self.source.priority {
            // Without it reports are merely stamped a little later.
            let _ = set_fifo(priority);
        }
        while !self.quit.load(Ordering::Relaxed) {
            if let Some((stream, layout)) = self.connect() {
                self.listen(stream, layout);
            }
            std::thread::sleep(RETRY);
        }
    }

    fn connect(&self) -> Option<(TcpStream, Layout)> {
        let open = |port| {
            TcpStream::connect_timeout(&SocketAddr::new(self.source.arm, port), CONNECT_TIMEOUT)
        };
        let (stream, layout) = open(self.source.realtime_port)
            .map(|s| (s, Layout::Realtime))
            .or_else(|_refused| open(self.source.fallback_port).map(|s| (s, Layout::Force)))
            .ok()?;
        stream.set_read_timeout(Some(READ_TIMEOUT)).ok()?;
        tracing::info!(?layout, arm = %self.source.arm, "listening to joint reports");
        Some((stream, layout))
    }

    /// Passes reports on until the connection breaks, falls silent or `quit`.
    fn listen(&mut self, mut stream: TcpStream, layout: Layout) {
        let mut reader = ReportReader::new();
        let mut clocks = ClockMap::default();
        let mut heard_ns = now_ns();
        while !self.quit.load(Ordering::Relaxed) {
            match stream.read(reader.space()) {
                Ok(0) => break,
                Ok(n) => reader.commit(n),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    if now_ns().saturating_sub(heard_ns) > SILENCE_NS {
                        break;
                    }
                    continue;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(_gone) => break,
            }
            heard_ns = now_ns();
            loop {
                match reader.next_report() {
                    Ok(Some(frame)) => {
                        if let Some(report) = decode(frame, layout, heard_ns, &mut clocks) {
                            let _ = self.to_loop.push(report);
                            let _ = self.to_relay.push(report);
                        }
                    }
                    Ok(None) => break,
                    Err(broken) => {
                        tracing::warn!(%broken, "the joint report stream lost its place");
                        return;
                    }
                }
            }
        }
        tracing::debug!("joint report connection ended");
    }
}

/// One report as the others see it; `None` for one that is too short or holds
/// numbers that are not finite.
fn decode(
    frame: &[u8],
    layout: Layout,
    arrival_ns: u64,
    clocks: &mut ClockMap,
) -> Option<JointReport> {
    let report = match layout {
        Layout::Realtime => {
            let r = RealtimeReport::parse(frame).ok()?;
            JointReport {
                version: PAYLOAD_VERSION,
                arm_state: r.state.code(),
                arm_mode: r.mode.code(),
                arm_clock: 1,
                stamp_ns: clocks.to_monotonic_ns(r.time_us, arrival_ns),
                arrival_ns,
                q: r.actual.q,
                qd: r.actual.qd,
                q_target: r.target.q,
            }
        }
        Layout::Force => {
            let r = ForceReport::parse(frame).ok()?.basic;
            JointReport {
                version: PAYLOAD_VERSION,
                arm_state: r.state.code(),
                arm_mode: r.mode.code(),
                arm_clock: 0,
                stamp_ns: arrival_ns,
                arrival_ns,
                q: r.q,
                qd: JointVector::ZERO,
                q_target: r.q,
            }
        }
    };
    (report.q.is_finite() && report.qd.is_finite() && report.q_target.is_finite()).then_some(report)
}
