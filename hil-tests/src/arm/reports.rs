//! The controller's state as the frames of its report ports.

use super::model::ArmModel;
use rt_controller::xarm::TcpPose;
use rt_controller::xarm::report::{
    BasicReport, ForceReport, MAX_REPORT_LEN, NormalReport, RealtimeReport, RichReport,
};
use shared_types::{JOINTS, JointState, JointVector, kinematics};

/// One of the four report ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ReportKind {
    Realtime,
    Normal,
    Rich,
    Real,
}

impl ReportKind {
    /// In the order of the standard ports.
    pub(super) const ALL: [Self; 4] = [Self::Realtime, Self::Normal, Self::Rich, Self::Real];

    /// Time between two reports (ns).
    pub(super) const fn period_ns(self) -> u64 {
        match self {
            Self::Realtime => 4_000_000,
            Self::Normal | Self::Rich => 200_000_000,
            Self::Real => 10_000_000,
        }
    }

    /// Clients served at once; a real arm takes four on port 30000.
    pub(super) const fn clients_max(self) -> usize {
        match self {
            Self::Realtime => 4,
            Self::Normal | Self::Rich | Self::Real => 32,
        }
    }
}

/// A report frame, copied out of the model so that sending needs no lock.
pub(super) struct ReportFrame {
    bytes: [u8; MAX_REPORT_LEN],
    len: usize,
}

impl ReportFrame {
    /// The present report of one kind; `counter` counts the frames of a client.
    pub(super) fn of(model: &ArmModel, kind: ReportKind, counter: u32) -> Self {
        let mut bytes = [0; MAX_REPORT_LEN];
        let written = match kind {
            ReportKind::Realtime => realtime(model).emit(&mut bytes),
            ReportKind::Normal => normal(model).emit(&mut bytes),
            ReportKind::Rich => rich(model, counter).emit(&mut bytes),
            ReportKind::Real => ForceReport {
                basic: basic(model),
                external_force: [0.0; 6],
                raw_force: [0.0; 6],
            }
            .emit(&mut bytes),
        };
        // The buffer holds the longest report, so this never falls back.
        let len = written.unwrap_or(0);
        Self { bytes, len }
    }

    pub(super) fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
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
        torque_nm: JointVector::ZERO,
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

fn rich(model: &ArmModel, counter: u32) -> RichReport {
    let settings = &model.settings;
    let mut firmware = [0; 30];
    for (to, from) in firmware.iter_mut().zip(*b"v2.7.1") {
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
        joint_speed_max_rad_s: model.limits().velocity_max_rad_s[0],
        servo_error: [0; JOINTS],
        temperature_c: [25; JOINTS],
        target_tcp_speed_m_s: twist.position().norm(),
        target_qd: model.reference.qd,
        counter,
        // The flag is the controller's own simulation mode, in which the SDK
        // leaves motion requests out; this arm stands in for a real one.
        simulated: false,
    }
}

fn realtime(model: &ArmModel) -> RealtimeReport {
    let target = model.reference_motion();
    let actual = model.measured_motion();
    RealtimeReport {
        time_us: model.time().0 / 1000,
        state: model.state(),
        mode: model.mode,
        buffered: model.buffered(),
        target,
        actual,
        current_a: JointVector::ZERO,
        torque_nm: JointVector::ZERO,
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
