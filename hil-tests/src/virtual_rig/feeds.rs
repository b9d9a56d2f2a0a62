//! What the controller's report threads do, one cycle at a time: cut the
//! streams into frames, decode, drop and count what cannot be used.

use super::network::{Network, VirtualStream};
use rt_controller::clock_map::ClockMap;
use rt_controller::control::ArmCodes;
use rt_controller::transport::ByteWire;
use rt_controller::xarm::ReportReader;
use rt_controller::xarm::report::{NormalReport, RealtimeReport};
use shared_types::MonotonicNs;
use shared_types::ipc::{JointReport, PAYLOAD_VERSION};
use std::cell::RefCell;
use std::io::ErrorKind;
use std::rc::Rc;
use xarm_sim::{ReportKind, Service};

/// Pause before a lost stream is opened again (s).
const RETRY_S: f64 = 0.2;

/// One report stream, opened again whenever it is lost.
#[derive(Debug)]
pub(super) struct Feed {
    kind: ReportKind,
    stream: Option<VirtualStream>,
    reader: ReportReader,
    size: Option<usize>,
    clocks: ClockMap,
    retry: MonotonicNs,
    /// When it was opened last.
    opened: MonotonicNs,
    /// Frames dropped since they were last asked for.
    broken: u32,
}

impl Feed {
    pub(super) fn new(kind: ReportKind) -> Self {
        Self {
            kind,
            stream: None,
            reader: ReportReader::new(),
            size: None,
            clocks: ClockMap::default(),
            retry: MonotonicNs(0),
            opened: MonotonicNs(0),
            broken: 0,
        }
    }

    /// Frames dropped since the last call.
    pub(super) fn take_broken(&mut self) -> u32 {
        core::mem::take(&mut self.broken)
    }

    /// Passes every whole frame that has come to `take`, which says whether it
    /// can be used.
    fn frames(
        &mut self,
        network: &Rc<RefCell<Network>>,
        mut take: impl FnMut(&[u8], &mut ClockMap) -> bool,
    ) {
        let now = network.borrow().now;
        if self.stream.is_none() && now >= self.retry {
            self.retry = now.plus_s(RETRY_S);
            self.opened = now;
            self.stream = VirtualStream::connect(network, Service::Reports(self.kind)).ok();
            self.reader.reset();
            self.size = None;
            self.clocks = ClockMap::default();
        }
        while let Some(stream) = &mut self.stream {
            match stream.receive(self.reader.space()) {
                Ok((received, _)) if received > 0 => self.reader.commit(received),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                _ => return self.lose(now),
            }
            loop {
                // A torn report is filled up with the beginning of the next.
                let whole = self.reader.is_followed_by_a_report();
                match self.reader.next_report() {
                    Ok(Some(frame)) => {
                        let fits = self.size.is_none_or(|size| size == frame.len());
                        if whole && fits && take(frame, &mut self.clocks) {
                            self.size = Some(frame.len());
                        } else {
                            self.broken += 1;
                        }
                    }
                    Ok(None) => break,
                    Err(_lost_place) => {
                        self.broken += 1;
                        self.lose(now);
                        // One that has lasted is opened again at once.
                        if now.since_s(self.opened) > RETRY_S {
                            self.retry = now;
                        }
                        return;
                    }
                }
            }
        }
    }

    fn lose(&mut self, now: MonotonicNs) {
        self.stream = None;
        self.retry = now.plus_s(RETRY_S);
    }

    /// Joint reports that have come, oldest first.
    pub(super) fn joints(&mut self, network: &Rc<RefCell<Network>>) -> Vec<JointReport> {
        let arrival_ns = network.borrow().now.0;
        let mut reports = Vec::new();
        self.frames(network, |frame, clocks| {
            let parsed = RealtimeReport::parse(frame).ok();
            let Some(r) = parsed.filter(RealtimeReport::is_plausible) else {
                return false;
            };
            reports.push(JointReport {
                version: PAYLOAD_VERSION,
                arm_state: r.state.code(),
                arm_mode: r.mode.code(),
                // The reading is of this very stamp.
                stamp_ns: clocks.to_monotonic_ns(r.time_us, arrival_ns),
                arm_clock: clocks.reading(),
                arrival_ns,
                q: r.actual.q,
                qd: r.actual.qd,
                q_target: r.target.q,
            });
            true
        });
        reports
    }

    /// The arm's newest codes, if some have come.
    pub(super) fn codes(&mut self, network: &Rc<RefCell<Network>>) -> Option<ArmCodes> {
        let arrival_ns = network.borrow().now.0;
        let mut codes = None;
        self.frames(network, |frame, _| {
            let Ok(r) = NormalReport::parse(frame) else {
                return false;
            };
            codes = Some(ArmCodes {
                error: r.error.0,
                warning: r.warning,
                state: r.basic.state.code(),
                mode: r.basic.mode.code(),
                arrival_ns,
            });
            true
        });
        codes
    }
}
