//! Listening to a report port: connecting, cutting the stream into frames,
//! connecting again, for as long as the controller runs.
//!
//! What the frames mean is the sink's business. A frame that cannot be used is
//! dropped and counted; a stream that lost its place is opened anew at once. A
//! torn report is filled up with the beginning of the next one: such a frame may
//! hold proper numbers in wrong places, so one that took long to arrive, or that
//! is followed by what is no report, is dropped as well.

use crate::os::now_ns;
use crate::xarm::ReportReader;
use std::io::{ErrorKind, Read};
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

/// Longest wait for a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);
/// Pause before a new attempt.
const RETRY: Duration = Duration::from_millis(200);
/// Longest wait for bytes before `quit` is looked at again.
const READ_TIMEOUT: Duration = Duration::from_millis(100);
/// Longest time from the first byte of a report to its last (ns); half the time
/// between two. A report is one packet.
const ARRIVES_WITHIN_NS: u64 = 2_000_000;
/// Silence after which the connection is given up and opened again.
const SILENCE_NS: u64 = 2_000_000_000;

/// Reports that had to be dropped, counted across threads. Reading it is RT-safe.
#[derive(Debug, Clone, Default)]
pub struct BrokenReports(Arc<AtomicU32>);

impl BrokenReports {
    /// How many since the start, wrapping.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }

    fn add_one(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
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
            let opened_ns = now_ns();
            let mut at_once = false;
            if let Some((port, stream)) = self.connect() {
                self.sink.opened(port);
                let lost_its_place = self.listen(port, stream);
                let lasted_ns = u128::from(now_ns().saturating_sub(opened_ns));
                at_once = lost_its_place && lasted_ns > RETRY.as_nanos();
            }
            if self.quit.load(Ordering::Relaxed) {
                return;
            }
            if !at_once {
                std::thread::sleep(RETRY);
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

    /// Passes frames on until the connection breaks, falls silent or `quit`;
    /// true when it lost its place instead.
    fn listen(&mut self, port: usize, mut stream: TcpStream) -> bool {
        let mut reader = ReportReader::new();
        let mut seen = Seen::default();
        let mut heard_ns = now_ns();
        while !self.quit.load(Ordering::Relaxed) {
            match stream.read(reader.space()) {
                Ok(0) => break,
                Ok(n) => reader.commit(n),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    if now_ns().saturating_sub(heard_ns) > SILENCE_NS {
                        break;
                    }
                    continue;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(_gone) => break,
            }
            heard_ns = now_ns();
            if !self.pass_on(port, &mut reader, &mut seen, heard_ns) {
                return true;
            }
        }
        tracing::debug!("report connection ended");
        false
    }

    /// Passes all whole frames on; false when the stream lost its place. The
    /// size of a connection's reports never changes, so one of another size
    /// than the first good one is torn.
    fn pass_on(
        &mut self,
        port: usize,
        reader: &mut ReportReader,
        seen: &mut Seen,
        arrival_ns: u64,
    ) -> bool {
        loop {
            let followed_by_a_report = reader.is_followed_by_a_report();
            let begun_ns = seen.begun_ns.take().unwrap_or(arrival_ns);
            match reader.next_report() {
                Ok(Some(frame)) => {
                    let torn = !followed_by_a_report
                        || arrival_ns.saturating_sub(begun_ns) > ARRIVES_WITHIN_NS;
                    let fits = seen.size.is_none_or(|size| size == frame.len());
                    if fits && !torn && self.sink.take(port, frame, arrival_ns) {
                        seen.size = Some(frame.len());
                    } else {
                        self.broken.add_one();
                    }
                }
                Ok(None) => {
                    seen.begun_ns = (!reader.is_empty()).then_some(begun_ns);
                    return true;
                }
                Err(broken) => {
                    self.broken.add_one();
                    tracing::warn!(%broken, "a report stream lost its place");
                    return false;
                }
            }
        }
    }
}

/// What is remembered of a connection.
#[derive(Debug, Default)]
struct Seen {
    /// Size of its reports (bytes).
    size: Option<usize>,
    /// When the first byte of a report that is not whole yet came (ns).
    begun_ns: Option<u64>,
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
