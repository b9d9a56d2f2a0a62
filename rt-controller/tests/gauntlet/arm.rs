//! An arm without a body, on a socket of this machine: it answers every request,
//! well or badly.

use rt_controller::xarm::frame::{MAX_FRAME_LEN, Request};
use rt_controller::xarm::{FrameReader, ReplyData, Status};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

/// How it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Replies {
    /// As it should.
    Good,
    /// Not at all.
    Mute,
    /// With an error.
    Error,
    /// Unable to move.
    NotReady,
    /// To questions that nobody here asked.
    Foreign,
    /// By closing the connection.
    HangUp,
}

/// The arm and the one connection to it.
#[derive(Debug)]
pub(crate) struct EchoArm {
    listener: TcpListener,
    link: Option<TcpStream>,
    reader: FrameReader,
    pub(crate) replies: Replies,
}

impl EchoArm {
    pub(crate) fn start() -> Self {
        Self {
            listener: TcpListener::bind("127.0.0.1:0").unwrap(),
            link: None,
            reader: FrameReader::new(),
            replies: Replies::Good,
        }
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.listener.local_addr().unwrap()
    }

    /// Takes the next connection; the one before is over.
    pub(crate) fn accept(&mut self) {
        let (link, _) = self.listener.accept().unwrap();
        link.set_nodelay(true).unwrap();
        link.set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        (self.link, self.reader) = (Some(link), FrameReader::new());
    }

    /// Waits for `count` requests and meets each in its way; false once there is no
    /// connection any more.
    pub(crate) fn meet(&mut self, count: u64) -> bool {
        let mut met = 0;
        while met < count {
            let Some(link) = &mut self.link else {
                return false;
            };
            let goes_on = match self.reader.next_frame().unwrap() {
                Some(frame) => {
                    met += 1;
                    answer(link, self.replies, frame.as_request().unwrap())
                }
                None => {
                    let received = link.read(self.reader.space()).unwrap();
                    self.reader.commit(received);
                    received > 0
                }
            };
            if !goes_on {
                self.link = None;
            }
        }
        true
    }
}

/// False when the connection is to be closed.
fn answer(link: &mut TcpStream, replies: Replies, mut request: Request<'_>) -> bool {
    let status = match replies {
        Replies::Error => Status(Status::ERROR | Status::NOT_READY),
        Replies::NotReady => Status(Status::NOT_READY),
        Replies::Good | Replies::Foreign => Status(0),
        Replies::Mute => return true,
        Replies::HangUp => return false,
    };
    if replies == Replies::Foreign {
        request.transaction = request.transaction.wrapping_add(1000);
    }
    let mut out = [0; MAX_FRAME_LEN];
    let n = ReplyData::None.emit(&mut out, &request, status).unwrap();
    // The other end may have gone; that is seen when it is read from.
    let _ = link.write_all(&out[..n]);
    true
}
