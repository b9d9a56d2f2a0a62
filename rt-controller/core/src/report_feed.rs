//! A report stream of the arm: cut into frames, judged, decoded, and when to open
//! it again. Connecting and reading are the caller's.
//!
//! A frame that cannot be used is dropped and counted; a stream that lost its
//! place is opened anew. A truncated report is filled up with the beginning of the
//! next one: such a frame may hold proper numbers in wrong places, so one that
//! took long to arrive, or that is followed by what is no report, is dropped as
//! well.

use crate::clock_map::ClockMap;
use crate::control::ArmCodes;
use crate::xarm::ReportReader;
use crate::xarm::report::{
    ForceReport, MAX_REPORT_LEN, NormalReport, REALTIME_REPORT_LEN, RealtimeReport,
};
use crate::xarm::stream::BrokenStream;
use arm_model::JointVector;
use shared_types::ipc::{JointReport, PAYLOAD_VERSION};

/// Pause before a new attempt to connect (ns).
pub const RETRY_NS: u64 = 200_000_000;
/// Longest time from the first byte of a report to its last (ns); half the time
/// between two. A report is one packet.
const ARRIVES_WITHIN_NS: u64 = 2_000_000;
/// Silence after which a connection is given up and opened again (ns).
const SILENCE_NS: u64 = 2_000_000_000;

/// What became of the bytes of one read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Received {
    /// Reports that had to be dropped.
    pub broken: u32,
    /// Why the stream lost its place, if it did: the connection is of no use any
    /// more.
    pub lost_place: Option<BrokenStream>,
}

/// One connection to a report port.
#[derive(Debug)]
pub struct ReportFeed {
    reader: ReportReader,
    /// Size of its reports (bytes).
    size: Option<usize>,
    /// When the first byte of a report that is not whole yet came (ns).
    begun_ns: Option<u64>,
    opened_ns: u64,
    /// When bytes came last (ns).
    newest_ns: u64,
}

impl ReportFeed {
    /// A connection just opened.
    #[must_use]
    pub const fn opened(now_ns: u64) -> Self {
        Self {
            reader: ReportReader::new(),
            size: None,
            begun_ns: None,
            opened_ns: now_ns,
            newest_ns: now_ns,
        }
    }

    /// Where the next bytes belong; never empty.
    pub fn space(&mut self) -> &mut [u8] {
        self.reader.space()
    }

    /// Whether the connection has been silent for so long that it is to be given
    /// up.
    #[must_use]
    pub const fn is_silent(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.newest_ns) > SILENCE_NS
    }

    /// When to connect again, now that the connection is over: after a pause, or
    /// at once where it has lasted and merely lost its place.
    #[must_use]
    pub const fn retry_ns(&self, now_ns: u64, lost_place: bool) -> u64 {
        if lost_place && now_ns.saturating_sub(self.opened_ns) > RETRY_NS {
            now_ns
        } else {
            now_ns.saturating_add(RETRY_NS)
        }
    }

    /// Takes `len` bytes, written to [`space`](Self::space), that arrived at
    /// `arrival_ns`, and passes every whole frame to `take`, which says whether it
    /// can be used. The size of a connection's reports never changes, so one of
    /// another size than the first good one is truncated.
    pub fn received(
        &mut self,
        len: usize,
        arrival_ns: u64,
        mut take: impl FnMut(&[u8]) -> bool,
    ) -> Received {
        self.reader.commit(len);
        self.newest_ns = arrival_ns;
        let mut seen = Received::default();
        loop {
            let followed_by_a_report = self.reader.is_followed_by_a_report();
            let begun_ns = self.begun_ns.take().unwrap_or(arrival_ns);
            match self.reader.next_report() {
                Ok(Some(frame)) => {
                    let truncated = !followed_by_a_report
                        || arrival_ns.saturating_sub(begun_ns) > ARRIVES_WITHIN_NS;
                    let fits = self.size.is_none_or(|size| size == frame.len());
                    if fits && !truncated && take(frame) {
                        self.size = Some(frame.len());
                    } else {
                        seen.broken = seen.broken.saturating_add(1);
                    }
                }
                Ok(None) => {
                    self.begun_ns = (!self.reader.is_empty()).then_some(begun_ns);
                    return seen;
                }
                Err(why) => {
                    seen.broken = seen.broken.saturating_add(1);
                    seen.lost_place = Some(why);
                    return seen;
                }
            }
        }
    }
}

/// Decodes the joint reports of one connection, the arm's clock mapped to ours.
#[derive(Debug, Clone, Copy, Default)]
pub struct JointDecoder {
    clocks: ClockMap,
}

impl JointDecoder {
    /// A frame of port 30000; `None` for another size than any firmware sends and
    /// for numbers that no arm can mean.
    pub fn realtime(&mut self, frame: &[u8], arrival_ns: u64) -> Option<JointReport> {
        if !(REALTIME_REPORT_LEN..=MAX_REPORT_LEN).contains(&frame.len()) {
            return None;
        }
        // Before the clock is followed: nonsense must not move it.
        let r = RealtimeReport::parse(frame)
            .ok()
            .filter(RealtimeReport::is_plausible)?;
        Some(JointReport {
            version: PAYLOAD_VERSION,
            arm_state: r.state.code(),
            arm_mode: r.mode.code(),
            // The reading is of this very stamp.
            stamp_ns: self.clocks.to_monotonic_ns(r.time_us, arrival_ns),
            arm_clock: self.clocks.reading(),
            arrival_ns,
            q: r.actual.q,
            qd: r.actual.qd,
            q_target: r.target.q,
        })
        .filter(is_finite)
    }

    /// A frame of port 30003, which has measured angles only.
    #[must_use]
    pub fn real(frame: &[u8], arrival_ns: u64) -> Option<JointReport> {
        let r = ForceReport::parse(frame).ok()?.basic;
        Some(JointReport {
            version: PAYLOAD_VERSION,
            arm_state: r.state.code(),
            arm_mode: r.mode.code(),
            arm_clock: 0,
            stamp_ns: arrival_ns,
            arrival_ns,
            q: r.q,
            qd: JointVector::ZERO,
            q_target: r.q,
        })
        .filter(is_finite)
    }
}

fn is_finite(report: &JointReport) -> bool {
    report.q.is_finite() && report.qd.is_finite() && report.q_target.is_finite()
}

/// The arm's own codes from a frame of port 30001 or 30002; `None` for one that is too
/// short or holds numbers that are not finite.
#[must_use]
pub fn arm_codes(frame: &[u8], arrival_ns: u64) -> Option<ArmCodes> {
    let r = NormalReport::parse(frame).ok()?;
    let finite = r.basic.q.is_finite() && r.tcp_offset.is_finite();
    finite.then(|| ArmCodes {
        error: r.error.0,
        warning: r.warning,
        state: r.basic.state.code(),
        mode: r.basic.mode.code(),
        arrival_ns,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xarm::{ArmState, Mode};
    use arm_model::JointState;

    fn frame(q: f64, size: usize) -> Vec<u8> {
        let at = JointState::at_rest(JointVector::splat(q));
        let report = RealtimeReport {
            time_us: 5_000_000,
            state: ArmState::Moving,
            mode: Mode::Servo,
            target: at,
            actual: at,
            ..RealtimeReport::default()
        };
        let mut bytes = vec![0; MAX_REPORT_LEN];
        report.emit(&mut bytes).unwrap();
        bytes.truncate(size);
        bytes
    }

    #[test]
    fn numbers_that_are_not_finite_and_wrong_sizes_are_refused() {
        const NOW_NS: u64 = 9_000_000_000;
        let mut decoder = JointDecoder::default();
        let report = decoder.realtime(&frame(0.5, 784), NOW_NS).unwrap();
        assert_eq!((report.arm_mode, report.arm_clock), (1, 1));
        assert!((report.q - JointVector::splat(0.5)).max_abs() < 1e-7);
        let newer_firmware = frame(0.5, 804);
        assert!(decoder.realtime(&newer_firmware, NOW_NS).is_some());
        for damaged in [
            frame(f64::NAN, 784),
            frame(f64::INFINITY, 784),
            frame(0.5, 783),
            frame(0.5, 145),
            Vec::new(),
        ] {
            assert_eq!(decoder.realtime(&damaged, NOW_NS), None);
            let short = &damaged[..damaged.len().min(80)];
            assert_eq!(JointDecoder::real(short, NOW_NS), None);
            assert_eq!(arm_codes(short, NOW_NS), None);
        }
    }
}
