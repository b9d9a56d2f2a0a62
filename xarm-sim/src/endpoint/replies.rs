//! The command port: requests in, replies out, in whatever order the faults
//! want them.

use super::client::{Client, Closing};
use super::{ArmEndpoint, FaultKind};
use rand::RngExt;
use rt_controller::xarm::frame::{Frame, MAX_FRAME_LEN};
use rt_controller::xarm::{FrameReader, Protocol, Register, Reply, Request, Status};
use shared_types::MonotonicNs;

/// A reply that lets another one pass waits for it no longer than this (s).
const OVERTAKEN_MAX_S: f64 = 0.020;
/// Transaction id of replies that nobody asked for differs by this.
const FOREIGN_TRANSACTION: u16 = 0x4000;

impl ArmEndpoint {
    /// Takes bytes of the command port apart and answers what is whole.
    pub(super) fn feed(&mut self, client: u32, at: MonotonicNs, mut bytes: &[u8]) {
        let Some(state) = self.clients.get_mut(&client) else {
            return;
        };
        let mut inbox = core::mem::take(&mut state.inbox);
        loop {
            let taken = inbox.feed(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            let broken = loop {
                match inbox.next_frame() {
                    Ok(Some(frame)) => self.handle(client, at, &frame),
                    Ok(None) => break false,
                    Err(_) => break true,
                }
            };
            let Some(state) = self.clients.get_mut(&client) else {
                return;
            };
            if broken {
                state.closing.get_or_insert(Closing::Finish);
                return;
            }
            if bytes.is_empty() {
                state.inbox = inbox;
                return;
            }
        }
    }

    /// A request that arrived at `arrived`. It may have been read later, when
    /// other things had happened already: then those come first.
    fn handle(&mut self, client: u32, arrived: MonotonicNs, frame: &Frame<'_>) {
        let at = arrived.max(self.model.time());
        // Only the private protocol is spoken here; a heartbeat is taken
        // silently, as is standard Modbus.
        let spoken = matches!(
            frame.protocol,
            Protocol::Private | Protocol::PrivateHeartbeat
        );
        let Some(request) = frame.as_request().filter(|_| spoken) else {
            return;
        };
        if !self.is_stalled() && self.model.takes_motion(request.register) {
            // Faults that begin with this command begin before it.
            self.run_faults(at, self.model.counters().motion_commands + 1);
        }
        let (stalled, dark) = (self.is_stalled(), self.is_dark());
        let mut out = [0; MAX_FRAME_LEN];
        let Some(state) = self.clients.get_mut(&client) else {
            return;
        };
        if dark || state.deaf || state.closing.is_some() {
            return;
        }
        if stalled {
            let len = request.emit(&mut out).unwrap_or(0);
            state.held.push(out[..len].to_vec());
            return;
        }
        state.protocol = request.protocol;
        if request.register == Register::FeedbackMask.code()
            && let [mask, ..] = request.parameters
        {
            state.feedback_mask = *mask;
        }
        let mut answer = self.model.request_from(client, arrived, &request);
        answer.status.0 |= self.false_bits();
        // Replies are far shorter than the longest frame.
        if let Ok(len) = answer.emit(&mut out, &request) {
            self.deliver(client, at, &request, out[..len].to_vec());
        }
    }

    /// A stall is over: what came meanwhile is read at once.
    pub(super) fn release(&mut self, at: MonotonicNs) {
        let ids: Vec<u32> = self.clients.keys().copied().collect();
        for id in ids {
            let held = self
                .clients
                .get_mut(&id)
                .map_or(Vec::new(), |c| core::mem::take(&mut c.held));
            for request in held {
                let mut whole = FrameReader::new();
                whole.feed(&request);
                if let Ok(Some(frame)) = whole.next_frame() {
                    self.handle(id, at, &frame);
                }
            }
        }
    }

    /// Status bits that are set without a reason.
    fn false_bits(&self) -> u8 {
        self.faults
            .active()
            .map(|fault| match fault {
                FaultKind::ErrorBit => Status::ERROR,
                FaultKind::WarningBit => Status::WARNING,
                FaultKind::NotReadyBit => Status::NOT_READY,
                _ => 0,
            })
            .fold(0, |all, bit| all | bit)
    }

    /// Queues a reply, or what the faults make of it.
    fn deliver(&mut self, client: u32, at: MonotonicNs, request: &Request<'_>, reply: Vec<u8>) {
        let mut delay_s = 0.0_f64;
        let mut lost = false;
        let (mut twice, mut swap, mut foreign) = (false, false, false);
        for fault in self.faults.active() {
            match fault {
                FaultKind::RepliesDelayed { delay_s: by_s } => delay_s = delay_s.max(*by_s),
                FaultKind::RepliesLost { share } => lost |= self.rng.random_bool(*share),
                FaultKind::RepliesDuplicated => twice = true,
                FaultKind::RepliesReordered => swap = true,
                FaultKind::RepliesForeign => foreign = true,
                _ => {}
            }
        }
        let Some(state) = self.clients.get_mut(&client) else {
            return;
        };
        if lost {
            return;
        }
        let ready = at.plus_s(delay_s);
        if foreign {
            state.push(ready, foreign_reply(request));
        }
        if swap && state.overtaken.is_none() {
            state.overtaken = Some((at, reply));
            return;
        }
        if twice {
            state.push(ready, reply.clone());
        }
        state.push(ready, reply);
        if let Some((_, overtaken)) = state.overtaken.take() {
            state.push(ready, overtaken);
        }
    }

    /// Sends replies that waited in vain for another one to pass.
    pub(super) fn let_overtaken_go(&mut self, now: MonotonicNs) {
        let waited = |state: &&mut Client| matches!(&state.overtaken, Some((since, _)) if now.since_s(*since) > OVERTAKEN_MAX_S);
        for state in self.clients.values_mut().filter(waited) {
            if let Some((_, reply)) = state.overtaken.take() {
                state.push(now, reply);
            }
        }
    }

    /// Tells clients about the beginning and end of their moves.
    pub(super) fn push_feedback(&mut self, now: MonotonicNs) {
        for news in self.model.take_feedback() {
            let status = self.model.status();
            let mut out = [0; MAX_FRAME_LEN];
            let Some((client, transaction)) = news.task.origin else {
                continue;
            };
            let Some(state) = self.clients.get_mut(&client) else {
                continue;
            };
            if news.is_wanted(state.feedback_mask)
                && let Ok(len) = news.emit(&mut out, transaction, state.protocol, status)
            {
                state.push(now, out[..len].to_vec());
            }
        }
    }
}

/// A proper reply to a request that was never made.
fn foreign_reply(request: &Request<'_>) -> Vec<u8> {
    let mut out = [0; MAX_FRAME_LEN];
    let reply = Reply {
        transaction: request.transaction ^ FOREIGN_TRANSACTION,
        protocol: request.protocol,
        register: request.register,
        status: Status(0),
        data: &[],
    };
    let len = reply.emit(&mut out).unwrap_or(0);
    out[..len].to_vec()
}
