//! The arm's own status: a thread that listens to the 5 Hz reports, which alone
//! carry error and warning codes, the configured tool and the firmware.
//!
//! The rich report (port 30002) is preferred; where it is refused, the normal
//! one (port 30001) says everything but the firmware. Each status goes through
//! two rings, to the control loop and to the bridge.

use crate::control::ArmCodes;
use crate::report_stream::{BrokenReports, ReportSink, ReportStream};
use crate::xarm::report::{NormalReport, firmware_text};
use crate::xarm::{ErrorCode, Firmware};
use rtrb::Producer;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

/// What the arm says about itself five times a second. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmStatus {
    /// When the report arrived (CLOCK_MONOTONIC, ns).
    pub arrival_ns: u64,
    /// State, as in [`crate::xarm::ArmState`].
    pub state: u8,
    /// Mode, as in [`crate::xarm::Mode`].
    pub mode: u8,
    /// Error code.
    pub error: ErrorCode,
    /// Warning code, 0 for none.
    pub warning: u8,
    /// Bit `i` set: joint `i + 1` is enabled and its brake released.
    pub ready_joints: u8,
    /// Tool centre point in the flange frame (m).
    pub tcp_offset_m: [f64; 3],
    /// Firmware, where the report names it.
    pub firmware: Option<Firmware>,
}

impl ArmStatus {
    /// From a frame of port 30001 or 30002; `None` for one that is too short or
    /// holds numbers that are not finite.
    #[must_use]
    pub fn parse(frame: &[u8], arrival_ns: u64) -> Option<Self> {
        let r = NormalReport::parse(frame).ok()?;
        let tcp_offset_m = r.tcp_offset.position().into();
        let finite = r.basic.q.is_finite() && r.tcp_offset.is_finite();
        finite.then(|| Self {
            arrival_ns,
            state: r.basic.state.code(),
            mode: r.basic.mode.code(),
            error: r.error,
            warning: r.warning,
            ready_joints: r.brakes_released & r.enabled,
            tcp_offset_m,
            firmware: firmware_text(frame).and_then(Firmware::parse),
        })
    }
}

impl From<ArmStatus> for ArmCodes {
    fn from(status: ArmStatus) -> Self {
        Self {
            error: status.error.0,
            warning: status.warning,
            state: status.state,
            mode: status.mode,
            arrival_ns: status.arrival_ns,
        }
    }
}

/// Starts the reader; it ends soon after `quit` is set.
///
/// # Errors
/// When the system has no more threads.
pub fn spawn(
    arm: IpAddr,
    ports: [u16; 2],
    to_loop: Producer<ArmStatus>,
    to_bridge: Producer<ArmStatus>,
    broken: BrokenReports,
    quit: Arc<AtomicBool>,
) -> std::io::Result<JoinHandle<()>> {
    let mut stream = ReportStream {
        arm,
        ports: ports.to_vec(),
        sink: StatusSink { to_loop, to_bridge },
        broken,
        quit,
    };
    std::thread::Builder::new()
        .name("arm status".to_owned())
        .spawn(move || stream.run())
}

struct StatusSink {
    to_loop: Producer<ArmStatus>,
    to_bridge: Producer<ArmStatus>,
}

impl ReportSink for StatusSink {
    fn opened(&mut self, _port: usize) {}

    fn take(&mut self, _port: usize, frame: &[u8], arrival_ns: u64) -> bool {
        let Some(status) = ArmStatus::parse(frame, arrival_ns) else {
            return false;
        };
        let _ = self.to_loop.push(status);
        let _ = self.to_bridge.push(status);
        true
    }
}
