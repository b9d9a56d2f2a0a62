//! One client of a report port.

use super::Plant;
use crate::arm::clock;
use crate::arm::reports::{ReportFrame, ReportKind};
use shared_types::MonotonicNs;
use std::io::{self, Write};
use std::net::TcpStream;

/// Longest sleep, so that a stop is noticed soon (ns).
const NAP_NS: u64 = 20_000_000;

/// Sends reports until the client leaves or the plant stops; the first at once.
pub(super) fn serve(stream: &TcpStream, kind: ReportKind, plant: &Plant) {
    if let Err(error) = publish(stream, kind, plant) {
        tracing::debug!(%error, ?kind, "client of a report port is gone");
    }
}

fn publish(stream: &TcpStream, kind: ReportKind, plant: &Plant) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    let mut outbox = Outbox::default();
    let mut counter = 0_u32;
    let mut due = clock::now();
    while !plant.is_stopping() {
        let (frame, now) =
            plant.with_model(|model, now| (ReportFrame::of(model, kind, counter), now));
        counter = counter.wrapping_add(1);
        outbox.send(stream, frame.as_bytes())?;
        due.0 += kind.period_ns();
        if due <= now {
            // Too late for some: they are dropped, the grid stays.
            let missed = (now.0 - due.0) / kind.period_ns() + 1;
            due.0 += missed * kind.period_ns();
        }
        sleep_until_due(due, plant);
    }
    Ok(())
}

fn sleep_until_due(due: MonotonicNs, plant: &Plant) {
    loop {
        let now = clock::now();
        if now >= due || plant.is_stopping() {
            return;
        }
        clock::sleep_until(due.min(MonotonicNs(now.0 + NAP_NS)));
    }
}

/// Sends without ever waiting: a frame that the client is too slow for is
/// dropped, but never cut.
#[derive(Default)]
struct Outbox {
    /// Rest of a frame that was sent in part.
    unsent: Vec<u8>,
}

impl Outbox {
    fn send(&mut self, mut stream: &TcpStream, frame: &[u8]) -> io::Result<()> {
        if !self.unsent.is_empty() {
            let sent = write_some(&mut stream, &self.unsent)?;
            self.unsent.drain(..sent);
            if !self.unsent.is_empty() {
                return Ok(());
            }
        }
        let sent = write_some(&mut stream, frame)?;
        if sent > 0 {
            self.unsent.extend_from_slice(&frame[sent..]);
        }
        Ok(())
    }
}

/// Bytes written without waiting, 0 when the socket is full.
fn write_some(stream: &mut impl Write, bytes: &[u8]) -> io::Result<usize> {
    match stream.write(bytes) {
        Ok(0) => Err(io::ErrorKind::WriteZero.into()),
        Ok(sent) => Ok(sent),
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
            ) =>
        {
            Ok(0)
        }
        Err(error) => Err(error),
    }
}
