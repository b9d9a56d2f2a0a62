//! Sockets and the monotonic clock around the endpoint.
//!
//! One thread steps the endpoint every millisecond by absolute deadlines and
//! sends what is due; one thread per port accepts; one thread per connection
//! reads. Whoever needs the endpoint first brings it up to the present, so
//! simulated time equals monotonic time however late any thread runs.

use super::config::ArmConfig;
use super::endpoint::Service;
use super::event::TimedEvent;
use super::fault::Fault;
use super::history::{History, JointSample};
use super::reports::ReportKind;
use super::start_error::ArmStartError;
use listener::{Listener, join, listen};
use plant::Plant;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

mod line;
mod listener;
mod plant;

/// Ports that a simulated arm listens on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmPorts {
    /// Commands.
    pub command: u16,
    /// Real-time, normal, rich and real report. Firmware without a real-time
    /// report listens on the other three only.
    pub reports: [u16; 4],
}

/// A running simulated arm; stops when dropped.
#[derive(Debug)]
pub struct SimulatedArm {
    plant: Arc<Plant>,
    ports: ArmPorts,
    model_thread: Option<JoinHandle<()>>,
    listeners: Vec<Listener>,
}

impl SimulatedArm {
    /// Starts listening and moving; ports set to 0 become free ones, see
    /// [`ports`](Self::ports).
    ///
    /// # Errors
    /// [`ArmStartError`], which names the port and what to do.
    pub fn start(config: ArmConfig) -> Result<Self, ArmStartError> {
        config.check()?;
        let command = listen(config.bind, config.command_port)?;
        let mut numbers = [command.local_addr()?.port(), 0, 0, 0, 0];
        let mut sockets = vec![(command, Service::Commands)];
        let requests = config.report_ports.into_iter().zip(ReportKind::ALL);
        for ((port, kind), number) in requests.zip(&mut numbers[1..]) {
            let listener = listen(config.bind, port)?;
            *number = listener.local_addr()?.port();
            if kind.len(config.firmware).is_some() {
                sockets.push((listener, Service::Reports(kind)));
            }
        }
        let [command, reports @ ..] = numbers;

        let plant = Arc::new(Plant::new(config));
        let mut arm = Self {
            plant: Arc::clone(&plant),
            ports: ArmPorts { command, reports },
            model_thread: None,
            listeners: Vec::new(),
        };
        arm.model_thread = Some(
            thread::Builder::new()
                .name("arm-model".to_owned())
                .spawn(move || plant.run())?,
        );
        for (listener, service) in sockets {
            let listener = Listener::open(listener, service, &arm.plant)?;
            arm.listeners.push(listener);
        }
        Ok(arm)
    }

    /// The ports it listens on.
    #[must_use]
    pub fn ports(&self) -> ArmPorts {
        self.ports
    }

    /// True joint motion, 1 kHz, stamped CLOCK_MONOTONIC.
    #[must_use]
    pub fn history(&self) -> History<JointSample> {
        self.plant.history.clone()
    }

    /// What it got and what happened to it, stamped CLOCK_MONOTONIC.
    #[must_use]
    pub fn events(&self) -> History<TimedEvent> {
        self.plant.events.clone()
    }

    /// Adds a fault to the script it runs.
    pub fn inject(&self, fault: Fault) {
        self.plant
            .with_endpoint(|endpoint, _| endpoint.inject(fault));
    }

    /// Closes all connections and waits for all threads.
    pub fn stop(self) {
        drop(self);
    }
}

impl Drop for SimulatedArm {
    fn drop(&mut self) {
        self.plant.stop();
        self.plant.hang_up_all();
        for listener in self.listeners.drain(..) {
            listener.close();
        }
        if let Some(model_thread) = self.model_thread.take() {
            join(model_thread);
        }
    }
}
