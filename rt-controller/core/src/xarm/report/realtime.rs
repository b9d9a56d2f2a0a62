//! The real-time report of port 30000, the only one with measured velocity and
//! a time stamp of the controller.

use super::{ReportTooShort, emit_state, parse, parse_state};
use crate::xarm::bytes::{ByteReader, ByteWriter, EmitError};
use crate::xarm::pose::TcpPose;
use crate::xarm::status::{ArmState, Mode};
use arm_model::{JointState, JointVector};

/// Bytes of a report of port 30000, firmware 2.1 to 2.7.
pub const REALTIME_REPORT_LEN: usize = 784;

/// Offsets (bytes).
mod offset {
    pub(super) const TARGET: usize = 32;
    pub(super) const TARGET_POSE: usize = 424;
    pub(super) const ACTUAL_POSE: usize = 472;
}

/// Report of port 30000, 250 Hz.
#[derive(Debug, Clone, Copy, PartialEq)]
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

    /// Writes [`REALTIME_REPORT_LEN`] bytes and returns that.
    ///
    /// # Errors
    /// [`EmitError::BufferTooSmall`].
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
        let mut out = ByteWriter::new(out);
        out.u32_be(u32::try_from(REALTIME_REPORT_LEN).unwrap_or(u32::MAX))?;
        out.u64_be(self.time_us)?;
        emit_state(&mut out, self.state, self.mode)?;
        out.u16_be(self.buffered)?;
        out.zeros_to(offset::TARGET)?;
        for joints in [
            &self.target.q,
            &self.target.qd,
            &self.target.qdd,
            &self.actual.q,
            &self.actual.qd,
            &self.actual.qdd,
            &self.current_a,
            &self.torque_nm,
        ] {
            out.joints(joints)?;
        }
        out.zeros_to(offset::TARGET_POSE)?;
        self.target_tcp.emit(&mut out)?;
        self.target_twist.emit(&mut out)?;
        self.actual_tcp.emit(&mut out)?;
        self.actual_twist.emit(&mut out)?;
        out.zeros_to(REALTIME_REPORT_LEN)?;
        Ok(out.len())
    }

    /// Parses a frame. RT-safe.
    ///
    /// # Errors
    /// [`ReportTooShort`].
    pub fn parse(frame: &[u8]) -> Result<Self, ReportTooShort> {
        parse(frame, REALTIME_REPORT_LEN, Self::read)
    }

    fn read(frame: &[u8]) -> Option<Self> {
        let mut head = ByteReader::at(frame, 4)?;
        let time_us = head.u64_be()?;
        let (state, mode) = parse_state(&mut head)?;
        let buffered = head.u16_be()?;
        let mut joints = ByteReader::at(frame, offset::TARGET)?;
        let mut motion = || {
            Some(JointState {
                q: joints.joints()?,
                qd: joints.joints()?,
                qdd: joints.joints()?,
            })
        };
        let (target, actual) = (motion()?, motion()?);
        let mut target_pose = ByteReader::at(frame, offset::TARGET_POSE)?;
        let mut actual_pose = ByteReader::at(frame, offset::ACTUAL_POSE)?;
        Some(Self {
            time_us,
            state,
            mode,
            buffered,
            target,
            actual,
            current_a: joints.joints()?,
            torque_nm: joints.joints()?,
            target_tcp: TcpPose::parse(&mut target_pose)?,
            target_twist: TcpPose::parse(&mut target_pose)?,
            actual_tcp: TcpPose::parse(&mut actual_pose)?,
            actual_twist: TcpPose::parse(&mut actual_pose)?,
        })
    }
}
