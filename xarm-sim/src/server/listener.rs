//! Listening ports, and the threads that read what their clients send.

use super::plant::{Plant, stand_for_another_machine};
use crate::clock;
use crate::endpoint::Service;
use crate::start_error::ArmStartError;
use rt_controller::os::receive::{receive, stamp_arrivals};
use shared_types::MonotonicNs;
use socket2::{Domain, SockRef, Socket, Type};
use std::io;
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Connections that the system may keep waiting for `accept`.
const BACKLOG: i32 = 64;
/// Bytes read at once.
const READ_LEN: usize = 2048;
/// Older stamps are not believed (s).
const STAMP_AGE_MAX_S: f64 = 0.1;
/// Pause of a reader that must not read.
const DEAF_PAUSE: Duration = Duration::from_millis(2);

/// A listening port and its accepting thread.
#[derive(Debug)]
pub(super) struct Listener {
    socket: TcpListener,
    thread: JoinHandle<()>,
}

impl Listener {
    pub(super) fn open(
        socket: TcpListener,
        service: Service,
        plant: &Arc<Plant>,
    ) -> Result<Self, ArmStartError> {
        let accepting = socket.try_clone()?;
        let plant = Arc::clone(plant);
        let thread = thread::Builder::new()
            .name("arm-accept".to_owned())
            .spawn(move || accept_all(&accepting, service, &plant))?;
        Ok(Self { socket, thread })
    }

    /// Accepts nobody any more; the plant has been told to stop.
    pub(super) fn close(self) {
        // Wakes the thread out of accept.
        if let Err(error) = SockRef::from(&self.socket).shutdown(Shutdown::Both) {
            tracing::debug!(%error, "listener was closed already");
        }
        join(self.thread);
    }
}

/// Accepts clients until the plant stops, then waits for their readers.
fn accept_all(listener: &TcpListener, service: Service, plant: &Arc<Plant>) {
    let mut readers: Vec<JoinHandle<()>> = Vec::new();
    while !plant.is_stopping() {
        let accepted = listener.accept();
        readers.retain(|reader| !reader.is_finished());
        match accepted {
            Ok(_) if plant.is_stopping() => break,
            Ok((stream, peer)) => match serve(stream, service, plant) {
                Ok(reader) => readers.push(reader),
                Err(error) => tracing::warn!(%peer, %error, "client of the simulated arm closed"),
            },
            Err(error) => {
                // Out of descriptors, say: later is better than never.
                tracing::debug!(%error, "accept failed");
                thread::sleep(Duration::from_millis(10));
            }
        }
    }
    plant.hang_up_all();
    readers.into_iter().for_each(join);
}

fn serve(stream: TcpStream, service: Service, plant: &Arc<Plant>) -> io::Result<JoinHandle<()>> {
    stream.set_nodelay(true)?;
    // Without stamps the time of reading counts.
    let _ = stamp_arrivals(&stream);
    let (id, line) = plant.connect(stream, service).map_err(io::Error::other)?;
    let reading_plant = Arc::clone(plant);
    let spawned = thread::Builder::new()
        .name("arm-client".to_owned())
        .spawn(move || {
            stand_for_another_machine();
            read_all(&line.stream, id, &reading_plant, &line);
            reading_plant.hang_up(id, false);
        });
    if spawned.is_err() {
        plant.hang_up(id, false);
    }
    spawned
}

/// Reads until the client leaves or its connection is closed. Clients of report
/// ports say nothing; reading notices that they leave.
fn read_all(stream: &TcpStream, id: u32, plant: &Plant, line: &super::line::Line) {
    let mut bytes = [0; READ_LEN];
    let is_closed = || plant.with_endpoint(|endpoint, _| endpoint.closing(id).is_some());
    while !plant.is_stopping() {
        let (received, stamp_ns) = match receive(stream, &mut bytes) {
            Ok((0, _)) => return,
            Ok(received) => received,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(_gone) => return,
        };
        let arrival = arrival(stamp_ns, clock::now());
        let listens =
            plant.with_endpoint(|endpoint, _| endpoint.receive(id, arrival, &bytes[..received]));
        plant.flush(id, line);
        if !listens {
            while !plant.is_stopping() && !is_closed() {
                thread::sleep(DEAF_PAUSE);
            }
        }
    }
}

/// When bytes reached the network: this thread may be held up with the whole
/// machine, a controller of its own would not be. A stamp far from now is that
/// of a wall clock that was set meanwhile.
fn arrival(stamp_ns: Option<u64>, now: MonotonicNs) -> MonotonicNs {
    stamp_ns
        .map(|ns| MonotonicNs(ns.min(now.0)))
        .filter(|stamp| now.since_s(*stamp) < STAMP_AGE_MAX_S)
        .unwrap_or(now)
}

pub(super) fn join(thread: JoinHandle<()>) {
    let name = thread.thread().name().unwrap_or("unnamed").to_owned();
    if thread.join().is_err() {
        tracing::error!(name, "thread of the simulated arm panicked");
    }
}

pub(super) fn listen(bind: IpAddr, port: u16) -> Result<TcpListener, ArmStartError> {
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
