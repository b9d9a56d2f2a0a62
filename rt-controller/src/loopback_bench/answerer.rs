//! The other end of the bench's command link: a thread that answers every request.

use crate::xarm::frame::MAX_FRAME_LEN;
use crate::xarm::{FrameReader, ReplyData, Status};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

/// Listens on this machine; its thread serves one connection and ends with it.
#[derive(Debug)]
pub(super) struct Answerer {
    address: SocketAddr,
}

impl Answerer {
    pub(super) fn start() -> std::io::Result<Self> {
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
        Ok(Self { address })
    }

    pub(super) const fn address(&self) -> SocketAddr {
        self.address
    }
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
