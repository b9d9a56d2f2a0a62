//! The endpoint in real time, shared by the threads of the server.

use super::line::Line;
use crate::clock;
use crate::config::ArmConfig;
use crate::endpoint::{ArmEndpoint, Closing, ConnectRefused, Service};
use crate::event::{ArmEvent, TimedEvent};
use crate::history::{History, JointSample, lock};
use crate::model::STEP_S;
use rt_controller::os::{RealTimeSettings, enter_real_time};
use shared_types::MonotonicNs;
use std::collections::BTreeMap;
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// `SCHED_FIFO` priority of the arm's threads, below that of a controller.
const ARM_PRIORITY: u8 = 40;

/// Puts the calling thread ahead of ordinary ones: a real arm has a computer of
/// its own and takes setpoints in time whatever the client's machine does.
/// Without the right to do so the arm works all the same, but under heavy load
/// it may see setpoints late and stop with C24.
pub(super) fn stand_for_another_machine() {
    let settings = RealTimeSettings {
        priority: Some(ARM_PRIORITY),
        cpu: None,
        lock_memory: false,
        require: false,
        warm_up_us: 0,
    };
    for warning in enter_real_time(&settings) {
        tracing::debug!(%warning, "simulated arm");
    }
}

/// The endpoint, its sockets, and what threads need to share them.
#[derive(Debug)]
pub(super) struct Plant {
    endpoint: Mutex<ArmEndpoint>,
    lines: Mutex<BTreeMap<u32, Arc<Line>>>,
    pub(super) history: History<JointSample>,
    pub(super) events: History<TimedEvent>,
    stop: AtomicBool,
}

impl Plant {
    pub(super) fn new(config: ArmConfig) -> Self {
        Self {
            endpoint: Mutex::new(ArmEndpoint::new(config, clock::now())),
            lines: Mutex::default(),
            history: History::default(),
            events: History::default(),
            stop: AtomicBool::new(false),
        }
    }

    /// Brings the endpoint up to the present and uses it; `now` is that present.
    pub(super) fn with_endpoint<R>(
        &self,
        use_endpoint: impl FnOnce(&mut ArmEndpoint, MonotonicNs) -> R,
    ) -> R {
        let mut endpoint = lock(&self.endpoint);
        let now = clock::now();
        let mut samples = Vec::new();
        endpoint.advance_to(now, |sample| samples.push(sample));
        self.history.extend(samples);
        let used = use_endpoint(&mut endpoint, now);
        let events = endpoint.take_events();
        // Kept before the lock is given up, so that they stay in order.
        self.events.extend(events.iter().copied());
        drop(endpoint);
        events.iter().for_each(report);
        used
    }

    /// Takes a connection in.
    pub(super) fn connect(
        &self,
        stream: TcpStream,
        service: Service,
    ) -> Result<(u32, Arc<Line>), ConnectRefused> {
        let id = self.with_endpoint(|endpoint, now| endpoint.connect(service, now))?;
        let line = Arc::new(Line::new(stream));
        lock(&self.lines).insert(id, Arc::clone(&line));
        self.flush(id, &line);
        Ok((id, line))
    }

    /// Sends what waits for a client, and closes its connection if that is due.
    pub(super) fn flush(&self, id: u32, line: &Line) {
        let next = || self.with_endpoint(|endpoint, now| endpoint.take_frame(id, now));
        let sent = line.send(next);
        let closing = self.with_endpoint(|endpoint, _| endpoint.closing(id));
        match (sent, closing) {
            (Ok(()), None) => {}
            (_, Some(Closing::Reset)) => self.hang_up(id, true),
            (Err(error), _) => {
                tracing::debug!(%error, "client of the simulated arm is gone");
                self.hang_up(id, false);
            }
            (Ok(()), Some(Closing::Finish)) => self.hang_up(id, false),
        }
    }

    /// Ends a connection.
    pub(super) fn hang_up(&self, id: u32, by_reset: bool) {
        let line = lock(&self.lines).remove(&id);
        self.with_endpoint(|endpoint, _| endpoint.disconnect(id));
        if let Some(line) = line {
            line.close(by_reset);
        }
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    pub(super) fn stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    /// Ends all connections.
    pub(super) fn hang_up_all(&self) {
        let ids: Vec<u32> = lock(&self.lines).keys().copied().collect();
        ids.into_iter().for_each(|id| self.hang_up(id, false));
    }

    /// Steps the model and sends every millisecond until told to stop.
    pub(super) fn run(&self) {
        stand_for_another_machine();
        let mut deadline = clock::now();
        while !self.is_stopping() {
            let (now, busy) = self.with_endpoint(|endpoint, now| (now, endpoint.busy_clients(now)));
            for id in busy {
                let line = lock(&self.lines).get(&id).cloned();
                if let Some(line) = line {
                    self.flush(id, &line);
                }
            }
            // Late by more than a step: the next deadline still lies ahead.
            deadline = deadline.plus_s(STEP_S).max(now);
            clock::sleep_until(deadline);
        }
    }
}

/// Logs what a user of the simulated arm would want to know.
fn report(event: &TimedEvent) {
    match event.event {
        ArmEvent::Error(code) => tracing::warn!(%code, "the simulated arm stops"),
        ArmEvent::Fault {
            entry,
            kind,
            begins,
        } => {
            tracing::warn!(entry, ?kind, begins, "fault of the script");
        }
        _ => {}
    }
}
