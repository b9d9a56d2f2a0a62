//! One client of the command port.

use super::Plant;
use crate::arm::clock;
use rt_controller::xarm::frame::MAX_FRAME_LEN;
use rt_controller::xarm::{FrameReader, Protocol};
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// A client that does not take its replies for this long is dropped.
const SEND_TIMEOUT: Duration = Duration::from_secs(1);

/// Serves until the client leaves, breaks its stream, or the plant stops.
pub(super) fn serve(stream: &TcpStream, plant: &Plant) {
    if let Err(error) = answer_all(stream, plant) {
        tracing::debug!(%error, "client of the command port is gone");
    }
}

fn answer_all(mut stream: &TcpStream, plant: &Plant) -> io::Result<()> {
    stream.set_write_timeout(Some(SEND_TIMEOUT))?;
    let mut reader = FrameReader::new();
    let mut out = [0; MAX_FRAME_LEN];
    while !plant.is_stopping() {
        let received = stream.read(reader.space())?;
        let arrival = clock::now();
        if received == 0 {
            return Ok(());
        }
        reader.commit(received);
        while let Some(frame) = reader.next_frame().map_err(io::Error::other)? {
            // Only the private protocol is spoken here; a heartbeat is taken
            // silently, as is standard Modbus.
            if !matches!(
                frame.protocol,
                Protocol::Private | Protocol::PrivateHeartbeat
            ) {
                continue;
            }
            let Some(request) = frame.as_request() else {
                continue;
            };
            let answer = plant.with_model(|model, _| {
                model.request(arrival, request.register, request.parameters)
            });
            let len = answer
                .data
                .emit(&mut out, &request, answer.status)
                .map_err(io::Error::other)?;
            // One send per reply: the C++ SDK loses its place otherwise.
            stream.write_all(&out[..len])?;
        }
    }
    Ok(())
}
