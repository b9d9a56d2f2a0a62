//! An arm without a body, on a socket of this machine: it answers every request,
//! well or badly.

use rt_controller::xarm::frame::{MAX_FRAME_LEN, Request};
use rt_controller::xarm::{FrameReader, ReplyData, Status};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// How it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Replies {
    /// As it should.
    #[default]
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

/// The arm; its thread ends with the process.
#[derive(Debug, Clone)]
pub(crate) struct EchoArm {
    pub(crate) address: SocketAddr,
    replies: Arc<Mutex<Replies>>,
    received: Arc<AtomicU64>,
    hung_up: Arc<AtomicBool>,
}

impl EchoArm {
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let arm = Self {
            address: listener.local_addr().unwrap(),
            replies: Arc::default(),
            received: Arc::default(),
            hung_up: Arc::default(),
        };
        let its = arm.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if !its.serve(stream.unwrap()) {
                    its.hung_up.store(true, Ordering::SeqCst);
                }
            }
        });
        arm
    }

    pub(crate) fn be(&self, replies: Replies) {
        self.hung_up.store(false, Ordering::SeqCst);
        *self.replies.lock().unwrap() = replies;
    }

    fn replies(&self) -> Replies {
        *self.replies.lock().unwrap()
    }

    /// Requests met so far, on all connections.
    pub(crate) fn received(&self) -> u64 {
        self.received.load(Ordering::SeqCst)
    }

    /// Whether it has met `asked` requests, each in its way.
    pub(crate) fn is_done_with(&self, asked: u64) -> bool {
        if self.replies() == Replies::HangUp {
            return self.hung_up.load(Ordering::SeqCst);
        }
        self.received() >= asked
    }

    /// False when it closed the connection itself.
    fn serve(&self, mut stream: TcpStream) -> bool {
        stream.set_nodelay(true).unwrap();
        let mut reader = FrameReader::new();
        while let Ok(n @ 1..) = stream.read(reader.space()) {
            reader.commit(n);
            while let Ok(Some(frame)) = reader.next_frame() {
                let request = frame.as_request().unwrap();
                let goes_on = self.answer(&mut stream, &request);
                self.received.fetch_add(1, Ordering::SeqCst);
                if !goes_on {
                    return false;
                }
            }
        }
        true
    }

    /// False when the connection is to be closed.
    fn answer(&self, stream: &mut TcpStream, request: &Request<'_>) -> bool {
        let replies = self.replies();
        let status = match replies {
            Replies::Error => Status(Status::ERROR | Status::NOT_READY),
            Replies::NotReady => Status(Status::NOT_READY),
            Replies::Good | Replies::Foreign => Status(0),
            Replies::Mute => return true,
            Replies::HangUp => return false,
        };
        let mut request = *request;
        if replies == Replies::Foreign {
            request.transaction = request.transaction.wrapping_add(1000);
        }
        let mut out = [0; MAX_FRAME_LEN];
        let n = ReplyData::None.emit(&mut out, &request, status).unwrap();
        // The other end may have gone; that is seen when it is read from.
        let _ = stream.write_all(&out[..n]);
        true
    }
}
