//! The cable between controller and arm, in virtual time.

use rt_controller::transport::ByteStream;
use shared_types::MonotonicNs;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{Error, ErrorKind};
use std::rc::Rc;
use xarm_sim::{ArmEndpoint, Closing, ConnectRefused, JointSample, Service};

/// The arm, the present, and what is under way between the two ends.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) arm: ArmEndpoint,
    pub(super) now: MonotonicNs,
    /// Time a byte takes, each way (s).
    pub(super) delay_s: f64,
    /// Bytes on their way to the arm: arrival, client, bytes.
    to_arm: VecDeque<(MonotonicNs, u32, Vec<u8>)>,
}

impl Network {
    pub(super) fn new(arm: ArmEndpoint, now: MonotonicNs, delay_s: f64) -> Self {
        Self {
            arm,
            now,
            delay_s,
            to_arm: VecDeque::new(),
        }
    }

    /// Runs to `now`; the arm gets each byte when it arrives.
    pub(super) fn advance_to(&mut self, now: MonotonicNs, mut each: impl FnMut(JointSample)) {
        while let Some((at, ..)) = self.to_arm.front()
            && *at <= now
        {
            let at = *at;
            self.arm.advance_to(at, &mut each);
            if let Some((_, client, bytes)) = self.to_arm.pop_front() {
                self.arm.receive(client, at, &bytes);
            }
        }
        self.arm.advance_to(now, each);
        self.now = self.now.max(now);
    }

    /// The next frame that has reached the controller.
    pub(super) fn take_frame(&mut self, client: u32) -> Option<Vec<u8>> {
        let sent = self.now.plus_s(-self.delay_s);
        self.arm.take_frame(client, sent)
    }
}

/// The controller's end of a connection.
#[derive(Debug)]
pub struct VirtualStream {
    network: Rc<RefCell<Network>>,
    pub(super) client: u32,
    /// What came and did not fit into the last read.
    unread: Vec<u8>,
}

impl VirtualStream {
    pub(super) fn connect(
        network: &Rc<RefCell<Network>>,
        service: Service,
    ) -> Result<Self, ConnectRefused> {
        let client = {
            let mut net = network.borrow_mut();
            let now = net.now;
            net.arm.connect(service, now)?
        };
        Ok(Self {
            network: Rc::clone(network),
            client,
            unread: Vec::new(),
        })
    }
}

impl Drop for VirtualStream {
    fn drop(&mut self) {
        self.network.borrow_mut().arm.disconnect(self.client);
    }
}

impl ByteStream for VirtualStream {
    /// All that has come and fits, as a socket gives it.
    fn receive(&mut self, into: &mut [u8]) -> std::io::Result<(usize, Option<u64>)> {
        let mut net = self.network.borrow_mut();
        while self.unread.len() < into.len()
            && let Some(frame) = net.take_frame(self.client)
        {
            self.unread.extend(frame);
        }
        if self.unread.is_empty() {
            return match net.arm.closing(self.client) {
                None => Err(ErrorKind::WouldBlock.into()),
                Some(Closing::Finish) => Ok((0, None)),
                Some(Closing::Reset) => Err(ErrorKind::ConnectionReset.into()),
            };
        }
        let taken = self.unread.len().min(into.len());
        into[..taken].copy_from_slice(&self.unread[..taken]);
        self.unread.drain(..taken);
        Ok((taken, Some(net.now.0)))
    }

    fn send(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut net = self.network.borrow_mut();
        if net.arm.closing(self.client).is_some() {
            return Err(Error::from(ErrorKind::BrokenPipe));
        }
        let arrival = net.now.plus_s(net.delay_s);
        net.to_arm.push_back((arrival, self.client, bytes.to_vec()));
        Ok(bytes.len())
    }
}
