//! The controller's state as the frames of its report ports.

use super::firmware::Firmware;
use super::model::ArmModel;
use arm_model::{JOINTS, JointState, kinematics};
use rt_controller::xarm::TcpPose;
use rt_controller::xarm::report::{
    BasicReport, ForceReport, MAX_REPORT_LEN, NORMAL_REPORT_LEN, NormalReport, RealtimeReport,
    RichReport,
};

/// One of the four report ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportKind {
    /// Port 30000.
    Realtime,
    /// Port 30001.
    Normal,
    /// Port 30002.
    Rich,
    /// Port 30003.
    Real,
}

impl ReportKind {
    /// In the order of the standard ports.
    pub const ALL: [Self; 4] = [Self::Realtime, Self::Normal, Self::Rich, Self::Real];

    /// Time between two reports (s).
    #[must_use]
    pub const fn period_s(self) -> f64 {
        match self {
            Self::Realtime => 0.004,
            Self::Normal | Self::Rich => 0.2,
            Self::Real => 0.01,
        }
    }

    /// Clients served at once; a real arm takes four on port 30000.
    pub(super) const fn clients_max(self) -> usize {
        match self {
            Self::Realtime => 4,
            Self::Normal | Self::Rich | Self::Real => 32,
        }
    }

    /// Size of a frame, `None` where the firmware has no such port (bytes).
    #[must_use]
    pub fn len(self, firmware: Firmware) -> Option<usize> {
        match self {
            Self::Realtime => firmware.realtime_report_len(),
            Self::Normal => Some(NORMAL_REPORT_LEN),
            Self::Rich => Some(firmware.rich_report_len()),
            Self::Real => Some(firmware.real_report_len()),
        }
    }

    /// Where the measured angle of a joint (from 0) lies in a frame (bytes).
    pub(super) const fn joint_offset(self, joint: usize) -> usize {
        match self {
            Self::Realtime => 116 + 4 * joint,
            Self::Normal | Self::Rich | Self::Real => 7 + 4 * joint,
        }
    }

    /// The present report; `counter` counts the frames of a client.
    pub(super) fn frame(self, model: &ArmModel, firmware: Firmware, counter: u32) -> Vec<u8> {
        let mut bytes = vec![0; MAX_REPORT_LEN];
        let written = match self {
            Self::Realtime => realtime(model).emit(&mut bytes),
            Self::Normal => normal(model).emit(&mut bytes),
            Self::Rich => rich(model, firmware, counter).emit(&mut bytes),
            Self::Real => ForceReport {
                basic: basic(model),
                external_force: [0.0; 6],
                raw_force: [0.0; 6],
            }
            .emit(&mut bytes),
        };
        // The buffer holds the longest report, so this never falls back.
        bytes.truncate(written.unwrap_or(0));
        if self == Self::Rich {
            fill_in(&mut bytes, model);
        }
        let len = self.len(firmware).unwrap_or(bytes.len());
        bytes.resize(len, 0);
        let size = u32::try_from(len).unwrap_or(u32::MAX);
        bytes[..4].copy_from_slice(&size.to_be_bytes());
        bytes
    }
}

/// Writes fields of the rich report that its codec leaves zero, at the offsets
/// of the vendor's SDK.
fn fill_in(bytes: &mut [u8], model: &ArmModel) {
    let settings = &model.settings;
    let mut put = |at: usize, field: &[u8]| {
        if let Some(place) = bytes.get_mut(at..at + field.len()) {
            place.copy_from_slice(field);
        }
    };
    let reduced = &settings.reduced;
    for (j, current) in model.current_a().iter().enumerate() {
        put(355 + 4 * j, &(*current as f32).to_le_bytes());
    }
    put(495, &[u8::from(reduced.on)]);
    put(496, &settings.boundary_i16());
    put(508, &reduced.tcp_speed_mm_s.to_le_bytes());
    put(512, &reduced.joint_speed_rad_s.to_le_bytes());
    for (i, angle) in reduced.joint_ranges_rad.iter().enumerate() {
        put(516 + 4 * i, &angle.to_le_bytes());
    }
    let flags = [settings.boundary.on, settings.collision_rebound];
    put(572, &flags.map(u8::from));
    if let Some(bits) = bytes.get_mut(494) {
        *bits |= u8::from(settings.reports_current) << 2;
    }
}

fn basic(model: &ArmModel) -> BasicReport {
    let measured = model.measured_motion();
    BasicReport {
        state: model.state(),
        mode: model.mode,
        buffered: model.buffered(),
        q: measured.q,
        tcp: model.tcp_pose(&measured.q),
        torque_nm: if model.settings.reports_current {
            model.current_a()
        } else {
            model.effort_nm()
        },
    }
}

fn normal(model: &ArmModel) -> NormalReport {
    let settings = &model.settings;
    NormalReport {
        basic: basic(model),
        brakes_released: model.brakes_released,
        enabled: model.enabled,
        error: model.error,
        warning: model.warning,
        tcp_offset: settings.tcp_offset,
        load_kg: settings.load_kg,
        load_centre_m: settings.load_centre_m,
        collision_sensitivity: settings.collision_sensitivity,
        teach_sensitivity: settings.teach_sensitivity,
        gravity: [0.0, 0.0, -1.0],
    }
}

fn rich(model: &ArmModel, version: Firmware, counter: u32) -> RichReport {
    let settings = &model.settings;
    let mut firmware = [0; 30];
    for (to, from) in firmware.iter_mut().zip(format!("v{version}").bytes()) {
        *to = from;
    }
    let twist = tool_twist(model, &model.reference_motion());
    RichReport {
        normal: normal(model),
        firmware,
        // Largest values of the vendor's table.
        tcp_jerk_m_s3: 100.0,
        tcp_acceleration_max_m_s2: 50.0,
        tcp_speed_max_m_s: 1.0,
        joint_jerk_rad_s3: settings.joint_jerk_rad_s3,
        joint_acceleration_max_rad_s2: settings.joint_acceleration_rad_s2,
        joint_speed_max_rad_s: model.config().limits.velocity_max_rad_s[0],
        servo_error: model.servo_error,
        temperature_c: [25; JOINTS],
        target_tcp_speed_m_s: twist.position().norm(),
        target_qd: model.reference.qd,
        counter,
        // The flag is the controller's own simulation mode, in which the SDK
        // leaves motion requests out; this arm stands in for a real one.
        simulated: false,
        self_collision: settings.self_collision,
        reduced: settings.reduced.on,
        fence: settings.boundary.on,
    }
}

fn realtime(model: &ArmModel) -> RealtimeReport {
    let target = model.reference_motion();
    let actual = model.measured_motion();
    RealtimeReport {
        time_us: model.time_us(),
        state: model.state(),
        mode: model.mode,
        buffered: model.buffered(),
        target,
        actual,
        current_a: model.current_a(),
        torque_nm: model.effort_nm(),
        target_tcp: model.tcp_pose(&target.q),
        target_twist: tool_twist(model, &target),
        actual_tcp: model.tcp_pose(&actual.q),
        actual_twist: tool_twist(model, &actual),
    }
}

/// Velocity of the tool centre point: linear (m/s), angular (rad/s).
fn tool_twist(model: &ArmModel, motion: &JointState) -> TcpPose {
    let tool = kinematics::flange_motion(motion).at_offset(&model.settings.tcp_offset.position());
    TcpPose {
        position_m: tool.v_m_s.into(),
        rpy_rad: tool.w_rad_s.into(),
    }
}
