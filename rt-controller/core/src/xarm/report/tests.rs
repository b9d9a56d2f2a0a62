use super::*;
use crate::xarm::error_code::ErrorCode;
use crate::xarm::pose::TcpPose;
use arm_model::{JointState, JointVector};
use proptest::prelude::*;

fn joints(from: f64) -> JointVector {
    JointVector(core::array::from_fn(|i| from + 0.125 * i as f64))
}

fn pose(mm: f64) -> TcpPose {
    TcpPose {
        position_m: [mm / 1e3, (mm + 1.0) / 1e3, (mm + 2.0) / 1e3],
        rpy_rad: [0.5, -0.25, 1.5],
    }
}

fn basic() -> BasicReport {
    BasicReport {
        state: ArmState::Moving,
        mode: Mode::Servo,
        buffered: 258,
        q: joints(0.5),
        tcp: pose(206.0),
        torque_nm: joints(-3.0),
    }
}

fn normal() -> NormalReport {
    NormalReport {
        basic: basic(),
        brakes_released: 0x7F,
        enabled: 0x3F,
        error: ErrorCode::JOINT_LIMIT,
        warning: 13,
        tcp_offset: pose(10.0),
        load_kg: 0.5,
        load_centre_m: [0.001, 0.002, 0.003],
        collision_sensitivity: 3,
        teach_sensitivity: 2,
        gravity: [0.0, 0.0, -1.0],
    }
}

fn rich() -> RichReport {
    let mut firmware = [0; 30];
    firmware[..6].copy_from_slice(b"v2.7.1");
    RichReport {
        normal: normal(),
        firmware,
        tcp_jerk_m_s3: 1.0,
        tcp_acceleration_max_m_s2: 50.0,
        tcp_speed_max_m_s: 1.0,
        joint_jerk_rad_s3: 500.0,
        joint_acceleration_max_rad_s2: 20.0,
        joint_speed_max_rad_s: 3.0,
        servo_error: [0, 0, 23, 0, 0, 0, 12],
        temperature_c: [25, 26, -1, 28, 29, 30, 31],
        target_tcp_speed_m_s: 0.25,
        target_qd: joints(1.0),
        counter: 70_000,
        simulated: false,
        self_collision: true,
        reduced: false,
        fence: true,
    }
}

fn realtime() -> RealtimeReport {
    let motion = |from| JointState {
        q: joints(from),
        qd: joints(from + 1.0),
        qdd: joints(from + 2.0),
    };
    RealtimeReport {
        time_us: 1 << 40,
        state: ArmState::Ready,
        mode: Mode::JointVelocity,
        buffered: 3,
        target: motion(0.0),
        actual: motion(10.0),
        current_a: joints(20.0),
        torque_nm: joints(30.0),
        target_tcp: pose(1.0),
        target_twist: pose(2.0),
        actual_tcp: pose(3.0),
        actual_twist: pose(4.0),
    }
}

fn f32_at(frame: &[u8], offset: usize) -> f32 {
    f32::from_le_bytes(frame[offset..offset + 4].try_into().unwrap())
}

#[test]
fn what_is_emitted_is_parsed_back() {
    let mut out = [0; MAX_REPORT_LEN];
    let n = normal().emit(&mut out).unwrap();
    assert_eq!(n, 145);
    assert_eq!(NormalReport::parse(&out[..n]), Ok(normal()));
    let n = rich().emit(&mut out).unwrap();
    assert_eq!(n, 574);
    assert_eq!(RichReport::parse(&out[..n]), Ok(rich()));
    assert_eq!(NormalReport::parse(&out[..n]), Ok(normal()));
    let force = ForceReport {
        basic: basic(),
        external_force: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        raw_force: [7.0; 6],
    };
    let n = force.emit(&mut out).unwrap();
    assert_eq!(n, 135);
    assert_eq!(ForceReport::parse(&out[..n]), Ok(force));
    let n = realtime().emit(&mut out).unwrap();
    assert_eq!(n, 784);
    assert_eq!(RealtimeReport::parse(&out[..n]), Ok(realtime()));
}

/// Offsets of the vendor's report table, read without the parser.
#[test]
fn fields_sit_at_the_documented_offsets() {
    let mut out = [0; MAX_REPORT_LEN];
    rich().emit(&mut out).unwrap();
    assert_eq!(out[..4], 574_u32.to_be_bytes());
    assert_eq!(out[4], 0x11);
    assert_eq!(out[5..7], [1, 2]);
    assert_eq!(f32_at(&out, 7), 0.5);
    assert_eq!(f32_at(&out, 35), 206.0);
    assert_eq!(out[87..91], [0x7F, 0x3F, 23, 13]);
    assert_eq!(f32_at(&out, 119), 1.0);
    assert_eq!(out[131..133], [3, 2]);
    assert_eq!(f32_at(&out, 141), -1.0);
    assert_eq!(out[145..151], [7, 7, 0xAA, 0x55, 0, 0]);
    assert_eq!(&out[151..157], b"v2.7.1");
    assert_eq!(f32_at(&out, 189), 50_000.0);
    assert_eq!(f32_at(&out, 201), 500.0);
    assert_eq!(out[233..235], [1, 23]);
    assert_eq!(out[245], 25);
    assert_eq!(f32_at(&out, 252), 250.0);
    assert_eq!(f32_at(&out, 256), 1.0);
    assert_eq!(out[284..288], 70_000_u32.to_be_bytes());
    assert_eq!(out[314..316], [0, 1]);
    assert_eq!(out[494], 2);
    let reduced = RichReport {
        reduced: true,
        fence: false,
        simulated: true,
        self_collision: false,
        ..rich()
    };
    reduced.emit(&mut out).unwrap();
    assert_eq!((&out[314..316], out[494]), (&[1, 0][..], 1));
    assert_eq!(RichReport::parse(&out[..574]), Ok(reduced));

    realtime().emit(&mut out).unwrap();
    assert_eq!(out[..4], 784_u32.to_be_bytes());
    assert_eq!(out[4..12], (1_u64 << 40).to_be_bytes());
    assert_eq!(out[12], 0x42);
    assert_eq!(f32_at(&out, 116), 10.0);
    assert_eq!(f32_at(&out, 228), 30.0);
    assert_eq!(f32_at(&out, 472), 3.0);
}

proptest! {
    #[test]
    fn a_short_buffer_is_refused(len in 0_usize..784) {
        let mut out = [0; MAX_REPORT_LEN];
        prop_assert!(realtime().emit(&mut out[..len]).is_err());
        prop_assert!(rich().emit(&mut out[..len.min(573)]).is_err());
    }
}
