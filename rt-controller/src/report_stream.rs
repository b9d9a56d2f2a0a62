//! Listening to a report port: connecting, cutting the stream into frames,
//! connecting again, for as long as the controller runs.
//!
//! What the frames mean is the sink's business, which of them can be used that of
//! [`ReportFeed`].

use crate::os::now_ns;
use crate::report_feed::{RETRY_NS, ReportFeed};
use std::io::{ErrorKind, Read};
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

/// Longest wait for a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);
/// Longest wait for bytes before `quit` is looked at again.
const READ_TIMEOUT: Duration = Duration::from_millis(100);
/// Pause before a new attempt where nothing listened.
const RETRY: Duration = Duration::from_nanos(RETRY_NS);

/// Reports that had to be dropped, counted across threads. Reading it is RT-safe.
#[derive(Debug, Clone, Default)]
pub struct BrokenReports(Arc<AtomicU32>);

impl BrokenReports {
    /// How many since the start, wrapping.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }

    fn add(&self, count: u32) {
        self.0.fetch_add(count, Ordering::Relaxed);
    }
}

/// Takes the reports of one stream.
pub trait ReportSink {
    /// A connection to the port with index `port` was opened.
    fn opened(&mut self, port: usize);

    /// A whole frame from the port with index `port`, with its size field, that
    /// arrived at `arrival_ns`; false when it cannot be used.
    fn take(&mut self, port: usize, frame: &[u8], arrival_ns: u64) -> bool;
}

/// One report stream of an arm.
#[derive(Debug)]
pub struct ReportStream<S> {
    /// Address of the arm.
    pub arm: IpAddr,
    /// Ports in the order in which they are tried.
    pub ports: Vec<u16>,
    /// Where the frames go.
    pub sink: S,
    /// Where frames that cannot be used are counted.
    pub broken: BrokenReports,
    /// Ends the stream when set.
    pub quit: Arc<AtomicBool>,
}

impl<S: ReportSink> ReportStream<S> {
    /// Listens until `quit` is set.
    pub fn run(&mut self) {
        while !self.quit.load(Ordering::Relaxed) {
            let pause = self.connect().map_or(RETRY, |(port, stream)| {
                self.sink.opened(port);
                self.listen(port, stream)
            });
            if !self.quit.load(Ordering::Relaxed) {
                std::thread::sleep(pause);
            }
        }
    }

    fn connect(&self) -> Option<(usize, TcpStream)> {
        let open = |port: u16| {
            let address = SocketAddr::new(self.arm, port);
            let stream = TcpStream::connect_timeout(&address, CONNECT_TIMEOUT).ok()?;
            stream.set_read_timeout(Some(READ_TIMEOUT)).ok()?;
            tracing::info!(%address, "listening to reports");
            Some(stream)
        };
        let mut ports = self.ports.iter().enumerate();
        ports.find_map(|(index, port)| open(*port).map(|stream| (index, stream)))
    }

    /// Passes frames on until the connection breaks, falls silent, loses its place
    /// or `quit`; the pause before the next one.
    fn listen(&mut self, port: usize, mut stream: TcpStream) -> Duration {
        let mut feed = ReportFeed::opened(now_ns());
        let mut lost_place = None;
        while lost_place.is_none() && !self.quit.load(Ordering::Relaxed) {
            let len = match stream.read(feed.space()) {
                Ok(0) => break,
                Ok(len) => len,
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    if feed.is_silent(now_ns()) {
                        break;
                    }
                    continue;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(_gone) => break,
            };
            let arrival_ns = now_ns();
            let seen = feed.received(len, arrival_ns, |frame| {
                self.sink.take(port, frame, arrival_ns)
            });
            self.broken.add(seen.broken);
            lost_place = seen.lost_place;
        }
        match lost_place {
            Some(broken) => tracing::warn!(%broken, "a report stream lost its place"),
            None => tracing::debug!("report connection ended"),
        }
        let over_ns = now_ns();
        let retry_ns = feed.retry_ns(over_ns, lost_place.is_some());
        Duration::from_nanos(retry_ns.saturating_sub(over_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::net::TcpListener;
    use std::sync::mpsc;

    struct Sizes(mpsc::Sender<usize>);

    impl ReportSink for Sizes {
        fn opened(&mut self, _port: usize) {}
        fn take(&mut self, _port: usize, frame: &[u8], _arrival_ns: u64) -> bool {
            frame.get(4) != Some(&0xFF) && self.0.send(frame.len()).is_ok()
        }
    }

    fn frame(size: u32, first: u8) -> Vec<u8> {
        let mut bytes = size.to_be_bytes().to_vec();
        bytes.resize(usize::try_from(size).unwrap(), 0);
        bytes[4] = first;
        bytes
    }

    #[test]
    fn unusable_and_torn_frames_are_dropped_and_counted_and_a_lost_place_is_found_again() {
        let server = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = server.local_addr().unwrap();
        // The first port refuses: nobody listens there any more.
        let gone = TcpListener::bind("127.0.0.1:0").unwrap();
        let refused = gone.local_addr().unwrap().port();
        drop(gone);
        let (sender, sizes) = mpsc::channel();
        let (broken, quit) = (BrokenReports::default(), Arc::new(AtomicBool::new(false)));
        let mut stream = ReportStream {
            arm: address.ip(),
            ports: vec![refused, address.port()],
            sink: Sizes(sender),
            broken: broken.clone(),
            quit: Arc::clone(&quit),
        };
        let listening = std::thread::spawn(move || stream.run());
        let wait = Duration::from_secs(10);

        let (mut peer, _) = server.accept().unwrap();
        for bytes in [
            frame(135, 1),
            frame(145, 1),    // another size
            frame(135, 0xFF), // unusable
            frame(135, 2),
        ] {
            peer.write_all(&bytes).unwrap();
        }
        assert_eq!(sizes.recv_timeout(wait), Ok(135));
        assert_eq!(sizes.recv_timeout(wait), Ok(135));
        peer.write_all(&[0xFF; 8]).unwrap(); // no size at all

        let (mut again, _) = server.accept().unwrap();
        again.write_all(&frame(145, 1)).unwrap();
        assert_eq!(sizes.recv_timeout(wait), Ok(145));
        assert_eq!(broken.count(), 3);

        // Torn: filled up by the next one, whose rest is no report, at once ...
        let mut torn = frame(145, 1)[..60].to_vec();
        torn.extend(frame(145, 1));
        again.write_all(&torn).unwrap();
        let (mut again, _) = server.accept().unwrap();
        again.write_all(&frame(135, 1)).unwrap();
        assert_eq!(sizes.recv_timeout(wait), Ok(135), "nothing of the torn one");
        // ... or only when the next one comes.
        again.write_all(&frame(135, 1)[..60]).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        again.write_all(&frame(135, 1)[..75]).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        again.write_all(&frame(135, 2)).unwrap();
        assert_eq!(sizes.recv_timeout(wait), Ok(135));
        assert!(sizes.try_recv().is_err(), "the late one was dropped");
        assert_eq!(broken.count(), 6);
        quit.store(true, Ordering::Relaxed);
        listening.join().unwrap();
    }
}
