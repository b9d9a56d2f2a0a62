use super::*;
use crate::xarm::frame::{MAX_FRAME_LEN, Protocol, emit_command};
use crate::xarm::stream::FrameReader;
use proptest::prelude::*;

/// Numbers that the wire holds exactly, so that equality is the right test.
fn number() -> impl Strategy<Value = f64> {
    (-1000_i32..1000).prop_map(|n| f64::from(n) / 64.0)
}

fn joints() -> impl Strategy<Value = JointVector> {
    prop::array::uniform7(number()).prop_map(JointVector)
}

/// Lengths that are whole millimetres.
fn position() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3((-900_i32..900).prop_map(|mm| f64::from(mm) / 1000.0))
}

fn command() -> impl Strategy<Value = Command> {
    let plain = prop::sample::select(vec![
        Command::Version,
        Command::SerialNumbers,
        Command::GetState,
        Command::Buffered,
        Command::GetFault,
        Command::CleanError,
        Command::CleanWarning,
        Command::TcpPose,
        Command::GetSpeedLimitFactor,
        Command::FeedbackCheck,
        Command::SetState(StateRequest::Ready),
        Command::SetState(StateRequest::Pause),
        Command::SetState(StateRequest::Stop),
        Command::SetState(StateRequest::DeceleratedStop),
        Command::JointPosition(JointQuery::Commanded),
        Command::JointPosition(JointQuery::MEASURED),
    ]);
    let checked = prop::option::of(any::<u8>());
    prop_oneof![
        plain,
        (1_u8..=8, any::<bool>())
            .prop_map(|(joint, enable)| Command::MotionEnable { joint, enable }),
        (1_u8..=8, any::<bool>()).prop_map(|(joint, release)| Command::Brake { joint, release }),
        any::<u8>().prop_map(|code| Command::SetMode(Mode::from_code(code))),
        joints().prop_map(Command::ServoJoint),
        joints().prop_map(Command::ForwardKinematics),
        joints().prop_map(Command::JointLimitTest),
        (joints(), number(), number(), checked).prop_map(
            |(target, speed_rad_s, acceleration_rad_s2, checked)| Command::MoveJoint {
                target,
                speed_rad_s,
                acceleration_rad_s2,
                checked
            }
        ),
        (joints(), any::<bool>(), prop::option::of(number())).prop_map(
            |(velocity, synchronised, duration_s)| Command::JointVelocity {
                velocity,
                synchronised,
                duration_s
            }
        ),
        (1_u8..=3, any::<bool>()).prop_map(|(quantities, targets)| {
            Command::JointPosition(JointQuery::Quantities {
                quantities,
                targets,
            })
        }),
        (1_i32..100).prop_map(|n| Command::SetSpeedLimitFactor(f64::from(n) / 16.0)),
        (position(), prop::array::uniform3(number())).prop_map(|(position_m, rpy_rad)| {
            Command::TcpOffset(TcpPose {
                position_m,
                rpy_rad,
            })
        }),
        position().prop_map(|centre_m| Command::TcpLoad {
            mass_kg: 0.5,
            centre_m
        }),
        any::<u8>().prop_map(Command::FeedbackMask),
    ]
}

proptest! {
    #[test]
    fn what_is_emitted_is_parsed_back(command in command(), transaction in any::<u16>()) {
        let mut out = [0; MAX_FRAME_LEN];
        let n = emit_command(&mut out, transaction, Protocol::PrivateHeartbeat, &command).unwrap();
        let mut reader = FrameReader::new();
        reader.feed(&out[..n]);
        let request = reader.next_frame().unwrap().unwrap().as_request().unwrap();
        prop_assert_eq!(request.transaction, transaction);
        prop_assert_eq!(request.protocol, Protocol::PrivateHeartbeat);
        prop_assert_eq!(Command::parse(request.register, request.parameters), Ok(command));
        prop_assert!(reader.next_frame().unwrap().is_none());
    }
}

/// Ten floats of the SDK: seven angles, then 0.349, 8.727, 0, little-endian.
#[test]
fn the_sdks_servo_j_is_understood() {
    let mut parameters = Vec::new();
    for value in [0.5_f32, -0.25, 0.0, 1.0, 0.0, 0.0, 2.0, 0.349, 8.727, 0.0] {
        parameters.extend_from_slice(&value.to_le_bytes());
    }
    assert_eq!(
        Command::parse(29, &parameters),
        Ok(Command::ServoJoint(JointVector([
            0.5, -0.25, 0.0, 1.0, 0.0, 0.0, 2.0
        ])))
    );
    assert_eq!(
        Command::parse(29, &parameters[..27]),
        Err(CommandError::TooShort {
            register: Register::ServoJoint,
            given: 27
        })
    );
    parameters[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(
        Command::parse(29, &parameters),
        Err(CommandError::BadValue(Register::ServoJoint))
    );
}

#[test]
fn lengths_are_millimetres_on_the_wire() {
    let mut out = [0; MAX_FRAME_LEN];
    let offset = TcpPose {
        position_m: [0.0, 0.0, 0.2],
        rpy_rad: [0.0; 3],
    };
    emit_command(&mut out, 1, Protocol::Private, &Command::TcpOffset(offset)).unwrap();
    assert_eq!(out[15..19], 200.0_f32.to_le_bytes());
}

#[test]
fn mode_takes_both_lengths() {
    for parameters in [&[2_u8][..], &[2, 1]] {
        assert_eq!(
            Command::parse(19, parameters),
            Ok(Command::SetMode(Mode::Other(2)))
        );
    }
}

#[test]
fn unknown_and_untyped_registers_are_told_apart() {
    assert_eq!(
        Command::parse(0xEE, &[]),
        Err(CommandError::UnknownRegister(0xEE))
    );
    assert_eq!(
        Command::parse(0x33, &[0; 12]),
        Err(CommandError::Untyped(Register::GravityDirection))
    );
    assert_eq!(
        Command::parse(12, &[9]),
        Err(CommandError::BadValue(Register::SetState))
    );
}
