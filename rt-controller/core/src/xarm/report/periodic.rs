//! The reports that share a layout: real (30003), normal (30001), rich (30002).

use super::{ReportTooShort, size_field, state_field};
use crate::xarm::bytes::{ByteReader, ByteWriter, EmitError, Fields};
use crate::xarm::error_code::ErrorCode;
use crate::xarm::pose::TcpPose;
use crate::xarm::status::{ArmState, Mode};
use arm_model::{JOINTS, JointVector};

/// Bytes common to the three reports.
const BASIC_LEN: usize = 87;
/// Bytes of a report of port 30003.
pub const FORCE_REPORT_LEN: usize = 135;
/// Bytes of one of the two forces in it.
const FORCE_LEN: usize = (FORCE_REPORT_LEN - BASIC_LEN) / 2;
/// Bytes of a report of port 30001.
pub const NORMAL_REPORT_LEN: usize = 145;
/// Bytes of a report of port 30002, firmware 2.4 to 2.7.1.
pub const RICH_REPORT_LEN: usize = 574;

/// Offset of the marks that the arm is simulated, and that it stops before it touches
/// itself (bytes).
const MARKS: usize = 314;
/// Offset of the bits that say which safety functions are on (bytes).
const SAFETY_BITS: usize = 494;
/// Bit of reduced mode.
const REDUCED: u8 = 1;
/// Bit of the safety boundary.
const FENCE: u8 = 2;

/// What every periodic report begins with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
    /// The fields of a report of `size` bytes that begins with these.
    fn begin(&mut self, wire: &mut impl Fields, size: usize) {
        size_field(wire, size);
        state_field(wire, &mut self.state, &mut self.mode);
        wire.u16_be(&mut self.buffered);
        wire.joints(&mut self.q);
        self.tcp.fields(wire);
        wire.joints(&mut self.torque_nm);
    }
}

/// Report of port 30003, 100 Hz. It has no error code.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForceReport {
    /// Common part.
    pub basic: BasicReport,
    /// External force (N) and torque (Nm) of the force-torque sensor.
    pub external_force: [f64; 6],
    /// The same before compensation.
    pub raw_force: [f64; 6],
}

impl ForceReport {
    /// Forces that older firmware leaves out are zero.
    fn fields(&mut self, wire: &mut impl Fields) {
        self.basic.begin(wire, FORCE_REPORT_LEN);
        for force in [&mut self.external_force, &mut self.raw_force] {
            if wire.has(true, FORCE_LEN) {
                wire.f32s_le(force);
            }
        }
    }
}

both_directions!(ForceReport, BASIC_LEN);

/// Report of port 30001, 5 Hz; also the first part of the rich one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
    fn fields(&mut self, wire: &mut impl Fields) {
        self.begin(wire, NORMAL_REPORT_LEN);
    }

    /// The fields of a report of `size` bytes that begins with these.
    fn begin(&mut self, wire: &mut impl Fields, size: usize) {
        self.basic.begin(wire, size);
        wire.u8(&mut self.brakes_released);
        wire.u8(&mut self.enabled);
        wire.u8(&mut self.error.0);
        wire.u8(&mut self.warning);
        self.tcp_offset.fields(wire);
        wire.f32_le(&mut self.load_kg);
        wire.lengths(&mut self.load_centre_m);
        wire.u8(&mut self.collision_sensitivity);
        wire.u8(&mut self.teach_sensitivity);
        wire.f32s_le(&mut self.gravity);
    }
}

both_directions!(NormalReport, NORMAL_REPORT_LEN);

/// Report of port 30002, 5 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
    /// Whether the arm stops before it touches itself.
    pub self_collision: bool,
    /// Whether reduced mode is on.
    pub reduced: bool,
    /// Whether the safety boundary is on.
    pub fence: bool,
}

/// Rotation jerk and largest rotation acceleration (rad/s³, rad/s²), constants
/// of the arm.
const ROTATION: [f64; 2] = [2.3, 2.7];

impl RichReport {
    /// Least jerk, acceleration and speed are zero.
    fn fields(&mut self, wire: &mut impl Fields) {
        self.normal.begin(wire, RICH_REPORT_LEN);
        // Type 7 with 7 axes, then the two marks.
        wire.array(&mut [7, 7, 0xAA, 0x55, 0, 0]);
        wire.array(&mut self.firmware);
        wire.length(&mut self.tcp_jerk_m_s3);
        wire.length(&mut 0.0);
        wire.length(&mut self.tcp_acceleration_max_m_s2);
        wire.length(&mut 0.0);
        wire.length(&mut self.tcp_speed_max_m_s);
        wire.f32_le(&mut self.joint_jerk_rad_s3);
        wire.f32_le(&mut 0.0);
        wire.f32_le(&mut self.joint_acceleration_max_rad_s2);
        wire.f32_le(&mut 0.0);
        wire.f32_le(&mut self.joint_speed_max_rad_s);
        let mut rotation = ROTATION;
        wire.f32s_le(&mut rotation);
        for error in &mut self.servo_error {
            wire.flag(&mut (*error != 0));
            wire.u8(error);
        }
        wire.array(&mut [0; 2]);
        let mut temperatures = self.temperature_c.map(i8::cast_unsigned);
        wire.array(&mut temperatures);
        self.temperature_c = temperatures.map(u8::cast_signed);
        wire.length(&mut self.target_tcp_speed_m_s);
        wire.joints(&mut self.target_qd);
        wire.u32_be(&mut self.counter);
        wire.skip_to(MARKS);
        wire.flag(&mut self.simulated);
        wire.flag(&mut self.self_collision);
        wire.skip_to(SAFETY_BITS);
        let bit = |is_on: bool, bit: u8| if is_on { bit } else { 0 };
        let mut bits = bit(self.reduced, REDUCED) | bit(self.fence, FENCE);
        wire.u8(&mut bits);
        self.reduced = bits & REDUCED != 0;
        self.fence = bits & FENCE != 0;
        wire.skip_to(RICH_REPORT_LEN);
    }
}

both_directions!(RichReport, RICH_REPORT_LEN);
