//! The joint reports: a thread that decodes and stamps them and passes each on
//! through two rings, to the control loop and to the bridge.
//!
//! It is not the real-time thread. It listens to the real-time report (port
//! 30000, 250 Hz, with the arm's own clock) or, where that is refused, to the
//! real report (port 30003, 100 Hz, without).

use crate::os::schedule::set_fifo;
use crate::report_feed::JointDecoder;
use crate::report_stream::{BrokenReports, ReportSink, ReportStream};
use rtrb::Producer;
use shared_types::ipc::JointReport;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

/// Where the reports are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReportSource {
    /// Address of the arm.
    pub arm: IpAddr,
    /// Real-time report port.
    pub realtime_port: u16,
    /// Real report port, used when the other one refuses.
    pub fallback_port: u16,
    /// `SCHED_FIFO` priority of the receiver, if it may have one.
    pub priority: Option<u8>,
}

/// Starts the receiver; it ends soon after `quit` is set.
///
/// # Errors
/// When the system has no more threads.
pub fn spawn(
    source: ReportSource,
    to_loop: Producer<JointReport>,
    to_bridge: Producer<JointReport>,
    broken: BrokenReports,
    quit: Arc<AtomicBool>,
) -> std::io::Result<JoinHandle<()>> {
    let mut stream = ReportStream {
        arm: source.arm,
        ports: vec![source.realtime_port, source.fallback_port],
        sink: JointSink {
            to_loop,
            to_bridge,
            decoder: JointDecoder::default(),
        },
        broken,
        quit,
    };
    std::thread::Builder::new()
        .name("joint reports".to_owned())
        .spawn(move || {
            if let Some(priority) = source.priority {
                // Without it reports are merely stamped a little later.
                let _ = set_fifo(priority);
            }
            stream.run();
        })
}

struct JointSink {
    to_loop: Producer<JointReport>,
    to_bridge: Producer<JointReport>,
    decoder: JointDecoder,
}

impl ReportSink for JointSink {
    fn opened(&mut self, _port: usize) {
        self.decoder = JointDecoder::default();
    }

    fn take(&mut self, port: usize, frame: &[u8], arrival_ns: u64) -> bool {
        let decoded = if port == 0 {
            self.decoder.realtime(frame, arrival_ns)
        } else {
            JointDecoder::real(frame, arrival_ns)
        };
        let Some(report) = decoded else {
            return false;
        };
        let _ = self.to_loop.push(report);
        let _ = self.to_bridge.push(report);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xarm::report::{MAX_REPORT_LEN, RealtimeReport};
    use crate::xarm::{ArmState, Mode, TcpPose};
    use arm_model::{JointState, JointVector};
    use rtrb::{Consumer, RingBuffer};

    fn sink() -> (JointSink, Consumer<JointReport>) {
        let (to_loop, taken) = RingBuffer::new(4);
        let (to_bridge, _) = RingBuffer::new(4);
        let decoder = JointDecoder::default();
        let sink = JointSink {
            to_loop,
            to_bridge,
            decoder,
        };
        (sink, taken)
    }

    fn frame(q: f64, size: usize) -> Vec<u8> {
        let at = JointState::at_rest(JointVector::splat(q));
        let report = RealtimeReport {
            time_us: 5_000_000,
            state: ArmState::Moving,
            mode: Mode::Servo,
            buffered: 0,
            target: at,
            actual: at,
            current_a: JointVector::ZERO,
            torque_nm: JointVector::ZERO,
            target_tcp: TcpPose::default(),
            target_twist: TcpPose::default(),
            actual_tcp: TcpPose::default(),
            actual_twist: TcpPose::default(),
        };
        let mut bytes = vec![0; MAX_REPORT_LEN];
        report.emit(&mut bytes).unwrap();
        bytes.truncate(size);
        bytes
    }

    #[test]
    fn numbers_that_are_not_finite_and_wrong_sizes_are_refused() {
        let (mut sink, mut taken) = sink();
        assert!(sink.take(0, &frame(0.5, 784), 9_000_000_000));
        assert!(
            sink.take(0, &frame(0.5, 804), 9_000_000_000),
            "newer firmware"
        );
        for damaged in [
            frame(f64::NAN, 784),
            frame(f64::INFINITY, 784),
            frame(0.5, 783),
            frame(0.5, 145),
            Vec::new(),
        ] {
            assert!(!sink.take(0, &damaged, 9_000_000_000));
            assert!(!sink.take(1, &damaged[..damaged.len().min(80)], 9_000_000_000));
        }
        let report = taken.pop().unwrap();
        assert_eq!((report.arm_mode, report.arm_clock), (1, 1));
        assert!((report.q - JointVector::splat(0.5)).max_abs() < 1e-7);
        assert_eq!(std::iter::from_fn(|| taken.pop().ok()).count(), 1);
    }
}
