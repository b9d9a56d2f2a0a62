//! Listening to a report port: a thread that connects, cuts the stream into frames,
//! decodes them and passes each report on through two rings, to the control loop and
//! to the bridge; and connects again, for as long as the controller runs.
//!
//! It is not the real-time thread. Which frames can be used is decided by
//! [`ReportFeed`].

use crate::control::ArmCodes;
use crate::os::now_ns;
use crate::os::schedule::set_fifo;
use crate::report_feed::{JointDecoder, RETRY_NS, ReportFeed, arm_codes};
use rtrb::Producer;
use shared_types::ipc::JointReport;
use std::io::{ErrorKind, Read};
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest wait for a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);
/// Longest wait for bytes before `quit` is looked at again.
const READ_TIMEOUT: Duration = Duration::from_millis(100);
/// Pause before a new attempt where nothing listened.
const RETRY: Duration = Duration::from_nanos(RETRY_NS);

/// Decodes the frames of one connection, given with their size field and when they
/// arrived (CLOCK_MONOTONIC, ns); `None` for one that cannot be used.
pub type Decoder<R> = Box<dyn FnMut(&[u8], u64) -> Option<R>>;

/// Decodes joint reports: of the real-time port (index 0, 250 Hz, with the arm's own
/// clock) or, where that refuses, of the real port (100 Hz, without).
#[must_use]
pub fn joint_decoder(port: usize) -> Decoder<JointReport> {
    let mut joints = JointDecoder::default();
    Box::new(move |frame, arrival_ns| match port {
        0 => joints.realtime(frame, arrival_ns),
        _ => JointDecoder::real(frame, arrival_ns),
    })
}

/// Decodes the arm's codes, which only the 5 Hz reports carry.
#[must_use]
pub fn code_decoder(_port: usize) -> Decoder<ArmCodes> {
    Box::new(arm_codes)
}

/// One report stream of an arm.
#[derive(Debug)]
pub struct ReportStream<R> {
    /// Address of the arm.
    pub arm: IpAddr,
    /// Ports in the order in which they are tried.
    pub ports: Vec<u16>,
    /// Makes the decoder of a new connection from the index of its port.
    pub decoder: fn(usize) -> Decoder<R>,
    /// To the control loop and to the bridge.
    pub rings: [Producer<R>; 2],
    /// Where frames that cannot be used are counted, wrapping.
    pub broken: Arc<AtomicU32>,
    /// Ends the stream when set.
    pub quit: Arc<AtomicBool>,
}

impl<R: Copy + Send + 'static> ReportStream<R> {
    /// Listens in a thread called `name`, with a `SCHED_FIFO` priority if it may have
    /// one, which ends soon after `quit` is set.
    ///
    /// # Errors
    /// When the system has no more threads.
    pub fn spawn(mut self, name: &str, priority: Option<u8>) -> std::io::Result<JoinHandle<()>> {
        std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                if let Some(priority) = priority {
                    // Without it reports are merely stamped a little later.
                    let _ = set_fifo(priority);
                }
                self.run();
            })
    }

    fn run(&mut self) {
        while !self.quit.load(Ordering::Relaxed) {
            let pause = self
                .connect()
                .map_or(RETRY, |(port, stream)| self.listen(port, stream));
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
        let mut decode = (self.decoder)(port);
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
                let report = decode(frame, arrival_ns);
                for ring in &mut self.rings {
                    // A full ring loses what is pushed.
                    let _ = report.map(|report| ring.push(report));
                }
                report.is_some()
            });
            self.broken.fetch_add(seen.broken, Ordering::Relaxed);
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
    use rtrb::{Consumer, RingBuffer};
    use std::io::Write;
    use std::net::TcpListener;
    use std::time::Instant;

    /// The size of a frame, unless it begins with 0xFF.
    fn size_of_frame(_port: usize) -> Decoder<usize> {
        Box::new(|frame, _| (frame.get(4) != Some(&0xFF)).then_some(frame.len()))
    }

    fn next(sizes: &mut Consumer<usize>) -> Option<usize> {
        let began = Instant::now();
        while sizes.is_empty() && began.elapsed() < Duration::from_secs(10) {
            std::thread::sleep(Duration::from_millis(1));
        }
        sizes.pop().ok()
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
        let (to_loop, mut sizes) = RingBuffer::new(16);
        let (to_bridge, _nobody) = RingBuffer::new(16);
        let (broken, quit) = (Arc::<AtomicU32>::default(), Arc::<AtomicBool>::default());
        let stream = ReportStream {
            arm: address.ip(),
            ports: vec![refused, address.port()],
            decoder: size_of_frame,
            rings: [to_loop, to_bridge],
            broken: Arc::clone(&broken),
            quit: Arc::clone(&quit),
        };
        let listening = stream.spawn("reports", None).unwrap();

        let (mut peer, _) = server.accept().unwrap();
        for bytes in [
            frame(135, 1),
            frame(145, 1),    // another size
            frame(135, 0xFF), // unusable
            frame(135, 2),
        ] {
            peer.write_all(&bytes).unwrap();
        }
        assert_eq!(next(&mut sizes), Some(135));
        assert_eq!(next(&mut sizes), Some(135));
        peer.write_all(&[0xFF; 8]).unwrap(); // no size at all

        let (mut again, _) = server.accept().unwrap();
        again.write_all(&frame(145, 1)).unwrap();
        assert_eq!(next(&mut sizes), Some(145));
        assert_eq!(broken.load(Ordering::Relaxed), 3);

        // Truncated: filled up by the next one, whose rest is no report, at once ...
        let mut truncated = frame(145, 1)[..60].to_vec();
        truncated.extend(frame(145, 1));
        again.write_all(&truncated).unwrap();
        let (mut again, _) = server.accept().unwrap();
        again.write_all(&frame(135, 1)).unwrap();
        assert_eq!(next(&mut sizes), Some(135), "nothing of the truncated one");
        // ... or only when the next one comes.
        again.write_all(&frame(135, 1)[..60]).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        again.write_all(&frame(135, 1)[..75]).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        again.write_all(&frame(135, 2)).unwrap();
        assert_eq!(next(&mut sizes), Some(135));
        assert!(sizes.is_empty(), "the late one was dropped");
        assert_eq!(broken.load(Ordering::Relaxed), 6);
        quit.store(true, Ordering::Relaxed);
        listening.join().unwrap();
    }
}
