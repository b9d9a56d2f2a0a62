//! One connection, without its socket.

use crate::fault::FaultKind;
use crate::firmware::Firmware;
use crate::reports::ReportKind;
use rt_controller::xarm::{FrameReader, Protocol};
use shared_types::MonotonicNs;
use std::collections::VecDeque;

/// Frames that wait for a client at most. One that takes no replies for so
/// long is dropped; reports give way to newer ones.
const REPLIES_MAX: usize = 1024;
const REPORTS_MAX: usize = 16;

/// What a connection is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Service {
    /// Requests and replies.
    Commands,
    /// One of the report streams.
    Reports(ReportKind),
}

/// How a connection ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closing {
    /// In order, after what is still to be sent.
    Finish,
    /// At once, by a reset.
    Reset,
}

#[derive(Debug)]
pub(super) struct Client {
    pub(super) service: Service,
    /// Requests that are not whole yet.
    pub(super) inbox: FrameReader,
    /// Requests that came during a stall.
    pub(super) held: Vec<Vec<u8>>,
    /// Frames to send, with the time from which they may go.
    outbox: VecDeque<(MonotonicNs, Vec<u8>)>,
    /// A reply that lets the next one pass.
    pub(super) overtaken: Option<(MonotonicNs, Vec<u8>)>,
    pub(super) closing: Option<Closing>,
    /// Neither read nor answered any more.
    pub(super) deaf: bool,
    /// Which feedback it wants.
    pub(super) feedback_mask: u8,
    /// Protocol id of its last request.
    pub(super) protocol: Protocol,
    /// Layout of its reports, fixed for the connection.
    pub(super) firmware: Firmware,
    /// When its next report is due.
    pub(super) due: MonotonicNs,
    /// Reports sent.
    pub(super) counter: u32,
    /// The last report, undamaged.
    pub(super) last_report: Vec<u8>,
    /// Faults that spoil its next reports, each so many of them.
    pub(super) damage: VecDeque<(FaultKind, u32)>,
}

impl Client {
    pub(super) fn new(service: Service, firmware: Firmware, now: MonotonicNs) -> Self {
        Self {
            service,
            inbox: FrameReader::new(),
            held: Vec::new(),
            outbox: VecDeque::new(),
            overtaken: None,
            closing: None,
            deaf: false,
            feedback_mask: 0,
            protocol: Protocol::Private,
            firmware,
            due: now,
            counter: 0,
            last_report: Vec::new(),
            damage: VecDeque::new(),
        }
    }

    pub(super) fn is_commands(&self) -> bool {
        self.service == Service::Commands
    }

    /// Queues a frame that may go from `ready` on.
    pub(super) fn push(&mut self, ready: MonotonicNs, frame: Vec<u8>) {
        if self.closing.is_some() || self.deaf {
            return;
        }
        let most = if self.is_commands() {
            REPLIES_MAX
        } else {
            REPORTS_MAX
        };
        if self.outbox.len() >= most {
            if self.is_commands() {
                self.closing = Some(Closing::Reset);
                return;
            }
            self.outbox.pop_front();
        }
        self.outbox.push_back((ready, frame));
    }

    /// The next frame that may go at `now`.
    pub(super) fn pop(&mut self, now: MonotonicNs) -> Option<Vec<u8>> {
        let (ready, _) = self.outbox.front()?;
        if *ready > now || self.deaf {
            return None;
        }
        self.outbox.pop_front().map(|(_, frame)| frame)
    }

    /// Whether something may go at `now`.
    pub(super) fn has_frame(&self, now: MonotonicNs) -> bool {
        !self.deaf && self.outbox.front().is_some_and(|(ready, _)| *ready <= now)
    }

    /// How the connection is to end now, if it is.
    pub(super) fn due_closing(&self) -> Option<Closing> {
        self.closing
            .filter(|how| *how == Closing::Reset || self.outbox.is_empty())
    }

    /// Ends it by a reset; nothing more is sent.
    pub(super) fn reset(&mut self) {
        self.forget();
        self.closing = Some(Closing::Reset);
    }

    /// Drops all that is under way in both directions.
    pub(super) fn forget(&mut self) {
        self.outbox.clear();
        self.held.clear();
        self.overtaken = None;
        self.inbox.reset();
    }

    /// The damage for the next report, if any is left.
    pub(super) fn next_damage(&mut self) -> Option<FaultKind> {
        let (damage, left) = self.damage.front_mut()?;
        let damage = *damage;
        *left = left.saturating_sub(1);
        if *left == 0 {
            self.damage.pop_front();
        }
        Some(damage)
    }
}
