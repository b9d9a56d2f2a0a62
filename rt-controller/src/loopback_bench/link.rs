//! The bench's command link: how long its receive call takes is noted, and a thread
//! answers every request at its other end.

use crate::control::LinkInput;
use crate::os::now_ns;
use crate::transport::tcp::TcpLink;
use crate::transport::{ArmTransport, LinkGone};
use crate::xarm::frame::MAX_FRAME_LEN;
use crate::xarm::{Command, FrameReader, ReplyData, Status};
use rtrb::Producer;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

/// A link with a stop-watch. RT-safe.
#[derive(Debug)]
pub(super) struct TimedLink {
    link: TcpLink,
    /// Duration of each poll (ns), in the order of the cycles.
    polls: Producer<u32>,
}

impl TimedLink {
    pub(super) fn new(link: TcpLink, polls: Producer<u32>) -> Self {
        Self { link, polls }
    }
}

impl ArmTransport for TimedLink {
    fn send(&mut self, commands: &[Command], now_ns: u64) -> Result<(), LinkGone> {
        self.link.send(commands, now_ns)
    }

    fn poll(&mut self, at_ns: u64) -> LinkInput {
        let began_ns = now_ns();
        let seen = self.link.poll(at_ns);
        let span_ns = now_ns().saturating_sub(began_ns);
        let _ = self.polls.push(u32::try_from(span_ns).unwrap_or(u32::MAX));
        seen
    }
}

/// Starts a thread that serves one connection and ends with it; its address.
pub(super) fn start_answerer() -> std::io::Result<SocketAddr> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    std::thread::Builder::new()
        .name("answerer".to_owned())
        .spawn(move || {
            if let Ok((stream, _)) = listener.accept() {
                // The other end has gone: that is how it ends.
                let _ = serve(stream);
            }
        })?;
    Ok(address)
}

fn serve(mut stream: TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let mut reader = FrameReader::new();
    let mut out = [0; MAX_FRAME_LEN];
    loop {
        let received = stream.read(reader.space())?;
        if received == 0 {
            return Ok(());
        }
        reader.commit(received);
        while let Ok(Some(frame)) = reader.next_frame() {
            let reply = frame
                .as_request()
                .and_then(|request| ReplyData::None.emit(&mut out, &request, Status(0)).ok());
            if let Some(reply) = reply.and_then(|len| out.get(..len)) {
                stream.write_all(reply)?;
            }
        }
    }
}
