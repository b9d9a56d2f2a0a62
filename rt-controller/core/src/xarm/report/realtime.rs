//! The real-time report of port 30000, the only one with measured velocity and
//! a time stamp of the controller.

use super::{ReportTooShort, size_field, state_field};
use crate::xarm::bytes::{ByteReader, ByteWriter, EmitError, Fields};
use crate::xarm::pose::TcpPose;
use crate::xarm::status::{ArmState, Mode};
use arm_model::{JointState, JointVector};

/// Bytes of a report of port 30000, firmware 2.1 to 2.7.
pub const REALTIME_REPORT_LEN: usize = 784;

/// Offset of the target joint states (bytes).
const TARGET: usize = 32;

/// Offset of the poses (bytes).
const POSES: usize = 424;

/// Report of port 30000, 250 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RealtimeReport {
    /// Time of the controller's own clock (µs).
    pub time_us: u64,
    /// State of the arm.
    pub state: ArmState,
    /// Mode of the arm.
    pub mode: Mode,
    /// Commands in the buffer.
    pub buffered: u16,
    /// What the controller asks of the joints.
    pub target: JointState,
    /// Measured joint motion.
    pub actual: JointState,
    /// Motor currents (A).
    pub current_a: JointVector,
    /// Joint torques (Nm).
    pub torque_nm: JointVector,
    /// Target TCP pose in the base frame.
    pub target_tcp: TcpPose,
    /// Target TCP velocity: m/s, then rad/s.
    pub target_twist: TcpPose,
    /// Measured TCP pose in the base frame.
    pub actual_tcp: TcpPose,
    /// Measured TCP velocity: m/s, then rad/s.
    pub actual_twist: TcpPose,
}

/// Beyond what any joint can reach or do; more is no measurement (rad, rad/s).
const PLAUSIBLE: (f64, f64) = (7.0, 50.0);
/// Largest state and mode that firmware reports, as in the vendor's SDK.
const LARGEST_CODES: (u8, u8) = (9, 11);

impl RealtimeReport {
    /// Whether these are joints, state and mode of an arm, and not bytes that
    /// happen to have the length of a report.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let (q_max, qd_max) = PLAUSIBLE;
        let within = |v: &JointVector, most: f64| v.is_finite() && v.max_abs() <= most;
        within(&self.actual.q, q_max)
            && within(&self.target.q, q_max)
            && within(&self.actual.qd, qd_max)
            && self.state.code() <= LARGEST_CODES.0
            && self.mode.code() <= LARGEST_CODES.1
    }

    fn fields(&mut self, wire: &mut impl Fields) {
        size_field(wire, REALTIME_REPORT_LEN);
        wire.u64_be(&mut self.time_us);
        state_field(wire, &mut self.state, &mut self.mode);
        wire.u16_be(&mut self.buffered);
        wire.skip_to(TARGET);
        for motion in [&mut self.target, &mut self.actual] {
            wire.joints(&mut motion.q);
            wire.joints(&mut motion.qd);
            wire.joints(&mut motion.qdd);
        }
        wire.joints(&mut self.current_a);
        wire.joints(&mut self.torque_nm);
        wire.skip_to(POSES);
        self.target_tcp.fields(wire);
        self.target_twist.fields(wire);
        self.actual_tcp.fields(wire);
        self.actual_twist.fields(wire);
        wire.skip_to(REALTIME_REPORT_LEN);
    }
}

both_directions!(RealtimeReport, REALTIME_REPORT_LEN);
