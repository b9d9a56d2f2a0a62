//! The reports that share a layout: real (30003), normal (30001), rich (30002).

use super::{ReportTooShort, emit_state, parse, parse_state};
use crate::xarm::bytes::{ByteReader, ByteWriter, EmitError};
use crate::xarm::error_code::ErrorCode;
use crate::xarm::pose::TcpPose;
use crate::xarm::status::{ArmState, Mode};
use arm_model::{JOINTS, JointVector};

/// Bytes common to the three reports.
const BASIC_LEN: usize = 87;
/// Bytes of a report of port 30003.
pub const FORCE_REPORT_LEN: usize = 135;
/// Bytes of a report of port 30001.
pub const NORMAL_REPORT_LEN: usize = 145;
/// Bytes of a report of port 30002, firmware 2.4 to 2.7.1.
pub const RICH_REPORT_LEN: usize = 574;

/// Offsets in the rich report (bytes).
mod rich {
    pub(super) const AXES: usize = 145;
    pub(super) const TCP_DYNAMICS: usize = 181;
    pub(super) const JOINT_DYNAMICS: usize = 201;
    pub(super) const ROTATION: usize = 221;
    pub(super) const SERVO: usize = 229;
    pub(super) const TEMPERATURES: usize = 245;
    pub(super) const TARGET_SPEED: usize = 252;
    pub(super) const COUNTER: usize = 284;
    pub(super) const SIMULATED: usize = 314;
}

/// What every periodic report begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BasicReport {
    /// State of the arm.
    pub state: ArmState,
    /// Mode of the arm.
    pub mode: Mode,
    /// Commands in the buffer.
    pub buffered: u16,
    /// Measured joint angles (rad).
    pub q: JointVector,
    /// TCP pose in the base frame.
    pub tcp: TcpPose,
    /// Joint torques (Nm), or currents (A) if so configured.
    pub torque_nm: JointVector,
}

impl BasicReport {
    fn emit(&self, out: &mut ByteWriter<'_>, size: usize) -> Result<(), EmitError> {
        out.u32_be(u32::try_from(size).unwrap_or(u32::MAX))?;
        emit_state(out, self.state, self.mode)?;
        out.u16_be(self.buffered)?;
        out.joints(&self.q)?;
        self.tcp.emit(out)?;
        out.joints(&self.torque_nm)
    }

    fn read(bytes: &mut ByteReader<'_>) -> Option<Self> {
        let _size = bytes.u32_be()?;
        let (state, mode) = parse_state(bytes)?;
        Some(Self {
            state,
            mode,
            buffered: bytes.u16_be()?,
            q: bytes.joints()?,
            tcp: TcpPose::parse(bytes)?,
            torque_nm: bytes.joints()?,
        })
    }

    /// Parses the common part of any of the three reports.
    ///
    /// # Errors
    /// [`ReportTooShort`] below 87 bytes.
    pub fn parse(frame: &[u8]) -> Result<Self, ReportTooShort> {
        parse(frame, BASIC_LEN, |frame| {
            Self::read(&mut ByteReader::new(frame))
        })
    }
}

/// Report of port 30003, 100 Hz. It has no error code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceReport {
    /// Common part.
    pub basic: BasicReport,
    /// External force (N) and torque (Nm) of the force-torque sensor.
    pub external_force: [f64; 6],
    /// The same before compensation.
    pub raw_force: [f64; 6],
}

impl ForceReport {
    /// Writes [`FORCE_REPORT_LEN`] bytes and returns that.
    ///
    /// # Errors
    /// [`EmitError::BufferTooSmall`].
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
        let mut out = ByteWriter::new(out);
        self.basic.emit(&mut out, FORCE_REPORT_LEN)?;
        out.f32s_le(&self.external_force)?;
        out.f32s_le(&self.raw_force)?;
        Ok(out.len())
    }

    /// Parses a frame; forces that older firmware leaves out are zero.
    ///
    /// # Errors
    /// [`ReportTooShort`].
    pub fn parse(frame: &[u8]) -> Result<Self, ReportTooShort> {
        parse(frame, BASIC_LEN, |frame| {
            let mut bytes = ByteReader::new(frame);
            Some(Self {
                basic: BasicReport::read(&mut bytes)?,
                external_force: bytes.f32s_le().unwrap_or_default(),
                raw_force: bytes.f32s_le().unwrap_or_default(),
            })
        })
    }
}

/// Report of port 30001, 5 Hz; also the first part of the rich one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalReport {
    /// Common part.
    pub basic: BasicReport,
    /// Bit `i` set: the brake of joint `i + 1` is released.
    pub brakes_released: u8,
    /// Bit `i` set: joint `i + 1` is enabled.
    pub enabled: u8,
    /// Error code.
    pub error: ErrorCode,
    /// Warning code, 0 for none.
    pub warning: u8,
    /// TCP offset in the flange frame.
    pub tcp_offset: TcpPose,
    /// Mass of the load (kg).
    pub load_kg: f64,
    /// Its centre of mass in the flange frame (m).
    pub load_centre_m: [f64; 3],
    /// Collision sensitivity, 0 to 5.
    pub collision_sensitivity: u8,
    /// Teach sensitivity, 1 to 5.
    pub teach_sensitivity: u8,
    /// Direction of gravity in the base frame; (0, 0, -1) for an upright arm.
    pub gravity: [f64; 3],
}

impl NormalReport {
    /// Writes [`NORMAL_REPORT_LEN`] bytes and returns that.
    ///
    /// # Errors
    /// [`EmitError::BufferTooSmall`].
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
        let mut out = ByteWriter::new(out);
        self.write(&mut out, NORMAL_REPORT_LEN)?;
        Ok(out.len())
    }

    fn write(&self, out: &mut ByteWriter<'_>, size: usize) -> Result<(), EmitError> {
        self.basic.emit(out, size)?;
        out.bytes(&[
            self.brakes_released,
            self.enabled,
            self.error.0,
            self.warning,
        ])?;
        self.tcp_offset.emit(out)?;
        out.f32_le(self.load_kg)?;
        self.load_centre_m.iter().try_for_each(|v| out.length(*v))?;
        out.bytes(&[self.collision_sensitivity, self.teach_sensitivity])?;
        out.f32s_le(&self.gravity)
    }

    fn read(bytes: &mut ByteReader<'_>) -> Option<Self> {
        Some(Self {
            basic: BasicReport::read(bytes)?,
            brakes_released: bytes.u8()?,
            enabled: bytes.u8()?,
            error: ErrorCode(bytes.u8()?),
            warning: bytes.u8()?,
            tcp_offset: TcpPose::parse(bytes)?,
            load_kg: bytes.f32_le()?,
            load_centre_m: [bytes.length()?, bytes.length()?, bytes.length()?],
            collision_sensitivity: bytes.u8()?,
            teach_sensitivity: bytes.u8()?,
            gravity: bytes.f32s_le()?,
        })
    }

    /// Parses a frame of port 30001, or the same part of one of port 30002.
    ///
    /// # Errors
    /// [`ReportTooShort`].
    pub fn parse(frame: &[u8]) -> Result<Self, ReportTooShort> {
        parse(frame, NORMAL_REPORT_LEN, |frame| {
            Self::read(&mut ByteReader::new(frame))
        })
    }
}

/// Report of port 30002, 5 Hz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RichReport {
    /// Everything of the normal report.
    pub normal: NormalReport,
    /// Firmware text, at most 29 characters, NUL padded.
    pub firmware: [u8; 30],
    /// TCP jerk (m/s³).
    pub tcp_jerk_m_s3: f64,
    /// Largest TCP acceleration (m/s²).
    pub tcp_acceleration_max_m_s2: f64,
    /// Largest TCP speed (m/s).
    pub tcp_speed_max_m_s: f64,
    /// Joint jerk (rad/s³).
    pub joint_jerk_rad_s3: f64,
    /// Largest joint acceleration (rad/s²).
    pub joint_acceleration_max_rad_s2: f64,
    /// Largest joint speed (rad/s).
    pub joint_speed_max_rad_s: f64,
    /// Servo error of each joint, 0 for none.
    pub servo_error: [u8; JOINTS],
    /// Joint temperatures (°C).
    pub temperature_c: [i8; JOINTS],
    /// Target TCP speed (m/s).
    pub target_tcp_speed_m_s: f64,
    /// Target joint speeds (rad/s).
    pub target_qd: JointVector,
    /// Frame counter.
    pub counter: u32,
    /// Whether the controller simulates its arm.
    pub simulated: bool,
}

/// Rotation jerk and largest rotation acceleration (rad/s³, rad/s²), constants
/// of the arm.
const ROTATION: [f64; 2] = [2.3, 2.7];

impl RichReport {
    /// Writes [`RICH_REPORT_LEN`] bytes and returns that.
    ///
    /// # Errors
    /// [`EmitError::BufferTooSmall`].
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
        let mut out = ByteWriter::new(out);
        self.normal.write(&mut out, RICH_REPORT_LEN)?;
        // Type 7 with 7 axes, then the two marks.
        out.bytes(&[7, 7, 0xAA, 0x55, 0, 0])?;
        out.bytes(&self.firmware)?;
        out.length(self.tcp_jerk_m_s3)?;
        out.length(0.0)?;
        out.length(self.tcp_acceleration_max_m_s2)?;
        out.length(0.0)?;
        out.length(self.tcp_speed_max_m_s)?;
        out.f32s_le(&[
            self.joint_jerk_rad_s3,
            0.0,
            self.joint_acceleration_max_rad_s2,
            0.0,
            self.joint_speed_max_rad_s,
        ])?;
        out.f32s_le(&ROTATION)?;
        for error in self.servo_error {
            out.bytes(&[u8::from(error != 0), error])?;
        }
        out.bytes(&[0, 0])?;
        out.bytes(&self.temperature_c.map(i8::cast_unsigned))?;
        out.length(self.target_tcp_speed_m_s)?;
        out.joints(&self.target_qd)?;
        out.u32_be(self.counter)?;
        out.zeros_to(rich::SIMULATED)?;
        out.u8(u8::from(self.simulated))?;
        out.zeros_to(RICH_REPORT_LEN)?;
        Ok(out.len())
    }

    /// Parses a frame.
    ///
    /// # Errors
    /// [`ReportTooShort`].
    pub fn parse(frame: &[u8]) -> Result<Self, ReportTooShort> {
        parse(frame, RICH_REPORT_LEN, Self::read)
    }

    fn read(frame: &[u8]) -> Option<Self> {
        let normal = NormalReport::read(&mut ByteReader::new(frame))?;
        let at = |offset| ByteReader::at(frame, offset);
        let mut text = at(rich::AXES)?;
        let _axes_and_marks = text.array::<6>()?;
        let firmware = text.array::<30>()?;
        let [jerk_mm, _, acceleration_mm, _, speed_mm] = at(rich::TCP_DYNAMICS)?.f32s_le::<5>()?;
        let [
            joint_jerk_rad_s3,
            _,
            joint_acceleration_max_rad_s2,
            _,
            joint_speed_max_rad_s,
        ] = at(rich::JOINT_DYNAMICS)?.f32s_le::<5>()?;
        let _rotation = at(rich::ROTATION)?.f32s_le::<2>()?;
        let mut servo = at(rich::SERVO)?;
        let mut servo_error = [0; JOINTS];
        for error in &mut servo_error {
            let [_status, code] = servo.array()?;
            *error = code;
        }
        let mut target = at(rich::TARGET_SPEED)?;
        Some(Self {
            normal,
            firmware,
            tcp_jerk_m_s3: jerk_mm / 1e3,
            tcp_acceleration_max_m_s2: acceleration_mm / 1e3,
            tcp_speed_max_m_s: speed_mm / 1e3,
            joint_jerk_rad_s3,
            joint_acceleration_max_rad_s2,
            joint_speed_max_rad_s,
            servo_error,
            temperature_c: at(rich::TEMPERATURES)?
                .array::<JOINTS>()?
                .map(u8::cast_signed),
            target_tcp_speed_m_s: target.length()?,
            target_qd: target.joints()?,
            counter: at(rich::COUNTER)?.u32_be()?,
            simulated: at(rich::SIMULATED)?.u8()? != 0,
        })
    }
}
