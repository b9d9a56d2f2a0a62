//! The whole controller as clients see it, without sockets and clocks: the
//! model, its connections, and the faults of both.
//!
//! Bytes and time go in, bytes come out. The server puts sockets around it, a
//! virtual rig a test; both get the same replies, reports and faults.

mod client;
mod faulty;
mod replies;
mod streams;

pub use client::{Closing, Service};

use super::config::ArmConfig;
use super::event::{ArmEvent, TimedEvent};
use super::fault::{Fault, FaultKind, FaultRunner};
use super::history::JointSample;
use super::model::{ArmModel, STEP_S};
use client::Client;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use shared_types::MonotonicNs;
use std::collections::BTreeMap;

/// Connections served at once on the command port.
const COMMAND_CLIENTS_MAX: usize = 32;

/// Why a client is not served.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConnectRefused {
    /// As many as this port serves are there already.
    #[error("{0} clients are served already, which is all this port takes")]
    Full(usize),
    /// The firmware does not have this port.
    #[error("this firmware has no such report port")]
    NoSuchPort,
    /// The cable is unplugged or the controller is off.
    #[error("the controller cannot be reached")]
    Unreachable,
}

/// A simulated controller with its connections.
#[derive(Debug)]
pub struct ArmEndpoint {
    model: ArmModel,
    start: MonotonicNs,
    faults: FaultRunner,
    clients: BTreeMap<u32, Client>,
    last_client: u32,
    /// When the second commander sends next.
    foreign_due: MonotonicNs,
    rng: ChaCha8Rng,
    events: Vec<TimedEvent>,
}

impl ArmEndpoint {
    /// A controller switched on at `start`, without clients.
    #[must_use]
    pub fn new(config: ArmConfig, start: MonotonicNs) -> Self {
        Self {
            faults: FaultRunner::new(&config.faults),
            rng: ChaCha8Rng::seed_from_u64(config.seed),
            model: ArmModel::new(config, start),
            start,
            clients: BTreeMap::new(),
            last_client: 0,
            foreign_due: start,
            events: Vec::new(),
        }
    }

    /// The controller behind the connections.
    #[must_use]
    pub fn model(&self) -> &ArmModel {
        &self.model
    }

    /// Adds a fault to the script.
    pub fn inject(&mut self, fault: Fault) {
        self.faults.add(fault);
    }

    /// What has happened since the last call, in order of time.
    pub fn take_events(&mut self) -> Vec<TimedEvent> {
        self.collect_events();
        core::mem::take(&mut self.events)
    }

    fn collect_events(&mut self) {
        self.events.extend(self.model.take_events());
    }

    /// A client connects; its number.
    ///
    /// # Errors
    /// [`ConnectRefused`].
    pub fn connect(&mut self, service: Service, now: MonotonicNs) -> Result<u32, ConnectRefused> {
        let firmware = self.model.config().firmware;
        let most = match service {
            Service::Commands => COMMAND_CLIENTS_MAX,
            Service::Reports(kind) => {
                kind.len(firmware).ok_or(ConnectRefused::NoSuchPort)?;
                kind.clients_max()
            }
        };
        if self.is_dark() {
            return Err(ConnectRefused::Unreachable);
        }
        let served = |c: &&Client| c.service == service && c.closing.is_none();
        if self.clients.values().filter(served).count() >= most {
            return Err(ConnectRefused::Full(most));
        }
        self.last_client += 1;
        let client = Client::new(service, firmware, now);
        self.clients.insert(self.last_client, client);
        // A report goes out at once.
        self.publish(now);
        Ok(self.last_client)
    }

    /// A client is gone.
    pub fn disconnect(&mut self, client: u32) {
        self.clients.remove(&client);
    }

    /// Runs whole steps up to `now` and gives the motion after each.
    pub fn advance_to(&mut self, now: MonotonicNs, mut each: impl FnMut(JointSample)) {
        while self.model.time().plus_s(STEP_S) <= now {
            self.model.step();
            let at = self.model.time();
            each(JointSample {
                at,
                state: self.model.true_motion(),
            });
            self.run_faults(at, self.model.counters().motion_commands);
            self.run_second_commander(at);
            self.let_overtaken_go(at);
            self.push_feedback(at);
            self.publish(at);
        }
    }

    /// Bytes of a client that arrived at `at`; the model has been advanced to
    /// that time or past it. Whether it still listens to this client.
    pub fn receive(&mut self, client: u32, at: MonotonicNs, bytes: &[u8]) -> bool {
        let dark = self.is_dark();
        let Some(state) = self.clients.get_mut(&client) else {
            return false;
        };
        if state.deaf || !state.is_commands() || state.closing.is_some() {
            return !state.deaf;
        }
        if dark {
            return true;
        }
        self.feed(client, at, bytes);
        true
    }

    /// The next frame for a client, if one may go at `now`.
    pub fn take_frame(&mut self, client: u32, now: MonotonicNs) -> Option<Vec<u8>> {
        let (stalled, dark) = (self.is_stalled(), self.is_dark());
        let state = self.clients.get_mut(&client)?;
        if dark || (stalled && state.is_commands()) {
            return None;
        }
        state.pop(now)
    }

    /// How a connection is to be closed now; also for an unknown client.
    #[must_use]
    pub fn closing(&self, client: u32) -> Option<Closing> {
        self.clients
            .get(&client)
            .map_or(Some(Closing::Reset), Client::due_closing)
    }

    /// Clients with a frame to send or a connection to close at `now`.
    #[must_use]
    pub fn busy_clients(&self, now: MonotonicNs) -> Vec<u32> {
        let (stalled, dark) = (self.is_stalled(), self.is_dark());
        self.clients
            .iter()
            .filter(|(_, c)| {
                let sends = c.has_frame(now) && !dark && !(stalled && c.is_commands());
                sends || c.due_closing().is_some()
            })
            .map(|(id, _)| *id)
            .collect()
    }

    fn is_stalled(&self) -> bool {
        self.faults.any(|fault| matches!(fault, FaultKind::Stall))
    }

    /// Nothing passes: the cable is out, or power is off.
    fn is_dark(&self) -> bool {
        self.faults
            .any(|fault| matches!(fault, FaultKind::CablePull | FaultKind::PowerCycle))
    }

    fn log(&mut self, at: MonotonicNs, event: ArmEvent) {
        self.collect_events();
        self.events.push(TimedEvent {
            at,
            client: None,
            event,
        });
    }
}
