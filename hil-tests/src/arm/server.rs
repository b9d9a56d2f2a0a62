//! Sockets and the monotonic clock around the model.
//!
//! One thread steps the model every millisecond by absolute deadlines; one
//! thread per port accepts; one thread per connection serves. Whoever needs the
//! model first brings it up to the present, so simulated time equals monotonic
//! time however late any thread runs.

use super::clock;
use super::config::{ArmConfig, ArmStartError};
use super::history::MotionHistory;
use super::model::{ArmModel, STEP_S};
use super::reports::ReportKind;
use rt_controller::os::{RealTimeSettings, enter_real_time};
use rt_controller::xarm::ErrorCode;
use shared_types::MonotonicNs;
use socket2::{Domain, SockRef, Socket, Type};
use std::io;
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

mod commands;
mod publish;

/// Connections served at once on the command port.
const COMMAND_CLIENTS_MAX: usize = 32;
/// Connections that the system may keep waiting for `accept`.
const BACKLOG: i32 = 64;

/// Ports that a simulated arm listens on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmPorts {
    /// Commands.
    pub command: u16,
    /// Real-time, normal, rich and real report.
    pub reports: [u16; 4],
}

/// The model, and what threads need to share it.
#[derive(Debug)]
struct Plant {
    model: Mutex<ArmModel>,
    history: MotionHistory,
    stop: AtomicBool,
}

impl Plant {
    /// Brings the model up to the present and uses it; `now` is that present.
    fn with_model<R>(&self, use_model: impl FnOnce(&mut ArmModel, MonotonicNs) -> R) -> R {
        // The model is consistent between steps even if a user of it panicked.
        let mut model = self.model.lock().unwrap_or_else(PoisonError::into_inner);
        let now = clock::now();
        let mut samples = Vec::new();
        model.advance_to(now, |sample| samples.push(sample));
        self.history.extend(samples);
        use_model(&mut model, now)
    }

    fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    /// Steps the model every millisecond until told to stop.
    fn run(&self) {
        stand_for_another_machine();
        let mut deadline = clock::now();
        while !self.is_stopping() {
            let now = self.with_model(|_, now| now);
            // Late by more than a step: the next deadline still lies ahead.
            deadline = deadline.plus_s(STEP_S).max(now);
            clock::sleep_until(deadline);
        }
    }
}

/// `SCHED_FIFO` priority of the arm's threads, below that of a controller.
const ARM_PRIORITY: u8 = 40;

/// Puts the calling thread ahead of ordinary ones: a real arm has a computer of
/// its own and takes setpoints in time whatever the client's machine does.
/// Without the right to do so the arm works all the same, but under heavy load
/// it may see setpoints late and stop with C24.
fn stand_for_another_machine() {
    let settings = RealTimeSettings {
        priority: Some(ARM_PRIORITY),
        cpu: None,
        lock_memory: false,
        require: false,
    };
    for warning in enter_real_time(&settings) {
        tracing::debug!(%warning, "simulated arm");
    }
}

/// A connection being served.
#[derive(Debug)]
struct Connection {
    stream: TcpStream,
    thread: JoinHandle<()>,
}

/// A listening port and its accepting thread.
#[derive(Debug)]
struct Door {
    listener: TcpListener,
    thread: JoinHandle<()>,
}

/// What a port serves.
#[derive(Debug, Clone, Copy)]
enum Service {
    Commands,
    Reports(ReportKind),
}

/// A running simulated arm; stops when dropped.
#[derive(Debug)]
pub struct SimulatedArm {
    plant: Arc<Plant>,
    ports: ArmPorts,
    model_thread: Option<JoinHandle<()>>,
    doors: Vec<Door>,
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
        let mut doors_to_open = vec![(command, Service::Commands)];
        for (port, kind) in config.report_ports.into_iter().zip(ReportKind::ALL) {
            doors_to_open.push((listen(config.bind, port)?, Service::Reports(kind)));
        }
        let mut numbers = [0; 5];
        for (number, (listener, _)) in numbers.iter_mut().zip(&doors_to_open) {
            *number = listener.local_addr()?.port();
        }
        let [command, reports @ ..] = numbers;

        let plant = Arc::new(Plant {
            model: Mutex::new(ArmModel::new(config, clock::now())),
            history: MotionHistory::default(),
            stop: AtomicBool::new(false),
        });
        let mut arm = Self {
            plant: Arc::clone(&plant),
            ports: ArmPorts { command, reports },
            model_thread: None,
            doors: Vec::new(),
        };
        arm.model_thread = Some(
            thread::Builder::new()
                .name("arm-model".to_owned())
                .spawn(move || plant.run())?,
        );
        for (listener, service) in doors_to_open {
            arm.doors.push(Door::open(listener, service, &arm.plant)?);
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
    pub fn history(&self) -> MotionHistory {
        self.plant.history.clone()
    }

    /// Raises an error as if the arm had found it, to try how clients react.
    pub fn raise_error(&self, error: ErrorCode) {
        self.plant.with_model(|model, _| model.raise(error));
    }

    /// Closes all connections and waits for all threads.
    pub fn stop(self) {
        drop(self);
    }
}

impl Drop for SimulatedArm {
    fn drop(&mut self) {
        self.plant.stop.store(true, Ordering::Release);
        for door in self.doors.drain(..) {
            // Wakes the thread out of accept.
            if let Err(error) = SockRef::from(&door.listener).shutdown(Shutdown::Both) {
                tracing::debug!(%error, "listener was closed already");
            }
            join(door.thread);
        }
        if let Some(model_thread) = self.model_thread.take() {
            join(model_thread);
        }
    }
}

/// Runs a simulated arm until `stop` is set.
///
/// # Errors
/// [`ArmStartError`].
pub fn serve_forever(config: ArmConfig, stop: &AtomicBool) -> Result<(), ArmStartError> {
    let arm = SimulatedArm::start(config)?;
    while !stop.load(Ordering::Acquire) {
        thread::sleep(Duration::from_millis(50));
    }
    arm.stop();
    Ok(())
}

impl Door {
    fn open(
        listener: TcpListener,
        service: Service,
        plant: &Arc<Plant>,
    ) -> Result<Self, ArmStartError> {
        let accepting = listener.try_clone()?;
        let plant = Arc::clone(plant);
        let thread = thread::Builder::new()
            .name("arm-accept".to_owned())
            .spawn(move || accept_all(&accepting, service, &plant))?;
        Ok(Self { listener, thread })
    }
}

/// Accepts clients until the plant stops, then closes them all.
fn accept_all(listener: &TcpListener, service: Service, plant: &Arc<Plant>) {
    let clients_max = match service {
        Service::Commands => COMMAND_CLIENTS_MAX,
        Service::Reports(kind) => kind.clients_max(),
    };
    let mut open: Vec<Connection> = Vec::new();
    while !plant.is_stopping() {
        let accepted = listener.accept();
        open.retain(|connection| !connection.thread.is_finished());
        match accepted {
            Ok(_) if plant.is_stopping() => break,
            Ok((_, peer)) if open.len() >= clients_max => {
                tracing::warn!(%peer, clients_max, "too many clients, connection closed");
            }
            Ok((stream, peer)) => match Connection::serve(stream, service, plant) {
                Ok(connection) => open.push(connection),
                Err(error) => tracing::warn!(%peer, %error, "cannot serve the client"),
            },
            Err(error) => {
                // Out of descriptors, say: later is better than never.
                tracing::debug!(%error, "accept failed");
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
    for connection in open {
        connection.close();
    }
}

impl Connection {
    fn serve(stream: TcpStream, service: Service, plant: &Arc<Plant>) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        let served = stream.try_clone()?;
        let plant = Arc::clone(plant);
        let thread = thread::Builder::new()
            .name("arm-client".to_owned())
            .spawn(move || {
                stand_for_another_machine();
                match service {
                    Service::Commands => commands::serve(&served, &plant),
                    Service::Reports(kind) => publish::serve(&served, kind, &plant),
                }
                // The other handle would keep the connection open. An error
                // means that the client was faster.
                let _ = served.shutdown(Shutdown::Both);
            })?;
        Ok(Self { stream, thread })
    }

    fn close(self) {
        // An error means that the client was faster.
        let _ = self.stream.shutdown(Shutdown::Both);
        join(self.thread);
    }
}

fn join(thread: JoinHandle<()>) {
    let name = thread.thread().name().unwrap_or("unnamed").to_owned();
    if thread.join().is_err() {
        tracing::error!(name, "thread of the simulated arm panicked");
    }
}

fn listen(bind: IpAddr, port: u16) -> Result<TcpListener, ArmStartError> {
    let address = SocketAddr::new(bind, port);
    let attempt = || -> io::Result<TcpListener> {
        let socket = Socket::new(Domain::for_address(address), Type::STREAM, None)?;
        // A restart must not wait for connections of the last run to expire.
        socket.set_reuse_address(true)?;
        socket.bind(&address.into())?;
        socket.listen(BACKLOG)?;
        Ok(socket.into())
    };
    attempt().map_err(|source| match source.kind() {
        io::ErrorKind::PermissionDenied => ArmStartError::Permission { bind, port },
        io::ErrorKind::AddrInUse => ArmStartError::PortInUse { bind, port },
        _ => ArmStartError::Listen { bind, port, source },
    })
}
