//! The controller's report threads in virtual time: what they do with a stream is
//! [`ReportFeed`], here is only the connection.

use super::network::{Network, VirtualStream};
use rt_controller::report_feed::{RETRY_NS, ReportFeed};
use rt_controller::transport::ByteStream;
use std::cell::RefCell;
use std::io::ErrorKind;
use std::rc::Rc;
use xarm_sim::{ReportKind, Service};

/// One report stream, opened again whenever it is lost.
#[derive(Debug)]
pub(super) struct Feed {
    kind: ReportKind,
    open: Option<(VirtualStream, ReportFeed)>,
    retry_ns: u64,
    /// Frames dropped since they were last asked for.
    broken: u32,
}

impl Feed {
    pub(super) const fn new(kind: ReportKind) -> Self {
        Self {
            kind,
            open: None,
            retry_ns: 0,
            broken: 0,
        }
    }

    /// Frames dropped since the last call.
    pub(super) const fn take_broken(&mut self) -> u32 {
        core::mem::replace(&mut self.broken, 0)
    }

    /// Opens the stream if it is due; whether it did.
    pub(super) fn reopen(&mut self, network: &Rc<RefCell<Network>>) -> bool {
        let now_ns = network.borrow().now.0;
        if self.open.is_some() || now_ns < self.retry_ns {
            return false;
        }
        self.retry_ns = now_ns.saturating_add(RETRY_NS);
        let stream = VirtualStream::connect(network, Service::Reports(self.kind)).ok();
        self.open = stream.map(|stream| (stream, ReportFeed::opened(now_ns)));
        self.open.is_some()
    }

    /// Passes every whole frame that has come until `now_ns` to `take`, which says
    /// whether it can be used.
    pub(super) fn frames(&mut self, now_ns: u64, mut take: impl FnMut(&[u8]) -> bool) {
        while let Some((stream, feed)) = &mut self.open {
            let lost_place = match stream.receive(feed.space()) {
                Ok((len, _)) if len > 0 => {
                    let seen = feed.received(len, now_ns, &mut take);
                    self.broken += seen.broken;
                    if seen.lost_place.is_none() {
                        continue;
                    }
                    true
                }
                Err(e) if e.kind() == ErrorKind::WouldBlock && !feed.is_silent(now_ns) => return,
                _ => false,
            };
            self.retry_ns = feed.retry_ns(now_ns, lost_place);
            self.open = None;
        }
    }
}
